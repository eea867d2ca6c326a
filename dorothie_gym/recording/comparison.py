"""Where two recordings of a session part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.recording.events import encode_event
from dorothie_gym.recording.json_io import canonical, from_line
from dorothie_gym.recording.surroundings import SceneTable

if TYPE_CHECKING:
    from dorothie_gym.recording.session import Session

_VERSIONS: Final = ("format_version", "package_version")
"""Fields of the header that tell who wrote the session, not what happened."""

_LONGEST: Final = 120


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The first thing in which two recordings differ.

    Attributes:
        frame: the first frame at which they do; -1 for what is known before the session begins.
        field: what differs, such as "frames.x", "actors.speed of number 7", "events[12].data.text".
        recorded: value in the first recording, as text.
        replayed: value in the second, as text.
    """

    frame: int
    field: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        return f"frame {self.frame}: {self.field}: recorded {self.recorded}, now {self.replayed}"


def first_difference(recorded: Session, replayed: Session) -> Difference | None:
    """Returns the first difference between a recording and a second one of the same session; None: they are equal.

    Every number is compared bit for bit. Names, pictures and the versions of the writers do not count. A recording that
    was cut off equals the beginning of a longer one.
    """
    found = [
        difference
        for difference in (
            _in_header(recorded, replayed),
            _in_decisions(recorded, replayed),
            _in_frames(recorded, replayed),
            *(_in_table(name, recorded, replayed) for name in ("actors", "lights", "weather")),
            _in_events(recorded, replayed),
            _in_outcome(recorded, replayed),
        )
        if difference is not None
    ]
    return min(found, key=lambda difference: difference.frame, default=None)


def _in_header(recorded: Session, replayed: Session) -> Difference | None:
    one, other = (
        {name: value for name, value in session.header.to_json().items() if name not in _VERSIONS}
        for session in (recorded, replayed)
    )
    return _difference(-1, "header", one, other)


def _in_outcome(recorded: Session, replayed: Session) -> Difference | None:
    if not recorded.complete:
        return None
    one, other = (canonical(session.summary, "outcome") for session in (recorded, replayed))
    return _difference(_last(recorded), "outcome", one, other)


def _in_decisions(recorded: Session, replayed: Session) -> Difference | None:
    one, other = (
        {decision.frame: canonical(decision.actions, "actions") for decision in session.decisions or ()}
        for session in (recorded, replayed)
    )
    # Of what was cut off the last decision may be there, and what came of it may not.
    frames = sorted(frame for frame in one.keys() | other.keys() if recorded.complete or frame < _last(recorded))
    return _first(_difference(frame, "actions", one.get(frame), other.get(frame)) for frame in frames)


def _in_frames(recorded: Session, replayed: Session) -> Difference | None:
    one, other = recorded.trajectory, replayed.trajectory
    both = min(len(one), len(other))
    places = {name: _first_place(one[name][:both], other[name][:both]) for name in one.dtype.names or ()}
    parted = {name: place for name, place in places.items() if place is not None}
    if parted:
        name, place = min(parted.items(), key=lambda item: item[1])
        values = (repr(rows[name][place].item()) for rows in (one, other))
        return Difference(
            frame=int(one["frame"][place]), field=f"frames.{name}", recorded=next(values), replayed=next(values)
        )
    if len(one) == len(other) or (not recorded.complete and len(one) < len(other)):
        return None
    longer = one if len(one) > both else other
    told = [f"{len(rows)} frames" for rows in (one, other)]
    return Difference(frame=int(longer["frame"][both]), field="frames", recorded=told[0], replayed=told[1])


def _in_table(name: str, recorded: Session, replayed: Session) -> Difference | None:
    one: SceneTable = getattr(recorded.scene, name)
    other: SceneTable = getattr(replayed.scene, name)
    for k in range(max(len(one), len(other))):
        if k >= len(one) and not recorded.complete:
            return None
        if k >= min(len(one), len(other)) or one.frames[k] != other.frames[k]:
            frames = [int(table.frames[k]) if k < len(table) else None for table in (one, other)]
            first = min(frame for frame in frames if frame is not None)
            told = ["recorded here" if frame == first else "not recorded here" for frame in frames]
            return Difference(frame=first, field=name, recorded=told[0], replayed=told[1])
        rows = [table.rows[table.offsets[k] : table.offsets[k + 1]] for table in (one, other)]
        if rows[0].tobytes() != rows[1].tobytes():
            return _in_rows(int(one.frames[k]), name, *rows)
    return None


def _in_rows(frame: int, name: str, one: NDArray[np.void], other: NDArray[np.void]) -> Difference:
    if len(one) != len(other):
        return Difference(frame=frame, field=name, recorded=f"{len(one)} rows", replayed=f"{len(other)} rows")
    for column in one.dtype.names or ():
        place = _first_place(one[column], other[column])
        if place is not None:
            key = (one.dtype.names or ())[0]
            whose = f" of number {one[key][place]}" if key in ("key", "signal") else ""
            return Difference(
                frame=frame,
                field=f"{name}.{column}{whose}",
                recorded=repr(one[column][place].item()),
                replayed=repr(other[column][place].item()),
            )
    return Difference(frame=frame, field=name, recorded="these bytes", replayed="other bytes")


def _in_events(recorded: Session, replayed: Session) -> Difference | None:
    lines = [[encode_event(event, check=False) for event in session.events] for session in (recorded, replayed)]
    both = min(map(len, lines))
    for k in range(both):
        if lines[0][k] != lines[1][k]:
            frame = min(recorded.events[k].frame, replayed.events[k].frame)
            return _difference(frame, f"events[{k}]", *(from_line(of[k], "event") for of in lines))
    longer, has_more = (recorded, True) if len(lines[0]) > both else (replayed, False)
    if len(longer.events) == both:
        return None
    event = longer.events[both]
    if not recorded.complete and not has_more and event.frame >= _last(recorded):
        return None
    told = [f"{event.type_name} of {event.source}", "none"]
    return Difference(frame=event.frame, field=f"events[{both}]", recorded=told[not has_more], replayed=told[has_more])


def _difference(frame: int, field: str, one: Any, other: Any) -> Difference | None:
    """The first difference within values of JSON types."""
    if one == other:
        return None
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for name in (*one, *(name for name in other if name not in one)):
            if name not in one or name not in other or one[name] != other[name]:
                return _difference(frame, f"{field}.{name}", one.get(name), other.get(name))
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        parts = (_difference(frame, f"{field}[{k}]", *pair) for k, pair in enumerate(zip(one, other, strict=True)))
        return _first(parts)
    return Difference(frame=frame, field=field, recorded=_told(one), replayed=_told(other))


def _first(differences: Iterator[Difference | None]) -> Difference | None:
    return next((difference for difference in differences if difference is not None), None)


def _told(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _first_place(one: NDArray[Any], other: NDArray[Any]) -> int | None:
    """The first place at which the bits of two columns of equal length and type differ."""
    if one.tobytes() == other.tobytes():
        return None
    width = one.dtype.itemsize
    bits = [np.ascontiguousarray(column).view(np.uint8).reshape(-1, width) for column in (one, other)]
    return int(np.argmax((bits[0] != bits[1]).any(axis=1)))


def _last(session: Session) -> int:
    """The last frame that was recorded."""
    return int(session.trajectory["frame"][-1]) if len(session.trajectory) else -1
