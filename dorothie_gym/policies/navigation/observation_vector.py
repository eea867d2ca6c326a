"""Observation vector of `Navigation-v0`: numbers in [-1, 1] computed from the Co-Wizard's knowledge."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.navigation.actions import write_mask
from dorothie_gym.policies.navigation.cost_to_go import CostToGo, cost_from
from dorothie_gym.policies.navigation.driver_view import (
    CostRecord,
    DriverArrays,
    DriverView,
    HeardRecord,
    driver_arrays,
    look,
    read_view,
)
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.observation_fields import (
    AGE_UNIT,
    CLOSE_UNIT,
    COLOURS,
    DETOUR_UNIT,
    DISTANCE_UNIT,
    FIELDS,
    KINDS,
    MANOEUVRES,
    OBJECTS,
    SECTORS,
    SPEED_UNIT,
    TOWN_UNIT,
    Vector,
)
from dorothie_gym.policies.policy import replace
from dorothie_gym.sim.ego.limits import MAX_CRUISE
from dorothie_gym.sim.ego.manoeuvre_lanes import find_oncoming
from dorothie_gym.sim.ego.path_builder import position_on, project_on
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray, plain

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.routing_graph import RoutingLane
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.junction_exits import ExitArrays, JunctionExits
    from dorothie_gym.session.spaces.observations import ObservationMapping
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

_WEATHER = tuple((parameter.low, parameter.high - parameter.low) for parameter in WeatherParameter)
_TURN = int(PhysicalAction.J_TURN.value)
_MANOEUVRES = tuple(int(action.value) for action in MANOEUVRES)
_KINDS = tuple(int(kind.value) for kind in KINDS)
_MOTIONS, _MOVES, _ACTIONS, _LANDMARKS = len(Motion), len(DialogueMove), len(ActionValue), len(LandmarkName)


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

    def write(self, town: Town, driver: DriverArrays) -> None:
        """Writes the instruction into the arrays of a driver in a town."""
        record, given = plain(driver.heard)[0], self.instruction
        record["driven"] = self.driven
        if given is not None:
            record["distance"], record["time"], record["move"] = given.distance, given.time, given.act.move.value
            record["sector"] = -1 if given.sector is None else given.sector
            for name, value in (("action", given.action), ("landmark", given.landmark), ("street", given.street)):
                record[name] = -1 if value is None else value.value
        record["goal_lane"] = -1
        if self.goal is not None:
            record["goal_lane"], record["goal_station"] = self.goal
            record["goal_x"], record["goal_y"] = town.lanes[self.goal[0]].position(self.goal[1])

    def driven_on(self, before: ObservationMapping, now: ObservationMapping) -> HeardInstruction:
        """Adds the distance driven between two observations, computed from the speeds in both."""
        seconds = float(now["time"][0] - before["time"][0])
        return self.after(seconds, float(before["speed"][0]), float(now["speed"][0]))

    def after(self, seconds: float, before: float, now: float) -> HeardInstruction:
        """Adds the distance driven in some time [s] between two speeds [m/s]."""
        return replace(self, driven=self.driven + seconds * (before + now) / 2.0)


@compiled
def encode(driver: DriverArrays, max_seconds: float) -> None:
    """Writes the observation vector of a driver from its view, the last instruction and the costs of routes.

    Args:
        driver: arrays of the driver; `vector` is written.
        max_seconds: time limit of the session [s].
    """
    view, heard, vector = driver.inputs[0], driver.heard[0], driver.vector
    vector[:] = 0.0
    k = _encode_car(view, vector)
    k = _encode_junction(view, heard, vector, k)
    if view.light >= 0:
        put(vector, k, view.light_distance / DISTANCE_UNIT)
        vector[k + 1 + view.light] = 1.0
    k = _encode_instruction(view, heard, vector, k + 1 + len(COLOURS))
    k = _encode_goal(view, heard, driver.costs[0], vector, k)
    k = _encode_objects(view, vector, k)
    for n in range(len(_WEATHER)):
        low, span = _WEATHER[n]
        k = put(vector, k, (view.weather[n] - low) / span)
    put(vector, k, view.time / max_seconds)


@inlined
def put(vector: Vector, k: int, value: float) -> int:
    """Writes a value, clipped to its range; returns the next index."""
    vector[k] = min(max(value, -1.0), 1.0)
    return k + 1


@inlined
def _encode_car(view: DriverView, vector: Vector) -> int:
    k = put(vector, 0, view.speed / SPEED_UNIT)
    k = put(vector, k, view.cruise / MAX_CRUISE)
    vector[k + view.motion] = 1.0
    k += _MOTIONS
    for n in range(len(_MANOEUVRES)):
        k = put(vector, k, 1.0 if view.manoeuvre == _MANOEUVRES[n] else 0.0)
    if view.hazard > 0:
        vector[k] = 1.0
        put(vector, k + 1, view.hazard_distance / DISTANCE_UNIT)
    k += 2
    for flag in (view.lights, view.in_junction, view.has_left, view.has_right):
        k = put(vector, k, 1.0 if flag else 0.0)
    k = put(vector, k, view.limit / SPEED_UNIT)
    k = put(vector, k, math.sqrt(view.place_variance) / 10.0)
    return put(vector, k, math.sqrt(view.heading_variance) / 0.1)


@inlined
def _encode_junction(view: DriverView, heard: HeardRecord, vector: Vector, k: int) -> int:
    if view.junction >= 0:
        vector[k] = 1.0
        put(vector, k + 1, view.junction_distance / DISTANCE_UNIT)
        for n in range(len(SECTORS)):
            if view.exit_lane[n] >= 0:
                at = k + 2 + 3 * n
                vector[at] = 1.0
                if view.manoeuvre == _TURN and view.exit_angle[n] == view.angle:
                    vector[at + 1] = 1.0
                if heard.street > 0 and view.exit_street[n] == heard.street:
                    vector[at + 2] = 1.0
    return k + 2 + 3 * len(SECTORS)


@inlined
def _encode_instruction(view: DriverView, heard: HeardRecord, vector: Vector, k: int) -> int:
    if heard.move >= 0:
        vector[k] = 1.0
        vector[k + 1 + heard.move] = 1.0
        at = k + 1 + _MOVES
        if heard.action >= 0:
            vector[at + heard.action] = 1.0
        at += _ACTIONS
        if heard.sector >= 0:
            vector[at + heard.sector] = 1.0
        at += len(SECTORS)
        if heard.landmark >= 0:
            vector[at + heard.landmark] = 1.0
        left = heard.distance - heard.driven
        at = put(vector, at + _LANDMARKS, left / DISTANCE_UNIT)
        at = put(vector, at, left / CLOSE_UNIT)
        put(vector, at, (view.time - heard.time) / AGE_UNIT)
    return k + 4 + _MOVES + _ACTIONS + len(SECTORS) + _LANDMARKS


@inlined
def _encode_goal(view: DriverView, heard: HeardRecord, costs: CostRecord, vector: Vector, k: int) -> int:
    """Writes the place of the goal, and by how much each manoeuvre and exit lengthens the route to it."""
    if heard.goal_lane >= 0:
        dx, dy = heard.goal_x - view.x, heard.goal_y - view.y
        sine, cosine = pm.sin(view.heading), pm.cos(view.heading)
        vector[k] = 1.0
        at = put(vector, k + 1, (dx * cosine + dy * sine) / TOWN_UNIT)
        at = put(vector, at, (dy * cosine - dx * sine) / TOWN_UNIT)
        at = put(vector, at, costs.here / TOWN_UNIT)
        ahead = heard.goal_station - view.station if view.lane == heard.goal_lane else math.inf
        at = put(vector, at, ahead / DISTANCE_UNIT)
        at = put(vector, at, ahead / CLOSE_UNIT)
        for other in (costs.back, costs.left, costs.right):
            at = put(vector, at, _added_cost(other, costs.here))
        best = math.inf
        for n in range(len(SECTORS)):
            best = min(best, costs.exits[n])
        for n in range(len(SECTORS)):
            at = put(vector, at, _added_cost(costs.exits[n], best))
    return k + 9 + len(SECTORS)


@inlined
def _added_cost(cost: float, than: float) -> float:
    """Returns by how much a cost exceeds another, of `DETOUR_UNIT`; 1 for an infinite cost."""
    if cost == math.inf:
        return 1.0
    return (cost - than) / DETOUR_UNIT if than < math.inf else -1.0


@inlined
def _encode_objects(view: DriverView, vector: Vector, k: int) -> int:
    for n in range(OBJECTS):
        kind, at = view.object_kind[n], k + n * (3 + len(_KINDS))
        if kind == 0:
            break
        at = put(vector, at, view.object_distance[n] / 50.0)
        at = put(vector, at, pm.sin(view.object_bearing[n]))
        at = put(vector, at, pm.cos(view.object_bearing[n]))
        vector[at + (1 if kind == _KINDS[1] else 2 if kind == _KINDS[2] else 0)] = 1.0
    return k + OBJECTS * (3 + len(_KINDS))


@compiled
def measure_costs(town: TownArrays, lanes: RecordArray[RoutingLane], costs: Array, driver: DriverArrays) -> None:
    """Writes the costs of the routes to the goal from the place at which the driver believes the car to be.

    Args:
        town: arrays of the town.
        lanes: lanes of the routing graph.
        costs: costs to the goal, see `cost_to_go.cost_from`.
        driver: arrays of the driver with a known goal; view and instruction are read, the costs are written.
    """
    view, heard, found = driver.inputs[0], driver.heard[0], driver.costs[0]
    goal, stop, lane, station = int(heard.goal_lane), heard.goal_station, int(view.lane), view.station
    found.here = cost_from(lanes, costs, goal, stop, lane, station)
    found.back = found.left = found.right = math.inf
    oncoming, there = find_oncoming(town, lane, station)
    if oncoming >= 0:
        found.back = cost_from(lanes, costs, goal, stop, oncoming, there)
    x, y = position_on(town.points, town.lanes[lane], station)
    if town.lanes[lane].left >= 0:
        there, _ = project_on(town, int(town.lanes[lane].left), x, y)
        found.left = cost_from(lanes, costs, goal, stop, int(town.lanes[lane].left), there)
    if town.lanes[lane].right >= 0:
        there, _ = project_on(town, int(town.lanes[lane].right), x, y)
        found.right = cost_from(lanes, costs, goal, stop, int(town.lanes[lane].right), there)
    for k in range(len(SECTORS)):
        found.exits[k] = math.inf
        if view.exit_lane[k] >= 0:
            found.exits[k] = cost_from(lanes, costs, goal, stop, int(view.exit_lane[k]), 0.0)


@compiled
def observe(
    town: TownArrays,
    exits: ExitArrays,
    world: WorldArrays,
    driver: DriverArrays,
    lanes: RecordArray[RoutingLane],
    costs: Array,
    max_seconds: float,
) -> None:
    """Writes view, observation vector and mask of a driver at a decision.

    Args:
        town: arrays of the town.
        exits: exits of its junctions.
        world: arrays of the world.
        driver: arrays of the driver, with the last instruction.
        lanes: lanes of the routing graph.
        costs: costs to the goal of the instruction, if there is one, see `cost_to_go.cost_from`.
        max_seconds: time limit of the session [s].
    """
    look(town, exits, world, driver)
    if driver.heard[0].goal_lane >= 0:
        measure_costs(town, lanes, costs, driver)
    encode(driver, max_seconds)
    write_mask(town, exits, world, driver)


class NavigationEncoder:
    """Encoder of observations for a driver in a town, in `DuoWizardEnv`.

    The vector depends only on the Co-Wizard's observation in `DuoWizardEnv`, the map, and the instructions: it holds
    nothing that the Co-Wizard does not know.
    """

    def __init__(self, town: Town, exits: JunctionExits, max_seconds: float) -> None:
        self._town, self._exits, self._max_seconds = town, exits, max_seconds
        self._arrays, self._cost_to_go = town_arrays(network_of(town)), CostToGo(town)

    def observe(self, seen: ObservationMapping, heard: HeardInstruction, blocked: tuple[Place, ...]) -> Vector:
        """Encodes an observation.

        Args:
            seen: observation of the Co-Wizard.
            heard: last instruction.
            blocked: places beyond the known roadblocks.

        Returns:
            Vector (n,) of `navigation_space`.
        """
        driver = driver_arrays(sum(FIELDS.values()))
        read_view(seen, self._exits, plain(driver.inputs)[0])
        heard.write(self._town, driver)
        if heard.goal is not None:
            self._cost_to_go.aim(heard.goal, blocked)
            measure_costs(self._arrays, *self._cost_to_go.rows, driver)
        encode(driver, self._max_seconds)
        return driver.vector
