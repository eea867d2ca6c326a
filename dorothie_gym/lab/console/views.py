"""Views of the roles: JSON for the browser, made only of the role's observation, its mask and the static map."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.lab.console.pins import Pin, drawn_names, pin_rows
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.observation_parser import titles_of
from dorothie_gym.session.spaces.observations import (
    MESSAGE_KINDS,
    ExitColumn,
    GuessColumn,
    LandmarkColumn,
    ObjectColumn,
    ObservationMapping,
    PropColumn,
    SubgoalColumn,
)
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.lab.console.lane_lookup import LaneLookup
    from dorothie_gym.maps.town import Town

RoleView: TypeAlias = dict[str, Any]
"""View of a role in JSON types; the same fields at each decision, so that a browser needs the changed ones only."""

KMH: Final = 3.6
_PROPS, _SENSORS, _WEATHER = tuple(PropKind), tuple(Sensor), tuple(WeatherParameter)
_DRIVING: Final = frozenset({ObjectClass.VEHICLES})


def role_view(role: Role, observation: ObservationMapping, mask: Mapping[str, Any], places: LaneLookup) -> RoleView:
    """Returns the view of a role.

    Args:
        role: participant, Co-Wizard or Ad-Wizard.
        observation: observation of the role.
        mask: action mask of the role.
        places: lanes of the static map; vehicles in sight are drawn along them.
    """
    return {**_common(observation, places), **_VIEWS[role](observation, mask, places)}


def static_view(observation: ObservationMapping, town: Town) -> RoleView:
    """Returns the constant data of a session: names of the streets, and the story if the role observes it.

    In a town whose map names its streets, `titles` has the name in the map of each name in the session.

    Args:
        observation: observation of the role.
        town: the map.
    """
    labels = drawn_names(StreetName(int(i)) for i in observation["street_names"][: len(town.streets)])
    titles = titles_of(observation, town)
    streets = titles.labels(labels)
    named = {label: title for label, title in zip(labels, streets, strict=True) if label and label != title}
    return {
        "streets": streets,
        **({"titles": named} if titles else {}),
        "story": observation.get("story", ""),
    }


def _common(observation: ObservationMapping, places: LaneLookup) -> RoleView:
    x, y, heading = observation["pose"].tolist()
    return {
        "time": round(float(observation["time"][0]), 2),
        "pose": [round(x, 2), round(y, 2), round(heading, 3)],
        "speed": round(float(observation["speed"][0]) * KMH, 1),
        "landmarks": _landmarks(observation, places),
    }


def _participant(observation: ObservationMapping, mask: Mapping[str, Any], places: LaneLookup) -> RoleView:
    return {
        **_talk_state(observation),
        "lights": bool(observation["lights"]),
        "objects": _objects(observation, places),
        "tasks": _tasks(observation["subgoals"], observation["tasks"], only_live=True),
    }


def _co_wizard(observation: ObservationMapping, mask: Mapping[str, Any], places: LaneLookup) -> RoleView:
    covariance = observation["pose_covariance"]
    hazard, manoeuvre = int(observation["hazard"]), int(observation["manoeuvre"])
    feasible = mask["physical"]
    return {
        **_talk_state(observation),
        "covariance": [_r(covariance[0, 0], 2), _r(covariance[1, 1], 2), _r(covariance[0, 1], 2)],
        "cruise": round(float(observation["cruise_speed"][0])),
        "lights": bool(observation["lights"]),
        "motion": Motion(int(observation["motion"])).name.lower(),
        "sight": round(float(observation["sight"][0])),
        "hazard": [ObjectClass(hazard).label, round(float(observation["hazard_distance"][0]))] if hazard else None,
        "manoeuvre": [PhysicalAction(manoeuvre).label, round(float(observation["manoeuvre_angle"][0]))]
        if manoeuvre
        else None,
        "path": _path(observation["waypoints"]),
        "exits": [
            [
                round(float(row[ExitColumn.ANGLE])),
                round(float(row[ExitColumn.DISTANCE])),
                int(row[ExitColumn.STREET]),
                int(row[ExitColumn.JUNCTION]),
            ]
            for row in observation["exits"]
            if row[ExitColumn.PRESENT]
        ],
        "objects": _objects(observation, places),
        "guesses": [
            [LandmarkName(number).label, *(_r(row[k]) for k in GuessColumn if k is not GuessColumn.PRESENT)]
            for number, row in enumerate(observation["guesses"])
            if row[GuessColumn.PRESENT]
        ],
        "feasible": [action.label for action in PhysicalAction if feasible[int(action)]],
    }


def _ad_wizard(observation: ObservationMapping, mask: Mapping[str, Any], places: LaneLookup) -> RoleView:
    subgoals = observation["subgoals"]
    texts = {kind: observation[f"{kind}_messages"].split("\n") for kind in MESSAGE_KINDS}
    changes = observation["changes"].split("\n")
    tasks = _tasks(subgoals, observation["tasks"], only_live=False)
    for task in tasks:
        row = task["item"]
        task["may"] = [
            kind
            for kind, column in zip(
                MESSAGE_KINDS,
                (SubgoalColumn.CAN_TRIGGER, SubgoalColumn.CAN_DELETE, SubgoalColumn.CAN_CHANGE),
                strict=True,
            )
            if subgoals[row][column]
        ]
        task["messages"] = {kind: _line(lines, row) for kind, lines in texts.items()}
        task["after_change"] = _line(changes, row)
    exceptions = mask["exception"]
    return {
        "motion": Motion(int(observation["motion"])).name.lower(),
        "hidden": [
            bool(flag)
            for flag, row in zip(observation["hidden"], observation["landmarks"], strict=True)
            if row[LandmarkColumn.NAME]
        ],
        "tasks": tasks,
        "path": _path(observation["waypoints"]),
        "props": [
            [
                _PROPS[int(row[PropColumn.KIND]) - 1].value,
                _r(row[PropColumn.X]),
                _r(row[PropColumn.Y]),
                _r(row[PropColumn.HEADING], 2),
            ]
            for row in observation["props"]
            if row[PropColumn.KIND]
        ],
        "faults": [sensor.value for sensor, on in zip(_SENSORS, observation["sensors"], strict=True) if on],
        "weather": weather_shares(dict(zip(_WEATHER, observation["weather"].tolist(), strict=True))),
        "feasible": [kind.name.lower() for kind in ExceptionKind if exceptions[int(kind)]],
    }


_VIEWS: Final[Mapping[Role, Callable[[ObservationMapping, Mapping[str, Any], LaneLookup], RoleView]]] = {
    Role.PARTICIPANT: _participant,
    Role.CO_WIZARD: _co_wizard,
    Role.AD_WIZARD: _ad_wizard,
}


# --- parts ------------------------------------------------------------------------------------------------------------


def weather_shares(values: Mapping[WeatherParameter, float]) -> dict[str, float]:
    """Returns each weather parameter as a share of its range, in [0, 1]."""
    return {
        parameter.value: round((value - parameter.low) / (parameter.high - parameter.low), 3)
        for parameter, value in values.items()
    }


def _landmarks(observation: ObservationMapping, places: LaneLookup) -> list[list[Any]]:
    pins = [
        Pin(
            LandmarkName(int(row[LandmarkColumn.NAME])),
            (float(row[LandmarkColumn.X]), float(row[LandmarkColumn.Y])),
            int(row[LandmarkColumn.LANE]),
            float(row[LandmarkColumn.STATION]),
            int(row[LandmarkColumn.STREET]),
        )
        for row in observation["landmarks"]
        if row[LandmarkColumn.NAME]
    ]
    number = len(places.town.streets)
    labels = drawn_names(StreetName(int(i)) for i in observation["street_names"][:number])
    streets = titles_of(observation, places.town).labels(labels)
    return [list(row) for row in pin_rows(pins, streets, places)]


def _talk_state(observation: ObservationMapping) -> RoleView:
    return {
        "speaking": bool(observation["speaking"][0] > 0.0),
        "other_speaking": bool(observation["other_speaking"][0]),
    }


def _tasks(subgoals: NDArray[np.float64], texts: str, *, only_live: bool) -> list[RoleView]:
    """Returns the subgoals: landmark (row), status, text, and whether a stop would complete it now.

    Args:
        subgoals: rows of `SubgoalColumn`.
        texts: descriptions, a line each.
        only_live: whether only live subgoals have a line, or each row.
    """
    lines = texts.split("\n")
    found, live = [], 0
    for number, row in enumerate(subgoals):
        status = GoalStatus(int(row[SubgoalColumn.STATUS]))
        if status is GoalStatus.UNKNOWN and not row[SubgoalColumn.LIVE]:
            continue
        is_live = bool(row[SubgoalColumn.LIVE])
        text = _line(lines, live if only_live else number) if is_live or not only_live else ""
        live += is_live
        found.append(
            {
                "item": number,
                "landmark": int(row[SubgoalColumn.LANDMARK]),
                "status": status.label.lower(),
                "text": text,
                "live": is_live,
                "allowed": bool(row[SubgoalColumn.ALLOWED]),
            }
        )
    return found


def _objects(observation: ObservationMapping, places: LaneLookup) -> list[list[Any]]:
    """Returns the objects in sight: class, x, y [m], heading [rad], length, width [m].

    Headings are not observed; vehicles are drawn along the nearest lane.
    """
    found: list[list[Any]] = []
    for row in observation["objects"]:
        if not row[ObjectColumn.KIND]:
            break
        kind = ObjectClass(int(row[ObjectColumn.KIND]))
        x, y = float(row[ObjectColumn.X]), float(row[ObjectColumn.Y])
        heading = places.heading(x, y) if kind in _DRIVING else 0.0
        size = [_r(row[ObjectColumn.LENGTH]), _r(row[ObjectColumn.WIDTH])]
        found.append([kind.label, _r(x), _r(y), _r(heading, 2), *size])
    return found


def _path(waypoints: NDArray[np.float64]) -> list[list[float]]:
    """Returns the points of a path; the last one fills the remaining rows of the observation and is given once."""
    points = [[round(x, 1), round(y, 1)] for x, y in waypoints[np.any(waypoints != 0.0, axis=1)].tolist()]
    return [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]


def _line(lines: list[str], row: int) -> str:
    return lines[row] if row < len(lines) else ""


def _r(value: float, digits: int = 1) -> float:
    number = round(float(value), digits)
    return number if math.isfinite(number) else 0.0
