"""Layers of a map: all shapes in world coordinates, in the order of painting."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.pictures.maps import markings
from dorothie_gym.pictures.maps.borders import Border, Borders, find_borders
from dorothie_gym.pictures.maps.ground import landscape
from dorothie_gym.pictures.maps.levels import LevelLookup, stretches
from dorothie_gym.pictures.maps.markings import lane_arrows
from dorothie_gym.pictures.maps.medians import find_pockets, held, pocket_paint
from dorothie_gym.pictures.maps.shapes import Shape, TownSamples
from dorothie_gym.pictures.maps.surfaces import BEYOND_BRIDGE, deck, streets, tunnel_floors, tunnel_pavements

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

_SIGN_ASIDE = 1.5  # [m] from the edge of the lane
SHOWN = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)
"""Kinds of signals that are drawn."""


@dataclass(frozen=True)
class Post:
    """Light or sign on the map.

    Attributes:
        kind: kind of the signal.
        at: position of the icon (x, y) [m].
        lanes: ids of the lanes that it applies to.
    """

    kind: SignalKind
    at: tuple[float, float]
    lanes: tuple[int, ...]


def posts(town: Town, borders: Borders, stops: Mapping[int, float]) -> tuple[Post, ...]:
    """Returns the lights and signs of a town, one for each approach and kind.

    Maps may place a light on the far side of its junction, or several at one approach; here one stands at the stop
    line. A light for inner lanes only stands on their left. One without lanes keeps the position in the map.
    """
    found: dict[tuple[SignalKind, tuple[float, float]], Post] = {}
    for signal in town.signals:
        if signal.kind in SHOWN:
            for post in _posts(town, borders, stops, signal):
                found.setdefault((post.kind, post.at), post)
    return tuple(found.values())


def _posts(town: Town, borders: Borders, stops: Mapping[int, float], signal: Signal) -> Iterator[Post]:
    lanes = [lane for lane in signal.lanes if not town.lanes[lane].in_junction]
    if not lanes:
        yield Post(signal.kind, signal.position[:2], signal.lanes)
        return
    own = frozenset(lanes)
    for number in lanes:
        beside = borders.outer_neighbour.get(number)
        if beside in own:
            continue
        lane, sign = town.lanes[number], town.traffic.sign
        if beside is not None:
            # the outermost lanes have their own light
            lane, sign = town.lanes[_innermost(borders, own, number)], -town.traffic.sign
        station = stops.get(lane.id, lane.length)
        x, y = lane.position(station, sign * (lane.width_at(station) / 2.0 + _SIGN_ASIDE)).tolist()
        yield Post(signal.kind, (round(x, 2), round(y, 2)), signal.lanes)


def _innermost(borders: Borders, lanes: frozenset[int], lane: int) -> int:
    seen = {lane}
    while (beside := borders.inner_neighbour.get(lane, -1)) in lanes and beside not in seen:
        seen.add(beside)
        lane = beside
    return lane


# --- All layers ------------------------------------------------------------------------------------------------------


class MapLayers:
    """Everything on the map except text and icons.

    Attributes:
        town: the town.
        detail: level of detail.
        borders: borders of the lanes, along which names are placed.
        stretches: bridges and tunnels.
        raised: lookup of the positions on bridges and in tunnels.
        arrows: turn arrows before junctions.
        pockets: starts of turn lanes.
        ruled: control at the end of each lane that has one.
        stops: station of the (possible) stop line of each lane that leads to a junction [m].
        posts: lights and signs.
    """

    def __init__(self, town: Town, *, scale: float = 8.0, border: float = 6.0) -> None:
        """Derives the layers from a town.

        Args:
            town: town to paint.
            scale: scale of the picture [px/m]; details too small for it are omitted.
            border: width of the country beyond the streets [m].
        """
        self.town = town
        self.detail = markings.MapDetail.at(scale)
        self._border = border
        self._samples = samples = TownSamples.of(town)
        self.borders = borders = find_borders(town, samples)
        self.stretches = stretches(town, samples)
        self.raised = LevelLookup(samples, self.stretches)
        self.stops = markings.stop_stations(town)
        self.ruled = markings.ruled_lanes(town)
        shared = {*borders.outer_neighbour, *borders.outer_neighbour.values()}
        self.arrows = tuple(lane_arrows(town, shared, self.stops))
        self.pockets = find_pockets(town, borders)
        self.posts = posts(town, borders, self.stops)

    @property
    def bridge_levels(self) -> list[int]:
        """Levels of the bridges, lower ones first."""
        return sorted({part.level for part in self.stretches if part.level > 0})

    def at_scale(self, scale: float, border: float) -> MapLayers:
        """Returns the layers of the same town for another scale [px/m] and another width of country [m].

        It shares what does not depend on them.
        """
        other = copy.copy(self)
        other.__dict__.pop("shapes", None)
        other.__dict__["_streets"] = self._streets
        other.detail, other._border = markings.MapDetail.at(scale), border
        return other

    @cached_property
    def shapes(self) -> list[Shape]:
        """All polygons, in the order of painting."""
        return [*landscape(self.town, self._border), *self._streets, *self._layers(list(self._paint()))]

    @cached_property
    def _streets(self) -> list[Shape]:
        return list(streets(self.town, self._samples, self.borders.lines, self.stretches, self.pockets))

    def ground_shapes(self) -> list[Shape]:
        """Returns the polygons on the ground without bridges, as if streets under bridges lay in the open.

        Roads on bridges are left out; the place of a bridge shows the floor of a tunnel where nothing else is.
        """
        bridges = [part for part in self.stretches if part.level > 0]
        ground = streets(self.town, self._samples, self.borders.lines, self.stretches, self.pockets, bridges)
        left_out = LevelLookup(self._samples, self.stretches)
        paint = self._held(list(self._paint()), left_out, wanted=False)
        return [*landscape(self.town, self._border), *ground, *paint]

    def bridge_shapes(self, level: int) -> list[Shape]:
        """Returns the polygons of the bridges of one level: parapets, asphalt and paint."""
        parts = [part for part in self.stretches if part.level == level]
        lines = self.borders.lines
        above = LevelLookup(self._samples, parts, BEYOND_BRIDGE)
        shapes = deck(self.town, parts, lines, LevelLookup(self._samples, parts))
        return [*shapes, *self._held(list(self._paint()), above)]

    def tunnel_shapes(self) -> list[Shape]:
        """Returns the polygons in tunnels: pavements, floors and the lines on them."""
        parts = [part for part in self.stretches if part.level < 0]
        if not parts:
            return []
        covered = LevelLookup(self._samples, parts)
        inside = [line.part(run) for line in self.borders.lines for run in held(line, covered)]
        floors = tunnel_floors(self.town, parts, self.borders.lines, covered)
        pavements = tunnel_pavements(self.town, covered)
        return [*pavements, *floors, *markings.lines(inside, self.detail), *self._held(list(self._paint()), covered)]

    @staticmethod
    def _held(paint: list[Shape], places: LevelLookup, wanted: bool = True) -> Iterator[Shape]:
        """Yields the road markings that lie (or do not lie) on the stretches of a lookup."""
        centres = np.array([[*shape.points.mean(axis=0), shape.height] for shape in paint]).reshape(-1, 3)
        yield from (shape for shape, on in zip(paint, places.hold(centres).tolist(), strict=True) if on == wanted)

    def _paint(self) -> Iterator[Shape]:
        pen = self.detail.pen
        yield from markings.lines(self._open_lines(), self.detail)
        yield from pocket_paint(self.town, self.pockets, pen, self.detail.fine)
        yield from markings.approaches(self.town, self.ruled, self.stops, pen)
        yield from markings.crossings(self.town)
        if self.detail.arrows:
            yield from markings.painted_arrows(self.town, self.arrows, pen)

    def _open_lines(self) -> Iterator[Border]:
        """Yields the borders that are not covered by a street."""
        tunnels = [part for part in self.stretches if part.level < 0]
        covered = LevelLookup(self._samples, tunnels)
        for line in self.borders.lines:
            yield from (line.part(run) for run in held(line, covered, wanted=False))

    def _layers(self, paint: list[Shape]) -> Iterator[Shape]:
        """Yields road markings on the ground, then level by level the bridges with their markings."""
        samples = self._samples
        tunnels = LevelLookup(samples, [part for part in self.stretches if part.level < 0])
        yield from self._held(paint, tunnels, wanted=False)
        for level in self.bridge_levels:
            parts = [part for part in self.stretches if part.level == level]
            yield from deck(self.town, parts, self.borders.lines, LevelLookup(samples, parts))
            yield from self._held(paint, LevelLookup(samples, parts, BEYOND_BRIDGE))
