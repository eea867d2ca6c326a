"""Policy that lets a trained driver of `Navigation-v0` drive as the Co-Wizard; the scripted Co-Wizard talks for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import Town
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.policies.co_wizard import CoWizardState, CoWizardStyle, ScriptedCoWizard, attend, respond
from dorothie_gym.policies.co_wizard.driving import CRUISE_TOLERANCE
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.navigation.action_mask import EstimatedActionMask
from dorothie_gym.policies.navigation.actions import NavigationAction, physical_of
from dorothie_gym.policies.navigation.instruction_state import InstructionState, note_driving
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.policies.navigation.observation_vector import (
    DECISION_FREQUENCY,
    MAX_SECONDS,
    NavigationEncoder,
    Vector,
)
from dorothie_gym.policies.policy import Policy
from dorothie_gym.spaces import ActionDict, Motion, ObservationMapping, Physical, SpaceLimits

Choose: TypeAlias = Callable[[Vector, NDArray[np.bool_]], int]
"""Driver: chooses one of the 18 actions from an observation of `Navigation-v0` (161,) and a mask (18,)."""

PLAIN_STYLE = CoWizardStyle(echoes=0.0, checks=0.0, announces=0.0, silent=0.0, asks=1.0)
"""Traits of the Co-Wizard that talks for a driver: acknowledges instructions, asks for unknown ways, and answers."""

_EPSILON = 1e-6


@dataclass(frozen=True, kw_only=True)
class NavigationPolicyState:
    """State of a driver between decisions.

    Attributes:
        co_wizard: state of the scripted Co-Wizard that listens and talks.
        instructions: instructions heard.
        observation: observation of the Co-Wizard at the last decision; None before the first.
        decided_at: time of the last decision of the driver [s].
        speed: cruise speed that was asked for and has been set [km/h].
    """

    co_wizard: CoWizardState
    instructions: InstructionState = field(default_factory=InstructionState)
    observation: ObservationMapping | None = None
    decided_at: float = -1.0
    speed: int


class DriverInputs:
    """Conversion of Co-Wizard observations in a town to observations and masks of `Navigation-v0`.

    Attributes:
        exits: exits of the town's junctions.
    """

    def __init__(self, town: Town, max_seconds: float) -> None:
        self.exits = JunctionExits(town)
        self._encoder = NavigationEncoder(town, self.exits, max_seconds)
        self._mask = EstimatedActionMask(town, self.exits)

    def update(
        self,
        state: NavigationPolicyState,
        co_wizard: CoWizardState,
        view: CoWizardView,
        observation: ObservationMapping,
    ) -> NavigationPolicyState:
        """Returns the state after another observation; `co_wizard` has listened to it already and is updated."""
        instructions = state.instructions
        if state.observation is not None:
            instructions = replace(instructions, heard=instructions.heard.driven_on(state.observation, observation))
        note_driving(co_wizard, view)
        return replace(
            state,
            co_wizard=co_wizard,
            instructions=instructions.renewed(co_wizard, view, self.exits),
            observation=observation,
        )

    def observe(self, state: NavigationPolicyState) -> tuple[Vector, NDArray[np.bool_]]:
        """Returns observation (161,) and mask (18,) of the driver."""
        assert state.observation is not None
        vector = self._encoder.observe(state.observation, state.instructions.heard, state.co_wizard.route.blocked)
        return vector, self._mask.mask(state.observation)


def has_nothing_to_do(state: NavigationPolicyState) -> bool:
    """Returns whether the policy is not queried: no instruction was given yet, or the car stands as instructed."""
    assert state.observation is not None
    stopped = int(state.observation["motion"]) == Motion.STOPPED
    return state.instructions.heard.instruction is None or (state.co_wizard.intentions.halted and stopped)


class NavigationPolicy(Policy[NavigationPolicyState]):
    """Co-Wizard whose physical actions are chosen by a driver of `Navigation-v0`.

    The driver receives the observations of that environment. The rules of the scripted Co-Wizard interpret the
    utterances, talk, and send belief updates. Cruise speed and lights, which are not asked for in `Navigation-v0`, are
    set as the participant asks.
    """

    def __init__(
        self,
        choose: Choose,
        limits: SpaceLimits | None = None,
        *,
        max_seconds: float = MAX_SECONDS,
        decision_frequency: float = DECISION_FREQUENCY,
    ) -> None:
        """Prepares the policy.

        Args:
            choose: the driver.
            limits: sizes of the spaces.
            max_seconds: time limit of the sessions that the driver was trained in [s].
            decision_frequency: driving decisions per second in training [Hz].
        """
        super().__init__(Role.CO_WIZARD, limits)
        self._choose, self._max_seconds, self._interval = choose, max_seconds, 1.0 / decision_frequency
        self._scripted = ScriptedCoWizard(limits, PLAIN_STYLE)
        self._inputs: dict[Town, DriverInputs] = {}

    def initial_state(self, seed: int, town: Town) -> NavigationPolicyState:
        """Returns the state before anything was said."""
        co_wizard = self._scripted.initial_state(seed, town)
        return NavigationPolicyState(co_wizard=co_wizard, speed=co_wizard.intentions.speed)

    def step(
        self, observation: ObservationMapping, state: NavigationPolicyState
    ) -> tuple[ActionDict, NavigationPolicyState]:
        """Listens and looks, drives, and says something or nothing."""
        decision = attend(observation, state.co_wizard)
        inputs = self._inputs_of(decision.state.town)
        updated = inputs.update(state, decision.state, decision.view, dict(observation))
        physical, now = None, decision.view.time
        if now - updated.decided_at > self._interval - _EPSILON:
            updated = replace(updated, decided_at=now)
            physical = self._drive(inputs, updated)
            if physical is None:
                physical, updated = _set_speed_and_lights(updated, decision.view)
        return respond(decision, physical).encode(self.limits), updated

    def _drive(self, inputs: DriverInputs, state: NavigationPolicyState) -> Physical | None:
        if has_nothing_to_do(state):
            return None
        assert state.observation is not None
        action = NavigationAction(self._choose(*inputs.observe(state)))
        return physical_of(action, state.observation, inputs.exits)

    def _inputs_of(self, town: Town) -> DriverInputs:
        """Returns the conversion for a town; each is made once."""
        if town not in self._inputs:
            self._inputs[town] = DriverInputs(town, self._max_seconds)
        return self._inputs[town]


def _set_speed_and_lights(
    state: NavigationPolicyState, view: CoWizardView
) -> tuple[Physical | None, NavigationPolicyState]:
    """Sets cruise speed and lights as the participant asked, once; afterwards they are left to the driver."""
    wanted = state.co_wizard.intentions
    if wanted.speed != state.speed:
        if abs(view.cruise - wanted.speed) > CRUISE_TOLERANCE:
            return Physical(action=PhysicalAction.SPEED_CHANGE, up=view.cruise < wanted.speed), state
        state = replace(state, speed=wanted.speed)
    if wanted.lights is not None and wanted.lights is not view.lights:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=wanted.lights), state
    return None, state
