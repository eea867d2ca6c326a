"""Comparison of sessions: the first difference of two recordings, and of two folders of recordings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.corpus import layout_of, read_session
from dorothie_gym.errors import MAX_SHOWN, SessionError
from dorothie_gym.session.recording.events import encode_event
from dorothie_gym.session.recording.files import canonical, from_line

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.recording.surroundings import SceneTable

_VERSIONS: Final = ("format_version", "package_version")
"""Fields of the header that name the writer of the session."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """First difference of two recordings.

    Attributes:
        frame: the first frame at which they differ; -1 for data from before the start of the session.
        field: the field, such as "frames.x", "actors.speed of number 7", "events[12].data.text".
        recorded: value in the first recording, as text.
        replayed: value in the second, as text.
    """

    frame: int
    field: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        return f"frame {self.frame}: {self.field}: recorded {self.recorded}, now {self.replayed}"


def first_difference(recorded: Session, replayed: Session, *, strict: bool = False) -> Difference | None:
    """Returns the first difference between two recordings of a session; None if they are equal.

    Numbers are compared bit by bit. Names, pictures and the versions of the writers do not count.

    Args:
        recorded: the first recording.
        replayed: the second.
        strict: whether completeness and further columns of the frames count. Otherwise, a first recording that was cut
            off, and thus has no outcome, equals the start of a longer one.
    """
    return _Comparison(recorded, replayed, strict=strict).first()


def compare_folders(first: Path | str, second: Path | str) -> Iterator[tuple[str, Difference | None]]:
    """Compares a session with a session, or the sessions of two folders (a corpus, a rollout) that have equal paths.

    Yields:
        The path of each session within its folder (the name of the first, for two sessions), and the first difference;
        None for equal sessions. A session that only one folder has differs in the field "session".

    Raises:
        SessionError: there is no session in a folder, only one of the two is a session itself, or a session cannot be
            read.
    """
    folders = [_sessions(Path(path)) for path in (first, second)]
    if (Path() in folders[0]) != (Path() in folders[1]):
        single = first if Path() in folders[0] else second
        raise SessionError(f"{single}: is a session, and the other is a folder of sessions; give two of the same kind")
    for path in sorted(folders[0].keys() | folders[1].keys()):
        name = str(path) if path != Path() else Path(first).resolve().name
        if path in folders[0] and path in folders[1]:
            yield name, first_difference(*(read_session(folder[path]) for folder in folders), strict=True)
        else:
            found = ["present" if path in folder else "missing" for folder in folders]
            yield name, Difference(frame=-1, field="session", recorded=found[0], replayed=found[1])


def _sessions(root: Path) -> dict[Path, Path]:
    """Returns the sessions in a folder by path within it; hidden folders are left out."""
    if not root.is_dir():
        raise SessionError(f"{root}: there is no such folder; give a session, or a folder of sessions")
    found: dict[Path, Path] = {}
    for name, below, _ in os.walk(root):
        folder = Path(name)
        if layout_of(folder) is not None:
            found[folder.relative_to(root)] = folder
            below.clear()
        below[:] = [child for child in below if not child.startswith(".")]
    if not found:
        raise SessionError(f"{root}: holds no session")
    return found


class _Comparison:
    """Comparison of two recordings.

    Args:
        recorded: the first.
        replayed: the second.
        strict: as in `first_difference`.
    """

    def __init__(self, recorded: Session, replayed: Session, *, strict: bool) -> None:
        self._pair = (recorded, replayed)
        self._strict = strict
        self._whole = strict or recorded.complete or recorded.summary is not None
        self._last = int(recorded.trajectory["frame"][-1]) if len(recorded.trajectory) else -1

    def first(self) -> Difference | None:
        """Returns the difference at the lowest frame."""
        found = [
            difference
            for difference in (
                self._in_header(),
                self._in_decisions(),
                self._in_frames(),
                *(self._in_table(name) for name in ("actors", "lights", "weather")),
                self._in_columns(),
                self._in_events(),
                self._in_outcome(),
            )
            if difference is not None
        ]
        return min(found, key=lambda difference: difference.frame, default=None)

    def _in_header(self) -> Difference | None:
        one, other = (
            {name: value for name, value in session.header.to_json().items() if name not in _VERSIONS}
            for session in self._pair
        )
        return _in_values(-1, "header", one, other)

    def _in_outcome(self) -> Difference | None:
        if not self._whole:
            return None
        one, other = self._pair
        if self._strict and one.complete != other.complete:
            return _in_values(self._last, "complete", one.complete, other.complete)
        outcomes = (canonical(session.summary, "outcome") for session in self._pair)
        return _in_values(self._last, "outcome", *outcomes)

    def _in_decisions(self) -> Difference | None:
        one, other = (
            {decision.frame: canonical(decision.actions, "actions") for decision in session.decisions or ()}
            for session in self._pair
        )
        # An interrupted recording may contain its last decision without the frames after it.
        frames = sorted(frame for frame in one.keys() | other.keys() if self._whole or frame < self._last)
        return _first(_in_values(frame, "actions", one.get(frame), other.get(frame)) for frame in frames)

    def _in_frames(self) -> Difference | None:
        one, other = (session.trajectory for session in self._pair)
        both = min(len(one), len(other))
        rows = {name: _first_row(one[name][:both], other[name][:both]) for name in one.dtype.names or ()}
        differing = {name: row for name, row in rows.items() if row is not None}
        if differing:
            name, row = min(differing.items(), key=lambda item: item[1])
            values = [repr(table[name][row].item()) for table in (one, other)]
            return Difference(
                frame=int(one["frame"][row]), field=f"frames.{name}", recorded=values[0], replayed=values[1]
            )
        if len(one) == len(other) or (not self._whole and len(one) < len(other)):
            return None
        longer = one if len(one) > both else other
        return Difference(
            frame=int(longer["frame"][both]),
            field="frames",
            recorded=f"{len(one)} frames",
            replayed=f"{len(other)} frames",
        )

    def _in_table(self, name: str) -> Difference | None:
        one, other = (getattr(session.scene, name) for session in self._pair)
        for k in range(max(len(one), len(other))):
            if k >= len(one) and not self._whole:
                return None
            if k >= min(len(one), len(other)) or one.frames[k] != other.frames[k]:
                return _only_in_one(name, [int(t.frames[k]) if k < len(t) else None for t in (one, other)])
            rows = [_rows(table, k) for table in (one, other)]
            if rows[0].tobytes() != rows[1].tobytes():
                return _in_rows(int(one.frames[k]), name, *rows)
        return None

    def _in_columns(self) -> Difference | None:
        """Returns the first difference of further columns of the frames."""
        if not self._strict:
            return None
        one, other = (session.scene.columns for session in self._pair)
        frames = self._pair[0].trajectory["frame"]
        for name in sorted(one.keys() | other.keys()):
            if name not in one or name not in other:
                found = ["present" if name in columns else "missing" for columns in (one, other)]
                return Difference(frame=-1, field=f"frames.{name}", recorded=found[0], replayed=found[1])
            both = min(len(one[name]), len(other[name]))
            row = _first_row(one[name][:both], other[name][:both])
            if row is not None:
                values = [str(columns[name][row]) for columns in (one, other)]
                return Difference(
                    frame=int(frames[row]), field=f"frames.{name}", recorded=values[0], replayed=values[1]
                )
        return None

    def _in_events(self) -> Difference | None:
        recorded, replayed = self._pair
        lines = [[encode_event(event, check=False) for event in session.events] for session in self._pair]
        both = min(map(len, lines))
        for k in range(both):
            if lines[0][k] != lines[1][k]:
                frame = min(recorded.events[k].frame, replayed.events[k].frame)
                return _in_values(frame, f"events[{k}]", *(from_line(of[k], "event") for of in lines))
        longer, has_more = (recorded, True) if len(lines[0]) > both else (replayed, False)
        if len(longer.events) == both:
            return None
        event = longer.events[both]
        if not self._whole and not has_more and event.frame >= self._last:
            return None
        values = [f"{event.type_name} of {event.source}", "none"]
        return Difference(
            frame=event.frame, field=f"events[{both}]", recorded=values[not has_more], replayed=values[has_more]
        )


def _only_in_one(name: str, frames: list[int | None]) -> Difference:
    first = min(frame for frame in frames if frame is not None)
    found = ["recorded here" if frame == first else "not recorded here" for frame in frames]
    return Difference(frame=first, field=name, recorded=found[0], replayed=found[1])


def _rows(table: SceneTable, k: int) -> NDArray[np.void]:
    return table.rows[table.offsets[k] : table.offsets[k + 1]]


def _in_rows(frame: int, name: str, one: NDArray[np.void], other: NDArray[np.void]) -> Difference:
    if len(one) != len(other):
        return Difference(frame=frame, field=name, recorded=f"{len(one)} rows", replayed=f"{len(other)} rows")
    for column in one.dtype.names or ():
        row = _first_row(one[column], other[column])
        if row is not None:
            key = (one.dtype.names or ())[0]
            owner = f" of number {one[key][row]}" if key in ("key", "signal") else ""
            return Difference(
                frame=frame,
                field=f"{name}.{column}{owner}",
                recorded=repr(one[column][row].item()),
                replayed=repr(other[column][row].item()),
            )
    return Difference(frame=frame, field=name, recorded="these bytes", replayed="other bytes")


def _in_values(frame: int, field: str, one: object, other: object) -> Difference | None:
    """Returns the first difference within values of JSON types."""
    if one == other:
        return None
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for name in (*one, *(name for name in other if name not in one)):
            if name not in one or name not in other or one[name] != other[name]:
                return _in_values(frame, f"{field}.{name}", one.get(name), other.get(name))
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        parts = (_in_values(frame, f"{field}[{k}]", *pair) for k, pair in enumerate(zip(one, other, strict=True)))
        return _first(parts)
    return Difference(frame=frame, field=field, recorded=_shown(one), replayed=_shown(other))


def _first(differences: Iterator[Difference | None]) -> Difference | None:
    return next((difference for difference in differences if difference is not None), None)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


def _first_row(one: NDArray[np.generic], other: NDArray[np.generic]) -> int | None:
    """Returns the first row whose bits differ, of two columns of one length."""
    if not len(one):
        return None
    if one.dtype == object or other.dtype == object:
        return next((k for k, (a, b) in enumerate(zip(one, other, strict=True)) if a != b), None)
    bits = [np.ascontiguousarray(values).view(np.uint8).reshape(len(values), -1) for values in (one, other)]
    if one.dtype != other.dtype:
        return 0
    differing = np.flatnonzero((bits[0] != bits[1]).any(axis=1))
    return int(differing[0]) if len(differing) else None
