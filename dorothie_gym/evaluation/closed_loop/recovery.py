"""Exceptions that a session met, and how long it took until things went forward again.

Both are read from what happened in the world, not from what was said:

- an exception is *met* when it takes effect; one that puts something on the road when the car first comes within 60 m
  of it (`sessions.statistics.handling.NEAR`), or of the square in which newcomers appear. What it takes away again (a
  prop, the end of a fault) is nothing to meet;
- it is *recovered from* if the next subgoal is reached in the end, and from the moment on from which the car stays
  nearer, by `FORWARD`, to the end of its task than when it met the exception; at the latest when that subgoal is
  reached. The task is that which the exception left, and the way is the router's, past what stands on the road by
  then. So a detour counts from its beginning, a task that became longer is no step back, and who drives on to where
  nothing is to be done any more has not recovered until it has come back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from dorothie_gym.evaluation.closed_loop.task import is_arrival, task_after
from dorothie_gym.evaluation.closed_loop.ways import TaskWay, places_of
from dorothie_gym.ontology import ExceptionKind
from dorothie_gym.sessions import FRAME_RATE, Event, Session
from dorothie_gym.sessions.statistics.handling import NEAR, kind_of, time_met
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.routing import Place

FORWARD: Final = 10.0
"""The car has come forward when so much less is left [m at 40 km/h]: a cell of the router's, its accuracy."""

STEP: Final = 1.0
"""The car's place is looked at so often [s]."""


@dataclass(frozen=True, kw_only=True)
class MetException:
    """An exception, and what became of it.

    Attributes:
        kind: of the exception.
        met: when it was met [s]; None if never.
        seconds: from then until it was recovered from; None if it was not.
    """

    kind: ExceptionKind
    met: float | None = None
    seconds: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Returns `kind` (lower-case name), `met` and `seconds`."""
        return {"kind": self.kind.name.lower(), "met": self.met, "seconds": self.seconds}

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> MetException:
        """Reads what `to_json` returned."""
        return cls(kind=ExceptionKind[row["kind"].upper()], met=row["met"], seconds=row["seconds"])


def met_exceptions(session: Session, town: Town) -> tuple[MetException, ...]:
    """Returns the exceptions of a session, in order, those left out that take something away again.

    Args:
        session: a recorded session.
        town: its map.
    """
    found = []
    for index, event in enumerate(session.events):
        kind = kind_of(event)
        if kind is None or kind in (ExceptionKind.NONE, ExceptionKind.MESSAGE) or _takes_away(kind, event):
            continue
        met = when_met(session, event, kind)
        if math.isinf(met):
            found.append(MetException(kind=kind))
            continue
        seconds = _seconds_to_recovery(session, town, index, met)
        found.append(MetException(kind=kind, met=round(met, 3), seconds=None if math.isinf(seconds) else seconds))
    return tuple(found)


def when_met(session: Session, event: Event, kind: ExceptionKind) -> float:
    """Returns when an exception was met [s], infinity if never; see the module."""
    if kind.is_plan_level:
        return time_met(session, event)
    if kind not in (ExceptionKind.SPAWN_VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS):
        return event.time
    corners = [event.data.get(name) for name in ("x0", "x1", "y0", "y1")]
    if not all(isinstance(corner, int | float) for corner in corners):
        return event.time  # other corpora do not tell where
    x0, x1, y0, y1 = (float(corner) for corner in corners if corner is not None)
    rows = session.trajectory[session.trajectory["frame"] >= event.frame]
    aside = np.maximum(np.maximum(x0 - rows["x"], rows["x"] - x1), 0.0)
    along = np.maximum(np.maximum(y0 - rows["y"], rows["y"] - y1), 0.0)
    near = np.flatnonzero(aside**2 + along**2 <= NEAR**2)
    return float(rows["frame"][near[0]]) / FRAME_RATE if len(near) else math.inf


def _takes_away(kind: ExceptionKind, event: Event) -> bool:
    return kind is ExceptionKind.DELETE_PROP or (kind is ExceptionKind.SENSOR_FAULT and event.data.get("on") is False)


def _seconds_to_recovery(session: Session, town: Town, index: int, met: float) -> float:
    frame = round(met * FRAME_RATE)
    known = max(index + 1, sum(event.frame <= frame for event in session.events))
    task = task_after(session, known)
    if task.done:
        return 0.0
    step = next((event.frame for event in session.events[known:] if is_arrival(event)), None)
    if step is None:
        return math.inf
    at_step = round((step - frame) / FRAME_RATE, 3)
    frames = range(frame, step, round(STEP * FRAME_RATE))
    places = places_of(session, town, frames)
    if not places or len(places) < len(frames):
        return at_step  # the recording does not know its lanes
    way = TaskWay(town, task, _on_road(session, known))
    left = [way.left(place) for place in places]
    if not math.isfinite(left[0]):
        return at_step
    behind = max(k for k, metres in enumerate(left) if left[0] - metres < FORWARD)
    return min((behind + 1) * STEP, at_step) if behind + 1 < len(left) else at_step


def _on_road(session: Session, events: int) -> tuple[Place, ...]:
    """What stands on the road after so many events; props are told by their number among those that stand."""
    props: list[Place] = []
    for event in session.events[:events]:
        kind, item = kind_of(event), event.data.get("item")
        numbered = isinstance(item, int) and 0 <= item < len(props)
        lane, station = event.data.get("lane"), event.data.get("station")
        if kind is ExceptionKind.DELETE_PROP and numbered:
            del props[event.data["item"]]
        elif isinstance(lane, int) and isinstance(station, int | float):
            if kind is ExceptionKind.PLACE_PROP:
                props.append((lane, float(station)))
            elif kind is ExceptionKind.MOVE_PROP and numbered:
                props[event.data["item"]] = (lane, float(station))
    return tuple(props)
