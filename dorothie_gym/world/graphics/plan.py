"""What there is to paint on a map, in world coordinates and in the order of painting."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dorothie_gym.world.graphics import markings
from dorothie_gym.world.graphics.arrows import lane_arrows
from dorothie_gym.world.graphics.borders import find_borders
from dorothie_gym.world.graphics.furniture import posts
from dorothie_gym.world.graphics.ground import landscape
from dorothie_gym.world.graphics.levels import Places, stretches
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
        shapes: polygons, in the order of painting.
        borders: what lies beside the lanes; names are set along it.
        stretches: parts of lanes that are bridges or tunnels.
        raised: the places on these.
        arrows: the turn arrows before junctions.
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
        samples = Samples.of(town)
        self.borders = borders = find_borders(town, samples)
        self.stretches = stretches(town, samples)
        self.raised = Places(samples, self.stretches)
        self.stops = markings.stop_stations(town)
        self.ruled = markings.ruled_lanes(town)
        shared = {*borders.right_neighbour, *borders.right_neighbour.values()}
        self.arrows = tuple(lane_arrows(town, shared, self.stops))
        self.posts = posts(town, borders, self.stops)
        paint = list(self._paint())
        self.shapes = [*landscape(town, border), *streets(town, samples, borders.lines, self.stretches)]
        self.shapes += self._layers(samples, paint)

    def _paint(self) -> Iterator[Shape]:
        pen = self.detail.pen
        yield from markings.lines(self.borders.lines, self.detail)
        yield from markings.approaches(self.town, self.ruled, self.stops, pen)
        yield from markings.crossings(self.town)
        if self.detail.arrows:
            yield from markings.painted_arrows(self.town, self.arrows, pen)

    def _layers(self, samples: Samples, paint: list[Shape]) -> Iterator[Shape]:
        """Paint on the ground, then bridge after bridge with the paint that lies on it."""
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
