"""Observations of the Co-Wizard in the form in which sessions are recorded."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.teacher_forced.features.incremental import ObservedFrame
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, StreetName
from dorothie_gym.session.recorder import LightStates
from dorothie_gym.session.recording.header import LandmarkRow, SessionHeader
from dorothie_gym.session.recording.surroundings import ACTOR_DTYPE, WEATHER_DTYPE, ActorKind, Rows, light_rows
from dorothie_gym.session.spaces.observations import LandmarkColumn, ObjectColumn, ObservationMapping
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.maps.town import LightColour, Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_KINDS: Final = {
    ObjectClass.VEHICLES.value: ActorKind.VEHICLE,
    ObjectClass.PEDESTRIAN.value: ActorKind.PEDESTRIAN,
    ObjectClass.STATIC.value: ActorKind.PROP,
}

_SHORTEST_CAR: Final = 2.5
"""Vehicles shorter than this count as cycles [m]."""


def observed_frame(view: CoWizardView, town: Town) -> ObservedFrame:
    """Returns the frame of a view.

    Headings of actors are not perceived: a vehicle takes that of the nearest lane, other actors take that of the car.
    """
    x, y, heading = view.raw["pose"].tolist()
    return ObservedFrame(
        frame=round(view.time * FRAME_RATE),
        pose=(x, y, heading),
        speed=view.speed,
        lane=view.lane,
        actors=_actors(view.raw["objects"], heading, town),
        lights=_light_table(town).at(view.time),
        weather=np.array([tuple(view.raw["weather"].tolist())], dtype=WEATHER_DTYPE),
    )


def header_of(observation: ObservationMapping, town: Town) -> SessionHeader:
    """Returns a session header with the Co-Wizard's knowledge: streets, and the landmarks on its map."""
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


class _LightTable:
    """Traffic lights of a town as recorded rows, built again only after a change of a light."""

    def __init__(self, town: Town) -> None:
        self._states = LightStates(town)
        self._shown: Mapping[int, LightColour] = {}
        self._rows = light_rows({})

    def at(self, time: float) -> Rows:
        """Returns the rows of `LIGHT_DTYPE` at a time of the session [s]."""
        states = self._states.at(time)
        if states is not self._shown:
            self._shown, self._rows = states, light_rows(states)
        return self._rows


@lru_cache(maxsize=16)
def _light_table(town: Town) -> _LightTable:
    return _LightTable(town)


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
    """Returns the heading of the lane nearest to a position [rad]."""
    xs, ys, headings = _lane_points(town)
    return float(headings[np.argmin(np.square(xs - x) + np.square(ys - y))])


@lru_cache(maxsize=16)
def _lane_points(town: Town) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Returns x and y [m] of points of all lanes (n,) each, and the headings there (n,) [rad]."""
    lanes = [lane for lane in town.lanes if not lane.in_junction] or town.lanes
    points = np.concatenate([lane.points[:, :2] for lane in lanes])
    return points[:, 0].copy(), points[:, 1].copy(), np.concatenate([lane.headings for lane in lanes])
