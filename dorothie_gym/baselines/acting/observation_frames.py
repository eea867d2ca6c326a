"""Observations of the Co-Wizard in the form in which sessions are recorded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.engine.recorder import LightStates
from dorothie_gym.maps import Town
from dorothie_gym.ontology import LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.recording import (
    ACTOR_DTYPE,
    FRAME_RATE,
    TRAJECTORY_DTYPE,
    WEATHER_DTYPE,
    ActorKind,
    LandmarkRow,
    SceneTable,
    SessionHeader,
    Surroundings,
    Trajectory,
)
from dorothie_gym.recording.surroundings import Rows, light_rows
from dorothie_gym.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.spaces import LandmarkColumn, ObjectColumn

_KINDS: Final = {
    ObjectClass.VEHICLES.value: ActorKind.VEHICLE,
    ObjectClass.PEDESTRIAN.value: ActorKind.PEDESTRIAN,
    ObjectClass.STATIC.value: ActorKind.PROP,
}

_SHORTEST_CAR: Final = 2.5
"""Vehicles shorter than this count as cycles [m]."""

_TURN: Final = 2.0 * math.pi


@dataclass(frozen=True, eq=False, kw_only=True)
class ObservationFrame:
    """State of the car and its surroundings in one observation of the Co-Wizard.

    Attributes:
        frame: frame of the physics (30 Hz).
        pose: estimated x, y [m] and heading [rad, clockwise].
        speed: measured speed [m/s].
        lane: estimated lane of the car.
        actors: perceived actors, rows of `ACTOR_DTYPE`. Headings are not perceived: a vehicle gets that of the nearest
            lane, other actors that of the car.
        lights: states of all traffic lights of the town, rows of `LIGHT_DTYPE`; `recorded_perception` selects the
            visible ones.
        weather: row of `WEATHER_DTYPE`.
    """

    frame: int
    pose: tuple[float, float, float]
    speed: float
    lane: int
    actors: Rows
    lights: Rows
    weather: Rows

    @classmethod
    def of(cls, view: CoWizardView, town: Town) -> Self:
        """Returns the frame of a view."""
        x, y, heading = view.raw["pose"].tolist()
        return cls(
            frame=round(view.time * FRAME_RATE),
            pose=(x, y, heading),
            speed=view.speed,
            lane=view.lane,
            actors=_actors(view.raw["objects"], heading, town),
            lights=light_rows(_light_states(town).at(view.time)),
            weather=np.array([tuple(view.raw["weather"].tolist())], dtype=WEATHER_DTYPE),
        )


def header_of(observation: Mapping[str, Any], town: Town) -> SessionHeader:
    """Returns a session header with what the Co-Wizard knows: streets, and the landmarks on its map."""
    column = LandmarkColumn
    marks = [row for row in observation["landmarks"].tolist() if row[column.NAME] > 0]
    return SessionHeader(
        town=town.name,
        storyboard="",
        seed=None,
        decision_frequency=1.0,
        street_names=[StreetName(int(name)).label for name in observation["street_names"][: len(town.streets)]],
        landmarks=[
            LandmarkRow(
                name=LandmarkName(int(row[column.NAME])).label,
                lane=int(row[column.LANE]),
                station=row[column.STATION],
                x=row[column.X],
                y=row[column.Y],
                street=int(row[column.STREET]),
                hidden=False,
            )
            for row in marks
        ],
        subgoals=[],
        story="",
        departure=(int(observation["lane"]), 0.0),
    )


def rows_between(before: ObservationFrame | None, after: ObservationFrame) -> Trajectory:
    """Returns the rows of the trajectory after one observation up to the next, ten a second.

    Places and speeds are interpolated; the lane is that of the nearer observation. As in a recording, nothing precedes
    the first tenth of a second.

    Args:
        before: the last observation; None for none, where there is a row for `after` only.
        after: the next observation.
    """
    before = before or replace(after, frame=after.frame - 1)
    first = max(FRAMES_PER_TENTH, (before.frame // FRAMES_PER_TENTH + 1) * FRAMES_PER_TENTH)
    rows = np.zeros(len(frames := np.arange(first, after.frame + 1, FRAMES_PER_TENTH)), dtype=TRAJECTORY_DTYPE)
    rows["frame"] = frames
    known = (before.frame, after.frame)
    columns = dict(zip(("x", "y", "heading"), np.array((before.pose, after.pose)).T, strict=True))
    columns["heading"] = np.unwrap(columns["heading"])
    for name, column in (*columns.items(), ("speed", (before.speed, after.speed))):
        rows[name] = np.interp(frames, known, column)
    rows["heading"] = (rows["heading"] + math.pi) % _TURN - math.pi
    rows["lane"] = np.where(frames <= sum(known) / 2, before.lane, after.lane)
    return rows


def scene_of(frame: ObservationFrame) -> Surroundings:
    """Returns the surroundings of an observation as they are recorded."""
    return Surroundings(
        actors=_table(frame.frame, frame.actors),
        lights=_table(frame.frame, frame.lights),
        weather=_table(frame.frame, frame.weather),
    )


@lru_cache(maxsize=16)
def _light_states(town: Town) -> LightStates:
    return LightStates(town)


def _actors(objects: NDArray[np.float64], heading: float, town: Town) -> Rows:
    seen = objects[objects[:, ObjectColumn.KIND] > 0]
    rows = np.zeros(len(seen), dtype=ACTOR_DTYPE)
    for name in ("x", "y", "length", "width", "speed"):
        rows[name] = seen[:, ObjectColumn[name.upper()]]
    rows["heading"] = heading
    rows["kind"] = [_KINDS.get(int(kind), ActorKind.OTHER) for kind in seen[:, ObjectColumn.KIND]]
    vehicles = np.flatnonzero(rows["kind"] == ActorKind.VEHICLE)
    rows["heading"][vehicles] = [_lane_heading(town, *place) for place in rows[["x", "y"]][vehicles].tolist()]
    rows["kind"][vehicles[rows["length"][vehicles] < _SHORTEST_CAR]] = ActorKind.CYCLIST
    return rows


def _lane_heading(town: Town, x: float, y: float) -> float:
    """Returns the heading of the lane nearest to a place [rad]."""
    points, headings = _lane_points(town)
    return float(headings[np.argmin(np.square(points - (x, y)).sum(1))])


@lru_cache(maxsize=16)
def _lane_points(town: Town) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns points of all lanes (n, 2) [m] and the headings there (n,) [rad]."""
    lanes = [lane for lane in town.lanes if not lane.in_junction] or town.lanes
    return np.concatenate([lane.points[:, :2] for lane in lanes]), np.concatenate([lane.headings for lane in lanes])


def _table(frame: int, rows: Rows) -> SceneTable:
    """Returns rows that were recorded at one frame."""
    return SceneTable(np.array([frame], dtype=np.int64), np.array([0, len(rows)], dtype=np.int64), rows)
