"""What there is to paint on a map, in world coordinates and in the order of painting."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from dorothie_gym.world.graphics import markings
from dorothie_gym.world.graphics.arrows import lane_arrows
from dorothie_gym.world.graphics.borders import Border, find_borders
from dorothie_gym.world.graphics.furniture import posts
from dorothie_gym.world.graphics.ground import landscape
from dorothie_gym.world.graphics.levels import Places, stretches
from dorothie_gym.world.graphics.medians import held
from dorothie_gym.world.graphics.pockets import find_pockets, pocket_paint
from dorothie_gym.world.graphics.samples import Samples
from dorothie_gym.world.graphics.shapes import Shape
from dorothie_gym.world.graphics.surfaces import deck, streets
from dorothie_gym.world.town.model import Town

_FURTHER = 6.0  # [m] of paint beyond a bridge, as much as its asphalt goes on


class Plan:
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
        self.detail = markings.Detail.at(scale)
        self._border = border
        self._samples = samples = Samples.of(town)
        self.borders = borders = find_borders(town, samples)
        self.stretches = stretches(town, samples)
        self.raised = Places(samples, self.stretches)
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
        covered = Places(self._samples, tunnels)
        for line in self.borders.lines:
            yield from (line.part(run) for run in held(line, covered, wanted=False))

    def _layers(self, paint: list[Shape]) -> Iterator[Shape]:
        """Paint on the ground, then bridge after bridge with the paint that lies on it."""
        samples = self._samples
        if not paint:
            places = np.zeros((0, 3))
        else:
            places = np.array([[*shape.points.mean(axis=0), shape.height] for shape in paint])
        hidden = Places(samples, [part for part in self.stretches if part.level < 0]).hold(places)
        yield from (shape for shape, under in zip(paint, hidden.tolist(), strict=True) if not under)
        for level in sorted({part.level for part in self.stretches if part.level > 0}):
            parts = [part for part in self.stretches if part.level == level]
            yield from deck(self.town, parts, self.borders.lines, Places(samples, parts))
            above = Places(samples, parts, _FURTHER).hold(places)
            yield from (shape for shape, over in zip(paint, above.tolist(), strict=True) if over)
