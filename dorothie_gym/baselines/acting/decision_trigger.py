"""When a model that knows no "do nothing" decides; between decisions the car follows its lane."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Self

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.policies.co_wizard.config import CoWizardConfig
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.policy import DECISION_INTERVAL
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.spaces import Motion

BEFORE_JUNCTION: Final = 40.0
"""A junction without a turn is an occasion when it is this near [m]."""

AGAIN: Final = 10.0
"""Who waits at a junction without a turn, or stands by Stop, decides again after this time [s]."""

NEAR: Final = 1.0
"""Who stands so near to a place has come there [m]."""

REST: Final = 4.0
"""A car that stands by Stop does not brake for anything: what it stopped for is taken to last so long [s]."""


@dataclass(frozen=True)
class DecisionTrigger:
    """What is to be decided now: what to say, and what to do."""

    speaks: bool = False
    drives: bool = False


@dataclass(frozen=True, kw_only=True)
class TriggerState:
    """What has been decided upon; every change gives a new one.

    Attributes:
        junction: lane before the junction at which it was decided, -1 for none.
        waited: when it was decided last at a junction [s].
        drove: when it was decided last what to do [s].
        hazard: since when something has been in the way [s], infinite where nothing is.
        at_place: whether the place that was named last is where the car would stop now.
        owed: whether a decision about what to do is put off until a lane switch or U-turn is over.
    """

    junction: int = -1
    waited: float = -math.inf
    drove: float = -math.inf
    hazard: float = math.inf
    at_place: bool = False
    owed: bool = False

    def look(self, view: CoWizardView, heard: bool, place: float | None = None) -> tuple[DecisionTrigger, Self]:
        """Returns what is to be decided, and the watch for the next observation.

        Args:
            view: what is observed.
            heard: whether the participant has spoken.
            place: how far the place that was named last is along the way [m]; None where it is not near, or not known.
        """
        hazard = self._hazard(view)
        changed = math.isinf(hazard) is not math.isinf(self.hazard)
        near = view.choice is not None and view.choice.distance <= BEFORE_JUNCTION
        at_junction = near and self._lacks_turn(view)
        at_place = place is not None and _would_stop_at(place, view.speed)
        watch = replace(self, hazard=hazard, at_place=at_place)
        if near and (at_junction or heard):
            assert view.choice is not None
            watch = replace(watch, junction=view.choice.lane, waited=view.time)
        speaks = heard or at_junction
        stands = view.motion is Motion.STOPPED and view.time - self.drove >= AGAIN
        wanted = speaks or changed or stands or self.owed or (at_place and not self.at_place)
        drives = wanted and not view.manoeuvring
        drove = view.time if drives else self.drove
        return DecisionTrigger(speaks=speaks, drives=drives), replace(watch, drove=drove, owed=wanted and not drives)

    def _lacks_turn(self, view: CoWizardView) -> bool:
        """Whether the car comes to a junction, or has waited there long, and no turn is planned."""
        assert view.choice is not None
        if view.motion is Motion.STOPPED or view.manoeuvring or view.manoeuvre is PhysicalAction.J_TURN:
            return False
        waits = view.motion is Motion.WAITING and view.time - self.waited >= AGAIN
        return view.choice.lane != self.junction or waits

    def _hazard(self, view: CoWizardView) -> float:
        if view.hazard is not ObjectClass.UNLABELED:
            return min(self.hazard, view.time)
        lasts = view.motion is Motion.STOPPED and view.time - self.drove < REST
        return self.hazard if lasts else math.inf


def _would_stop_at(place: float, speed: float) -> bool:
    """Whether it is time for a car at a speed [m/s] to stop at a place so far ahead [m]."""
    return -CoWizardConfig.passed < place < stopping_distance(speed) + DECISION_INTERVAL * speed + NEAR
