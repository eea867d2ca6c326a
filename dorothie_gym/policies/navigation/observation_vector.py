"""Observation vector of `Navigation-v0`: numbers in [-1, 1] computed from the observation of the Co-Wizard."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    StreetName,
    WeatherParameter,
)
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import SECTORS, JunctionExits, SectorExit
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.sim.ego.limits import MAX_CRUISE
from dorothie_gym.spaces import ExitColumn, Motion, ObjectColumn, ObservationMapping
from dorothie_gym.spaces.fields import share, signal, sizes

Vector: TypeAlias = NDArray[np.float32]

MAX_SECONDS = 600.0
"""Default time limit of a navigation session [s]."""

DECISION_FREQUENCY = 2.0
"""Default number of driving decisions per second [Hz]."""

OBJECTS = 6
"""Number of objects in the vector, the nearest first."""

KINDS = (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.STATIC)
"""Classes of objects that the vector distinguishes; all others count as the first."""

SPEED_UNIT = 25.0
"""Unit of speeds: 90 km/h [m/s]."""

DISTANCE_UNIT = 100.0
"""Unit of distances to junctions, instructions and hazards [m]."""

CLOSE_UNIT = 10.0
"""Second, finer unit of distances that have to be met to the metre [m]."""

DETOUR_UNIT = 200.0
"""Unit of differences between routes [m]."""

TOWN_UNIT = 500.0
"""Unit of positions on the map [m]."""

AGE_UNIT = 10.0
"""Unit of the age of an instruction [s]."""

_WEATHER = tuple((parameter.low, parameter.high - parameter.low) for parameter in WeatherParameter)
_MANOEUVRES = (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN, PhysicalAction.J_TURN)
_COLOURS = tuple(LightColour)

FIELD_SPECS = (
    signal("speed", 1, unit="25 m/s", meaning="speed of the car"),
    share("cruise", 1, unit="90 km/h", meaning="cruise speed"),
    share("motion", len(Motion), meaning="one-hot `Motion`"),
    share("manoeuvre", len(_MANOEUVRES), meaning="one-hot manoeuvre, planned or under way: lane switch, U-turn, turn"),
    share("hazard", 2, unit="1, 100 m", meaning="1 if the car brakes or stands for a hazard; distance to the hazard"),
    share("lights", 1, meaning="1 if the headlights are on"),
    share(
        "lane",
        4,
        unit="1, 1, 1, 25 m/s",
        meaning="1 in a junction; 1 if there is a lane to the left; 1 if there is a lane to the right; speed limit",
    ),
    share("uncertainty", 2, unit="10 m, 0.1 rad", meaning="standard deviations of the estimated position and heading"),
    share("junction", 2, unit="1, 100 m", meaning="1 if a junction with a choice is ahead; distance to the junction"),
    share(
        "exits",
        3 * len(SECTORS),
        meaning="three flags for each sector of `SECTORS`: exit present, exit planned, exit leads to the named street",
    ),
    signal(
        "traffic_light",
        1 + len(_COLOURS),
        unit="100 m, 1",
        meaning="distance to the light at the end of the lane; one-hot colour (green, yellow, red)",
    ),
    share("said", 1 + len(DialogueMove), meaning="1 if an instruction was heard; its one-hot `DialogueMove`"),
    share("said_action", len(ActionValue), meaning="one-hot `ActionValue` of the instruction"),
    share("said_sector", len(SECTORS), meaning="one-hot sector of the instruction, in the order of `SECTORS`"),
    share("said_landmark", len(LandmarkName), meaning="one-hot `LandmarkName` of the instruction"),
    signal(
        "said_distance",
        2,
        unit="100 m, 10 m",
        meaning="remaining part of the announced distance in two units; negative after the place",
    ),
    share("said_age", 1, unit="10 s", meaning="age of the instruction"),
    signal(
        "goal", 3, unit="1, 500 m, 500 m", meaning="1 if the place of the goal is known; its position ahead and right"
    ),
    signal(
        "goal_distance",
        3,
        unit="500 m, 100 m, 10 m",
        meaning="cost to go; distance ahead in two units, 1 if the goal is on another lane",
    ),
    signal(
        "detours",
        3 + len(SECTORS),
        unit="200 m",
        meaning="added route cost of a U-turn, of a switch to the left and right, and of the exit in each of `SECTORS`",
    ),
    signal(
        "objects",
        OBJECTS * (3 + len(KINDS)),
        unit="50 m, 1, 1, 1",
        meaning="for each object: distance, sine and cosine of the bearing, one-hot class "
        "(vehicle, pedestrian, static)",
    ),
    share("weather", len(_WEATHER), meaning="each `WeatherParameter` as a share of its range"),
    share("time", 1, meaning="elapsed share of the time limit"),
)
"""Fields of the observation vector, in order. Values are clipped to their range; unknown values are 0.

Units are the scales of normalised values: with the unit "25 m/s", 1 means 25 m/s.
"""

FIELDS = sizes(FIELD_SPECS)
"""Sizes of the fields by name, in order."""


def layout(fields: Mapping[str, int] = FIELDS) -> dict[str, slice]:
    """Returns the slice of the observation for each field; by default for the fields of `NavigationEnv`."""
    ends = np.cumsum(list(fields.values())).tolist()
    return {name: slice(end - size, end) for (name, size), end in zip(fields.items(), ends, strict=True)}


def navigation_space() -> spaces.Space[Vector]:
    """Returns the observation space: a vector of all `FIELDS`."""
    space: spaces.Space[Vector] = spaces.Box(-1.0, 1.0, (sum(FIELDS.values()),), dtype=np.float32)
    return space


@dataclass(frozen=True, kw_only=True)
class HeardInstruction:
    """Last instruction as a driver remembers it.

    Attributes:
        instruction: the last instruction, or None.
        driven: distance driven since [m].
        goal: place of the goal that was named and is on the Co-Wizard's map, or None.
    """

    instruction: NavigationInstruction | None = None
    driven: float = 0.0
    goal: Place | None = None

    def driven_on(self, before: ObservationMapping, now: ObservationMapping) -> HeardInstruction:
        """Adds the distance driven between two observations, computed from the speeds in both."""
        seconds = float(now["time"][0] - before["time"][0])
        return replace(self, driven=self.driven + seconds * float(before["speed"][0] + now["speed"][0]) / 2.0)


class NavigationEncoder:
    """Encoder of observations for a driver in a town, in `NavigationEnv` as in `DuoWizardEnv`.

    The vector depends only on the Co-Wizard's observation in `DuoWizardEnv`, the map, and the instructions: it holds
    nothing that the Co-Wizard does not know.
    """

    def __init__(self, town: Town, exits: JunctionExits, max_seconds: float) -> None:
        self._town, self._exits, self._max_seconds = town, exits, max_seconds
        self._oncoming = oncoming_lanes(town)
        self._cost_to_go = CostToGo(town)

    def observe(self, seen: ObservationMapping, heard: HeardInstruction, blocked: tuple[Place, ...]) -> Vector:
        """Encodes an observation.

        Args:
            seen: observation of the Co-Wizard.
            heard: last instruction.
            blocked: places behind the roadblocks known.

        Returns:
            Vector (n,) of `navigation_space`.
        """
        lane, station = int(seen["lane"]), float(seen["station"][0])
        choice = self._exits.choice_ahead(seen)
        ways = self._exits.by_sector(choice) if choice is not None else (None,) * len(SECTORS)
        self._cost_to_go.aim(heard.goal, blocked if heard.goal is not None else ())
        values = [
            *self._car(seen, lane),
            *self._junction(seen, heard, ways, choice),
            *self._light(lane, station, float(seen["time"][0])),
            *_instruction(heard, float(seen["time"][0])),
            *self._goal(seen, heard, lane, station),
            *self._detours(heard, ways, lane, station),
            *_objects(seen),
            *((float(value) - low) / span for value, (low, span) in zip(seen["weather"], _WEATHER, strict=True)),
            float(seen["time"][0]) / self._max_seconds,
        ]
        observation = np.array(values, dtype=np.float32)
        return np.minimum(np.maximum(observation, -1.0, out=observation), 1.0, out=observation)

    def _car(self, seen: ObservationMapping, lane: int) -> list[float]:
        town = self._town
        manoeuvre, covariance = int(seen["manoeuvre"]), seen["pose_covariance"]
        hazard = bool(seen["hazard"])
        return [
            float(seen["speed"][0]) / SPEED_UNIT,
            float(seen["cruise_speed"][0]) / MAX_CRUISE,
            *_one_hot(int(seen["motion"]), len(Motion)),
            *(float(manoeuvre == action.value) for action in _MANOEUVRES),
            float(hazard),
            float(seen["hazard_distance"][0]) / DISTANCE_UNIT if hazard else 0.0,
            float(seen["lights"]),
            float(town.lanes[lane].in_junction),
            float(town.neighbour(lane, LinkType.LANE_CHANGE_LEFT) is not None),
            float(town.neighbour(lane, LinkType.LANE_CHANGE_RIGHT) is not None),
            town.lanes[lane].speed_limit / SPEED_UNIT,
            math.sqrt(float(covariance[0, 0] + covariance[1, 1])) / 10.0,
            math.sqrt(float(covariance[2, 2])) / 0.1,
        ]

    def _junction(
        self, seen: ObservationMapping, heard: HeardInstruction, ways: tuple[SectorExit | None, ...], choice: int | None
    ) -> list[float]:  # fmt: skip
        if choice is None:
            return [0.0] * (2 + 3 * len(SECTORS))
        distance = float(seen["exits"][0, ExitColumn.DISTANCE])
        turning = int(seen["manoeuvre"]) == PhysicalAction.J_TURN
        angle = int(seen["manoeuvre_angle"][0])
        street = heard.instruction.street if heard.instruction is not None else None
        values = [1.0, distance / DISTANCE_UNIT]
        for way in ways:
            if way is None:
                values += (0.0, 0.0, 0.0)
                continue
            named = street is not None and street_of(seen, self._town, way.lane) is street
            values += (1.0, float(turning and way.angle == angle), float(named and street is not StreetName.UNKNOWN))
        return values

    def _light(self, lane: int, station: float, time: float) -> list[float]:
        colour = self._town.light(lane, time)
        if colour is None:
            return [0.0] * (1 + len(_COLOURS))
        left = self._town.lanes[lane].length - station
        return [left / DISTANCE_UNIT, *_one_hot(_COLOURS.index(colour), len(_COLOURS))]

    def _goal(self, seen: ObservationMapping, heard: HeardInstruction, lane: int, station: float) -> list[float]:
        if heard.goal is None:
            return [0.0] * 6
        x, y = self._town.lanes[heard.goal[0]].position(heard.goal[1])
        here_x, here_y, heading = (float(value) for value in seen["pose"])
        dx, dy = float(x) - here_x, float(y) - here_y
        sine, cosine = math.sin(heading), math.cos(heading)
        left = self._cost_to_go.from_place(lane, station)
        ahead = heard.goal[1] - station if lane == heard.goal[0] else math.inf
        return [
            1.0,
            (dx * cosine + dy * sine) / TOWN_UNIT,
            (dy * cosine - dx * sine) / TOWN_UNIT,
            min(left / TOWN_UNIT, 1.0),
            min(ahead / DISTANCE_UNIT, 1.0),
            min(ahead / CLOSE_UNIT, 1.0),
        ]

    def _detours(
        self, heard: HeardInstruction, ways: tuple[SectorExit | None, ...], lane: int, station: float
    ) -> list[float]:
        """Returns by how much each manoeuvre and exit lengthens the route to the goal; zeros where no goal is known."""
        if heard.goal is None:
            return [0.0] * (3 + len(SECTORS))
        town, left = self._town, self._cost_to_go.from_place
        stay = left(lane, station)
        oncoming = self._oncoming.at(lane, station)
        others = [math.inf if oncoming is None else left(oncoming.lane, oncoming.station)]
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT):
            beside = town.neighbour(lane, side)
            position = town.lanes[lane].position(station)
            others.append(math.inf if beside is None else left(beside, float(town.lanes[beside].project(position)[0])))
        costs = [math.inf if way is None else left(way.lane, 0.0) for way in ways]
        best = min(costs)
        return [*(_added_cost(other, stay) for other in others), *(_added_cost(cost, best) for cost in costs)]


def _added_cost(cost: float, than: float) -> float:
    """Returns by how much a cost exceeds another, of `DETOUR_UNIT`, from -1 to 1; 1 for an infinite cost."""
    if not math.isfinite(cost):
        return 1.0
    return max(min((cost - than) / DETOUR_UNIT, 1.0), -1.0) if math.isfinite(than) else -1.0


def _instruction(heard: HeardInstruction, time: float) -> list[float]:
    given = heard.instruction
    if given is None:
        count = ("said", "said_action", "said_sector", "said_landmark", "said_distance", "said_age")
        return [0.0] * sum(FIELDS[name] for name in count)
    left = given.distance - heard.driven
    return [
        1.0,
        *_one_hot(int(given.act.move), len(DialogueMove)),
        *_one_hot(-1 if given.action is None else given.action.value, len(ActionValue)),
        *_one_hot(-1 if given.sector is None else given.sector, len(SECTORS)),
        *_one_hot(-1 if given.landmark is None else given.landmark.value, len(LandmarkName)),
        left / DISTANCE_UNIT,
        left / CLOSE_UNIT,
        (time - given.time) / AGE_UNIT,
    ]


def _objects(seen: ObservationMapping) -> list[float]:
    values: list[float] = []
    for row in seen["objects"][:OBJECTS].tolist():
        kind = int(row[ObjectColumn.KIND])
        if kind == 0:
            break
        bearing = row[ObjectColumn.BEARING]
        place = next((k for k, known in enumerate(KINDS) if known.value == kind), 0)
        values += (row[ObjectColumn.DISTANCE] / 50.0, math.sin(bearing), math.cos(bearing))
        values += _one_hot(place, len(KINDS))
    return values + [0.0] * (FIELDS["objects"] - len(values))


def _one_hot(at: int, size: int) -> list[float]:
    values = [0.0] * size
    if at >= 0:
        values[at] = 1.0
    return values
