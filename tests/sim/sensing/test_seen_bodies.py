"""Compiled perception against the same rules in plain Python."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, PropKind, WeatherParameter
from dorothie_gym.sim.ego.obstacles import PerceivedBody
from dorothie_gym.sim.sensing.perception import (
    BODY,
    GLANCE,
    MOST_SIGMAS,
    Perception,
    detection_probability,
    position_error,
    see,
)
from dorothie_gym.sim.sensing.visibility import CLEAR_SIGHT, Visibility
from dorothie_gym.sim.state.codes import Group, Kind, Walk
from dorothie_gym.sim.state.records import EyeRecord, PedestrianRecord, PropRecord, SeenRecord, VehicleRecord
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.records import RecordArray, empty_records

P = WeatherParameter
SKIES: dict[str, dict[WeatherParameter, float]] = {
    "clear noon": {},
    "fog": {P.FOG_DENSITY: 60.0},
    "rain": {P.PRECIPITATION: 70.0, P.CLOUDINESS: 80.0},
    "night": {P.SUN_ALTITUDE_ANGLE: -90.0},
    "dusk in the fog": {P.SUN_ALTITUDE_ANGLE: -5.0, P.FOG_DENSITY: 30.0, P.FOG_DISTANCE: 20.0},
}


def weather_of(sky: str) -> Weather:
    weather = Weather()
    for parameter, value in SKIES[sky].items():
        weather.set(parameter, value)
    return weather


class Street:
    """Random bodies around a place, the first vehicle being the observer."""

    def __init__(self, seed: int, vehicles: int = 30, pedestrians: int = 20, props: int = 4) -> None:
        rng = np.random.default_rng(seed)
        self.x, self.y = rng.uniform(-500.0, 500.0, 2)
        self.vehicles, self.pedestrians, self.props = (
            empty_records(VehicleRecord, vehicles),
            empty_records(PedestrianRecord, pedestrians),
            empty_records(PropRecord, props),
        )
        keys = rng.permutation(1000)
        for bodies in (self.vehicles, self.pedestrians, self.props):
            for body in bodies:
                body.x, body.y = (self.x, self.y) + rng.uniform(-75.0, 75.0, 2)
                body.heading = rng.uniform(-math.pi, math.pi)
                body.cos, body.sin = math.cos(body.heading), math.sin(body.heading)
                body.height, body.key, keys = rng.uniform(0.0, 8.0), keys[0], keys[1:]
        for body in self.vehicles:
            body.kind, body.speed = (
                rng.choice([Kind.CAR, Kind.CYCLIST, Kind.EMPTY], p=[0.6, 0.2, 0.2]),
                rng.uniform(0, 9),
            )
            body.length, body.width = rng.uniform(1.0, 6.0), rng.uniform(0.5, 2.5)
        for walker in self.pedestrians:
            walker.state, walker.speed = rng.choice([Walk.EMPTY, Walk.WALKING, Walk.CROSSING]), rng.uniform(0, 2)
        for prop in self.props:
            prop.present, prop.length, prop.width = rng.random() < 0.8, *rng.uniform(0.3, 3.0, 2)
        if vehicles:
            self.vehicles[0].kind, self.vehicles[0].x, self.vehicles[0].y = Kind.DRIVEN, self.x, self.y

    def bodies(self) -> list[PerceivedBody]:
        """All within sight of a clear noon, nearest first, as objects."""
        found = [
            PerceivedBody(
                key=int(thing.key),
                kind=kind,
                x=float(thing.x),
                y=float(thing.y),
                heading=float(thing.heading),
                length=0.5 if kind is ObjectClass.PEDESTRIAN else float(thing.length),
                width=0.5 if kind is ObjectClass.PEDESTRIAN else float(thing.width),
                speed=0.0 if kind is ObjectClass.STATIC else float(thing.speed),
                height=float(thing.height),
            )
            for kind, things in (
                (ObjectClass.VEHICLES, [v for v in self.vehicles[1:] if v.kind != Kind.EMPTY]),
                (ObjectClass.PEDESTRIAN, [w for w in self.pedestrians if w.state != Walk.EMPTY]),
                (ObjectClass.STATIC, [p for p in self.props if p.present]),
            )
            for thing in things
        ]
        near = [body for body in found if self.distance(body) < CLEAR_SIGHT]
        return sorted(near, key=lambda body: (self.distance(body), body.key))

    def distance(self, body: PerceivedBody) -> float:
        return math.hypot(body.x - self.x, body.y - self.y)

    def seen(
        self, view: Visibility, frame: int, seed: int = 0, room: int = 64, skip: int = 0
    ) -> RecordArray[SeenRecord]:
        seen, eyes = empty_records(SeenRecord, room), empty_records(EyeRecord, 1)
        Perception(np.random.default_rng(seed)).open(eyes, view)
        count = see(
            self.vehicles, self.pedestrians, self.props, seen, eyes[0], float(self.x), float(self.y), frame, skip
        )
        return seen[:count]


def bodies_seen(seen: RecordArray[SeenRecord]) -> list[PerceivedBody]:
    """Returns the perceived bodies as objects."""
    return [
        PerceivedBody(**{name: thing[name].item() for name in BODY} | {"kind": ObjectClass(int(thing.kind))})
        for thing in seen
    ]


class Draw:
    """splitmix64 with the whole numbers of Python."""

    def __init__(self, *keys: int) -> None:
        self.state = 0
        for key in keys:
            self.state = self.next() ^ key

    def next(self) -> int:
        self.state = (self.state + 0x9E3779B97F4A7C15) % 2**64
        z = self.state
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return z ^ (z >> 31)

    def uniform(self) -> float:
        return (self.next() >> 11) * 2.0**-53

    def normal(self) -> float:
        radius = math.sqrt(-2.0 * math.log(1.0 - self.uniform()))
        return min(max(radius * math.cos(2 * math.pi * self.uniform()), -MOST_SIGMAS), MOST_SIGMAS)


def plainly_perceived(
    bodies: Sequence[PerceivedBody], x: float, y: float, view: Visibility, frame: int, seed: int
) -> list[PerceivedBody]:
    number = int(np.random.default_rng(seed).integers(1 << 63))
    if view.is_clear:
        return list(bodies)
    seen: list[PerceivedBody] = []
    for body in bodies:
        dx, dy = body.x - x, body.y - y
        distance = math.hypot(dx, dy)
        draw = Draw(number, body.key, frame // GLANCE)
        if distance > view.sight and draw.uniform() >= detection_probability(view, distance):
            continue
        away, aside = position_error(view, distance)
        if away > 0.0:
            along, across = 1.0 + away * draw.normal() / distance, aside * draw.normal() / distance
            body = replace(body, x=x + dx * along - dy * across, y=y + dy * along + dx * across)
        seen.append(body)
    return sorted(seen, key=lambda body: (math.hypot(body.x - x, body.y - y), body.key))


@pytest.mark.parametrize("sky", SKIES)
@pytest.mark.parametrize("lights", [False, True])
def test_perception_equals_the_plain_python_rules(sky: str, lights: bool) -> None:
    total = moved = 0
    for seed in range(60):
        street = Street(seed)
        view = weather_of(sky).visibility(lights=lights, clarity=0.25 if seed % 5 == 4 else 1.0)
        bodies = street.bodies()
        expected = plainly_perceived(bodies, street.x, street.y, view, 37 * seed, seed)
        found = bodies_seen(street.seen(view, 37 * seed, seed))
        assert [replace(body, x=0.0, y=0.0) for body in found] == [replace(body, x=0.0, y=0.0) for body in expected]
        places = [(body.x, body.y) for body in found]
        np.testing.assert_allclose(places, [(body.x, body.y) for body in expected], rtol=0.0, atol=1e-9)
        total += len(found)
        moved += sum((body.x, body.y) not in {(b.x, b.y) for b in bodies} for body in found)
    assert total > 200
    assert moved > 50  # on the clear noon by those whose view is blurred


def test_records_hold_row_and_perceived_distance() -> None:
    street = Street(3)
    for view in (weather_of("clear noon").visibility(lights=False), weather_of("fog").visibility(lights=False)):
        groups = {Group.VEHICLES: street.vehicles, Group.PEDESTRIANS: street.pedestrians, Group.PROPS: street.props}
        seen = street.seen(view, 0)
        assert {int(thing.group) for thing in seen} == {0, 1, 2}
        for thing in seen:
            body = groups[Group(int(thing.group))][thing.body]
            assert (thing.key, thing.cos, thing.sin, thing.height) == (body.key, body.cos, body.sin, body.height)
            assert thing.distance2 == pytest.approx((thing.x - street.x) ** 2 + (thing.y - street.y) ** 2)


def test_observer_does_not_see_itself() -> None:
    street, clear = Street(1), Visibility()
    keys = [thing.key for thing in street.seen(clear, 0)]
    assert street.vehicles[0].key not in keys
    assert street.seen(clear, 0, skip=-1)[0].key == street.vehicles[0].key


@pytest.mark.parametrize("sky", SKIES)
def test_where_room_is_short_the_nearest_are_kept(sky: str) -> None:
    view = weather_of(sky).visibility(lights=True)
    for seed in range(10):
        street = Street(seed)
        everything = street.seen(view, 9)
        for room in (0, 1, 5):
            assert street.seen(view, 9, room=room).tobytes() == everything[:room].tobytes()


def test_of_bodies_at_one_distance_the_lower_key_comes_first() -> None:
    street = Street(0, vehicles=1, pedestrians=6, props=0)
    street.pedestrians.state = Walk.WALKING
    street.pedestrians.x, street.pedestrians.y = street.x + 5.0, street.y
    street.pedestrians.key = [4, 2, 9, 1, 7, 3]
    assert [thing.key for thing in street.seen(Visibility(), 0)] == [1, 2, 3, 4, 7, 9]


def test_empty_world_has_no_perceived_bodies() -> None:
    assert len(Street(0, vehicles=1, pedestrians=0, props=0).seen(Visibility(fog=0.05), 0)) == 0


def test_all_kinds_of_props_are_seen_with_their_size() -> None:
    street = Street(0, vehicles=1, pedestrians=0, props=len(PropKind))
    for prop, kind in zip(street.props, PropKind, strict=True):
        prop.present, prop.length, prop.width = True, kind.length, kind.width
    street.props.x, street.props.y = street.x + np.arange(1.0, 1.0 + len(PropKind)), street.y
    seen = bodies_seen(street.seen(Visibility(), 0))
    assert [(body.length, body.width) for body in seen] == [(kind.length, kind.width) for kind in PropKind]
    assert {body.kind for body in seen} == {ObjectClass.STATIC}
