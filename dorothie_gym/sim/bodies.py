"""Views of the bodies in the arrays as highway-env's objects: vehicles, pedestrians, props.

A view keeps its holder, which has the arrays, and its row. Attributes of highway-env are read and written in the
arrays: `vehicle.speed` is `holder.arrays.vehicles[row].speed`. So highway-env's observations, viewer and planners
see the state of the compiled loops, and no state is copied.

On its own a `TrafficVehicle` is a complete `IDMVehicle` of highway-env, whose `act` and `step` work on the arrays. A
road that is stepped by the compiled loops does not call them; prediction with a copy of a vehicle does. Parameters that
highway-env keeps in the vehicle (`DELTA`, `POLITENESS`, ...) do not reach the compiled loops.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.objects import Obstacle, RoadObject

from dorothie_gym.ontology.world_exceptions import PropKind
from dorothie_gym.sim.pedestrians.pacing import WALKER_SIZE
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.record_views import (
    ArrayHolder,
    BodyView,
    Field,
    Record_co,
    converted_field,
    field_offset,
    flag_field,
    float_field,
    heading_field,
    int_field,
)
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.traffic.parameters import PLANNED
from dorothie_gym.sim.traffic.vehicle_models import extend, slip_of, steering_angle, take, update_lane
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import record_dtype

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.network.lane import PolylineLane
    from dorothie_gym.sim.network.network import LaneIndex, Route
    from dorothie_gym.sim.road import TownRoad

VEHICLE, PEDESTRIAN, PROP = (record_dtype(kind) for kind in (VehicleRecord, PedestrianRecord, PropRecord))

_KIND_OF_SIZE = {(kind.length, kind.width): kind for kind in PropKind}
if _alike := [kind for kind in PropKind if _KIND_OF_SIZE[kind.length, kind.width] is not kind]:
    raise ImportError(
        f"PropKind of dorothie_gym/ontology/world_exceptions.py: {_alike[0].name} has the length and width of "
        f"{_KIND_OF_SIZE[_alike[0].length, _alike[0].width].name}; every prop needs its own, by which it is recognised"
    )


class TrafficVehicle(BodyView[VehicleRecord], IDMVehicle):
    """A vehicle of the traffic as a vehicle of highway-env.

    Attributes:
        key: identifies the body; a respawned one gets another key.
        kind: `Kind`.
        height: height of the road under it [m].
        lane_id: closest lane, its id in the town; `station` [m] along it.
        target_speed: desired speed [m/s].
        standing: time for which it has stood while its light was not red [s].
        odometer: distance driven [m].
    """

    RECORDS = "vehicles"
    DTYPE = VEHICLE
    prediction_type = "constant_steering"
    enable_lane_change = True

    heading = heading_field(VEHICLE)
    cos, sin = float_field(VEHICLE, "cos"), float_field(VEHICLE, "sin")
    speed = float_field(VEHICLE, "speed")
    height = float_field(VEHICLE, "height")
    LENGTH, WIDTH = float_field(VEHICLE, "length"), float_field(VEHICLE, "width")
    diagonal = converted_field(VEHICLE, "radius", lambda radius: 2.0 * radius)
    crashed = flag_field(VEHICLE, "crashed")
    target_speed = float_field(VEHICLE, "desired")
    timer = float_field(VEHICLE, "timer")
    standing = float_field(VEHICLE, "standing")
    odometer = float_field(VEHICLE, "odometer")
    key = int_field(VEHICLE, "key")
    kind = converted_field(VEHICLE, "kind", Kind)
    lane_id = int_field(VEHICLE, "lane")
    station, lateral = float_field(VEHICLE, "own_station"), float_field(VEHICLE, "own_lateral")
    _followed, _planned = int_field(VEHICLE, "plan"), int_field(VEHICLE, "planned")

    def __init__(self, road: TownRoad, holder: ArrayHolder, row: int) -> None:
        """Shows a row of `holder.arrays.vehicles`; `road` is a `TownRoad` of the same town."""
        super().__init__(road, holder, row)
        self.log: list[object] = []
        self.history: deque[IDMVehicle] = deque(maxlen=self.HISTORY_SIZE)
        self._history_of = -1

    @classmethod
    def create_from(cls, vehicle: IDMVehicle) -> IDMVehicle:
        """Returns a vehicle of highway-env's own class in the same state, with its own memory."""
        twin = IDMVehicle.create_from(vehicle)
        twin.LENGTH, twin.WIDTH, twin.diagonal = vehicle.LENGTH, vehicle.WIDTH, vehicle.diagonal
        return twin

    @property
    def lane_index(self) -> LaneIndex:
        """Index of the closest lane in the network."""
        index: LaneIndex = self.road.network.index_of(self.lane_id)
        return index

    @lane_index.setter
    def lane_index(self, index: LaneIndex) -> None:
        self.lane = self.road.network.get_lane(index)

    @property
    def lane(self) -> PolylineLane:
        """The closest lane."""
        lane: PolylineLane = self.road.network.lane_of(self.lane_id)
        return lane

    @lane.setter
    def lane(self, lane: PolylineLane) -> None:
        self.lane_id = lane.town_lane.id
        self.station, self.lateral = lane.local_coordinates(self.position)

    @property
    def target_lane_index(self) -> LaneIndex:
        """The lane that it follows; setting another one than the next of its route draws a new plan."""
        index: LaneIndex = self.road.network.index_of(self._followed)
        return index

    @target_lane_index.setter
    def target_lane_index(self, index: LaneIndex) -> None:
        record, lane = self.record, self.road.network.lane_id(index)
        planned = self._planned
        if planned > 1 and record.plan[1] == lane:
            self._plan(record.plan[1:planned].tolist())
        elif record.plan[0] != lane:
            take(town_arrays(self.road.network), record, lane)

    @property
    def route(self) -> Route:
        """The lanes that it is going to drive, the one that it follows first."""
        network = self.road.network
        return [network.index_of(lane) for lane in self.record.plan[: self._planned].tolist()]

    @route.setter
    def route(self, route: Route | None) -> None:
        network = self.road.network
        lanes = [self._followed]
        rest = list(route or ())
        while rest and len(lanes) < PLANNED:
            here = network.index_of(lanes[-1])
            if rest[0][:2] == here[:2]:
                rest.pop(0)
            onward = network.along_route(network.successors(here), rest)
            if not onward:
                break  # the rest is drawn at random, as highway-env does where a route does not fit the road
            lanes.append(network.lane_id(onward[0]))
        self._plan(lanes)

    def _plan(self, lanes: Sequence[int]) -> None:
        """Follows the given lanes, each a continuation of the previous one, and extends the plan from the last."""
        town, record = town_arrays(self.road.network), self.record
        moves_on = lanes[0] != record.plan[0]
        record.plan[: len(lanes)] = lanes
        record.planned = len(lanes)
        if moves_on:
            update_lane(town, record)
        extend(town, record)

    @property
    def destination(self) -> Array:
        """End of the last lane of its route (2,) [m]."""
        lane = self.road.network.lane_of(self.memory()[1][_PLAN + self._planned - 1])
        end: Array = lane.position(lane.length)
        return end

    @property
    def destination_direction(self) -> Array:
        """Unit vector to its destination (2,), or zeros at the destination."""
        away = self.destination - self.position
        far = pm.hypot(*away)
        return away / far if far > 0.0 else np.zeros(2)

    def on_lane(self) -> tuple[float, float]:
        """Returns the station and distance to the right on the closest lane [m]."""
        return self.station, self.lateral

    @property
    def action(self) -> dict[str, float]:
        """Current action: `acceleration` [m/s^2] and `steering`, the angle of its front wheels [rad]."""
        record = self.record
        return {"acceleration": float(record.acceleration), "steering": float(steering_angle(record.slip))}

    @action.setter
    def action(self, action: dict[str, float]) -> None:
        record = self.record
        record.acceleration, record.slip = action["acceleration"], slip_of(float(action["steering"]))

    def clip_actions(self) -> None:
        """Limits the action, as highway-env does in place."""
        action = self.action
        if self.crashed:
            action = {"acceleration": -self.speed, "steering": 0.0}
        if self.speed > self.MAX_SPEED:
            action["acceleration"] = min(action["acceleration"], self.MAX_SPEED - self.speed)
        elif self.speed < self.MIN_SPEED:
            action["acceleration"] = max(action["acceleration"], self.MIN_SPEED - self.speed)
        self.action = action

    def on_state_update(self) -> None:
        """Finds the closest lane, and the place on the lane that it follows; must be called after a move."""
        update_lane(town_arrays(self.road.network), self.record)
        if self.road.record_history:
            self.remember()

    def remember(self) -> None:
        """Keeps its state for display; the history of a respawned vehicle is dropped."""
        if self.key != self._history_of:
            self.history.clear()
            self._history_of = self.key
        self.history.appendleft(self.create_from(self))


_PLAN = field_offset(VEHICLE, "plan") // 4
"""Beginning of the plan in the integers of a row."""


class Cyclist(TrafficVehicle):
    """A cyclist: a narrow, slow vehicle that keeps to the kerb."""


class _Thing(BodyView[Record_co]):
    """Body other than a vehicle: it has no lane, and highway-env never moves it."""

    height: Field[float]

    @property
    def lane_index(self) -> LaneIndex:
        """Index of the closest lane of its height in the network."""
        index: LaneIndex = self.road.network.get_closest_lane_index(self.position, self.heading, height=self.height)
        return index

    @property
    def lane(self) -> PolylineLane:
        """The closest lane."""
        lane: PolylineLane = self.road.network.get_lane(self.lane_index)
        return lane


class Pedestrian(_Thing[PedestrianRecord], RoadObject):
    """A pedestrian as an object on highway-env's road.

    Attributes:
        key: identifies the body.
        state: `Walk`.
        height: height of the ground under it [m].
    """

    RECORDS = "pedestrians"
    DTYPE = PEDESTRIAN
    LENGTH = WIDTH = WALKER_SIZE
    diagonal = pm.hypot(WALKER_SIZE, WALKER_SIZE)

    heading = heading_field(PEDESTRIAN)
    cos, sin = float_field(PEDESTRIAN, "cos"), float_field(PEDESTRIAN, "sin")
    speed = float_field(PEDESTRIAN, "speed")
    height = float_field(PEDESTRIAN, "height")
    crashed = flag_field(PEDESTRIAN, "crashed")
    odometer = float_field(PEDESTRIAN, "odometer")
    key = int_field(PEDESTRIAN, "key")
    state = converted_field(PEDESTRIAN, "state", Walk)

    def __init__(self, road: TownRoad, holder: ArrayHolder, row: int) -> None:
        """Shows a row of `holder.arrays.pedestrians`; `road` is a `TownRoad` of the same town."""
        super().__init__(road, holder, row)

    @property
    def lane_id(self) -> int:
        """The closest lane, its id in the town."""
        return int(self.lane.town_lane.id)

    @property
    def station(self) -> float:
        """Station on the closest lane [m]."""
        return self.on_lane()[0]


class Prop(_Thing[PropRecord], Obstacle):
    """A prop that the Ad-Wizard placed on the road, across its lane.

    Attributes:
        key: identifies the body.
        height: height of the road under it [m].
        lane_id: lane of the body; `station` [m] along it.
        crashed: highway-env's mark of a collision; the compiled loops keep none for props.
    """

    RECORDS = "props"
    DTYPE = PROP
    speed = 0.0
    crashed = False

    heading = heading_field(PROP)
    cos, sin = float_field(PROP, "cos"), float_field(PROP, "sin")
    height = float_field(PROP, "height")
    LENGTH, WIDTH = float_field(PROP, "length"), float_field(PROP, "width")
    diagonal = converted_field(PROP, "radius", lambda radius: 2.0 * radius)
    key = int_field(PROP, "key")
    lane_id, station = int_field(PROP, "lane"), float_field(PROP, "station")

    def __init__(self, road: TownRoad, holder: ArrayHolder, row: int) -> None:
        """Shows a row of `holder.arrays.props`; `road` is a `TownRoad` of the same town."""
        super().__init__(road, holder, row)

    @property
    def kind(self) -> PropKind:
        """Kind of the prop."""
        return _KIND_OF_SIZE[self.LENGTH, self.WIDTH]


View = TypeVar("View", TrafficVehicle, Pedestrian, Prop)


class _Views(Generic[View]):
    """Views of one kind of body, each made at its first use."""

    def __init__(self, road: TownRoad, holder: ArrayHolder) -> None:
        self._road, self._holder = road, holder
        self._made: dict[tuple[type[View], int], View] = {}

    def at(self, kind: type[View], row: int) -> View:
        """Returns the view of a row."""
        view = self._made.get((kind, row))
        if view is None:
            view = self._made[kind, row] = kind(self._road, self._holder, row)
        return view


class Bodies:
    """Views of a world."""

    def __init__(self, road: TownRoad, holder: ArrayHolder) -> None:
        """Shows the arrays of a holder on a road of the same town."""
        self._holder = holder
        self._vehicles = _Views[TrafficVehicle](road, holder)
        self._pedestrians = _Views[Pedestrian](road, holder)
        self._props = _Views[Prop](road, holder)

    def vehicles(self) -> list[TrafficVehicle]:
        """Returns the traffic, cyclists included, in the order of the rows, without vehicles driven from outside."""
        kinds = np.asarray(self._holder.arrays.vehicles)["kind"].tolist()
        return [self._vehicles.at(_CLASSES[kind], row) for row, kind in enumerate(kinds) if kind in _CLASSES]

    def pedestrians(self) -> list[Pedestrian]:
        """Returns the pedestrians in the order of the rows."""
        states = np.asarray(self._holder.arrays.pedestrians)["state"].tolist()
        return [self._pedestrians.at(Pedestrian, row) for row, state in enumerate(states) if state != Walk.EMPTY]

    def prop(self, row: int) -> Prop:
        """Returns the prop in a row."""
        return self._props.at(Prop, row)

    def props(self) -> list[Prop]:
        """Returns the props in the order of the rows."""
        present = np.asarray(self._holder.arrays.props)["present"].tolist()
        return [self.prop(row) for row, here in enumerate(present) if here]


_CLASSES: dict[int, type[TrafficVehicle]] = {int(Kind.CAR): TrafficVehicle, int(Kind.CYCLIST): Cyclist}
