"""Perception in bad weather, in which the ego still stops in time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PropKind, Sensor, WeatherParameter
from dorothie_gym.sim.ego.obstacles import PerceivedBody
from dorothie_gym.sim.sensing.perception import Perception, detection_probability, position_error, see
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT, Visibility
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.records import EyeRecord, PedestrianRecord, PropRecord, SeenRecord, VehicleRecord
from dorothie_gym.sim.weather import Weather
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation.records import empty_records
from tests.sim.driving import ALONE, long_lane, network, run, world_at

FOG = Visibility(fog=0.05)


def body(x: float, y: float = 0.0, key: int = 7) -> PerceivedBody:
    return PerceivedBody(
        key=key, kind=ObjectClass.VEHICLES, x=x, y=y, heading=0.0, length=5.0, width=2.0, speed=3.0, height=0.0
    )


class Eyes:
    """An observer on the x axis that looks at vehicles."""

    def __init__(self, seed: int = 0) -> None:
        self._perception = Perception(np.random.default_rng(seed))
        self._eye = empty_records(EyeRecord, 1)

    def look(
        self, bodies: Sequence[PerceivedBody], view: Visibility, frame: int, x: float = 0.0
    ) -> list[PerceivedBody]:
        """Returns the perceived bodies from a place on the x axis."""
        vehicles, seen = empty_records(VehicleRecord, len(bodies)), empty_records(SeenRecord, len(bodies))
        for vehicle, thing in zip(vehicles, bodies, strict=True):
            vehicle.kind, vehicle.key, vehicle.x, vehicle.y = Kind.CAR, thing.key, thing.x, thing.y
            vehicle.heading, vehicle.speed, vehicle.height = thing.heading, thing.speed, thing.height
            vehicle.length, vehicle.width = thing.length, thing.width
        self._perception.open(self._eye, view)
        count = see(vehicles, NO_PEDESTRIANS, NO_PROPS, seen, self._eye[0], x, 0.0, frame, -1)
        return [
            PerceivedBody(
                key=int(each.key), kind=ObjectClass(int(each.kind)), x=float(each.x), y=float(each.y),
                heading=float(each.heading), length=float(each.length), width=float(each.width),
                speed=float(each.speed), height=float(each.height),
            )
            for each in seen[:count]
        ]  # fmt: skip


NO_PEDESTRIANS, NO_PROPS = empty_records(PedestrianRecord, 0), empty_records(PropRecord, 0)


def test_clear_noon_has_no_perception_errors() -> None:
    bodies = [body(10.0, key=1), body(79.0, key=2)]
    assert Eyes().look(bodies, Weather().visibility(lights=False), 0) == bodies


def test_perception_does_not_depend_on_the_number_of_calls() -> None:
    bodies = [body(x, key=int(x)) for x in (20.0, 33.0, 50.0, 70.0)]
    eyes = Eyes()
    first = eyes.look(bodies, FOG, 400)
    eyes.look(bodies[:2], FOG, 900, x=3.0)
    assert eyes.look(bodies, FOG, 400) == first
    assert Eyes().look(bodies, FOG, 400) == first
    assert Eyes(1).look(bodies, FOG, 400) != first
    alone = eyes.look([bodies[1]], FOG, 400)
    assert alone == [thing for thing in first if thing.key == bodies[1].key]


def test_miss_rate_of_distant_bodies_follows_the_formula() -> None:
    distance, eyes = FOG.sight + 8.0, Eyes()
    seen = [bool(eyes.look([body(distance, key=key)], FOG, 15 * key)) for key in range(4000)]
    expected = detection_probability(FOG, distance)
    assert 0.1 < expected < 0.9
    assert np.mean(seen) == pytest.approx(expected, abs=0.03)


def test_bodies_within_sight_are_never_missed() -> None:
    eyes = Eyes()
    assert all(eyes.look([body(FOG.sight - 0.1, key=key)], FOG, key) for key in range(500))


def test_errors_of_place_have_the_spread_of_the_formula_and_are_cut_off() -> None:
    distance, eyes = FOG.sight - 1.0, Eyes()
    seen = [eyes.look([body(distance, key=key)], FOG, 0)[0] for key in range(4000)]
    away, aside = position_error(FOG, distance)
    errors = np.array([(thing.x - distance, thing.y) for thing in seen])
    # a normal distribution whose tails are set to two standard deviations has 0.96 of its spread
    np.testing.assert_allclose(errors.std(axis=0), [0.96 * away, 0.96 * aside], rtol=0.05)
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=0.1 * away)
    assert (np.abs(errors).max(axis=0) <= 2.0 * np.array([away, aside]) + 1e-9).all()


def test_bodies_are_listed_by_perceived_place_nearest_first() -> None:
    bodies = [body(x, key=int(10 * x)) for x in np.arange(20.0, 78.0, 0.5)]
    seen = Eyes().look(bodies, FOG, 0)
    distances = [math.hypot(thing.x, thing.y) for thing in seen]
    assert distances == sorted(distances)
    assert len(seen) > 10


TROUBLES: dict[str, dict[WeatherParameter, float]] = {
    "night": {WeatherParameter.SUN_ALTITUDE_ANGLE: -90.0},
    "night in the rain": {
        WeatherParameter.SUN_ALTITUDE_ANGLE: -90.0,
        WeatherParameter.PRECIPITATION: 100.0,
        WeatherParameter.WETNESS: 100.0,
        WeatherParameter.WIND_INTENSITY: 100.0,
    },
    "fog": {WeatherParameter.FOG_DENSITY: 60.0, WeatherParameter.WETNESS: 100.0},
}


def bad_world(trouble: str, seed: int, *, lights: bool = True) -> World:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0, ALONE, seed)
    for parameter, value in TROUBLES[trouble].items():
        world.weather.set(parameter, value)
    world.ego.lights = lights
    for _ in range(8):
        world.ego.change_cruise(up=True)
    return world


@pytest.mark.parametrize("trouble", TROUBLES)
@pytest.mark.parametrize("lights", [False, True])
def test_car_in_poor_sight_stops_before_obstacles(trouble: str, lights: bool) -> None:
    for seed in range(2):
        for blurred in (False, True):
            world = bad_world(trouble, seed, lights=lights)
            if blurred:
                world.set_fault(Sensor.BLUR, True)
            world.actors.add_prop(PropKind.TRAFFIC_CONE, world.planner.lane, 80.0)
            run(world, 60.0, lambda w=world: w.car.speed < 0.05 and w.planner.station > 40.0)
            assert world.collisions == 0
            assert world.car.speed < 0.05
            assert 9.0 < 80.0 - world.planner.station - world.car.LENGTH / 2 < 15.0


@pytest.mark.parametrize("trouble", TROUBLES)
def test_speed_allows_a_stop_within_sight(trouble: str) -> None:
    world = bad_world(trouble, 0)
    fastest = 0.0
    for _ in range(24):
        world.step(15)
        fastest = max(fastest, float(world.car.speed))
        way = 0.4 * world.car.speed + world.weather.braking_distance(float(world.car.speed), 4.0)
        assert way < world.sight - world.car.LENGTH / 2
    assert fastest > 4.0
    assert world.sight < CLEAR_SIGHT


def test_bad_weather_is_the_same_for_the_same_seed() -> None:
    frames = []
    for bundle in (15, 15):
        world = bad_world("night in the rain", 3)
        world.actors.add_prop(PropKind.DUMPSTER, world.planner.lane, 90.0)
        for _ in range(300 // bundle):
            world.step(bundle)
            frames.append(world.frames.copy())
    half = len(frames) // 2
    np.testing.assert_array_equal(np.concatenate(frames[:half]), np.concatenate(frames[half:]))
