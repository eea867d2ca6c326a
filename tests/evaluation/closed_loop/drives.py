"""Drives made by hand along one straight street, 400 m, along which a place's station is its x."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from dorothie_gym.evaluation.closed_loop import SessionRecord, TalkRecord
from dorothie_gym.maps import Town
from dorothie_gym.ontology import GoalStatus, Role
from dorothie_gym.session.recording import Event, EventType, LandmarkRow, Session, SubgoalRow, trajectory_of
from dorothie_gym.sim.config import FRAME_RATE
from tests.session.recording.builders import header
from tests.sim.network.towns import straight_town, town

START = (0, 20.0)


@lru_cache(maxsize=1)
def street() -> Town:
    (lane,) = straight_town(lanes=1, roads=1, length=400.0).lanes
    return town([replace(lane, speed_limit=40.0 / 3.6)])  # where the router's cost is the length


def landmark(station: float, name: str = "House") -> LandmarkRow:
    return LandmarkRow(name=name, lane=0, station=station, x=station, y=0.0, street=0, hidden=False)


def goal(row: int, *after: int, trigger: bool = False) -> SubgoalRow:
    return SubgoalRow(description="go", landmark=row, after=after, trigger=trigger, delete=True, change="there")


def event(time: float, what: EventType, source: Role = Role.AGENT, **data: Any) -> Event:
    return Event(frame=round(time * FRAME_RATE), type=what, source=source, data=data)


def reached(time: float, number: int) -> Event:
    return event(time, EventType.SUBGOAL, subgoal=number, landmark="House", status=GoalStatus.COMPLETE.label)


def unexpected(time: float, kind: str, **data: Any) -> Event:
    return event(time, EventType.EXCEPTION, Role.AD_WIZARD, kind=kind, **data)


def hit(time: float, other: str | None, *, own_fault: bool = True) -> Event:
    return event(time, EventType.COLLISION, other=other, own_fault=own_fault)


def drive(
    path: Sequence[tuple[float, float]],
    events: Sequence[Event] = (),
    *,
    goals: Sequence[SubgoalRow] = (goal(0), goal(1)),
    stations: Sequence[float] = (120.0, 320.0),
) -> Session:
    """A session of a car that is at x [m] at time [s], in between on straight lines.

    Args:
        path: pairs of time and x.
        events: what happens.
        goals: the subgoals, rows of the landmarks at `stations`.
        stations: where landmarks stand.
    """
    times, xs = np.array(path).T
    frames = np.arange(round(times[-1] * FRAME_RATE) + 1)
    rows = np.zeros((len(frames), 9))
    rows[:, 0], rows[:, 1] = frames, np.interp(frames / FRAME_RATE, times, xs)
    marks = tuple(landmark(station) for station in stations)
    about = header(landmarks=marks, subgoals=tuple(goals), departure=START, street_names=("Baits",))
    return Session(header=about, events=tuple(events), trajectory=trajectory_of(rows), name="drive")


def record(
    *, success: bool = True, completion: float | None = 1.0, infractions: Mapping[str, int] | None = None, **more: Any
) -> SessionRecord:
    """What was measured of a session of two subgoals."""
    fields: dict[str, Any] = {
        "live": 2,
        "reached": 2 if success else 1,
        "shortest": 300.0,
        "driven": 400.0,
        "seconds": 100.0,
        "decisions": 200,
        "talk": TalkRecord(utterances=12, exchanges=8, abandoned=2, clarifications=4),
    }
    return SessionRecord(success=success, completion=completion, infractions=infractions or {}, **{**fields, **more})
