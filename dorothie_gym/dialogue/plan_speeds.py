"""Speeds and distances of driving plans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.numerals import NUMBER_WORDS
from dorothie_gym.dialogue.plan_frames import NEEDING_PLACE, PlanState
from dorothie_gym.dialogue.routes import StepAction, StepChange

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_items import ActionItem, DistanceItem, SpeedItem, UnitItem

_OPPOSITE: Final = {StepChange.FASTER: StepChange.SLOWER, StepChange.SLOWER: StepChange.FASTER}
_AMOUNTS: Final = frozenset({"bit", "little", "touch", "tad", "hair"})
_DRIVEN: Final = frozenset({"do", "go", "drive", "make", "keep", "take"})
_DEGREES: Final = frozenset({"too", "less"})
_UNITS: Final = frozenset({"hour", "mph", "kph", "kmh", "kmph", "k", "clicks"})
_BY: Final = frozenset({"knock", "shave", "take"})
"""Verbs behind which a speed tells by how much to change it: "knock ten off that"."""


class SpeedReader(PlanState):
    """Reads the speeds and distances of a plan."""

    def __init__(self) -> None:
        """Begins without steps."""
        super().__init__()
        self.last_speed: int | None = None  # speed named last [km/h]

    def read_change(self, change: StepChange, item: ActionItem) -> None:
        """Reads an order to drive faster or slower."""
        before = self.clauses.words[item.place - 1] if item.place else ""
        if self.negation in ("not", "forbid", "cease") or before in _DEGREES or self.clauses.words[item.place] == "too":
            change = _OPPOSITE[change]
        frame = self.replaced(StepAction.SPEED)
        if frame is not None:
            frame.change, frame.speed = change, None  # "speed up, no, slow down"
            return
        frame = self.frame
        if frame is not None and not self.fresh and frame.action is not None:
            if frame.action is StepAction.SPEED:
                frame.change = frame.change or change
                if before.isdecimal() or before in NUMBER_WORDS or before in _UNITS:
                    frame.speed = frame.bare_number = None  # "go ten faster"
                return
            if frame.action is StepAction.STRAIGHT and before in _AMOUNTS:
                frame.action, frame.change = StepAction.SPEED, change  # "go a bit quicker"
                return
            if frame.action not in NEEDING_PLACE or frame.place is not None:
                frame.change = change
                return
        if frame is None or self.fresh or frame.action is not None:
            frame = self.open_step(StepAction.SPEED)
        frame.action, frame.change, frame.negated = StepAction.SPEED, change, False

    def read_distance(self, item: DistanceItem) -> None:
        """Reads a distance, for the current step or for the next one."""
        frame = self.replaced()
        if frame is None:
            frame = self.frame if self.frame is not None and not self.fresh else None
        if frame is not None and (frame.action is not None or frame.verb):
            frame.distance = item.metres
        else:
            self.pending.distance = item.metres

    def read_unit(self, item: UnitItem) -> None:
        """Reads a unit that follows its number with a pause: "thirty, miles"."""
        last = self.frames[-1] if self.frames else None
        if self.pending.bare_number is not None:
            self.pending.bare_number = round(self.pending.bare_number * item.factor)
        elif last is not None and last.action is StepAction.SPEED and last.bare_number is not None:
            last.speed = round(last.bare_number * item.factor)

    def read_speed(self, item: SpeedItem) -> None:
        """Reads a speed, for the current step or for the next one."""
        self.last_speed = item.speed
        frame = self.replaced(StepAction.SPEED)
        if frame is None:
            frame = self.frame if self.frame is not None and not self.fresh else None
        if frame is not None and frame.action is not None and frame.action not in NEEDING_PLACE:
            if item.unit or frame.action is StepAction.SPEED:
                said = self.clauses.words
                changed = frame.change is not None and "off" in said and not _BY.isdisjoint(said)
                frame.speed = None if changed else item.speed
                frame.bare_number = None if item.unit or changed else item.speed
        elif item.unit or (frame is not None and (frame.verb in _DRIVEN or frame.word == "do")):
            fits = frame is not None and (frame.action is None or (frame.word == "do" and frame.place is None))
            opened = frame if frame is not None and fits else self.open_step(StepAction.SPEED)
            opened.action, opened.speed = StepAction.SPEED, item.speed
        else:
            self.pending.bare_number = item.speed
