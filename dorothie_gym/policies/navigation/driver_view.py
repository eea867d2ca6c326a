"""Inputs of a driver of `Navigation-v0` in records: information from the car's sensors, map and instructions.

The records are filled from the arrays of a world (`look`), or from an observation of the Co-Wizard (`read_view`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.navigation.observation_fields import COLOURS, OBJECTS, SECTORS
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.session.spaces.observations import ExitColumn, ObjectColumn, ObservationMapping
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.motion_control import motion_of
from dorothie_gym.sim.ego.path_builder import SEARCH, progress_on_path
from dorothie_gym.sim.network.lane_lookup import closest_lane, wrap_radians
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.traffic.junctions import colour_at
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import Flag, Float, Int32, RecordArray, by_reference, empty_records, plain

if TYPE_CHECKING:
    from dorothie_gym.policies.navigation.junction_exits import ExitArrays, JunctionExits
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

_SECTORS, _PARAMETERS = len(SECTORS), len(WeatherParameter)


class DriverView:
    """Knowledge of a driver about the car and its surroundings at a decision."""

    time: Float  # [s]
    speed: Float  # [m/s]
    cruise: Float  # [km/h]
    hazard_distance: Float  # [m]
    x: Float  # estimated pose [m, m, rad], and its variances
    y: Float
    heading: Float
    place_variance: Float  # of x and y together [m^2]
    heading_variance: Float
    station: Float  # along the lane at the estimated pose [m]
    junction_distance: Float  # to the next junction with a choice [m]
    weather: Annotated[NDArray[np.float64], "f8", (_PARAMETERS,)]
    object_distance: Annotated[NDArray[np.float64], "f8", (OBJECTS,)]  # [m]
    object_bearing: Annotated[NDArray[np.float64], "f8", (OBJECTS,)]  # [rad]
    object_kind: Annotated[NDArray[np.int32], "i4", (OBJECTS,)]  # `ObjectClass`; 0: no further object
    motion: Int32  # `Motion`
    manoeuvre: Int32  # `PhysicalAction` in preparation or 0, and its angle [degrees, positive left]
    angle: Int32
    hazard: Int32  # `ObjectClass` of the hazard ahead or 0
    lane: Int32  # at the estimated pose, and its limit [m/s]
    limit: Float
    in_junction: Flag  # whether it crosses a junction, and whether there is a lane to its left and right
    has_left: Flag
    has_right: Flag
    light: Int32  # `codes.Colour` of the light at its end or -1, and the distance to that [m]
    light_distance: Float
    junction_ahead: Flag  # whether turn options are observed
    junction: Int32  # lane before the next junction with a choice, or -1
    exit_lane: Annotated[NDArray[np.int32], "i4", (_SECTORS,)]  # lane after the exit in each sector, or -1
    exit_angle: Annotated[NDArray[np.int32], "i4", (_SECTORS,)]  # its angle [degrees, positive left]
    exit_street: Annotated[NDArray[np.int32], "i4", (_SECTORS,)]  # id of the `StreetName` of its street
    lights: Flag  # whether the headlights are on


class HeardRecord:
    """Last instruction as a driver remembers it; fields without a value are -1."""

    distance: Float  # announced, and driven since [m]
    driven: Float
    time: Float  # at which it was given [s]
    goal_station: Float  # place of the goal that was named and is on the Co-Wizard's map [m]
    goal_x: Float
    goal_y: Float
    goal_lane: Int32
    move: Int32  # `DialogueMove`; -1: nothing was said yet
    action: Int32  # `ActionValue`
    sector: Int32  # index of `SECTORS`
    landmark: Int32  # `LandmarkName`
    street: Int32  # `StreetName`


class CostRecord:
    """Costs of the routes to the goal [m at 40 km/h], infinite if there is none."""

    here: Float
    back: Float  # after a U-turn
    left: Float  # after a lane switch
    right: Float
    exits: Annotated[NDArray[np.float64], "f8", (_SECTORS,)]


@by_reference
class DriverArrays(NamedTuple):
    """Inputs and observation of a driver; each is one record, or one row in a batch.

    Attributes:
        inputs: (1,) knowledge about the car and its surroundings.
        heard: (1,) the last instruction.
        costs: (1,) costs of routes to the goal, if one is known.
        streets: (s,) names of the town's streets in the session: ids of `StreetName`.
        vector: (161,) float32 observation, see `observation_vector`.
        mask: (18,) int8 feasible actions, see `actions.write_mask`.
    """

    inputs: RecordArray[DriverView]
    heard: RecordArray[HeardRecord]
    costs: RecordArray[CostRecord]
    streets: NDArray[np.int64]
    vector: NDArray[np.float32]
    mask: NDArray[np.int8]


def driver_arrays(size: int = 0, actions: int = 0, streets: Sequence[int] = ()) -> DriverArrays:
    """Returns the arrays of a driver that has neither seen nor heard anything.

    Args:
        size: length of the observation.
        actions: length of the mask.
        streets: names of the town's streets: ids of `StreetName`.
    """
    arrays = DriverArrays(
        empty_records(DriverView, 1),
        empty_records(HeardRecord, 1),
        empty_records(CostRecord, 1),
        np.array(streets, dtype=np.int64),
        np.zeros(size, dtype=np.float32),
        np.zeros(actions, dtype=np.int8),
    )
    for name in ("goal_lane", "move", "action", "sector", "landmark", "street"):
        arrays.heard[name] = -1
    return arrays


# --- from the arrays of a world ---------------------------------------------------------------------------------------


@compiled
def look(town: TownArrays, exits: ExitArrays, world: WorldArrays, driver: DriverArrays) -> None:
    """Fills a driver's view from the arrays of a world, except the weather.

    Args:
        town: arrays of the town.
        exits: exits of its junctions.
        world: arrays of the world.
        driver: arrays of the driver, whose view is written.
    """
    car, control, frame, view = world.vehicles[0], world.car[0], world.clock[0].frame, driver.inputs[0]
    view.time, view.speed, view.hazard = frame / FRAME_RATE, car.speed, control.hazard
    view.hazard_distance = max(control.hazard_gap, 0.0) if control.hazard > 0 else 0.0
    plan, belief = world.plan[0], world.localizer[0]
    view.cruise, view.lights, view.motion = plan.cruise, plan.lights, motion_of(world)
    view.manoeuvre, view.angle = plan.action, plan.angle
    x, y, heading = belief.estimate[0], belief.estimate[1], belief.estimate[2]
    view.x, view.y, view.heading = x, y, heading
    view.place_variance = belief.covariance[0, 0] + belief.covariance[1, 1]
    view.heading_variance = belief.covariance[2, 2]
    lane, station, _, _ = closest_lane(
        town, x, y, heading, pm.cos(heading), pm.sin(heading), car.height, int(view.lane)
    )
    record = town.lanes[lane]
    view.lane, view.station = lane, min(max(station, 0.0), record.length)
    view.limit, view.in_junction = record.limit, record.junction >= 0
    view.has_left, view.has_right = record.left >= 0, record.right >= 0
    view.light = colour_at(town, lane, view.time)
    view.light_distance = record.length - view.station
    junction = -1
    view.junction_ahead = plan.choice >= 0
    if plan.choice >= 0:
        error = pm.hypot(x - car.x, y - car.y)
        progress = progress_on_path(world.course, int(plan.points), x, y, control.s, SEARCH + 2.0 * error)
        view.junction_distance = max(plan.choice_at - control.s - (progress - control.s), 0.0)
        junction = believed_junction(exits, int(plan.choice), lane)
    _take_exits(exits, view, junction, driver.streets)
    count = see(world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], car.x, car.y, frame, 0)
    for row in range(OBJECTS):
        view.object_kind[row] = 0
        if row < count:
            body = world.seen[row]
            dx, dy = body.x - car.x, body.y - car.y
            view.object_kind[row], view.object_distance[row] = body.kind, math.sqrt(dx * dx + dy * dy)
            view.object_bearing[row] = wrap_radians(pm.atan2(dy, dx) - car.heading)


@compiled
def believed_junction(exits: ExitArrays, before: int, lane: int) -> int:
    """Returns the lane before the next junction with a choice, from its turn options and the estimated pose.

    Args:
        exits: exits of the town's junctions.
        before: lane before it on the path.
        lane: lane at the estimated pose.

    Returns:
        The lane, or -1 if neither the options, of which there are more than observed, nor the pose determine it.
    """
    first = exits.first[before]
    if exits.alone[before]:
        return before
    believed = exits.ahead[lane]
    if believed >= 0 and (first < 0 or exits.first[believed] == first):
        return int(believed)
    return int(first)


@compiled
def _take_exits(exits: ExitArrays, view: DriverView, junction: int, streets: NDArray[np.int64]) -> None:
    """Writes the exits of the junction behind a lane into a view; none for the lane -1."""
    view.junction = junction
    for k in range(_SECTORS):
        view.exit_lane[k] = -1
        if junction >= 0 and exits.lane[junction, k] >= 0:
            lane = exits.lane[junction, k]
            street = exits.street[lane]
            view.exit_lane[k], view.exit_angle[k] = lane, exits.angle[junction, k]
            view.exit_street[k] = streets[street] if 0 <= street < len(streets) else 0


# --- from an observation of the Co-Wizard -----------------------------------------------------------------------------


def read_view(observation: ObservationMapping, exits: JunctionExits, view: NDArray[np.void]) -> None:
    """Fills a driver's view, a single record, from an observation of the Co-Wizard.

    Args:
        observation: the observation.
        exits: exits of the town's junctions.
        view: record that is written.
    """
    town, number, covariance = exits.town, int(observation["lane"]), observation["pose_covariance"]
    lane, time, station = town.lanes[number], observation["time"][0], observation["station"][0]
    view["time"], view["speed"], view["cruise"] = time, observation["speed"][0], observation["cruise_speed"][0]
    view["hazard"], view["hazard_distance"] = observation["hazard"], observation["hazard_distance"][0]
    view["x"], view["y"], view["heading"] = observation["pose"]
    view["place_variance"], view["heading_variance"] = covariance[0, 0] + covariance[1, 1], covariance[2, 2]
    view["weather"], view["lights"], view["motion"] = (observation[name] for name in ("weather", "lights", "motion"))
    view["manoeuvre"], view["angle"] = observation["manoeuvre"], observation["manoeuvre_angle"][0]
    view["lane"], view["station"], view["limit"] = number, station, lane.speed_limit
    view["in_junction"] = lane.in_junction
    view["has_left"] = town.neighbour(number, LinkType.LANE_CHANGE_LEFT) is not None
    view["has_right"] = town.neighbour(number, LinkType.LANE_CHANGE_RIGHT) is not None
    colour = town.light(number, float(time))
    view["light"] = -1 if colour is None else COLOURS.index(colour)
    view["light_distance"] = lane.length - station
    junction = exits.choice_ahead(observation)
    view["junction"] = -1 if junction is None else junction
    view["junction_ahead"] = observation["exits"][0, ExitColumn.PRESENT] > 0.0
    view["junction_distance"] = observation["exits"][0, ExitColumn.DISTANCE]
    view["exit_lane"] = -1
    for k, way in enumerate(exits.by_sector(junction) if junction is not None else ()):
        if way is not None:
            view["exit_lane"][k], view["exit_angle"][k] = way.lane, way.angle
            view["exit_street"][k] = street_of(observation, town, way.lane).value
    objects = observation["objects"][:OBJECTS]
    for name, column in _OBJECT_COLUMNS:
        view[name][: len(objects)] = objects[:, column]


def driver_of(observation: ObservationMapping, exits: JunctionExits) -> DriverArrays:
    """Returns new arrays of a driver with the view of an observation of the Co-Wizard."""
    driver = driver_arrays()
    read_view(observation, exits, plain(driver.inputs)[0])
    return driver


_OBJECT_COLUMNS = (
    ("object_kind", ObjectColumn.KIND),
    ("object_distance", ObjectColumn.DISTANCE),
    ("object_bearing", ObjectColumn.BEARING),
)
