"""Observation of the Co-Wizard, read into typed fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.observation_parser import (
    IN_VIEW,
    SeenLandmark,
    SeenObject,
    landmarks_in_view,
    read_landmarks,
    read_objects,
    scalar,
)
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.route_progress import Choice, next_choice
from dorothie_gym.policies.route_tables import is_choice
from dorothie_gym.policies.scripted_agent_limits import STANDING_SPEED
from dorothie_gym.session.spaces.observations import ExitColumn, ObservationMapping
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town


@dataclass(frozen=True, kw_only=True)
class CoWizardView:
    """Observation of the Co-Wizard.

    Attributes:
        raw: the observation as received.
        time: session time [s].
        speed: speed of the car [m/s].
        lane: lane of the car, corrected by the turn options.
        station: distance along the lane, corrected by the turn options [m].
        speaking: remaining duration of its own utterance [s].
        other_speaking: whether the other speaker is talking.
        motion: state of motion.
        hazard: class of the object for which the car brakes or stands; UNLABELED if there is none.
        manoeuvre: manoeuvre in preparation or in progress.
        angle: angle of the manoeuvre [degrees].
        cruise: cruise speed [km/h].
        lights: whether the headlights are on.
        choice: next junction with a choice.
        landmarks: landmarks on the map.
    """

    raw: ObservationMapping
    time: float
    speed: float
    lane: int
    station: float
    speaking: float
    other_speaking: bool
    motion: Motion
    hazard: ObjectClass
    manoeuvre: PhysicalAction | None
    angle: float
    cruise: float
    lights: bool
    choice: Choice | None
    landmarks: tuple[SeenLandmark, ...]

    @classmethod
    def read(cls, observation: ObservationMapping, town: Town) -> CoWizardView:
        """Reads an observation."""
        manoeuvre = int(observation["manoeuvre"])
        view = cls(
            raw=observation,
            time=scalar(observation, "time"),
            speed=scalar(observation, "speed"),
            lane=int(observation["lane"]),
            station=scalar(observation, "station"),
            speaking=scalar(observation, "speaking"),
            other_speaking=bool(observation["other_speaking"][0]),
            motion=Motion(int(observation["motion"])),
            hazard=ObjectClass(int(observation["hazard"])),
            manoeuvre=PhysicalAction(manoeuvre) if manoeuvre else None,
            angle=scalar(observation, "manoeuvre_angle"),
            cruise=scalar(observation, "cruise_speed"),
            lights=bool(observation["lights"]),
            choice=None,
            landmarks=read_landmarks(observation, town),
        )
        return _located(view, town)

    @cached_property
    def objects(self) -> tuple[SeenObject, ...]:
        """Objects in sight."""
        return read_objects(self.raw)

    @property
    def landmarks_in_view(self) -> tuple[SeenLandmark, ...]:
        """Landmarks of the map that are in the picture, or else those that are near enough to be seen."""
        shown = landmarks_in_view(self.raw, self.landmarks)
        if shown is not None:
            return tuple(shown)
        x, y = self.position
        reach = min(IN_VIEW, scalar(self.raw, "sight"))
        return tuple(mark for mark in self.landmarks if pm.hypot(mark.x - x, mark.y - y) < reach)

    @cached_property
    def waypoints(self) -> np.ndarray:
        """Points of the planned path (n, 2) [m]."""
        points: np.ndarray = self.raw["waypoints"]
        return points[np.any(points != 0.0, axis=1)]

    @property
    def position(self) -> tuple[float, float]:
        """Estimated position of the car [m]."""
        x, y = self.raw["pose"][:2]
        return float(x), float(y)

    @property
    def variance(self) -> float:
        """Variance of the estimated position [m^2]."""
        covariance = self.raw["pose_covariance"]
        return float(covariance[0][0]) + float(covariance[1][1])

    @property
    def here(self) -> Place:
        """Lane and station of the car."""
        return self.lane, self.station

    @property
    def standing(self) -> bool:
        """Returns whether the car stands."""
        return self.speed < STANDING_SPEED

    @property
    def junction(self) -> int:
        """Id of the next junction with a choice, -1 if there is none."""
        return self.choice.junction if self.choice is not None else -1

    @property
    def manoeuvring(self) -> bool:
        """Returns whether the car is switching lanes or turning round.

        A car that waits at the end of its path is not: with little room, the manoeuvre ends only beyond that place, and
        the car would wait for ever.
        """
        if self.motion is Motion.WAITING:
            return False
        return self.manoeuvre in (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN)


def _located(view: CoWizardView, town: Town) -> CoWizardView:
    """Corrects lane and station by the turn options ahead, which are known even where the position has drifted."""
    believed = next_choice(town, view.lane, view.station)
    rows = [row for row in view.raw["exits"].tolist() if row[ExitColumn.PRESENT]]
    if not rows:
        return replace(view, choice=believed)
    exits = tuple(sorted(int(row[ExitColumn.LANE]) for row in rows))
    distance = rows[0][ExitColumn.DISTANCE]
    candidates = _lanes_by_exits(town).get(exits, ())
    if believed is not None and (believed.lane in candidates or not candidates):
        return replace(view, choice=replace(believed, distance=distance))
    if not candidates:
        return replace(view, choice=believed)
    lane = candidates[0]
    choice = Choice(lane=lane, distance=distance, exits=town.exits(lane))
    station = town.lanes[lane].length - distance
    if station < 0.0:
        return replace(view, choice=choice)
    return replace(view, choice=choice, lane=lane, station=station)


@lru_cache(maxsize=16)
def _lanes_by_exits(town: Town) -> Mapping[tuple[int, ...], tuple[int, ...]]:
    """Returns the lanes before junctions by the lanes that their exits lead to."""
    found: dict[tuple[int, ...], list[int]] = {}
    for lane in town.lanes:
        if is_choice(town, lane.id):
            found.setdefault(tuple(sorted(way.lane for way in town.exits(lane.id))), []).append(lane.id)
    return {exits: tuple(lanes) for exits, lanes in found.items()}
