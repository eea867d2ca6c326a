"""What there is to paint on a map, in world coordinates and in the order of painting."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.maps.town import Town
from dorothie_gym.rendering import markings
from dorothie_gym.rendering.borders import Border, Borders, find_borders
from dorothie_gym.rendering.ground import landscape
from dorothie_gym.rendering.levels import LevelLookup, stretches
from dorothie_gym.rendering.markings import lane_arrows
from dorothie_gym.rendering.medians import find_pockets, held, pocket_paint
from dorothie_gym.rendering.shapes import Shape, TownSamples
from dorothie_gym.rendering.surfaces import deck, streets

_ASIDE = 1.5  # [m] from the edge of the lane
SHOWN = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)
"""Kinds of signals that are drawn."""


@dataclass(frozen=True)
class Post:
    """A light or sign on the map.

    Attributes:
        kind: what it is.
        at: where it is drawn (x, y) [m].
        lanes: the lanes that it rules.
    """

    kind: SignalKind
    at: tuple[float, float]
    lanes: tuple[int, ...]


def posts(town: Town, borders: Borders, stops: Mapping[int, float]) -> tuple[Post, ...]:
    """The lights and signs of a town, one for every approach and kind.

    A map may put a light on the far side of its junction, or several on one approach; a reader looks for one at the
    stop line. A light for inner lanes alone stands on their left. One that rules no lane stands where the map says.
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
        beside = borders.right_neighbour.get(number)
        if beside in own:
            continue
        lane, sign = town.lanes[number], 1.0
        if beside is not None:
            # The outermost lanes have a light of their own.
            lane, sign = town.lanes[_leftmost(borders, own, number)], -1.0
        station = stops.get(lane.id, lane.length)
        x, y = lane.position(station, sign * (lane.width_at(station) / 2.0 + _ASIDE)).tolist()
        yield Post(signal.kind, (round(x, 2), round(y, 2)), signal.lanes)


def _leftmost(borders: Borders, lanes: frozenset[int], lane: int) -> int:
    left = {right: k for k, right in borders.right_neighbour.items()}
    seen = {lane}
    while (beside := left.get(lane, -1)) in lanes and beside not in seen:
        seen.add(beside)
        lane = beside
    return lane


# --- What there is to paint on a map, in world coordinates and in the order of painting ------------------------------

_FURTHER = 6.0  # [m] of paint beyond a bridge, as much as its asphalt goes on


class MapLayers:
    """Everything on the map but its words and signs.

    Attributes:
        town: what is painted.
        detail: what is worth drawing.
        borders: what lies beside the lanes; names are set along it.
        stretches: parts of lanes that are bridges or tunnels.
        raised: the places on these.
        arrows: the turn arrows before junctions.
        pockets: the beginnings of turn lanes.
        ruled: by lane, what a driver must heed at its end.
        stops: by lane, where its stop line lies or would lie [m].
        posts: the lights and signs.
    """

    def __init__(self, town: Town, *, scale: float = 8.0, border: float = 6.0) -> None:
        """Works out a town.

        Args:
            town: what to paint.
            scale: of the picture [px/m]; details too small for it are left out.
            border: how far the country reaches beyond the streets [m].
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
        shared = {*borders.right_neighbour, *borders.right_neighbour.values()}
        self.arrows = tuple(lane_arrows(town, shared, self.stops))
        self.pockets = find_pockets(town, borders)
        self.posts = posts(town, borders, self.stops)

    @cached_property
    def shapes(self) -> list[Shape]:
        """Polygons, in the order of painting."""
        ground = streets(self.town, self._samples, self.borders.lines, self.stretches, self.pockets)
        return [*landscape(self.town, self._border), *ground, *self._layers(list(self._paint()))]

    def _paint(self) -> Iterator[Shape]:
        pen = self.detail.pen
        yield from markings.lines(self._open_lines(), self.detail)
        yield from pocket_paint(self.town, self.pockets, pen, self.detail.fine)
        yield from markings.approaches(self.town, self.ruled, self.stops, pen)
        yield from markings.crossings(self.town)
        if self.detail.arrows:
            yield from markings.painted_arrows(self.town, self.arrows, pen)

    def _open_lines(self) -> Iterator[Border]:
        """The lines beside lanes where no street covers them."""
        tunnels = [part for part in self.stretches if part.level < 0]
        covered = LevelLookup(self._samples, tunnels)
        for line in self.borders.lines:
            yield from (line.part(run) for run in held(line, covered, wanted=False))

    def _layers(self, paint: list[Shape]) -> Iterator[Shape]:
        """Paint on the ground, then bridge after bridge with the paint that lies on it."""
        samples = self._samples
        if not paint:
            places = np.zeros((0, 3))
        else:
            places = np.array([[*shape.points.mean(axis=0), shape.height] for shape in paint])
        hidden = LevelLookup(samples, [part for part in self.stretches if part.level < 0]).hold(places)
        yield from (shape for shape, under in zip(paint, hidden.tolist(), strict=True) if not under)
        for level in sorted({part.level for part in self.stretches if part.level > 0}):
            parts = [part for part in self.stretches if part.level == level]
            yield from deck(self.town, parts, self.borders.lines, LevelLookup(samples, parts))
            above = LevelLookup(samples, parts, _FURTHER).hold(places)
            yield from (shape for shape, over in zip(paint, above.tolist(), strict=True) if over)
