"""What one observation of the Co-Wizard shows, in the form in which sessions are recorded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
from dorothie_gym.recording.surroundings import LIGHT_DTYPE, Rows, light_rows
from dorothie_gym.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.spaces import LandmarkColumn, ObjectColumn

_KINDS: Final = {
    ObjectClass.VEHICLES.value: ActorKind.VEHICLE,
    ObjectClass.PEDESTRIAN.value: ActorKind.PEDESTRIAN,
    ObjectClass.STATIC.value: ActorKind.PROP,
}

_SHORTEST_CAR: Final = 2.5
"""A vehicle that is shorter is a cycle [m]."""

_TURN: Final = 2.0 * math.pi


@dataclass(frozen=True, eq=False, kw_only=True)
class Glimpse:
    """The car and its surroundings at a moment, as the Co-Wizard has them.

    Attributes:
        frame: of the physics (30 Hz).
        pose: x, y [m], heading [rad, clockwise] as estimated.
        speed: as measured [m/s].
        lane: that the car is believed to be on.
        actors: what is perceived, rows of `ACTOR_DTYPE`. The way that something faces is not perceived: a vehicle's is
            taken to be that of its lane, anything else's the car's own.
        lights: what all lights of the town show, rows of `LIGHT_DTYPE`; sight and direction are looked at later.
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
        """Returns what a view shows."""
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
    """Returns what the Co-Wizard knows of a session before it begins: streets, and the landmarks on its map."""
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


def way_of(glimpses: Sequence[Glimpse]) -> Trajectory:
    """Returns the way at tenths of a second, straight from one glimpse to the next.

    As in a recording, the first row is that of the first tenth: nothing has happened before.
    """
    frames = np.array([glimpse.frame for glimpse in glimpses])
    rows = np.zeros(
        len(wanted := np.arange(_first_row(frames), frames[-1] + 1, FRAMES_PER_TENTH)), dtype=TRAJECTORY_DTYPE
    )
    rows["frame"] = wanted
    x, y, heading = np.array([glimpse.pose for glimpse in glimpses]).T
    columns = {"x": x, "y": y, "heading": np.unwrap(heading), "speed": [glimpse.speed for glimpse in glimpses]}
    for name, column in columns.items():
        rows[name] = np.interp(wanted, frames, column)
    rows["heading"] = (rows["heading"] + math.pi) % _TURN - math.pi
    middles = (frames[1:] + frames[:-1]) / 2
    rows["lane"] = np.array([glimpse.lane for glimpse in glimpses])[np.searchsorted(middles, wanted)]
    return rows


def scene_of(glimpses: Sequence[Glimpse]) -> Surroundings:
    """Returns what was around the car at the glimpses of which the way has a row."""
    seen = [
        glimpse for glimpse in glimpses if glimpse.frame >= FRAMES_PER_TENTH and glimpse.frame % FRAMES_PER_TENTH == 0
    ]
    frames = np.array([glimpse.frame for glimpse in seen], dtype=np.int64)
    return Surroundings(
        actors=_table(frames, [glimpse.actors for glimpse in seen], ACTOR_DTYPE),
        lights=_table(frames, [glimpse.lights for glimpse in seen], LIGHT_DTYPE),
        weather=_table(frames, [glimpse.weather for glimpse in seen], WEATHER_DTYPE),
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
    """Which way the lane nearest to a place leads [rad]."""
    points, headings = _lane_points(town)
    return float(headings[np.argmin(np.square(points - (x, y)).sum(1))])


@lru_cache(maxsize=16)
def _lane_points(town: Town) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of all lanes (n, 2) [m] and the headings there (n,) [rad]."""
    lanes = [lane for lane in town.lanes if not lane.in_junction] or town.lanes
    return np.concatenate([lane.points[:, :2] for lane in lanes]), np.concatenate([lane.headings for lane in lanes])


def _first_row(frames: NDArray[np.int64]) -> int:
    return max(FRAMES_PER_TENTH, -(-int(frames[0]) // FRAMES_PER_TENTH) * FRAMES_PER_TENTH)


def _table(frames: NDArray[np.int64], rows: list[Rows], kind: np.dtype[Any]) -> SceneTable:
    offsets = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
    return SceneTable(frames, offsets, np.concatenate([np.empty(0, dtype=kind), *rows]))
