"""Crosswalks: people step onto them when they may, and whoever drives gives way to them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dorothie_gym.world.town.footways import axis
from dorothie_gym.world.town.lights import LightColour
from dorothie_gym.world.town.model import Array, Crosswalk, Town

SAMPLE = 0.5
"""Step in which lanes are compared with crosswalks [m]."""

LEVEL = 2.5
"""Lanes further above or below a crosswalk do not cross it [m]."""

COMING = 7.0
"""Who drives gives way to people this far before the place where it would cross their way [m], 5 s of walking ..."""

GONE = 2.0
"""... until they are this far past it [m]: half its width, and as much again."""

REACTION = 1.0
"""People count on drivers to brake after this time [s] ..."""

BRAKING = 3.0
"""... no harder than this [m/s^2] ..."""

ROOM = 4.0
"""... and to stop this far before the crosswalk's middle line at the latest, measured from the front [m]."""

BEFORE = 8.0
"""The lanes whose lights people heed end this close to the middle line of the crosswalk [m]."""

SIGHT = 60.0
"""How far people look for those who drive [m]."""

STANDING = 0.3
"""Slower than this it stands [m/s]."""


class Span(NamedTuple):
    """Where a lane crosses a crosswalk: from and to along the lane, and how far along the crosswalk [m]."""

    crosswalk: int
    start: float
    end: float
    across: float


class Layout(NamedTuple):
    """What does not change in a town: by lane where it crosses crosswalks, by crosswalk its lights and its ends."""

    spans: dict[int, tuple[Span, ...]]
    lights: dict[int, tuple[int, ...]]
    ends: dict[int, Array]


@lru_cache(maxsize=16)
def layout(town: Town) -> Layout:
    """Crosswalks of a town and the lanes that cross them, found once."""
    spans: defaultdict[int, list[Span]] = defaultdict(list)
    lights: dict[int, tuple[int, ...]] = {}
    ends: dict[int, Array] = {}
    for crosswalk in town.crosswalks:
        ends[crosswalk.id], width = axis(crosswalk)
        crossed = list(_crossed(town, crosswalk, ends[crosswalk.id], width))
        for lane, span in crossed:
            spans[lane].append(span)
        # lights stand where the lanes end that lead onto it
        sources = {source for lane, _ in crossed for source in town.predecessors(lane)} | {lane for lane, _ in crossed}
        near = (
            source for source in sorted(sources)
            if town.light(source, 0.0) is not None and _end_near(town, source, ends[crosswalk.id])
        )  # fmt: skip
        lights[crosswalk.id] = tuple(near)
    return Layout({lane: tuple(sorted(found, key=lambda s: s.start)) for lane, found in spans.items()}, lights, ends)


def _crossed(town: Town, crosswalk: Crosswalk, ends: Array, width: float) -> Iterable[tuple[int, Span]]:
    length = float(np.hypot(*(ends[1] - ends[0])))
    unit = (ends[1] - ends[0]) / length
    low, high = crosswalk.outline.min(axis=0) - 1.0, crosswalk.outline.max(axis=0) + 1.0
    for lane in town.lanes:
        box = lane.points[:, :2]
        if np.any(box.max(axis=0) < low) or np.any(box.min(axis=0) > high):
            continue
        at = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / SAMPLE) + 1))
        places = np.column_stack([np.interp(at, lane.stations, lane.points[:, k]) for k in (0, 1)]) - ends[0]
        along, across = places @ unit, places @ (-unit[1], unit[0])
        inside = (along > 0.0) & (along < length) & (np.abs(across) <= width / 2)
        if inside.any():
            first, last = np.flatnonzero(inside)[[0, -1]]
            yield lane.id, Span(crosswalk.id, float(at[first]), float(at[last]), float(along[inside].mean()))


def _end_near(town: Town, lane: int, ends: Array) -> bool:
    """Whether a lane ends right before a crosswalk, and not on the other side of the junction."""
    length = float(np.hypot(*(ends[1] - ends[0])))
    unit = (ends[1] - ends[0]) / length
    dx, dy = town.lanes[lane].points[-1, :2] - ends[0]
    return bool(abs(dy * unit[0] - dx * unit[1]) < BEFORE and 0.0 < dx * unit[0] + dy * unit[1] < length)


class Crosswalks:
    """Who is on the crosswalks of a town.

    People on crosswalks have a `crosswalk` (its id, or -1 elsewhere), and `across` and `onward`: how far along it they
    are [m], and 1 or -1 for the direction in which they walk.
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self._layout = layout(town)
        self._walkers: dict[int, list[Any]] = {}

    def note(self, pedestrians: Iterable[Any]) -> None:
        """Takes note of who is on the crosswalks now; to be called once a substep."""
        self._walkers = {}
        for pedestrian in pedestrians:
            crosswalk = getattr(pedestrian, "crosswalk", -1)
            if crosswalk >= 0:
                self._walkers.setdefault(crosswalk, []).append(pedestrian)

    def spans(self, lane: int) -> tuple[Span, ...]:
        """Where a lane crosses crosswalks, in order."""
        return self._layout.spans.get(lane, ())

    def holds(self, span: Span) -> Any | None:
        """Somebody on the crosswalk to whom one who comes along a lane has to give way, or None."""
        for walker in self._walkers.get(span.crosswalk, ()):
            left = (span.across - walker.across) * walker.onward
            if -GONE < left < COMING:
                return walker
        return None

    def may_step(self, crosswalk: int, vehicles: Iterable[Any], time: float, seconds: float, height: float) -> bool:
        """Whether one may step onto a crosswalk.

        Args:
            crosswalk: its id.
            vehicles: all that drives.
            time: simulated time [s].
            seconds: that it takes to cross [s].
            height: of the crosswalk [m].

        Returns:
            False while a lane with a light leads onto it whose light is not red, or will not be until one is across;
            or while somebody drives towards it who could not stop with ease.
        """
        for lane in self._layout.lights[crosswalk]:
            for later in (0.0, 0.5 * seconds, seconds):
                if self._town.light(lane, time + later) is not LightColour.RED:
                    return False
        ends = self._layout.ends[crosswalk]
        return not any(_is_danger(vehicle, ends, height) for vehicle in vehicles)


def _is_danger(vehicle: Any, ends: Array, height: float) -> bool:
    """Whether a vehicle is on a crosswalk, or comes towards it too fast to stop with ease."""
    x, y = map(float, vehicle.position)
    ux, uy = ends[1] - ends[0]
    t = min(max(((x - ends[0, 0]) * ux + (y - ends[0, 1]) * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    dx, dy = ends[0, 0] + t * ux - x, ends[0, 1] + t * uy - y
    away = math.hypot(dx, dy)
    if away > SIGHT or abs(getattr(vehicle, "height", height) - height) > LEVEL:
        return False
    front = away - float(vehicle.LENGTH) / 2
    speed = float(vehicle.speed)
    if speed < STANDING:
        return front < 0.0
    ahead = dx * math.cos(vehicle.heading) + dy * math.sin(vehicle.heading)
    if ahead < 0.0 and front > ROOM:
        return False  # it has passed
    return front < ROOM + REACTION * speed + speed * speed / (2 * BRAKING)
