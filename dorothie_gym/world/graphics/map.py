"""The map of a town as a picture."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dorothie_gym.world.graphics import palette
from dorothie_gym.world.graphics.ground import town_bounds
from dorothie_gym.world.graphics.labels import Label, LabelPlacer
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.text import set_along, words
from dorothie_gym.world.town.model import Array, Town

SUPERSAMPLING = 2
_TILE = 1024  # [px]: what is painted at a time, so that large maps need little memory
_GROUND = 14.0  # [m] of country around the outermost roads
_BAR_LENGTHS = (10, 20, 50, 100, 200, 500, 1000, 2000)


class MapPainter:
    """Paints a town once; `surface()` hands out copies to draw on.

    Attributes:
        town: what is painted.
        size: width and height of the picture [px].
        scale: [px/m].
        origin: world position (2,) of the picture's upper left corner [m].
        street_names: names by street index.
        labels: the names as they were set.
    """

    def __init__(
        self,
        town: Town,
        *,
        size: tuple[int, int],
        street_names: Sequence[str] | None = None,
        margin: int | tuple[int, int, int, int] = 24,
        type_sizes: tuple[int, int] = (20, 11),
        label_spacing: float = 380.0,
        border: float | None = None,
    ) -> None:
        """Fits a town into a picture.

        Args:
            town: what to paint.
            size: width and height [px].
            street_names: names by street index; the town's own where absent.
            margin: pixels free of roads, all around or (left, top, right, bottom).
            type_sizes: largest and smallest type of street names [px].
            label_spacing: distance between two settings of one name [px].
            border: how far trees stand beyond the roads [m]; to the edge of the picture where absent.

        Raises:
            ValueError: `size` leaves no room inside `margin`, or there are too few names.
        """
        left, top, right, bottom = (margin,) * 4 if isinstance(margin, int) else margin
        room = np.array([size[0] - left - right, size[1] - top - bottom], dtype=float)
        if (room <= 0).any():
            raise ValueError(f"size: {size} leaves no room inside margin {margin}")
        names = [street.name for street in town.streets] if street_names is None else list(street_names)
        if len(names) < len(town.streets):
            raise ValueError(f"street_names: {len(names)} names for {len(town.streets)} streets of {town.name}")
        self.town, self.size, self.street_names = town, size, tuple(names)
        x0, y0, x1, y1 = town_bounds(town, _GROUND)
        extent = np.array([x1 - x0, y1 - y0])
        self.scale = float((room / extent).min())
        self.origin: Array = (
            np.array([x0, y0]) - (np.array([left, top]) + (room - extent * self.scale) / 2.0) / self.scale
        )
        border = float(max(size)) / self.scale / 3.0 if border is None else border
        plan = Plan(town, pen=0.8 / self.scale, border=border)
        placer = LabelPlacer(
            town=town,
            names=names[: len(town.streets)],
            scale=self.scale,
            origin=self.origin,
            frame=size,
            sizes=type_sizes,
            spacing=label_spacing,
        )
        self.labels: tuple[Label, ...] = tuple(placer.place(plan))
        self._surface = self._paint(plan)

    @classmethod
    def at_scale(cls, town: Town, scale: float, **options: Any) -> MapPainter:
        """A painter whose picture is as large as the town needs at a scale [px/m]; other options as in the class."""
        margin = options.setdefault("margin", 24)
        left, top, right, bottom = (margin,) * 4 if isinstance(margin, int) else margin
        x0, y0, x1, y1 = town_bounds(town, _GROUND)
        size = (round((x1 - x0) * scale) + left + right, round((y1 - y0) * scale) + top + bottom)
        return cls(town, size=size, border=_GROUND + min(left, top, right, bottom) / scale, **options)

    def surface(self) -> Any:
        """A copy of the base map, a `pygame.Surface`, to draw on."""
        return self._surface.copy()

    def window(self, centre: ArrayLike, size: tuple[int, int]) -> Any:
        """A part of the base map around a world position (2,), as a new surface of a size [px]."""
        import pygame

        view = pygame.Surface(size)
        view.fill(palette.COUNTRY)
        corner = np.round(self.to_pixel(centre) - np.array(size) / 2.0).astype(int)
        view.blit(self._surface, (0, 0), (int(corner[0]), int(corner[1]), *size))
        return view

    def to_pixel(self, xy: ArrayLike) -> NDArray[np.float64]:
        """World positions (..., 2) [m] as pixels (..., 2)."""
        return (np.asarray(xy, dtype=float) - self.origin) * self.scale

    def draw_scale_bar(self, surface: Any, corner: tuple[int, int], longest: int = 180) -> None:
        """A scale bar whose lower left corner is at a pixel, no longer than so many pixels; north is up."""
        draw_scale_bar(surface, self.scale, corner, longest)

    def _paint(self, plan: Plan) -> Any:
        import pygame

        picture = pygame.Surface(self.size)
        for left in range(0, self.size[0], _TILE):
            for top in range(0, self.size[1], _TILE):
                size = (min(_TILE, self.size[0] - left), min(_TILE, self.size[1] - top))
                picture.blit(self._paint_tile(plan, left, top, size), (left, top))
        return picture

    def _paint_tile(self, plan: Plan, left: int, top: int, size: tuple[int, int]) -> Any:
        import pygame

        factor = SUPERSAMPLING
        tile = pygame.Surface((size[0] * factor, size[1] * factor))
        tile.fill(palette.COUNTRY)
        corner = np.array([left, top], dtype=float)
        low = self.origin + corner / self.scale
        high = low + np.array(size) / self.scale
        for shape in plan.shapes:
            x0, y0, x1, y1 = shape.bounds
            if x1 < low[0] or y1 < low[1] or x0 > high[0] or y0 > high[1]:
                continue
            pygame.draw.polygon(tile, shape.colour, ((shape.points - low) * (self.scale * factor)).tolist())
        for label in self.labels:
            path = (label.path - corner) * factor
            set_along(
                tile,
                label.text,
                path,
                label.size * factor,
                palette.INK,
                halo=2 * factor,
                around=palette.ROAD,
            )
        return pygame.transform.smoothscale(tile, size)


def draw_scale_bar(surface: Any, scale: float, corner: tuple[int, int], longest: int) -> None:
    """A scale bar for a picture of `scale` [px/m], with its lower left corner at a pixel, and an arrow to the north."""
    import pygame

    metres = max((n for n in _BAR_LENGTHS if n * scale <= longest), default=_BAR_LENGTHS[0])
    length = round(metres * scale)
    x, y = corner
    text = words(f"{metres} m" if metres < 1000 else f"{metres // 1000} km", 13, palette.INK)
    frame = pygame.Rect(x, y - 34, length + 52, 34)
    back = pygame.Surface(frame.size, pygame.SRCALPHA, 32)
    pygame.draw.rect(back, (255, 255, 255, 215), back.get_rect(), border_radius=8)
    surface.blit(back, frame)
    for k in range(4):
        part = pygame.Rect(x + 12 + k * length // 4, y - 12, (k + 1) * length // 4 - k * length // 4, 4)
        pygame.draw.rect(surface, palette.INK if k % 2 == 0 else palette.PAPER, part)
    pygame.draw.rect(surface, palette.INK, (x + 12, y - 12, length, 4), 1)
    surface.blit(text, (x + 12, y - 31))
    tip = np.array([x + length + 32, y - 29])
    arrow = np.array([[0, 0], [6, 13], [0, 10], [-6, 13]])
    pygame.draw.polygon(surface, palette.INK, (tip + arrow).tolist())
    north = words("N", 11, palette.INK, True)
    surface.blit(north, north.get_rect(midtop=(int(tip[0]), y - 16)))


def town_picture(
    town: Town,
    path: str | os.PathLike[str],
    size: tuple[int, int] = (1600, 1200),
    street_names: Sequence[str] | None = None,
) -> MapPainter:
    """Writes a map one would hang up, as a PNG file: the town with a title line and a scale bar.

    Args:
        town: what to paint.
        path: where to write; the folder must exist.
        size: width and height [px].
        street_names: names by street index; the town's own where absent.

    Returns:
        The painter, which knows where everything is on the picture.

    Raises:
        FileNotFoundError: the folder of `path` does not exist.
        ValueError: the size is too small for a title and a map.
    """
    import pygame

    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{target}: the folder {target.parent} does not exist; make it first")
    painter = MapPainter(town, size=size, street_names=street_names, margin=(24, 92, 24, 30))
    surface = painter.surface()
    _draw_title(surface, town, size)
    painter.draw_scale_bar(surface, (24, size[1] - 22))
    pygame.image.save(surface, str(target), ".png")
    return painter


def _draw_title(surface: Any, town: Town, size: tuple[int, int]) -> None:
    import pygame

    pygame.draw.rect(surface, palette.PAPER, (0, 0, size[0], 72))
    pygame.draw.rect(surface, palette.PANEL_EDGE, (0, 72, size[0], 2))
    name = words(town.name[:1].upper() + town.name[1:], 32, palette.INK, True)
    surface.blit(name, (28, 36 - name.get_height() // 2))
    facts = (
        f"{town.kilometres:.1f} km of lanes",
        f"{len(town.lanes)} lanes",
        f"{len(town.junctions)} junctions",
        f"{len(town.streets)} streets",
    )
    line = words("   ·   ".join(facts), 16, palette.INK_SOFT)
    surface.blit(line, line.get_rect(midright=(size[0] - 28, 37)))
