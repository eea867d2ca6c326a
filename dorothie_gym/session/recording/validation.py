"""Checks of a session beyond those of its reader, and the report of a reader."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypedDict

import numpy as np

from dorothie_gym.ontology.actions import ArgumentKind
from dorothie_gym.session.recording.events import EventType, MoveRecord
from dorothie_gym.session.recording.header import NATIVE, is_newer

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session


def faults_of(session: Session) -> tuple[str, ...]:
    """Returns one sentence for each fault, starting with its place."""
    return (*_header(session), *_events(session), *_actions(session), *_utterances(session), *_frames(session))


def _header(session: Session) -> Iterator[str]:
    header = session.header
    for k, landmark in enumerate(header.landmarks):
        if not -1 <= landmark["street"] < len(header.street_names):
            yield f"header, landmarks[{k}]: street {landmark['street']} is none of {len(header.street_names)}"
    for k, subgoal in enumerate(header.subgoals):
        for other in subgoal["after"]:
            if other == k or not 0 <= other < len(header.subgoals):
                yield f"header, subgoals[{k}]: after {other}, which is no other subgoal"
    if session.complete and session.summary is None:
        yield "session: is said to be complete and has no outcome"


def _events(session: Session) -> Iterator[str]:
    newer = is_newer(session.header.format_version)
    over = False
    for k, event in enumerate(session.events):
        where = f"events[{k}] ({event.type_name}, frame {event.frame})"
        if over:
            yield f"{where}: comes after the end of the session"
            over = False  # reported once
        if event.type is EventType.OTHER and session.header.source == NATIVE and not newer:
            yield f"{where}: no type of event of version {session.header.format_version}"
        if event.type is EventType.END:
            over = True
        if event.type is EventType.SUBGOAL:
            number = event.data.get("subgoal")
            if not isinstance(number, int) or not 0 <= number < len(session.header.subgoals):
                yield f"{where}: subgoal {number!r} is none of the {len(session.header.subgoals)} of the header"


def _actions(session: Session) -> Iterator[str]:
    for action in session.physical_actions:
        where, kind = f"events[{action.index}] ({action.action.label})", action.action.argument
        turns = kind in (ArgumentKind.ANGLE, ArgumentKind.SIDE)
        if turns and action.angle is not None and not kind.accepts(action.angle):
            yield f"{where}: angle {action.angle:g} is not {kind.domain}"
        if kind in (ArgumentKind.SPEED_STEP, ArgumentKind.SWITCH) and action.up is None:
            yield f"{where}: does not say whether up or down"


def _utterances(session: Session) -> Iterator[str]:
    first: dict[int, MoveRecord] = {}
    for move in session.moves():
        where = f"events[{move.index}] (utterance {move.utterance})"
        if move.end < move.start:
            yield f"{where}: is over at {move.end:g} s, before it begins at {move.start:g} s"
        same = first.setdefault(move.utterance, move)
        for name in ("speaker", "text", "start", "end", "recognised"):
            if getattr(move, name) != getattr(same, name):
                yield f"{where}: has another {name} than events[{same.index}] of the same utterance"


def _frames(session: Session) -> Iterator[str]:
    frames = session.trajectory["frame"]
    steps = np.diff(frames)
    if len(steps) and np.any(steps <= 0):
        k = int(np.argmax(steps <= 0))
        yield f"frames[{k + 1}]: frame {frames[k + 1]} does not come after {frames[k]}"
    # All steps are 1, or 3 in a session that was written in SDN's layout and read again.
    elif session.header.source == NATIVE and len(steps) and np.any(steps > steps.min()):
        k = int(np.argmax(steps > steps.min()))
        yield f"frames[{k + 1}]: frames {frames[k] + 1} to {frames[k + 1] - 1} are missing"
    if np.any(session.trajectory["speed"] < 0):
        yield f"frames[{int(np.argmax(session.trajectory['speed'] < 0))}]: the speed is negative"
    scene = session.scene
    for name, table in (("actors", scene.actors), ("lights", scene.lights), ("weather", scene.weather)):
        if not np.all(np.isin(table.frames, frames)):
            yield f"{name}: are recorded at frames that the trajectory lacks"


# --- Report of a reader ----------------------------------------------------------------------------------------------

MAX_REPORTED_NAMES: Final = 100
"""Maximum number of names of one kind that a report counts separately."""

OTHERS: Final = "(others)"


class ReportPage(TypedDict):
    """Report of a reader in JSON types; fields as in `ReadReport`."""

    layout: str
    unknown: dict[str, int]
    missing: dict[str, int]
    repaired: dict[str, int]
    facts: dict[str, object]


@dataclass
class ReadReport:
    """Findings of a reader.

    Attributes:
        layout: layout of the session: "native", "release", "sample" or "hub".
        unknown: counts of unknown names (file, field or type), which were kept.
        missing: counts of expected files and fields that are missing.
        repaired: counts of repaired faults and of rows that were left out.
        facts: further figures, in JSON types.
    """

    layout: str = "native"
    unknown: Counter[str] = field(default_factory=Counter)
    missing: Counter[str] = field(default_factory=Counter)
    repaired: Counter[str] = field(default_factory=Counter)
    facts: dict[str, object] = field(default_factory=dict)

    def keep(self, name: str, count: int = 1) -> None:
        """Counts an unknown name that was kept."""
        _count(self.unknown, name, count)

    def miss(self, name: str, count: int = 1) -> None:
        """Counts an expected name that is missing."""
        _count(self.missing, name, count)

    def repair(self, what: str, count: int = 1) -> None:
        """Counts a repair, unless `count` is 0."""
        if count:
            _count(self.repaired, what, count)

    def to_json(self) -> ReportPage:
        """Returns the report in JSON types."""
        return {
            "layout": self.layout,
            "unknown": dict(sorted(self.unknown.items())),
            "missing": dict(sorted(self.missing.items())),
            "repaired": dict(sorted(self.repaired.items())),
            "facts": dict(self.facts),
        }

    def lines(self) -> list[str]:
        """Returns the report as lines of text."""
        return report_lines(self.to_json())


def report_lines(report: ReportPage) -> list[str]:
    """Returns a report, given in JSON types, as lines of text."""
    kinds = (
        ("kept, not understood", report["unknown"]),
        ("missing", report["missing"]),
        ("repaired", report["repaired"]),
    )
    lines = [f"{title}: {name}{_times(count)}" for title, names in kinds for name, count in names.items()]
    return lines + [f"{name.replace('_', ' ')}: {_in_words(value)}" for name, value in report["facts"].items()]


def _count(names: Counter[str], name: str, count: int) -> None:
    name = name if len(name) <= 200 else name[:200] + "..."
    names[name if name in names or len(names) < MAX_REPORTED_NAMES else OTHERS] += count


def _times(count: int) -> str:
    return "" if count == 1 else f" ({count} times)"


def _in_words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {item}" for key, item in value.items()) or "none"
    return str(value)
