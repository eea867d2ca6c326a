"""The face of `kernel.seeing` for Python: whose eyes they are, and bodies as objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.car.hazards import Body
from dorothie_gym.world.kernel.compiling import compiled
from dorothie_gym.world.kernel.records import EYE, PEDESTRIAN, PROP, SEEN, VEHICLE, Kind, Records
from dorothie_gym.world.kernel.seeing import detection_chance, errors_of_place, see
from dorothie_gym.world.visibility import Visibility


class Perception:
    """Sees bodies as well as visibility allows."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._seed = int(rng.integers(1 << 63))

    def open(self, eyes: Records, visibility: Visibility) -> None:
        """Lets eyes see as well as visibility allows now, with this one's errors.

        Args:
            eyes: `records.EYE` (1,), written.
            visibility: air and light.
        """
        view = visibility
        eyes[0] = (
            self._seed, view.sight, view.fog, view.fog_start, view.rain, view.light, view.lamps, view.clarity,
            view.is_clear,
        )  # fmt: skip

    def perceive(
        self, bodies: Sequence[Body], x: float, y: float, visibility: Visibility, frame: int
    ) -> list[Body]:  # fmt: skip
        """The bodies that are perceived, where they seem to be, nearest first.

        What is within sight is always perceived; beyond it, now and then. On a clear noon nothing is changed.

        Args:
            bodies: all within sight of a clear noon.
            x: position of whoever looks [m]; `y` likewise.
            y: [m].
            visibility: air and light.
            frame: present frame.
        """
        if visibility.is_clear:
            return list(bodies)
        scene = _scene(bodies)
        self.open(scene.eyes, visibility)
        seen = scene.seen[: _look(scene, x, y, frame)]
        return [
            replace(bodies[body], x=seen_x, y=seen_y)
            for body, seen_x, seen_y in zip(seen.body.tolist(), seen.x.tolist(), seen.y.tolist(), strict=True)
        ]


def bodies_seen(seen: Records) -> list[Body]:
    """What has been seen as objects, in the same order.

    Args:
        seen: the part of `records.SEEN` that `see` has filled (n,).
    """
    columns = (seen[name].tolist() for name in _BODY)
    return [
        Body(key=key, kind=ObjectClass(kind), x=x, y=y, heading=heading, length=length, width=width, speed=speed,
             height=height)
        for key, kind, x, y, heading, length, width, speed, height in zip(*columns, strict=True)
    ]  # fmt: skip


_BODY = "key", "kind", "x", "y", "heading", "length", "width", "speed", "height"


def detection_probability(visibility: Visibility, distance: float) -> float:
    """Chance that something at a distance [m] is perceived: 1 within sight, then falling with its signal."""
    if distance <= visibility.sight:
        return 1.0
    return float(detection_chance(visibility.signal(distance)))


def position_error(visibility: Visibility, distance: float) -> tuple[float, float]:
    """Standard deviations of the place of something at a distance [m], away from the car and across [m]."""
    away, aside = errors_of_place(visibility.gain(distance), distance * distance)
    return float(away), float(aside)


class _Scene(NamedTuple):
    """Bodies as `see` takes them: numba takes tuples of arrays of records faster than it takes the arrays."""

    vehicles: Records
    pedestrians: Records
    props: Records
    seen: Records
    eyes: Records


def _scene(bodies: Sequence[Body]) -> _Scene:
    """All bodies as vehicles: only their places and keys matter."""
    vehicles, seen = (np.zeros(len(bodies), dtype=kind).view(np.recarray) for kind in (VEHICLE, SEEN))
    vehicles.kind = Kind.CAR
    vehicles.key = [body.key for body in bodies]
    vehicles.x, vehicles.y = [body.x for body in bodies], [body.y for body in bodies]
    pedestrians, props, eyes = (
        np.zeros(n, kind).view(np.recarray) for n, kind in ((0, PEDESTRIAN), (0, PROP), (1, EYE))
    )
    return _Scene(vehicles, pedestrians, props, seen, eyes)


@compiled
def _look(scene: _Scene, x: float, y: float, frame: int) -> int:
    return see(scene.vehicles, scene.pedestrians, scene.props, scene.seen, scene.eyes[0], x, y, frame, -1)
