"""Scene of a session as one role has observed it, for the renderer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.ontology.world_exceptions import WeatherParameter as Weather
from dorothie_gym.pictures.views.scene import (
    SUBGOAL_STATES,
    Actor,
    CarView,
    Estimate,
    FigureKind,
    Pin,
    Scene,
    SpokenLine,
    SubgoalState,
)
from dorothie_gym.policies.observation_parser import titles_of
from dorothie_gym.session.spaces.observations import (
    GuessColumn,
    LandmarkColumn,
    ObjectColumn,
    Observation,
    ObservationMapping,
    PropColumn,
    SubgoalColumn,
    heard_acts,
)
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.tasks.catalogue import map_label, map_labels

if TYPE_CHECKING:
    from dorothie_gym.dialogue.street_titles import StreetTitles
    from dorothie_gym.maps.town import Town

_KINDS: dict[ObjectClass, FigureKind] = {ObjectClass.VEHICLES: "vehicle", ObjectClass.PEDESTRIAN: "pedestrian"}
_TITLES = {
    Role.PARTICIPANT: "Participant's view",
    Role.CO_WIZARD: "Co-Wizard's view",
    Role.AD_WIZARD: "Ad-Wizard's view",
}
_PROP_SIZE = 1.2
"""Length and width of an observed prop [m]; the observation has neither."""


class RoleView:
    """Scene of a session from the observations of one role and its own utterances, and nothing else.

    Utterances of others are shown at the time at which the role heard them, which is after their last word.

    Args:
        role: role whose observations are noted.
        town: the map.
    """

    def __init__(self, role: Role, town: Town) -> None:
        self.role = role
        self._town = town
        self._lines: list[SpokenLine] = []
        self._trail: list[tuple[float, float]] = []
        self._descriptions: dict[int, str] = {}
        self._seen: Observation | None = None

    def note(self, seen: Observation) -> None:
        """Adds the observation of the next decision."""
        self._seen = seen
        self._trail.append((float(seen["pose"][0]), float(seen["pose"][1])))
        time = float(seen["time"][0])
        for speaker in (Role.PARTICIPANT, Role.CO_WIZARD):
            if text := seen.get(f"{speaker}_text", ""):
                acts, titles = " ".join(_short(act) for act in heard_acts(seen, speaker) or ()), self._titles(seen)
                line = SpokenLine(time=time, speaker=speaker, text=titles.shown(text), acts=titles.shown(acts))
                self.add(line)
        if message := seen.get("message", ""):
            self.add(SpokenLine(time=time, speaker=Role.AD_WIZARD, text=message))
        if "tasks" in seen:
            table = seen["subgoals"]
            live = np.flatnonzero(table[:, SubgoalColumn.LIVE]).tolist()
            numbers = live if self.role is Role.PARTICIPANT else range(len(table))  # the Ad-Wizard reads all of them
            self._descriptions.update(zip(numbers, seen["tasks"].split("\n"), strict=False))

    def add(self, line: SpokenLine) -> None:
        """Adds an utterance that the role has heard or spoken."""
        self._lines.append(line)

    def scene(self, own: Sequence[SpokenLine] = ()) -> Scene:
        """Returns the scene at the last noted decision; `own` are the utterances of the role itself.

        Raises:
            RuntimeError: no observation has been noted.
        """
        seen = self._seen
        if seen is None:
            raise RuntimeError("no session is being played: call reset() first")
        pins, subgoals = _pins(seen, self._town), self._subgoals(seen)
        for landmark, state in ((row[0], row[2]) for row in subgoals):
            if 0 <= landmark < len(pins):
                pins[landmark] = replace(pins[landmark], state=state)
        x, y, heading = seen["pose"].tolist()
        estimates = list(_estimates(seen))
        pins += [
            Pin(label=at.label, x=at.x, y=at.y, waypoint=(at.x, at.y), hidden=True) for at in estimates if at.label
        ]
        waypoints = seen.get("waypoints", np.zeros((0, 2)))
        return Scene(
            time=float(seen["time"][0]),
            town=self._town,
            car=CarView(x=x, y=y, heading=heading, speed=float(seen["speed"][0]), lights=bool(seen.get("lights", 0))),
            street_names=self._titles(seen).labels([name.label for name in self._names(seen)]),
            trail=np.array(self._trail),
            waypoints=waypoints[waypoints.any(axis=1)],
            others=[*self._objects(seen), *_props(seen)],
            landmarks=pins,
            subgoals=[(text, state) for _, text, state in subgoals],
            utterances=sorted((*self._lines, *own), key=lambda line: line.time),
            notes=list(_notes(seen)),
            weather={str(name): float(value) for name, value in zip(Weather, seen["weather"], strict=True)},
            estimates=estimates,
            caption=_caption(self.role, seen),
        )

    def _names(self, seen: ObservationMapping) -> list[StreetName]:
        return [StreetName(int(k)) for k in seen["street_names"][: len(self._town.streets)]]

    def _titles(self, seen: ObservationMapping) -> StreetTitles:
        return titles_of(seen, self._town)

    def _subgoals(self, seen: ObservationMapping) -> list[tuple[int, str, SubgoalState]]:
        """Returns landmark, description and state of the subgoals that the role observes."""
        found: list[tuple[int, str, SubgoalState]] = []
        for number, row in enumerate(seen.get("subgoals", ())):
            status = GoalStatus(int(row[SubgoalColumn.STATUS]))
            if status not in SUBGOAL_STATES or not (row[SubgoalColumn.LIVE] or status is GoalStatus.ABANDONED):
                continue
            landmark = int(row[SubgoalColumn.LANDMARK])
            name = map_label(LandmarkName(int(seen["landmarks"][landmark][LandmarkColumn.NAME])))
            found.append(
                (landmark, self._descriptions.get(number, f"Subgoal {number + 1}: {name}"), SUBGOAL_STATES[status])
            )
        return found

    def _objects(self, seen: ObservationMapping) -> Iterator[Actor]:
        """Yields the objects in sight; their heading is not observed, and vehicles get that of the nearest lane."""
        points, headings = self._lane_points
        for row in seen.get("objects", ()):
            kind = ObjectClass(int(row[ObjectColumn.KIND]))
            if not kind.value:
                break
            x, y = float(row[ObjectColumn.X]), float(row[ObjectColumn.Y])
            yield Actor(
                kind=_KINDS.get(kind, "prop"),
                x=x,
                y=y,
                heading=float(headings[points.query((x, y))[1]]),
                length=float(row[ObjectColumn.LENGTH]),
                width=float(row[ObjectColumn.WIDTH]),
            )

    @cached_property
    def _lane_points(self) -> tuple[cKDTree, np.ndarray[tuple[int], np.dtype[np.float64]]]:
        """Points of the lanes' centre lines, and the heading of the lane at each [rad]."""
        steps = [np.diff(lane.points[:, :2], axis=0) for lane in self._town.lanes]
        starts = np.concatenate([lane.points[:-1, :2] for lane in self._town.lanes])
        return cKDTree(starts), np.concatenate([pn.arctan2(step[:, 1], step[:, 0]) for step in steps])


def _pins(seen: ObservationMapping, town: Town) -> list[Pin]:
    hidden = seen.get("hidden", np.zeros(len(seen["landmarks"])))
    rows = [row for row in seen["landmarks"] if row[LandmarkColumn.NAME]]
    labels = map_labels([LandmarkName(int(row[LandmarkColumn.NAME])) for row in rows])
    pins = []
    for row, label, unknown in zip(rows, labels, hidden, strict=False):
        stop = town.lanes[int(row[LandmarkColumn.LANE])].position(float(row[LandmarkColumn.STATION]))
        pins.append(
            Pin(
                label=label,
                x=float(row[LandmarkColumn.X]),
                y=float(row[LandmarkColumn.Y]),
                waypoint=(float(stop[0]), float(stop[1])),
                hidden=bool(unknown),
            )
        )
    return pins


def _estimates(seen: ObservationMapping) -> Iterator[Estimate]:
    """Yields the estimated positions of the car (without label) and of hidden landmarks."""
    if "pose_covariance" in seen:
        (xx, xy), (_, yy) = seen["pose_covariance"][:2, :2].tolist()
        yield Estimate(x=float(seen["pose"][0]), y=float(seen["pose"][1]), covariance=(xx, xy, yy))
    for name, row in enumerate(seen.get("guesses", ())):
        if row[GuessColumn.PRESENT]:
            _, x, y, xx, yy, xy = row.tolist()
            yield Estimate(label=map_label(LandmarkName(name)), x=x, y=y, covariance=(xx, xy, yy))


def _props(seen: ObservationMapping) -> Iterator[Actor]:
    for row in seen.get("props", ()):
        if row[PropColumn.KIND]:
            _, x, y, heading = row.tolist()
            yield Actor(kind="prop", x=x, y=y, heading=heading, length=_PROP_SIZE, width=_PROP_SIZE)


def _notes(seen: ObservationMapping) -> Iterator[str]:
    hazard = ObjectClass(int(seen.get("hazard", 0)))
    if hazard.value:
        yield f"Hazard stop: {hazard.label}"
    for sensor, faulty in zip(Sensor, seen.get("sensors", ()), strict=False):
        if faulty:
            yield f"Sensor fault: {sensor}"


def _caption(role: Role, seen: ObservationMapping) -> str:
    parts = [_TITLES[role]]
    if seen.get("manoeuvre", 0):
        action, angle = PhysicalAction(int(seen["manoeuvre"])), float(seen["manoeuvre_angle"][0])
        parts.append(action.label + (f" {angle:+.0f}°" if angle else ""))
    return " · ".join(parts)


def _short(act: object) -> str:
    return str(act).removesuffix("()")
