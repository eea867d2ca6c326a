"""What a Co-Wizard believes, and why it does what it does: the protocol that scripted and learned Co-Wizards fill.

`co_wizard.proposition_truth` judges propositions and reasons over it, and `co_wizard.answers` words what follows. The
state of the scripted Co-Wizard and the memory of the learned one differ in how their fields come about, which is by
rules or by a network, and in what the learned one does not keep: whether a place that is not on its map was described
to it, for what a stop was decided on that is over, and the reason for which it was told to stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.config import CoWizardConfig
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress

TOLD_TO_STOP: Final = Proposition.of(Predicate.TOLD, action=ActionValue.STOP)
"""The usual reason for stopping on an instruction."""


@dataclass(frozen=True, kw_only=True)
class Standstill:
    """Present or last standstill of the car, and the reason for it.

    Attributes:
        since: start of the present standstill [s]; None while the car moves.
        until: end of the last standstill [s].
        reason: why the car stands, or stood last, as far as that is known.
        reason_since: since when it has stood for this reason [s].
    """

    since: float | None = 0.0
    until: float = -math.inf
    reason: Proposition | None = None
    reason_since: float = -math.inf

    def observed(self, now: float, *, standing: bool) -> Standstill:
        """Brings the standstill up to date."""
        if not standing:
            return self if self.since is None else replace(self, since=None, until=now)
        return replace(self, since=now, reason=None) if self.since is None else self

    def with_reason(self, reason: Proposition | None, now: float) -> Standstill:
        """Notes why the car stands; a reason that is not known any more stays."""
        return self if reason is None or reason == self.reason else replace(self, reason=reason, reason_since=now)


class CoWizardKnowledge(Protocol):
    """What a Co-Wizard believes and intends; it is only read."""

    @property
    def town(self) -> Town:
        """The map."""
        ...

    @property
    def config(self) -> CoWizardConfig:
        """Thresholds of the judgements."""
        ...

    @property
    def goal(self) -> LandmarkName | None:
        """Name of the destination; None without one."""
        ...

    @property
    def goal_is_on_map(self) -> bool:
        """Whether the place of the goal is taken from the map; otherwise it is a guess, or unknown."""
        ...

    @property
    def goal_is_findable(self) -> bool:
        """Whether the place of the goal is taken from the map or was described."""
        ...

    @property
    def progress(self) -> RouteProgress | None:
        """Route to the goal and the progress on it; None without a place to go to."""
        ...

    @property
    def ruled_out(self) -> tuple[Place, ...]:
        """Places of houses and people that were visited, or that were not the ones meant."""
        ...

    @property
    def is_halted(self) -> bool:
        """Whether the car is to stand."""
        ...

    @property
    def has_arrived(self) -> bool:
        """Whether the car has stopped at its goal and waits for the next task."""
        ...

    @property
    def is_sent_on(self) -> bool:
        """Whether the car has only stopped where it was told to drive to, which may be the goal."""
        ...

    @property
    def is_pausing(self) -> bool:
        """Whether the car stops before the junction ahead until the way is known."""
        ...

    @property
    def is_directed(self) -> bool:
        """Whether a turn that the participant asked for is ahead."""
        ...

    @property
    def is_to_turn_round(self) -> bool:
        """Whether a U-turn that the participant asked for has not begun yet."""
        ...

    @property
    def asks_for_detour(self) -> bool:
        """Whether a question about a way round an obstacle is open."""
        ...

    @property
    def blocked_at(self) -> float:
        """Time at which an obstacle across the road was last found [s]."""
        ...

    @property
    def told_to_stop_at(self) -> float:
        """Time of the last instruction to stop [s]."""
        ...

    @property
    def stop_reason(self) -> Proposition:
        """Why the car stopped on that instruction."""
        ...

    @property
    def told_to_turn_round_at(self) -> float:
        """Time of the last instruction to turn round [s]."""
        ...

    @property
    def standstill(self) -> Standstill:
        """Present or last standstill."""
        ...

    def rests_for(self, now: float) -> ObjectClass:
        """Returns for what the car stops at `now` [s] by a decision; UNLABELED for nothing."""
        ...
