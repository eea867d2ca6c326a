from __future__ import annotations

import math
from typing import Any, NamedTuple

import pytest

from dorothie_gym.maps import Lane
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.sim.ego.decision_setup import write_window
from dorothie_gym.sim.ego.manoeuvres import begin
from dorothie_gym.sim.ego.obstacles import bodies_ahead, room, safe_speed
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_car
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.network.towns import lane, town

ROAD: Lane = lane(0, [(0.0, 0.0), (100.0, 0.0)])


class Found(NamedTuple):
    """Obstacle: class, gap [m], its speed [m/s], and the speed that it allows [m/s]."""

    kind: ObjectClass
    gap: float
    speed: float
    safe_speed: float


def body(x: float, y: float = 0.0, *, kind: ObjectClass = ObjectClass.VEHICLES, **fields: float) -> dict[str, Any]:
    values = {"heading": 0.0, "length": 5.0, "width": 2.0, "speed": 0.0, "height": 0.0} | fields
    return {"x": x, "y": y, "kind": kind.value, **values}


def ahead(*bodies: dict[str, Any], road: Lane = ROAD, speed: float = 0.0) -> Found | None:
    """Returns the obstacle of a car that keeps its lane 10 m from the start of a road."""
    arrays = town_arrays(TownNetwork(town([road])))
    world = empty_world(arrays, vehicles=4, pedestrians=0, driven=True)
    add_car(arrays, world, 0, 5.0)
    begin(arrays, world, 0, 0.0, 0.0)
    world.car[0].s = 10.0
    write_window(world)
    world.vehicles[0].speed = speed
    for row, fields in zip(world.seen, bodies, strict=False):
        for name, value in fields.items():
            row[name] = value
        row.cos, row.sin = math.cos(row.heading), math.sin(row.heading)
        row.distance2 = (row.x - 10.0) ** 2 + row.y**2
    safe = float(bodies_ahead(arrays, world, len(bodies)))
    if math.isinf(safe):
        return None
    car = world.car[0]
    return Found(ObjectClass(int(car.kind)), float(car.gap), float(car.ahead_speed), safe)


def test_gap_is_from_nose_to_tail() -> None:
    hazard = ahead(body(30.0))
    assert hazard is not None
    assert hazard.gap == pytest.approx(15.0, abs=0.1)
    assert hazard.safe_speed > 0.0


@pytest.mark.parametrize("place", [(-5.0, 0.0), (30.0, 3.5), (30.0, -3.5), (90.0, 0.0)])
def test_bodies_behind_beside_or_far_away_are_no_hazard(place: tuple[float, float]) -> None:
    assert ahead(body(*place)) is None


def test_prop_beside_the_path_is_no_hazard() -> None:
    assert ahead(body(30.0, 2.0, kind=ObjectClass.STATIC, length=0.4, width=0.4)) is None
    assert ahead(body(30.0, 1.2, kind=ObjectClass.STATIC, length=0.4, width=0.4)) is not None


def test_bodies_on_a_bridge_are_no_hazard() -> None:
    assert ahead(body(30.0, height=5.0)) is None


def test_bodies_up_a_slope_are_a_hazard() -> None:
    slope = lane(0, [(0.0, 0.0, 0.0), (100.0, 0.0, 12.0)])
    assert ahead(body(40.0, height=4.8), road=slope) is not None
    assert ahead(body(40.0, height=0.0), road=slope) is None


def test_faster_car_looks_farther() -> None:
    assert ahead(body(90.0)) is None
    assert ahead(body(90.0), speed=25.0) is not None


def test_body_about_to_cross_is_a_hazard() -> None:
    walker = body(30.0, 3.0, kind=ObjectClass.PEDESTRIAN, heading=-math.pi / 2, speed=1.4, length=0.5, width=0.5)
    leaving = body(30.0, 3.0, kind=ObjectClass.PEDESTRIAN, heading=math.pi / 2, speed=1.4, length=0.5, width=0.5)
    assert ahead(walker) is not None
    assert ahead(leaving) is None


def test_the_most_pressing_of_several_counts() -> None:
    hazard = ahead(body(40.0), body(25.0, speed=8.0), body(35.0, kind=ObjectClass.STATIC, length=0.6))
    assert hazard is not None
    assert hazard.kind is ObjectClass.STATIC


def safe(gap: float, kind: ObjectClass = ObjectClass.VEHICLES, *, line: bool = False, friction: float = 1.0) -> float:
    return float(safe_speed(0.0, room(kind.value, gap, 0.0, False, line), friction))


def test_safe_speed_falls_with_gap_and_grip() -> None:
    speeds = [safe(gap) for gap in (2.0, 5.0, 10.0, 40.0)]
    assert speeds[0] == 0.0
    assert speeds == sorted(speeds)
    assert safe(20.0, friction=0.7) < speeds[-1]


def test_car_comes_closer_to_a_line_than_to_a_body_and_stops_before_it() -> None:
    gaps = [0.1 * k for k in range(60)]
    light = [safe(gap, ObjectClass.TRAFFIC_LIGHT, line=True) for gap in gaps]
    vehicle = [safe(gap) for gap in gaps]
    stops = [gaps[speeds.index(next(speed for speed in speeds if speed > 0.0))] for speeds in (light, vehicle)]
    assert 1.0 < stops[0] < 2.0 < stops[1]
