"""Notes of an import: elements of a map file that were dropped or repaired, and values that were assumed."""

from __future__ import annotations

import enum
import logging
from collections import Counter
from dataclasses import dataclass
from itertools import islice

LOGGED = 3
"""Maximum number of warnings for each kind of note; `dorothie-gym towns FILE --check` lists all."""

_log = logging.getLogger(__name__)


class NoteAction(enum.StrEnum):
    """Treatment of an element by the import."""

    DROPPED = "dropped"
    REPAIRED = "repaired"
    ASSUMED = "assumed"


class NoteKind(enum.StrEnum):
    """Kind of an element, in the order of the report."""

    ROAD = "road"
    SECTION = "lane section"
    LANE = "lane"
    TURNAROUND = "turnaround"
    ROAD_LINK = "road link"
    LANE_LINK = "lane link"
    JUNCTION = "junction"
    CONNECTION = "connection"
    LANE_CHANGE = "lane change"
    DIRECTION = "direction"
    TRAFFIC = "traffic rule"
    ACCESS = "access"
    SPEED = "speed limit"
    SIGNAL = "signal"
    CROSSWALK = "crosswalk"
    ID = "id"


@dataclass(frozen=True, kw_only=True)
class ImportNote:
    """Note on one element of a map file.

    Attributes:
        action: what was done.
        kind: kind of the element.
        element: the element with its ids in the file, e.g. `road 12 / link / successor (line 40)`.
        message: reason, or result.
    """

    action: NoteAction
    kind: NoteKind
    element: str
    message: str


class ImportNotes:
    """Collects the notes of an import.

    Attributes:
        source: the file, as named by the user.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self._notes: list[ImportNote] = []

    def dropped(self, kind: NoteKind, element: str, message: str) -> None:
        """Adds a note on an element that the town does not have."""
        self._notes.append(ImportNote(action=NoteAction.DROPPED, kind=kind, element=element, message=message))

    def repaired(self, kind: NoteKind, element: str, message: str) -> None:
        """Adds a note on an element that was changed so that it can be used."""
        self._notes.append(ImportNote(action=NoteAction.REPAIRED, kind=kind, element=element, message=message))

    def assumed(self, kind: NoteKind, element: str, message: str) -> None:
        """Adds a note on a value that the file leaves open."""
        self._notes.append(ImportNote(action=NoteAction.ASSUMED, kind=kind, element=element, message=message))

    def sorted(self) -> tuple[ImportNote, ...]:
        """Returns the notes by action and kind, those of one kind in the order of the import."""
        actions, kinds = ({member: k for k, member in enumerate(of)} for of in (NoteAction, NoteKind))
        return tuple(sorted(self._notes, key=lambda note: (actions[note.action], kinds[note.kind])))

    def first_loss(self) -> ImportNote | None:
        """Returns the first note on a road or lane that was dropped, or None."""
        kinds = (NoteKind.ROAD, NoteKind.SECTION, NoteKind.LANE)
        return next((n for n in self._notes if n.action is NoteAction.DROPPED and n.kind in kinds), None)

    def log(self) -> None:
        """Logs what was dropped as warnings, a few of each kind.

        Lanes without access for cars, and turnarounds beside other ways on, are no loss.
        """
        dropped = (note for note in self.sorted() if note.action is NoteAction.DROPPED)
        lost = [note for note in dropped if note.kind not in (NoteKind.ACCESS, NoteKind.TURNAROUND)]
        for kind, count in Counter(note.kind for note in lost).items():
            for note in islice((note for note in lost if note.kind is kind), LOGGED):
                _log.warning("%s: %s: %s: dropped", self.source, note.element, note.message)
            if count > LOGGED:
                more = "%s: %d more of kind %s were dropped; dorothie-gym towns %s --check lists all"
                _log.warning(more, self.source, count - LOGGED, kind, self.source)
