"""Execution of the Ad-Wizard's exceptions. An exception that could make the task impossible is refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from dorothie_gym.errors import StoryboardError
from dorothie_gym.maps.routing import crowds, cuts_off
from dorothie_gym.ontology.labelled_enums import complete
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind
from dorothie_gym.sim.collisions import OrientedBox, boxes_touch
from dorothie_gym.sim.ego.limits import PLANNED_BRAKING
from dorothie_gym.sim.population import kerb
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.session_log import Outcome
    from dorothie_gym.session.spaces.actions import AdWizardAction
    from dorothie_gym.sim.bodies import Prop
    from dorothie_gym.sim.world import World
    from dorothie_gym.tasks.storyboard import TaskState

PROP_FROM_START = 30.0
"""Minimum distance of a prop from the start of its lane [m]; it leaves room for a U-turn in front of the prop."""

PROP_FROM_END = 8.0
"""Minimum distance of a prop from the end of its lane [m]."""

FROM_SITE = 25.0
"""Minimum distance of a prop from a waypoint along the lane [m]; the ego must be able to stop at the waypoint."""

FROM_CAR = 25.0
"""Minimum distance of new bodies from the ego, beyond its stopping distance [m]; it leaves room for a U-turn."""

FROM_VEHICLE = 6.0
"""Minimum distance of a new prop from the centre of a vehicle [m]."""

PROP_GAP = 0.5
"""Minimum gap between two props [m]."""

FROM_WAYPOINT = 8.0
"""Minimum distance of a new vehicle from a waypoint along the lane [m]."""

SPAWN_STEP = 3.5
"""Distance between the candidate places of new actors along a lane [m]."""

MAX_POPULATION = 30
"""Maximum number of vehicles, and of pedestrians, up to which spawning fills a town."""


class ExceptionExecutor:
    """Executes exceptions in the world and the task of a session.

    Args:
        world: simulated world.
        task: progress in the storyboard.
        max_props: maximum number of props.
    """

    def __init__(self, world: World, task: TaskState, max_props: int) -> None:
        self._world, self._task, self._max_props = world, task, max_props

    def execute(self, action: AdWizardAction) -> Outcome:
        """Executes an exception other than NONE; returns its event data, or the reason of a refusal."""
        return HANDLERS[action.exception](self, action)

    # --- environment ------------------------------------------------------------------------------------------------

    def _weather(self, action: AdWizardAction) -> Outcome:
        weather = self._world.weather
        before = weather.values[action.weather]
        value = weather.set_share(action.weather, action.share)
        if value == before:
            return f"{action.weather} is {value:g} already"
        return {"parameter": str(action.weather), "value": round(value, 3)}

    def _spawn(self, action: AdWizardAction) -> Outcome:
        world = self._world
        if (reason := self._no_such_place(action)) is not None:
            return reason
        if action.count == 0:
            return "nobody was to come: count is 0"
        crowd = world.actors.vehicles if action.exception is ExceptionKind.SPAWN_VEHICLES else world.actors.pedestrians
        there = len(crowd)
        if there >= MAX_POPULATION:
            return f"there are {MAX_POPULATION} of them in the town already"
        middle = world.town.lanes[action.place.lane].position(action.place.metres)
        half = max(float(action.extent), 5.0)
        driving = action.exception is ExceptionKind.SPAWN_VEHICLES
        candidates = self._places_within(middle, half, driving=driving)
        order = np.random.default_rng([world.frame, action.place.lane, action.place.metres]).permutation(
            len(candidates)
        )
        done = 0
        for k in order:
            if done == action.count or there + done >= MAX_POPULATION:
                break
            lane, station = candidates[int(k)]
            if driving:
                done += world.actors.add_vehicle(lane, station, distance=FROM_CAR + self._stopping_distance())
            else:
                done += world.actors.add_pedestrian(lane, station)
        if done == 0:
            return "there is no room for anybody in the rectangle"
        corners = (float(middle[0] - half), float(middle[0] + half), float(middle[1] - half), float(middle[1] + half))
        return {"asked": action.count, "count": done, **dict(zip(("x0", "x1", "y0", "y1"), corners, strict=True))}

    def _places_within(self, middle: Array, half: float, *, driving: bool) -> list[tuple[int, float]]:
        """Returns candidate places in a square: on lanes away from waypoints for vehicles, else at the kerb."""
        places, points = _spawn_places(self._world.town, driving)
        inside = np.abs(points - middle).max(axis=1) <= half
        return [places[k] for k in np.flatnonzero(inside).tolist()]

    def _place_prop(self, action: AdWizardAction) -> Outcome:
        if len(self._world.actors.props) >= self._max_props:
            return f"there are {self._max_props} props already"
        if (reason := self._no_such_place(action) or self._unsafe(action, action.prop, without=None)) is not None:
            return reason
        prop = self._world.actors.add_prop(action.prop, action.place.lane, float(action.place.metres))
        return {"prop": str(prop.kind), "lane": prop.lane_id, "station": prop.station, **_xy(prop)}

    def _move_prop(self, action: AdWizardAction) -> Outcome:
        prop = self._prop(action.item)
        if prop is None:
            return f"there is no prop {action.item}"
        if (reason := self._no_such_place(action) or self._unsafe(action, prop.kind, without=prop)) is not None:
            return reason
        self._world.actors.move_prop(prop, action.place.lane, float(action.place.metres))
        return {
            "item": action.item,
            "prop": str(prop.kind),
            "lane": prop.lane_id,
            "station": prop.station,
            **_xy(prop),
        }

    def _delete_prop(self, action: AdWizardAction) -> Outcome:
        prop = self._prop(action.item)
        if prop is None:
            return f"there is no prop {action.item}"
        gone = {"item": action.item, "prop": str(prop.kind), **_xy(prop)}
        self._world.actors.remove_prop(prop)
        return gone

    def _fault(self, action: AdWizardAction) -> Outcome:
        reason = self._world.set_fault(action.sensor, action.on)
        return reason if reason is not None else {"sensor": str(action.sensor), "on": action.on}

    # --- task -------------------------------------------------------------------------------------------------------

    def _change_task(self, action: AdWizardAction) -> Outcome:
        task = self._task
        change = {
            ExceptionKind.TASK_TRIGGER: task.trigger,
            ExceptionKind.TASK_DELETE: task.delete,
            ExceptionKind.TASK_CHANGE: task.change,
        }[action.exception]
        try:
            change(action.item)
        except StoryboardError as error:
            return str(error)
        row = task.landmark_of(action.item)
        landmark = task.storyboard.landmarks[row]
        status = GoalStatus.ABANDONED if action.exception is ExceptionKind.TASK_DELETE else task.status(action.item)
        return {"subgoal": action.item, "landmark": landmark.name.label, "row": row, "status": status.label}

    def _message(self, action: AdWizardAction) -> Outcome:
        return {} if action.message else "the message is empty"

    # --- checks -----------------------------------------------------------------------------------------------------

    def _prop(self, item: int) -> Prop | None:
        props = self._world.actors.props
        return props[item] if item < len(props) else None

    def _no_such_place(self, action: AdWizardAction) -> str | None:
        lanes = self._world.town.lanes
        if action.place.lane >= len(lanes):
            return f"the town has no lane {action.place.lane}; its lanes are 0..{len(lanes) - 1}"
        length = lanes[action.place.lane].length
        if action.place.metres > length:
            return f"lane {action.place.lane} is only {length:.0f} m long"
        return None

    def _stopping_distance(self) -> float:
        """Returns the stopping distance of the ego at the current wetness of the road [m]."""
        return self._world.weather.braking_distance(float(self._world.car.speed), PLANNED_BRAKING)

    def _unsafe(self, action: AdWizardAction, kind: PropKind, *, without: Prop | None) -> str | None:
        """Returns the reason why a prop must not be placed somewhere, or None.

        The checks cover every site of the town, not only those of the live subgoals: a refusal must not reveal hidden
        landmarks. Every reachable site stays reachable.
        """
        world, town = self._world, self._world.town
        lane = town.lanes[action.place.lane]
        station = float(action.place.metres)
        if lane.in_junction:
            return "a prop in a junction would leave no room to turn round"
        if not PROP_FROM_START <= station <= lane.length - PROP_FROM_END:
            return (
                f"a prop stands at least {PROP_FROM_START:.0f} m into its lane and {PROP_FROM_END:.0f} m before its end"
            )
        place = lane.position(station)
        if pm.hypot(*(place - world.car.position)) < FROM_CAR + self._stopping_distance():
            return "it would appear inside the car's stopping distance"
        for site in town.sites:
            if site.lane == lane.id and abs(site.station - station) < FROM_SITE:
                return "it would stand where a landmark is reached"
        props = [prop for prop in world.actors.props if prop is not without]
        box = OrientedBox(
            float(place[0]), float(place[1]), lane.heading_at(station), kind.length + PROP_GAP, kind.width + PROP_GAP
        )
        if any(pm.hypot(*(place - other.position)) < FROM_VEHICLE for other in world.actors.vehicles) or any(
            boxes_touch(box, OrientedBox.of(prop)) for prop in props
        ):
            return "there is something in that place already"
        standing = [(prop.lane_id, prop.station) for prop in props]
        if crowds(town, (lane.id, station), standing):
            return "there would be no room to turn round before it and the prop beside it"
        if cuts_off(town, (world.planner.lane, world.planner.station), standing, (lane.id, station)):
            return "it would cut every way to a place where a landmark may be"
        return None


Handler: TypeAlias = Callable[[ExceptionExecutor, "AdWizardAction"], "Outcome"]

HANDLERS: Final[Mapping[ExceptionKind, Handler]] = complete(
    {
        ExceptionKind.WEATHER: ExceptionExecutor._weather,
        ExceptionKind.SPAWN_VEHICLES: ExceptionExecutor._spawn,
        ExceptionKind.SPAWN_PEDESTRIANS: ExceptionExecutor._spawn,
        ExceptionKind.PLACE_PROP: ExceptionExecutor._place_prop,
        ExceptionKind.MOVE_PROP: ExceptionExecutor._move_prop,
        ExceptionKind.DELETE_PROP: ExceptionExecutor._delete_prop,
        ExceptionKind.SENSOR_FAULT: ExceptionExecutor._fault,
        ExceptionKind.TASK_TRIGGER: ExceptionExecutor._change_task,
        ExceptionKind.TASK_DELETE: ExceptionExecutor._change_task,
        ExceptionKind.TASK_CHANGE: ExceptionExecutor._change_task,
        ExceptionKind.MESSAGE: ExceptionExecutor._message,
    },
    [kind for kind in ExceptionKind if kind is not ExceptionKind.NONE],
    "HANDLERS",
    __name__,
)
"""Method that executes an exception, by kind."""


def _xy(prop: Prop) -> dict[str, float]:
    return {"x": round(float(prop.position[0]), 3), "y": round(float(prop.position[1]), 3)}


@lru_cache(maxsize=16)
def _spawn_places(town: Town, driving: bool) -> tuple[list[tuple[int, float]], Array]:
    """Returns the candidate places of a town, lanes and stations [m], and their positions (n, 2) [m]."""
    places, points = [], []
    for lane in town.lanes:
        if lane.in_junction or lane.length < 12.0:
            continue
        if not driving and town.neighbour(lane.id, town.traffic.to_kerb) is not None:
            continue
        waypoints = [site.station for site in town.sites if site.lane == lane.id] if driving else []
        for station in np.arange(6.0, lane.length - 5.0, SPAWN_STEP).tolist():
            if all(abs(waypoint - station) >= FROM_WAYPOINT for waypoint in waypoints):
                places.append((lane.id, station))
                points.append(lane.position(station) if driving else kerb(town, lane, station))
    return places, np.array(points).reshape(-1, 2)
