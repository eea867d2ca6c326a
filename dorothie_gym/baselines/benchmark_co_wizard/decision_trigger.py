"""Triggers of decisions, for models without a "do nothing" class; between decisions the car follows its lane."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Self

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.co_wizard.config import CoWizardConfig
from dorothie_gym.policies.policy import DECISION_INTERVAL
from dorothie_gym.policies.route_progress import Choice, stopping_distance
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.view import CoWizardView

BEFORE_JUNCTION: Final = 40.0
"""Distance to a junction without a planned turn at which a decision is triggered [m]."""

DECISION_REPEAT_TIME: Final = 10.0
"""Time after which a car that waits at a junction without a turn, or has stopped, decides again [s]."""

PLACE_REACHED_DISTANCE: Final = 1.0
"""Distance at which a place counts as reached [m]."""

ASSUMED_HAZARD_TIME: Final = 4.0
"""Assumed duration of the hazard for which the car has stopped [s]; a standing car shows no braking."""


@dataclass(frozen=True)
class DecisionTrigger:
    """Decisions that are due: an utterance, a navigation action."""

    speaks: bool = False
    drives: bool = False


@dataclass(frozen=True, kw_only=True)
class TriggerState:
    """State of the triggers; every change returns a new object.

    Attributes:
        junction: lane before the junction of the last decision, -1 for none.
        waited: time of the last decision at a junction [s].
        drove: time of the last navigation decision [s].
        hazard: start of the current hazard [s], infinite if there is none.
        at_place: whether the car would stop at the last-named place now.
        owed: whether a navigation decision is postponed until the end of a lane switch or U-turn.
    """

    junction: int = -1
    waited: float = -math.inf
    drove: float = -math.inf
    hazard: float = math.inf
    at_place: bool = False
    owed: bool = False

    def look(self, view: CoWizardView, heard: bool, place: float | None = None) -> tuple[DecisionTrigger, Self]:
        """Returns the decisions that are due, and the state for the next observation.

        Args:
            view: the observation.
            heard: whether the participant has spoken.
            place: driving distance to the last-named place [m]; None if it is not near or unknown.
        """
        hazard = self._hazard(view)
        changed = math.isinf(hazard) is not math.isinf(self.hazard)
        near = view.choice if view.choice is not None and view.choice.distance <= BEFORE_JUNCTION else None
        at_junction = near is not None and self._lacks_turn(view, near)
        at_place = place is not None and _would_stop_at(place, view.speed)
        watch = replace(self, hazard=hazard, at_place=at_place)
        if near is not None and (at_junction or heard):
            watch = replace(watch, junction=near.lane, waited=view.time)
        speaks = heard or at_junction
        stands = view.motion is Motion.STOPPED and view.time - self.drove >= DECISION_REPEAT_TIME
        wanted = speaks or changed or stands or self.owed or (at_place and not self.at_place)
        drives = wanted and not view.manoeuvring
        drove = view.time if drives else self.drove
        return DecisionTrigger(speaks=speaks, drives=drives), replace(watch, drove=drove, owed=wanted and not drives)

    def _lacks_turn(self, view: CoWizardView, near: Choice) -> bool:
        """Returns whether the car approaches a junction, or has waited there long, without a planned turn."""
        if view.motion is Motion.STOPPED or view.manoeuvring or view.manoeuvre is PhysicalAction.J_TURN:
            return False
        waits = view.motion is Motion.WAITING and view.time - self.waited >= DECISION_REPEAT_TIME
        return near.lane != self.junction or waits

    def _hazard(self, view: CoWizardView) -> float:
        if view.hazard is not ObjectClass.UNLABELED:
            return min(self.hazard, view.time)
        lasts = view.motion is Motion.STOPPED and view.time - self.drove < ASSUMED_HAZARD_TIME
        return self.hazard if lasts else math.inf


def _would_stop_at(place: float, speed: float) -> bool:
    """Returns whether a car at a speed [m/s] must begin to stop for a place at a distance ahead [m]."""
    return (
        -CoWizardConfig.passed < place < stopping_distance(speed) + DECISION_INTERVAL * speed + PLACE_REACHED_DISTANCE
    )
