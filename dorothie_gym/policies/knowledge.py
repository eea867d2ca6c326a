"""Beliefs of a Co-Wizard and the reasons for its actions: the record that scripted and learned Co-Wizards fill.

`co_wizard.proposition_truth` judges propositions and reasons over it, and `co_wizard.answers` words what follows. The
state of the scripted Co-Wizard follows from rules, the memory of the learned one from a network. The learned one does
not keep whether a place that is not on its map was described to it, the obstacle for which it stopped by a decision,
and the reason for an instruction to stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass
from dorothie_gym.policies.co_wizard.config import CoWizardConfig
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.scripted_agent_limits import USUAL_SPEED
from dorothie_gym.policies.travel_time import CruiseSpeed

TOLD_TO_STOP: Final = Proposition.of(Predicate.TOLD, action=ActionValue.STOP)
"""The usual reason for stopping on an instruction."""


@dataclass(frozen=True, kw_only=True)
class Standstill:
    """Current or last standstill of the car, and the reason for it.

    Attributes:
        since: start of the current standstill [s]; None while the car moves.
        until: end of the last standstill [s].
        reason: why the car stands, or last stood; None if unknown.
        reason_since: start of the standstill for this reason [s].
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
        """Stores why the car stands; a reason that can no longer be determined is kept."""
        return self if reason is None or reason == self.reason else replace(self, reason=reason, reason_since=now)


@dataclass(frozen=True, kw_only=True)
class CoWizardKnowledge:
    """Beliefs and intentions of a Co-Wizard.

    Only the scripted Co-Wizard sets the fields with a default.

    Attributes:
        town: the map.
        config: thresholds of the judgements.
        goal: name of the destination; None without one.
        goal_is_on_map: whether the place of the goal is taken from the map; otherwise it is a guess, or unknown.
        goal_is_findable: whether the place of the goal is taken from the map or was described.
        progress: route to the goal and the progress on it; None without a place to go to.
        ruled_out: places of houses and people that were visited, or that were not the ones meant.
        halted: whether the car must stand.
        arrived: whether the car has stopped at its goal and waits for the next task.
        sent_on: whether the stop ends a short advance on request, at a place that may be the goal.
        pausing: whether the car stops before the junction ahead until the way is known.
        directed: whether a turn that the participant requested is ahead.
        to_turn_round: whether a U-turn that the participant requested has not begun yet.
        asks_for_detour: whether a question about a detour around an obstacle is open.
        blocked_at: time at which an obstacle across the road was last found [s].
        told_to_stop_at: time of the last instruction to stop [s].
        stop_reason: why the car stopped on that instruction.
        told_to_turn_round_at: time of the last instruction to turn round [s].
        standstill: current or last standstill.
        rests_for: obstacle for which the car stops by a decision.
        rests_until: end of that stop [s].
        usual_speed: cruise speed where nothing is said about it [km/h].
        cruise: cruise speed that is meant now and later.
    """

    town: Town
    config: CoWizardConfig
    goal: LandmarkName | None
    goal_is_on_map: bool
    goal_is_findable: bool = True
    progress: RouteProgress | None
    ruled_out: tuple[Place, ...]
    halted: bool
    arrived: bool
    sent_on: bool = False
    pausing: bool
    directed: bool
    to_turn_round: bool
    asks_for_detour: bool
    blocked_at: float
    told_to_stop_at: float
    stop_reason: Proposition = TOLD_TO_STOP
    told_to_turn_round_at: float
    standstill: Standstill
    rests_for: ObjectClass = ObjectClass.UNLABELED
    rests_until: float = -math.inf
    usual_speed: int = USUAL_SPEED
    cruise: CruiseSpeed = CruiseSpeed()
