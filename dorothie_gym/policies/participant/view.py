"""Observation of the participant, read into typed fields."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.observation_parser import (
    SeenLandmark,
    SeenObject,
    SeenSubgoal,
    read_landmarks,
    read_objects,
    read_subgoals,
    scalar,
)
from dorothie_gym.policies.scripted_agent_limits import STANDING_SPEED
from dorothie_gym.session.spaces.observations import ObservationMapping
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town

ACROSS_LANE = 0.8
"""Cosine of the angle between car and lane below which the car is in the middle of a U-turn."""


@dataclass(frozen=True, kw_only=True)
class ParticipantView:
    """Observation of the participant.

    Attributes:
        raw: the observation as received.
        time: time of the session [s].
        speed: speed of the car [m/s].
        lane: lane of the car.
        station: distance along the lane [m].
        speaking: remaining duration of its own utterance [s].
        other_speaking: whether the other speaker is talking.
        landmarks: all landmarks.
        subgoals: all subgoals.
        turning: whether the car stands across its lane.
    """

    raw: ObservationMapping
    time: float
    speed: float
    lane: int
    station: float
    speaking: float
    other_speaking: bool
    landmarks: tuple[SeenLandmark, ...]
    subgoals: tuple[SeenSubgoal, ...]
    turning: bool

    @classmethod
    def read(cls, observation: ObservationMapping, town: Town) -> ParticipantView:
        """Reads an observation."""
        lane, station = int(observation["lane"]), scalar(observation, "station")
        across = float(observation["pose"][2]) - town.lanes[lane].heading_at(station)
        return cls(
            raw=observation,
            time=scalar(observation, "time"),
            speed=scalar(observation, "speed"),
            lane=lane,
            station=station,
            speaking=scalar(observation, "speaking"),
            other_speaking=bool(observation["other_speaking"][0]),
            landmarks=read_landmarks(observation, town),
            subgoals=read_subgoals(observation),
            turning=pm.cos(across) < ACROSS_LANE,
        )

    @cached_property
    def objects(self) -> tuple[SeenObject, ...]:
        """Objects in sight."""
        return read_objects(self.raw)

    @property
    def position(self) -> tuple[float, float]:
        """Position of the car [m]."""
        x, y = self.raw["pose"][:2]
        return float(x), float(y)

    @property
    def heading(self) -> float:
        """Heading of the car, counterclockwise from east [degrees]."""
        return math.degrees(float(self.raw["pose"][2]))

    @property
    def place(self) -> Place:
        """Lane and station of the car."""
        return self.lane, self.station

    @property
    def standing(self) -> bool:
        """Returns whether the car stands."""
        return self.speed < STANDING_SPEED

    def landmark(self, row: int) -> SeenLandmark | None:
        """Returns the landmark of a row."""
        return next((landmark for landmark in self.landmarks if landmark.row == row), None)

    def unique(self, landmark: SeenLandmark) -> bool:
        """Returns whether the name identifies the landmark."""
        return sum(other.name is landmark.name for other in self.landmarks) == 1 and landmark.name not in (
            LandmarkName.HOUSE,
            LandmarkName.PERSON,
        )
