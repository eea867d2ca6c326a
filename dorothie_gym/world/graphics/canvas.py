"""A transparent layer over a map, on which things are drawn in metres and come out with smooth edges."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dorothie_gym.world.graphics.map import SUPERSAMPLING
from dorothie_gym.world.graphics.palette import Colour
from dorothie_gym.world.graphics.shapes import stroke
from dorothie_gym.world.graphics.text import words
from dorothie_gym.world.town.model import Array

_STROKE = 6  # segments


class Canvas:
    """Draws on a layer twice as fine as the picture below it.

    The layer holds premultiplied colours: what is half covered after scaling down is then mixed rightly.

    Attributes:
        size: of the picture below [px].
        scale: of that picture [px/m].
        origin: world position (2,) of its upper left corner [m].
    """

    def __init__(self, size: tuple[int, int]) -> None:
        import pygame

        self.size = size
        self.scale = 1.0
        self.origin: Array = np.zeros(2)
        self._layer = pygame.Surface((size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING), pygame.SRCALPHA, 32)

    def begin(self, scale: float, origin: Array) -> None:
        """Clears the layer and sets where it lies."""
        self.scale, self.origin = scale, origin
        self._layer.fill((0, 0, 0, 0))

    def blit_on(self, picture: Any) -> None:
        """Puts what was drawn onto the picture."""
        import pygame

        smooth = pygame.transform.smoothscale(self._layer, self.size)
        picture.blit(smooth, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)

    def pixel(self, xy: ArrayLike) -> Array:
        """World positions (..., 2) [m] as pixels (..., 2) of the picture."""
        return np.asarray((np.asarray(xy, dtype=float) - self.origin) * self.scale)

    def shows(self, xy: ArrayLike, border: float = 0.0) -> bool:
        """Whether a world position (2,) is on the picture, not closer to its edge than so many pixels."""
        x, y = self.pixel(xy)
        return bool(border <= x <= self.size[0] - border and border <= y <= self.size[1] - border)

    def polygon(self, points: ArrayLike, colour: Colour, alpha: float = 1.0) -> None:
        """Fills a polygon (n, 2) [m]."""
        self.pixel_polygon(self.pixel(points), colour, alpha)

    def pixel_polygon(self, points: Array, colour: Colour, alpha: float = 1.0) -> None:
        """Fills a polygon (n, 2) [px]; a translucent one hides what was drawn on this layer before it."""
        import pygame

        ink = (*(round(c * alpha) for c in colour), round(255 * alpha))
        pygame.draw.polygon(self._layer, ink, (points * SUPERSAMPLING).tolist())

    def dot(self, centre: Array, radius: float, colour: Colour) -> None:
        """Fills a circle, all in pixels."""
        import pygame

        pygame.draw.circle(self._layer, colour, (centre * SUPERSAMPLING).tolist(), radius * SUPERSAMPLING)

    def ring(self, centre: Array, radius: float, width: float, colour: Colour) -> None:
        """Draws a circle, all in pixels."""
        import pygame

        pen = max(1, round(width * SUPERSAMPLING))
        pygame.draw.circle(self._layer, colour, (centre * SUPERSAMPLING).tolist(), radius * SUPERSAMPLING, pen)

    def line(self, points: Array, width: float, colour: Colour) -> None:
        """Draws a line (n, 2) with round joints, all in pixels."""
        import pygame

        fine = points * SUPERSAMPLING
        pen = width * SUPERSAMPLING - 1.0  # a polygon's border adds half a pixel on either side
        # In short strokes: a polygon that crosses itself, as a way around a block does, would have holes.
        for k in range(0, len(fine) - 1, _STROKE):
            piece = fine[k : k + _STROKE + 1]
            pygame.draw.polygon(self._layer, colour, stroke(piece, pen).tolist())
            for end in (piece[0], piece[-1]):
                pygame.draw.circle(self._layer, colour, end.tolist(), pen / 2.0)

    def box(self, rect: tuple[float, float, float, float], colour: Colour, border: Colour, radius: float = 5) -> None:
        """Draws a filled rounded box (x, y, width, height) with a thin border, all in pixels."""
        import pygame

        fine = pygame.Rect([round(v * SUPERSAMPLING) for v in rect])
        pygame.draw.rect(self._layer, colour, fine, border_radius=round(radius * SUPERSAMPLING))
        pygame.draw.rect(self._layer, border, fine, SUPERSAMPLING, border_radius=round(radius * SUPERSAMPLING))

    def text(self, text: str, left: float, middle: float, size: int, colour: Colour, bold: bool = False) -> None:
        """Writes a line of text, all in pixels."""
        import pygame

        piece = words(text, size * SUPERSAMPLING, colour, bold)
        corner = (round(left * SUPERSAMPLING), round(middle * SUPERSAMPLING - piece.get_height() / 2))
        self._layer.blit(piece.premul_alpha(), corner, special_flags=pygame.BLEND_PREMULTIPLIED)
