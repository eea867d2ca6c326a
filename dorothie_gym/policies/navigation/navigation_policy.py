"""Drivers of `Navigation-v0` as Co-Wizards: they drive, and the scripted Co-Wizard listens and talks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import Town
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.policies import Policy
from dorothie_gym.policies.co_wizard import CoWizardState, CoWizardStyle, ScriptedCoWizard, attend, respond
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.navigation.action_mask import EstimatedActionMask
from dorothie_gym.policies.navigation.actions import NavigationAction, physical_of
from dorothie_gym.policies.navigation.instruction_state import InstructionState, note_deeds
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.policies.navigation.observation_vector import (
    DECISION_FREQUENCY,
    MAX_SECONDS,
    NavigationEncoder,
    Vector,
)
from dorothie_gym.spaces import ActionDict, Motion, Physical, SpaceLimits

Choose: TypeAlias = Callable[[Vector, NDArray[np.bool_]], int]
"""Chooses one of the 18 actions from an observation of `Navigation-v0` (161,) and a mask (18,)."""

PLAIN = CoWizardStyle(echoes=0.0, checks=0.0, tells=0.0, silent=0.0, asks=1.0)
"""How the Co-Wizard talks: it acknowledges what it is told, asks for the way where it does not know it, and answers."""

SPEED_STEP = 2.6
"""A cruise speed that is closer than this to the one asked for is that one [km/h]."""

_EPSILON = 1e-6


@dataclass(frozen=True, kw_only=True)
class NavigationPolicyState:
    """What a driver has seen and heard so far; it is handed on from decision to decision.

    Attributes:
        mind: of the scripted Co-Wizard, who listens.
        briefing: what the driver was told.
        seen: what was observed at the decision before; None at first.
        decided_at: when the driver last decided [s].
        speed: cruise speed that was last asked for and has been set [km/h].
    """

    mind: CoWizardState
    briefing: InstructionState = field(default_factory=InstructionState)
    seen: Mapping[str, Any] | None = None
    decided_at: float = -1.0
    speed: int


class DriverInputs:
    """Where a driver sits in a town: turns what the Co-Wizard observes into observations of `Navigation-v0`.

    Attributes:
        ways: ways on at the town's junctions.
    """

    def __init__(self, town: Town, max_seconds: float) -> None:
        self.ways = JunctionExits(town)
        self._viewpoint, self._likely = (
            NavigationEncoder(town, self.ways, max_seconds),
            EstimatedActionMask(town, self.ways),
        )

    def note(
        self, watched: NavigationPolicyState, mind: CoWizardState, view: CoWizardView, seen: Mapping[str, Any]
    ) -> NavigationPolicyState:
        """What is known after another decision; `mind` has listened already."""
        briefing = watched.briefing
        if watched.seen is not None:
            briefing = replace(briefing, heard=briefing.heard.driven_on(watched.seen, seen))
        note_deeds(mind, view)
        return replace(watched, mind=mind, briefing=briefing.renewed(mind, view, self.ways), seen=seen)

    def observe(self, watched: NavigationPolicyState) -> tuple[Vector, NDArray[np.bool_]]:
        """Observation (161,) and mask (18,) of the driver."""
        assert watched.seen is not None
        vector = self._viewpoint.observe(watched.seen, watched.briefing.heard, watched.mind.blocked)
        return vector, self._likely.mask(watched.seen)


def has_nothing_to_do(watched: NavigationPolicyState) -> bool:
    """Whether the car stands because it is to, or has not been told anything yet: then nobody is asked to drive."""
    assert watched.seen is not None
    stopped = int(watched.seen["motion"]) == Motion.STOPPED
    return watched.briefing.heard.told is None or (watched.mind.halted and stopped)


class NavigationPolicy(Policy[NavigationPolicyState]):
    """A Co-Wizard whose physical actions are chosen by a driver of `Navigation-v0`.

    The driver observes what it would observe there. What was said is made out by the scripted Co-Wizard's rules, which
    also talk and keep the notes; cruise speed and lights are set as they are asked for, which nobody does there.
    """

    def __init__(
        self,
        choose: Choose,
        limits: SpaceLimits | None = None,
        *,
        max_seconds: float = MAX_SECONDS,
        decision_frequency: float = DECISION_FREQUENCY,
    ) -> None:  # fmt: skip
        """Prepares the policy.

        Args:
            choose: the driver.
            limits: sizes of the spaces.
            max_seconds: time limit of the sessions that the driver was trained in [s].
            decision_frequency: driving decisions per second in training [Hz].
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._choose, self._max_seconds, self._interval = choose, max_seconds, 1.0 / decision_frequency
        self._scripted = ScriptedCoWizard(limits, PLAIN)
        self._seats: dict[Town, DriverInputs] = {}

    def initial_state(self, seed: int, town: Town) -> NavigationPolicyState:
        """A driver who has not been told anything yet."""
        mind = self._scripted.initial_state(seed, town)
        return NavigationPolicyState(mind=mind, speed=mind.speed)

    def step(
        self, observation: Mapping[str, Any], state: NavigationPolicyState
    ) -> tuple[ActionDict, NavigationPolicyState]:
        """Listens and looks, drives, and says something or nothing."""
        attention = attend(observation, state.mind)
        seat = self._seat(attention.mind.town)
        watched = seat.note(state, attention.mind, attention.view, dict(observation))
        physical, now = None, attention.view.time
        if now - watched.decided_at > self._interval - _EPSILON:
            watched = replace(watched, decided_at=now)
            physical = self._drive(seat, watched)
            if physical is None:
                physical, watched = _oblige(watched, attention.view)
        return respond(attention, physical).encode(self.limits), watched

    def _drive(self, seat: DriverInputs, watched: NavigationPolicyState) -> Physical | None:
        if has_nothing_to_do(watched):
            return None
        assert watched.seen is not None
        return physical_of(NavigationAction(self._choose(*seat.observe(watched))), watched.seen, seat.ways)

    def _seat(self, town: Town) -> DriverInputs:
        """The seat in a town; one is kept for each."""
        if town not in self._seats:
            self._seats[town] = DriverInputs(town, self._max_seconds)
        return self._seats[town]


def _oblige(watched: NavigationPolicyState, view: CoWizardView) -> tuple[Physical | None, NavigationPolicyState]:
    """Sets cruise speed and lights as was asked for; once they are, they are the driver's business again."""
    mind = watched.mind
    if mind.speed != watched.speed:
        if abs(view.cruise - mind.speed) > SPEED_STEP:
            return Physical(action=PhysicalAction.SPEED_CHANGE, up=view.cruise < mind.speed), watched
        watched = replace(watched, speed=mind.speed)
    if mind.lights is not None and mind.lights is not view.lights:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=mind.lights), watched
    return None, watched
