"""Recorded world of a session: facts at a time."""

from __future__ import annotations

import bisect
import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.routing import Place, router
from dorothie_gym.maps.town import LightColour, Town
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, ObjectClass
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.session.recording.surroundings import ActorKind
from dorothie_gym.sim.config import FAULT_SECONDS, FRAME_RATE
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.session.recording.header import LandmarkRow
    from dorothie_gym.session.recording.session import Session

_NAMING: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})
_OVER: Final = frozenset({GoalStatus.ABANDONED, GoalStatus.COMPLETE, GoalStatus.PENDING})
STANDING_SPEED: Final = 0.5  # [m/s]
_CLOSE: Final = 25.0  # distance from a landmark within which a car is at it or just before it [m]
_SOON: Final = 3.0  # time from the standstill at a place to the end of the errand [s]
_LATELY: Final = 30.0  # time for which a car has arrived after that [s]
_LIGHT_SIGHT: Final = 60.0  # distance of the light that a standing car waits for [m]


class SessionWorld:
    """World of a recorded session.

    Attributes:
        session: the session.
        town: its town.
    """

    def __init__(self, session: Session, town: Town) -> None:
        self.session, self.town = session, town
        self._rows = session.trajectory

    # --- the car ------------------------------------------------------------------------------------------------------

    def row(self, time: float) -> np.void:
        """Returns the row of the trajectory at a time [s], the nearest within the session."""
        place = int(np.searchsorted(self._rows["frame"], round(time * FRAME_RATE)))
        row: np.void = self._rows[min(place, len(self._rows) - 1)]
        return row

    @property
    def end(self) -> float:
        """Time of the last row of the trajectory [s]."""
        return float(self._rows["frame"][-1]) / FRAME_RATE

    def position(self, time: float) -> tuple[float, float]:
        """Returns where the car is at a time [s] (x, y) [m]."""
        row = self.row(time)
        return float(row["x"]), float(row["y"])

    def speed(self, time: float) -> float:
        """Returns the speed of the car [m/s] at a time [s]."""
        return float(self.row(time)["speed"])

    def stands(self, time: float) -> bool:
        """Returns whether the car is stationary at a time [s]."""
        return self.speed(time) < STANDING_SPEED

    def place(self, time: float) -> Place:
        """Returns lane of the car and distance along it at a time [s]."""
        lane = int(self.row(time)["lane"])
        return lane, float(self.town.lanes[lane].project(np.array(self.position(time)))[0])

    def street(self, time: float) -> str | None:
        """Returns the label of the name of the car's street; None if the street has none."""
        return self.street_name(self.town.lanes[int(self.row(time)["lane"])].street)

    def street_name(self, street: int) -> str | None:
        """Returns the label of the name of a street by its index in the town; None if it has none."""
        names = self.session.header.street_names
        return names[street] if 0 <= street < len(names) else None

    def bearing(self, time: float, x: float, y: float) -> float:
        """Returns the angle between the heading of the car and a point, in 0..180 [degrees]."""
        row = self.row(time)
        away = math.atan2(y - float(row["y"]), x - float(row["x"]))
        return abs(wrap_degrees(math.degrees(away - float(row["heading"]))))

    def way_to(self, time: float, landmark: LandmarkRow) -> float:
        """Returns the length of the shortest route from the car to a landmark [m]; infinity if there is none."""
        route = router(self.town).route(self.place(time), (landmark["lane"], landmark["station"]))
        return route.length if route is not None else math.inf

    def light_is_red(self, time: float) -> bool:
        """Returns whether the next traffic light on the lanes ahead, if near, is not green at a time [s]."""
        lane, station = self.place(time)
        ahead = -station
        for _ in range(6):
            ahead += self.town.lanes[lane].length
            if ahead > _LIGHT_SIGHT:
                return False
            colour = self.town.light(lane, time)
            if colour is not None:
                return colour is not LightColour.GREEN
            following = self.town.exits(lane)
            if len(following) != 1:
                return False
            lane = following[0].connector if following[0].connector >= 0 else following[0].lane
        return False

    def lights_on(self, time: float) -> bool:
        """Returns whether the headlights are on at a time [s]; they are off at first."""
        switched = [
            action.up
            for action in self.session.physical_actions
            if action.action is PhysicalAction.LIGHT_CHANGE and action.frame < time * FRAME_RATE
        ]
        return bool(switched and switched[-1])

    # --- the surroundings ---------------------------------------------------------------------------------------------

    def weather(self, time: float, parameter: WeatherParameter) -> float:
        """Returns a parameter of the weather at a time [s], in its unit."""
        table = self.session.scene.weather
        place = bisect.bisect_right(table.frames.tolist(), round(time * FRAME_RATE)) - 1
        if place < 0:
            return parameter.clear_noon
        return float(table.rows[int(table.offsets[place])][parameter.value])

    def sight(self, time: float, *, faulty: bool = True) -> float:
        """Returns the range of sight at a time [s], by weather, light, headlights and the camera [m].

        Args:
            time: time [s].
            faulty: whether the faults of the camera count.
        """
        weather = Weather()
        for parameter in WeatherParameter:
            weather.set(parameter, self.weather(time, parameter))
        faults = [sensor for sensor in CLARITY if faulty and self.failed(time, sensor)]
        clarity = min((CLARITY[sensor] for sensor in faults), default=1.0)
        return weather.visibility(lights=self.lights_on(time), clarity=clarity).sight

    def distance_of(self, time: float, kinds: Sequence[ActorKind]) -> float:
        """Returns the distance of the nearest recorded actor of the given kinds at a time [m]; infinity without one."""
        return float(self._distances(time, kinds).min(initial=math.inf))

    def count_near(self, time: float, kinds: Sequence[ActorKind], distance: float) -> int:
        """Returns the number of recorded actors of the given kinds within a distance at a time [m, s]."""
        return int((self._distances(time, kinds) <= distance).sum())

    def _distances(self, time: float, kinds: Sequence[ActorKind]) -> NDArray[np.float64]:
        """Returns the distances of the recorded actors of the given kinds (n,) [m]."""
        offsets = self._offsets(time, kinds)
        return np.hypot(offsets[:, 0], offsets[:, 1])

    def _offsets(self, time: float, kinds: Sequence[ActorKind]) -> NDArray[np.float64]:
        """Returns the positions of the recorded actors of the given kinds relative to the car (n, 2) [m]."""
        table = self.session.scene.actors
        place = bisect.bisect_right(table.frames.tolist(), round(time * FRAME_RATE)) - 1
        if place < 0:
            return np.empty((0, 2))
        rows = table.rows[int(table.offsets[place]) : int(table.offsets[place + 1])]
        rows = rows[np.isin(rows["kind"], [int(kind) for kind in kinds])]
        x, y = self.position(time)
        return np.column_stack((rows["x"] - x, rows["y"] - y)).astype(np.float64)

    def is_ahead(self, time: float, kinds: Sequence[ActorKind], distance: float, angle: float) -> bool:
        """Returns whether a recorded actor of the given kinds is in front of the car at a time [s].

        Args:
            time: [s].
            kinds: kinds of the actors.
            distance: largest distance from the centre of the car [m].
            angle: largest angle to its heading [degrees].
        """
        offsets, heading = self._offsets(time, kinds), float(self.row(time)["heading"])
        angles = np.abs(wrap_degrees(np.degrees(np.arctan2(offsets[:, 1], offsets[:, 0]) - heading)))
        return bool(((np.hypot(*offsets.T) <= distance) & (angles <= angle)).any())

    def hazards(self, time: float, around: float) -> set[str]:
        """Returns the labels of the objects that the car brakes for within a few seconds of a time [s]."""
        found: set[str] = set()
        for begun, ended, reason in self._hazards:
            if begun - around <= time <= ended + around:
                found.add(reason)
        return found

    @functools.cached_property
    def _hazards(self) -> list[tuple[float, float, str]]:
        found: list[tuple[float, float, str]] = []
        begun: dict[str, float] = {}
        for event in self.session.of_type(EventType.HAZARD_STOP, EventType.HAZARD_END):
            reason = str(event.data.get("reason"))
            if event.type is EventType.HAZARD_STOP:
                begun.setdefault(reason, event.time)
            else:
                # the reason may have changed while the car was braking, or standing: a red light, then a car in front
                start = min([event.time, *begun.values()])
                found += [(since, event.time, other) for other, since in begun.items()]
                found.append((begun.get(reason, start), event.time, reason))
                begun.clear()
        return found + [(start, math.inf, reason) for reason, start in begun.items()]

    def failed(self, time: float, sensor: Sensor) -> bool:
        """Returns whether a sensor is faulty at a time [s]; a fault ends by itself."""
        switched = [
            (bool(event.data.get("on")), event.time)
            for event in self.session.of_type(EventType.EXCEPTION)
            if event.data.get("sensor") == sensor.value and event.time <= time
        ]
        return bool(switched) and switched[-1][0] and time < switched[-1][1] + FAULT_SECONDS

    # --- tasks --------------------------------------------------------------------------------------------------------

    def landmarks(self, name: LandmarkName) -> list[LandmarkRow]:
        """Returns the landmarks with a name."""
        return [row for row in self.session.header.landmarks if row["name"] == name.label]

    @functools.cached_property
    def changes(self) -> tuple[Event, ...]:
        """Changes of the subgoals, in order."""
        return self.session.of_type(EventType.SUBGOAL)

    def statuses(self, time: float, name: LandmarkName) -> tuple[GoalStatus, ...]:
        """Returns the statuses of the tasks at places with a name that have been introduced by a time [s]."""
        found: list[GoalStatus] = []
        for number, subgoal in enumerate(self.session.header.subgoals):
            place = str(self.session.header.landmarks[subgoal["landmark"]]["name"])
            status = None if subgoal["trigger"] else GoalStatus.PENDING.label
            for event in self.session.of_type(EventType.SUBGOAL, EventType.EXCEPTION):
                if event.data.get("subgoal") == number and event.time <= time:
                    place, status = str(event.data.get("landmark")), str(event.data.get("status"))
            if status is not None and place == name.label:
                found.append(next(value for value in GoalStatus if value.label == status))
        return tuple(found)

    def arrival(self, time: float, name: LandmarkName) -> float | None:
        """Returns the time of the next arrival [s], if it is at a landmark with the name and before any task change."""
        following = next((event for event in self.changes if event.time > time), None)
        if following is None or following.data.get("landmark") != name.label:
            return None
        arrived = following.data.get("cause") == "arrival"
        return following.time if arrived and following.data.get("status") == GoalStatus.COMPLETE.label else None

    def arrived_at(self, time: float, name: LandmarkName) -> bool | None:
        """Returns whether the car arrives at a landmark with a name: in the last half minute, or very soon.

        None if the car stands close to it and the errand there is not done: both "there" and "just before it" are true.
        """
        done = any(
            event.data.get("landmark") == name.label
            and event.data.get("status") == GoalStatus.COMPLETE.label
            and -_SOON <= time - event.time < _LATELY
            for event in self.changes
        )
        x, y = self.position(time)
        near = any(math.hypot(row["x"] - x, row["y"] - y) < _CLOSE for row in self.landmarks(name))
        return True if done else None if near and self.stands(time) else False

    def told_to(self, time: float, action: ActionValue, within: float) -> bool:
        """Returns whether the participant has named an action in the last seconds before a time [s]."""
        return any(
            action in move.act.slots and 0.0 <= time - move.end <= within
            for move in self.session.moves(Role.PARTICIPANT)
        )

    def believed_goal(self, time: float) -> LandmarkName | None:
        """Returns the destination that the Co-Wizard believes in at a time [s], by its recorded belief updates."""
        goal: str | None = None
        for event in self.session.of_type(EventType.BELIEF_UPDATE):
            if event.time > time:
                break
            named, status = event.data.get("landmark"), event.data.get("status")
            goals = event.data.get("landmarks")
            if isinstance(goals, list | tuple) and goals:
                goal = str(goals[0])
            elif status in _TAKEN_UP:
                goal = str(named)
            elif status is not None and named == goal:
                goal = None
        return next((name for name in LandmarkName if name.label == goal), None)

    def goal_named(self, time: float) -> bool:
        """Returns whether the participant has named a place to go to since the last change of a task."""
        since = max((event.time for event in self.changes if event.time <= time), default=0.0)
        named = (move for move in self.session.moves(Role.PARTICIPANT) if since <= move.start and move.end <= time)
        return any(
            isinstance(value, LandmarkName)
            for move in named
            if move.act.move in _NAMING and not _OVER & move.act.slots
            for value in move.act.slots
        )


_TAKEN_UP: Final = frozenset({GoalStatus.ONGOING.label, GoalStatus.UNKNOWN.label})
ACTORS: Final = {
    ObjectClass.VEHICLES: (ActorKind.VEHICLE, ActorKind.CYCLIST),
    ObjectClass.PEDESTRIAN: (ActorKind.PEDESTRIAN,),
    ObjectClass.STATIC: (ActorKind.PROP,),
}
"""Kinds of recorded actors by the class by which they are seen."""
