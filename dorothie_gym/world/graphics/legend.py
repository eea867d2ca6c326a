"""What the symbols of a map mean: those alone that occur on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.arrows import one_way_arrow, one_way_places, turn_arrow
from dorothie_gym.world.graphics.borders import BorderKind
from dorothie_gym.world.graphics.icons import pin_icon, sign_icon, stamp
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.text import words
from dorothie_gym.world.town.model import Array, LinkType, SignalKind, Town

_ROWS = 4
_FINE = 4
_HIGH = 1.9  # units: a swatch
_WIDE = 3.2
_METRES = 8.0  # that a swatch is wide, for what is drawn in metres


class Legend:
    """The legend of a map.

    Attributes:
        entries: what it explains, in order: the words and the function that draws the swatch.
    """

    def __init__(self, town: Town, plan: Plan, unit: float) -> None:
        """Finds out what there is to explain; `unit` is what the sheet is measured in [px]."""
        self._unit = unit
        kinds = {border.kind for border in plan.borders.lines}
        signals = {post.kind for post in plan.posts}
        size = round(_HIGH * unit)
        known: list[tuple[bool, str, Callable[[], Any]]] = [
            (bool(town.sites), "landmark site", lambda: pin_icon("7", round(0.72 * unit), 90)),
            (SignalKind.TRAFFIC_LIGHT in signals, "traffic light", lambda: sign_icon(SignalKind.TRAFFIC_LIGHT, size)),
            (SignalKind.STOP in signals, "stop", lambda: sign_icon(SignalKind.STOP, size)),
            (SignalKind.YIELD in signals, "yield", lambda: sign_icon(SignalKind.YIELD, size)),
            (bool(town.crosswalks), "crosswalk", self._crosswalk),
            (bool(plan.arrows) and plan.detail.arrows, "ways on from a lane", self._arrow),
            (any(True for _ in one_way_places(town, plan.borders)), "one-way street", self._one_way),
            (BorderKind.LANE in kinds, "lanes of one direction", self._lanes),
            (BorderKind.CENTRE in kinds, "between directions", self._centre),
            (BorderKind.MEDIAN in kinds, "planted median", self._median),
            (any(part.level > 0 for part in plan.stretches), "bridge", self._bridge),
            (any(part.level < 0 for part in plan.stretches), "tunnel", self._tunnel),
        ]
        self.entries = tuple((text, draw) for wanted, text, draw in known if wanted)

    def draw(self, surface: Any, left: float, right: float, top: float) -> None:
        """Draws it in columns between two sides [px]; what does not fit is left out."""
        unit = self._unit
        size = max(9, round(1.15 * unit))
        x = left
        for column in range(0, len(self.entries), _ROWS):
            rows = [(words(text, size, palette.INK), draw) for text, draw in self.entries[column : column + _ROWS]]
            wide = max(text.get_width() for text, _ in rows) + (_WIDE + 0.9) * unit
            if x + wide > right:
                return
            for k, (text, draw) in enumerate(rows):
                middle = top + (0.6 + 2.2 * k) * unit
                stamp(surface, draw(), np.array([x + _WIDE * unit / 2.0, middle]))
                surface.blit(text, (round(x + (_WIDE + 0.9) * unit), round(middle - text.get_height() / 2.0)))
            x += wide + 2.2 * unit

    def _swatch(self, *shapes: tuple[Array, palette.Colour], ground: palette.Colour = palette.ROAD) -> Any:
        """A little piece of map, `_METRES` wide, whose middle is (0, 0)."""
        import pygame

        wide, high = round(_WIDE * self._unit), round(_HIGH * self._unit)
        fine = pygame.Surface((wide * _FINE, high * _FINE), pygame.SRCALPHA, 32)
        pygame.draw.rect(fine, ground, fine.get_rect(), border_radius=round(0.25 * self._unit * _FINE))
        scale = wide * _FINE / _METRES
        for points, colour in shapes:
            pygame.draw.polygon(fine, colour, (points * scale + np.array(fine.get_size()) / 2.0).tolist())
        return pygame.transform.smoothscale(fine.premul_alpha(), (wide, high))

    def _crosswalk(self) -> Any:
        bars = [_box(x, x + 0.7, -1.7, 1.7) for x in np.arange(-3.3, 3.0, 1.35)]
        return self._swatch(*((bar, palette.ZEBRA) for bar in bars))

    def _arrow(self) -> Any:
        outlines = turn_arrow((LinkType.STRAIGHT, LinkType.LEFT), np.array([-3.1, 0.5]), 0.0)
        return self._swatch(*((outline, palette.ARROW) for outline in outlines))

    def _one_way(self) -> Any:
        return self._swatch(*((outline, palette.ONE_WAY) for outline in one_way_arrow(np.zeros(2), 0.0, 6.4)))

    def _lanes(self) -> Any:
        return self._swatch(*((_box(x, x + 2.0, -0.15, 0.15), palette.LANE_LINE) for x in (-3.4, -1.0, 1.4)))

    def _centre(self) -> Any:
        return self._swatch(*((_box(-4.0, 4.0, y - 0.13, y + 0.13), palette.CENTRE_LINE) for y in (-0.35, 0.35)))

    def _median(self) -> Any:
        return self._swatch(
            (_box(-4.0, 4.0, -1.1, 1.1), palette.MEDIAN_KERB), (_box(-4.0, 4.0, -0.8, 0.8), palette.MEDIAN)
        )

    def _bridge(self) -> Any:
        sides = [(y, y + 0.35) for y in (-1.85, 1.5)]
        return self._swatch(*((_box(-4.0, 4.0, a, b), palette.BRIDGE_EDGE) for a, b in sides))

    def _tunnel(self) -> Any:
        dashes = [_box(x, x + 1.1, y, y + 0.35) for x in np.arange(-3.8, 3.5, 1.8) for y in (-1.85, 1.5)]
        return self._swatch(*((dash, palette.TUNNEL_EDGE) for dash in dashes), ground=palette.TUNNEL)


def _box(x0: float, x1: float, y0: float, y1: float) -> Array:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
