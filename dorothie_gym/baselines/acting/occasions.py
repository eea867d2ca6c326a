"""When a model that knows no "do nothing" decides; between decisions the car follows its lane."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import Final, Self

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.policies.co_wizard.mind import View
from dorothie_gym.spaces import Motion

BEFORE_JUNCTION: Final = 40.0
"""A junction without a turn is an occasion when it is this near [m]."""

AGAIN: Final = 10.0
"""Who waits at a junction without a turn decides again after this time [s]."""


class Occasion(enum.Enum):
    """Why a decision is taken."""

    WORDS = "words"
    """The participant has spoken."""
    JUNCTION = "junction"
    """A junction is near, or the car waits at one, and no turn is planned."""
    HAZARD = "hazard"
    """A hazard begins or ends."""


@dataclass(frozen=True, kw_only=True)
class Watch:
    """What has been decided upon; every change gives a new one.

    Attributes:
        junction: lane before the junction at which it was decided, -1 for none.
        waited: when it was decided last while waiting there [s].
        hazard: what was in the way at the last observation.
    """

    junction: int = -1
    waited: float = -AGAIN
    hazard: ObjectClass = ObjectClass.UNLABELED

    def look(self, view: View, heard: bool) -> tuple[Occasion | None, Self]:
        """Returns why to decide now, or None, and the watch for the next observation.

        Args:
            view: what is observed.
            heard: whether the participant has spoken.
        """
        began_or_ended = (view.hazard is ObjectClass.UNLABELED) is not (self.hazard is ObjectClass.UNLABELED)
        watch = replace(self, hazard=view.hazard)
        at_junction = watch._is_at_junction(view)
        if at_junction or (heard and view.choice is not None and view.choice.distance <= BEFORE_JUNCTION):
            assert view.choice is not None
            watch = replace(watch, junction=view.choice.lane, waited=view.time)
        if heard:
            return Occasion.WORDS, watch
        if at_junction:
            return Occasion.JUNCTION, watch
        return (Occasion.HAZARD if began_or_ended else None), watch

    def _is_at_junction(self, view: View) -> bool:
        choice = view.choice
        if choice is None or choice.distance > BEFORE_JUNCTION or view.motion is Motion.STOPPED:
            return False
        if view.manoeuvre in (PhysicalAction.J_TURN, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH):
            return False
        waits = view.motion is Motion.WAITING and view.time - self.waited >= AGAIN
        return choice.lane != self.junction or waits
