"""Fields of the observation of the navigation environments: their sizes, units and meaning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.spaces.fields import share, signal, sizes
from dorothie_gym.sim.state.codes import Motion

Vector: TypeAlias = NDArray[np.float32]

MAX_SECONDS = 600.0
"""Default time limit of a navigation session [s]."""

DECISION_FREQUENCY = 2.0
"""Default number of driving decisions per second [Hz]."""

SECTORS = tuple(range(-180, 180, 45))
"""Middles of the sectors [degrees, positive left]: back, sharp right, right, half right, straight, ..."""

OBJECTS: Final = 6
"""Number of objects in a view, the nearest first."""

COLOURS: Final = tuple(LightColour)
"""Colours of lights in the order of `codes.Colour`."""

MANOEUVRES = (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN, PhysicalAction.J_TURN)
"""Actions that the vector distinguishes while they are planned or under way."""

KINDS = (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.STATIC)
"""Classes of objects that the vector distinguishes; all others count as the first."""

SPEED_UNIT = 25.0
"""Unit of speeds: 90 km/h [m/s]."""

DISTANCE_UNIT = 100.0
"""Unit of distances to junctions, instructions and hazards [m]."""

CLOSE_UNIT = 10.0
"""Second, finer unit for distances that matter to the metre [m]."""

DETOUR_UNIT = 200.0
"""Unit of differences between routes [m]."""

TOWN_UNIT = 500.0
"""Unit of positions on the map [m]."""

AGE_UNIT = 10.0
"""Unit of the age of an instruction [s]."""

FIELD_SPECS = (
    signal("speed", 1, unit="25 m/s", meaning="speed of the car"),
    share("cruise", 1, unit="90 km/h", meaning="cruise speed"),
    share("motion", len(Motion), meaning="one-hot `Motion`"),
    share("manoeuvre", len(MANOEUVRES), meaning="one-hot manoeuvre, planned or under way: lane switch, U-turn, turn"),
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
        1 + len(COLOURS),
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
    share("weather", len(WeatherParameter), meaning="each `WeatherParameter` as a share of its range"),
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
