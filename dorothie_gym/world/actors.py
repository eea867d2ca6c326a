"""Everybody and everything on the road besides the car: traffic, pedestrians, props."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dorothie_gym.ontology import ObjectClass, PropKind
from dorothie_gym.world.car.hazards import Body
from dorothie_gym.world.car.vehicle import Car
from dorothie_gym.world.crosswalks import Crosswalks
from dorothie_gym.world.cyclists import SHARE, Cyclist, may_ride
from dorothie_gym.world.cyclists import SPEEDS as CYCLING_SPEEDS
from dorothie_gym.world.junctions import JunctionControl
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.pedestrians import KERB, Pedestrian, leftmost, rightmost, walkway
from dorothie_gym.world.places import free_places
from dorothie_gym.world.props import Prop
from dorothie_gym.world.town.footways import WayKind, footways
from dorothie_gym.world.town.model import Array
from dorothie_gym.world.town.oncoming import oncoming_lanes
from dorothie_gym.world.traffic import CurveSpeeds, TrafficVehicle
from dorothie_gym.world.walkers import Walker

GOES_HOME = 45.0
"""A walker who has not got on for this long goes home [s]; longer than one waits at a crosswalk."""

TOW_CRASHED = 3.0
"""A crashed vehicle is towed away after this long [s]."""

TOW_BLOCKED = 15.0
"""A vehicle that stands before a prop gives up after this long [s]."""

TOW_FACING = 6.0
"""A vehicle that stands before a car that stands in the middle of a U-turn gives way to it after this long [s]."""

TOW_STUCK = 60.0
"""Any vehicle that stands for this long, not for a red light, is towed away: no knot lasts for ever [s]."""

STANDING = 0.1
"""Slower than this the car stands [m/s]."""

CLEAR_OF_CAR = 25.0
"""Nobody appears closer to the car than this [m]."""

CLEAR_OF_OTHERS = 14.0
"""Nobody appears closer to others before or behind it than this [m], ..."""

CLEAR_BESIDE = 2.5
"""... who are no farther aside than this [m], ..."""

CLEAR_OF_BODIES = 6.0
"""... nor this close to the middle of any, half of it aside [m]."""

DRIVING_SPEEDS = (6.5, 10.0)
"""Least and greatest desired speed of traffic [m/s]."""

CLEAR_OF_WALKER = 8.0
"""No pedestrian appears closer to the car than this [m]."""

OUT_OF_SIGHT = 60.0
"""A towed vehicle comes back no closer to the car than this [m]."""


class Actors:
    """Traffic, pedestrians and props of a road.

    Attributes:
        vehicles: background traffic, cyclists among it, in the order of their keys.
        pedestrians: people on foot.
        crosswalks: who is on them.
        props: things placed by the Ad-Wizard.
    """

    def __init__(
        self, road: TownRoad, junctions: JunctionControl, car: Car, *,
        traffic_rng: np.random.Generator, walk_rng: np.random.Generator, crosswalks: Crosswalks | None = None,
    ) -> None:  # fmt: skip
        self._road, self._junctions, self._car = road, junctions, car
        self._traffic_rng, self._walk_rng = traffic_rng, walk_rng
        self._town = road.network.town
        self._curve_speeds = CurveSpeeds(self._town)
        self.crosswalks = crosswalks if crosswalks is not None else Crosswalks(self._town)
        self._next_key = 1
        self.vehicles: list[TrafficVehicle] = []
        self.pedestrians: list[Pedestrian | Walker] = []
        self.props: list[Prop] = []

    # --- coming and going -------------------------------------------------------------------------------------------

    def populate(self, *, vehicles: int, pedestrians: int) -> None:
        """Brings traffic and pedestrians to random places, as many as fit; these to pavements, if there are any."""
        for lane, station in free_places(self._town, self._traffic_rng, 12 * vehicles):
            if len(self.vehicles) == vehicles:
                break
            self.add_vehicle(lane, station, distance=CLEAR_OF_CAR)
        if self._town.sidewalks:
            self._add_walkers(pedestrians)
            return
        for lane, station in free_places(self._town, self._walk_rng, 12 * pedestrians):
            if len(self.pedestrians) == pedestrians:
                break
            self.add_pedestrian(lane, station)

    def add_vehicle(self, lane: int, station: float, *, distance: float) -> bool:
        """Puts a vehicle, or a cyclist, on a lane if there is room and the car is farther than `distance` [m]."""
        town = self._town
        if not self._is_clear(lane, station, distance):
            return False
        cycles = may_ride(town.lanes[lane]) and lane == rightmost(town, lane) and self._traffic_rng.random() < SHARE
        kind, speeds = (Cyclist, CYCLING_SPEEDS) if cycles else (TrafficVehicle, DRIVING_SPEEDS)
        vehicle = kind(
            self._road, lane, station, key=self._new_key(), speed=0.0,
            desired_speed=float(self._traffic_rng.uniform(*speeds)),
            junctions=self._junctions, crosswalks=self.crosswalks, curve_speeds=self._curve_speeds,
            rng=self._traffic_rng,
        )  # fmt: skip
        self._road.vehicles.append(vehicle)
        self.vehicles.append(vehicle)
        return True

    def _add_walkers(self, count: int) -> None:
        """Puts people on pavements, drawn evenly along them."""
        ways = footways(self._town)
        pavements = [k for k, way in enumerate(ways.ways) if way.kind is WayKind.PAVEMENT]
        lengths = np.array([ways.ways[k].length for k in pavements])
        for k in self._walk_rng.choice(pavements, size=12 * count, p=lengths / lengths.sum()):
            if len(self.pedestrians) == count:
                return
            station = float(self._walk_rng.uniform(0.0, ways.ways[k].length))
            place = np.array(ways.ways[k].place(station)[:2])
            others = [(self._car, CLEAR_OF_WALKER), *((other, 1.5) for other in self.pedestrians)]
            if all(math.hypot(*(place - other.position)) >= room for other, room in others):
                walker = Walker(
                    self._road, ways, self.crosswalks, int(k), station, key=self._new_key(), rng=self._walk_rng
                )  # fmt: skip
                self._road.objects.append(walker)
                self.pedestrians.append(walker)

    def kerb(self, lane: int, station: float) -> Array:
        """Where a pedestrian stands beside a lane (2,) [m]; `lane` is the rightmost one of its direction."""
        town_lane = self._town.lanes[lane]
        place: Array = town_lane.position(station, town_lane.width_at(station) / 2 + KERB)
        return place

    def add_pedestrian(self, lane: int, station: float) -> bool:
        """Puts a pedestrian beside a lane, or to the right of those beside it, if nobody is there.

        Such pedestrians keep to the street where they are, and cross it anywhere.
        """
        lane = rightmost(self._town, lane)
        station = min(station, self._town.lanes[lane].length)
        place = self.kerb(lane, station)
        if math.hypot(*(place - self._car.position)) < CLEAR_OF_WALKER:
            return False
        if any(math.hypot(*(place - p.position)) < 1.0 for p in self.pedestrians):
            return False
        stretch = walkway(self._road.network, lane, station)
        if stretch is None:
            return False
        pedestrian = Pedestrian(self._road, lane, station, stretch=stretch, key=self._new_key(), rng=self._walk_rng)
        self._road.objects.append(pedestrian)
        self.pedestrians.append(pedestrian)
        return True

    def add_prop(self, kind: PropKind, lane: int, station: float, *, key: int | None = None) -> Prop:
        """Puts a prop on a lane; whether it may stand there is the caller's business.

        Args:
            kind: of prop.
            lane: it stands on.
            station: distance along the lane [m].
            key: that of a prop that is moved; by default a new one.
        """
        prop = Prop(self._road, kind, lane, station, key=self._new_key() if key is None else key)
        self._road.objects.append(prop)
        self.props.append(prop)
        return prop

    def remove_prop(self, prop: Prop) -> None:
        """Takes a prop away."""
        self._road.objects.remove(prop)
        self.props.remove(prop)

    def tidy(self) -> None:
        """Tows crashed and stuck vehicles away and brings others in; to be called once a decision.

        Walkers who do not get on, as between the end of a pavement and a car that waits for them, go home; others come.
        """
        for vehicle in list(self.vehicles):
            blocked = vehicle.stuck > TOW_BLOCKED and self._before_prop(vehicle)
            blocked |= vehicle.stuck > TOW_FACING and self._faces_turning_car(vehicle)
            if vehicle.crash_age > TOW_CRASHED or vehicle.stuck > TOW_STUCK or blocked:
                self._remove(vehicle)
                self._replace()
        home = [p for p in self.pedestrians if isinstance(p, Walker) and p.staying > GOES_HOME]
        gone = [p for p in self.pedestrians if p.crashed or p in home]
        self.pedestrians = [p for p in self.pedestrians if p not in gone]
        self._road.objects = [o for o in self._road.objects if o not in gone]
        if home:
            self._add_walkers(len(self.pedestrians) + len(home))

    def book(self, touched: Sequence[Any]) -> list[tuple[ObjectClass, Any]]:
        """What the car has touched, with their classes; all but props stay until they are towed away."""
        hit: list[tuple[ObjectClass, Any]] = []
        for thing in touched:
            thing.collidable = False  # touched once: it does not count again until it is towed
            if isinstance(thing, Prop):
                hit.append((ObjectClass.STATIC, thing))
                self.remove_prop(thing)
            elif isinstance(thing, Pedestrian | Walker):
                hit.append((ObjectClass.PEDESTRIAN, thing))
            else:
                thing.speed = 0.0  # else it would go on through the car
                hit.append((ObjectClass.VEHICLES, thing))
        return hit

    # --- moving and seeing ------------------------------------------------------------------------------------------

    def act(self, dt: float) -> None:
        """Lets traffic decide and pedestrians walk for `dt` [s]; `road.step` then moves the traffic."""
        crossing = self._car if getattr(self._car, "sweep", None) else None
        self.crosswalks.note(self.pedestrians)
        for vehicle in self.vehicles:
            vehicle.crossing = crossing
            vehicle.act()
        for pedestrian in self.pedestrians:
            if isinstance(pedestrian, Walker):
                pedestrian.walk(dt)
            else:
                pedestrian.walk(dt, self._across)

    def bodies(self, position: Array, sight: float) -> list[Body]:
        """Bodies within sight of a position, nearest first."""
        found: list[tuple[float, int, ObjectClass, Any]] = []
        x, y = float(position[0]), float(position[1])
        for kind, group in (
            (ObjectClass.VEHICLES, self.vehicles),
            (ObjectClass.PEDESTRIAN, self.pedestrians),
            (ObjectClass.STATIC, self.props),
        ):
            for thing in group:
                dx, dy = thing.position[0] - x, thing.position[1] - y
                if dx * dx + dy * dy < sight * sight:
                    found.append((dx * dx + dy * dy, thing.key, kind, thing))
        found.sort(key=lambda row: row[:2])
        return [_body(kind, key, thing) for _, key, kind, thing in found]

    def _across(self, pedestrian: Pedestrian) -> float:
        """How far it is to the other side of the road, over all its lanes [m]."""
        town = self._town
        lane = town.lanes[pedestrian.lane_id]
        station, _ = lane.project(pedestrian.position)
        place = lane.position(station)
        far = town.lanes[leftmost(town, lane.id)]
        oncoming = oncoming_lanes(town).at(far.id, far.project(place)[0])
        side = -1.0  # the far kerb is to the left of the last lane of this direction, to the right of an oncoming one
        if oncoming is not None:
            far, side = town.lanes[rightmost(town, oncoming.lane)], 1.0
        there, _ = far.project(place)
        kerb = far.position(there, side * (far.width_at(there) / 2 + KERB))
        return float(lane.width_at(station) / 2 + KERB + math.hypot(*(kerb - place)))

    def _before_prop(self, vehicle: TrafficVehicle) -> bool:
        return any(
            math.hypot(*(prop.position - vehicle.position)) < 40.0 and vehicle.front_distance_to(prop) > 0.0
            for prop in self.props
        )

    def _faces_turning_car(self, vehicle: TrafficVehicle) -> bool:
        car = self._car
        return bool(getattr(car, "sweep", None)) and car.speed < STANDING and _near(vehicle, car, 6.0)

    def _is_clear(self, lane: int, station: float, distance: float) -> bool:
        """Whether a vehicle would have room: to the car, to whoever is on the lane, and to what is beside it."""
        town_lane = self._town.lanes[lane]
        place, heading = town_lane.position(station), town_lane.heading_at(station)
        if math.hypot(*(place - self._car.position)) < distance:
            return False
        c, s = math.cos(heading), math.sin(heading)
        others: list[Any] = [*self.vehicles, *self.props]
        for other in others:
            dx, dy = other.position - place
            along, across = abs(dx * c + dy * s), abs(dy * c - dx * s)
            if along < CLEAR_OF_OTHERS and across < (CLEAR_BESIDE if along > CLEAR_OF_BODIES else CLEAR_OF_BODIES / 2):
                return False
        return True

    def _remove(self, vehicle: TrafficVehicle) -> None:
        self._junctions.release(vehicle.key)
        self._road.vehicles.remove(vehicle)
        self.vehicles.remove(vehicle)

    def _replace(self) -> None:
        for lane, station in free_places(self._town, self._traffic_rng, 20):
            if self.add_vehicle(lane, station, distance=OUT_OF_SIGHT):
                return

    def _new_key(self) -> int:
        self._next_key += 1
        return self._next_key


def _near(thing: Any, car: Car, reach: float) -> bool:
    return bool(math.hypot(*(thing.position - car.position)) < reach + thing.diagonal / 2)


def _body(kind: ObjectClass, key: int, thing: Any) -> Body:
    return Body(
        key=key,
        kind=kind,
        x=float(thing.position[0]),
        y=float(thing.position[1]),
        heading=float(thing.heading),
        length=float(thing.LENGTH),
        width=float(thing.WIDTH),
        speed=float(thing.speed),
        height=float(thing.height),
    )
