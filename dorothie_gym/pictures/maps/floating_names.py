"""Street names drawn on top of a picture of a map: of all places for a name, those where it covers nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.shapes import longer, strokes
from dorothie_gym.pictures.text import set_along
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.maps.street_names import Label

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width and height [px]."""

SUPERSAMPLING: Final = 2
"""Pixels of a name along each side of a pixel of the picture, before it is scaled down."""

_NAME_GROUND: Final = (0.25, 1.04)  # extra length and height of the plain road under a name, relative to the font size
_HALO: Final = 0.09  # relative to the font size


class FloatingNames:
    """Names of the streets of a map, of which those that cover nothing are drawn.

    Attributes:
        labels: possible places of the names, best first.
        spacing: smallest distance between two labels with the same name [px].
    """

    def __init__(self, labels: Sequence[Label], spacing: float) -> None:
        self.labels, self.spacing = labels, spacing
        self._pieces: dict[int, tuple[pygame.Surface, Array]] = {}

    def draw(self, picture: pygame.Surface, obstacles: Iterable[Box], corner: Array) -> list[Box]:
        """Draws the names of a part of the map; returns boxes around them.

        Args:
            picture: picture of the part.
            obstacles: boxes in the picture that names leave free where another place is possible.
            corner: pixel of the map (2,) at the upper left corner of the picture.
        """
        shown = self.chosen(picture.get_size(), list(obstacles), corner)
        for number in shown:
            piece, at = self._piece(number)
            left, top = np.round(at - corner).astype(int).tolist()
            picture.blit(piece, (left, top), special_flags=pygame.BLEND_PREMULTIPLIED)
        return [box_around(self.labels[number].path - corner, self.labels[number].half) for number in shown]

    def chosen(self, size: tuple[int, int], obstacles: Sequence[Box], corner: Array) -> list[int]:
        """Returns the numbers of the labels to draw: each name that fits, on places that are wholly in the picture.

        A name whose places all cover an obstacle is drawn where it covers least.
        """
        boxes = {
            number: box_around(label.path - corner, label.half)
            for number, label in enumerate(self.labels)
            if _is_inside(label.path - corner, size, label.half)
        }
        covered = {number: sum(overlap(box, other) for other in obstacles) for number, box in boxes.items()}
        found: list[int] = []
        for number in sorted(boxes, key=lambda number: (covered[number], number)):
            label = self.labels[number]
            same = [self.labels[other] for other in found if self.labels[other].text == label.text]
            middle = label.path.mean(axis=0)
            apart = all(pn.hypot(*(other.path.mean(axis=0) - middle)) >= self.spacing for other in same)
            if apart and (covered[number] == 0.0 or not same):
                found.append(number)
        return sorted(found)

    def _piece(self, number: int) -> tuple[pygame.Surface, Array]:
        """Returns the picture of a label, with premultiplied colours, and its corner (2,) on the map [px]."""
        if number not in self._pieces:
            label = self.labels[number]
            left, top, width, height = box_around(label.path, 2.0 * label.size * len(label.rows))
            corner = np.floor(np.array([left, top]))
            size = int(np.ceil(width)) + 1, int(np.ceil(height)) + 1
            fine = pygame.Surface((size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING), pygame.SRCALPHA, 32)
            draw_name(fine, label, corner)
            self._pieces[number] = pygame.transform.smoothscale(fine.premul_alpha(), size), corner
        return self._pieces[number]


def draw_name(tile: pygame.Surface, label: Label, corner: Array) -> None:
    """Draws a label on a supersampled tile with its corner at a pixel (2,).

    Names are light on plain road, or dark with a halo beside the road.
    """
    size = label.size * SUPERSAMPLING
    for text, row in zip(label.rows, label.row_paths(), strict=True):
        line = (row - corner) * SUPERSAMPLING
        if label.beside:
            for turn in np.arange(0.0, 2.0 * np.pi, np.pi / 6.0):
                aside = _HALO * size * np.array([pn.cos(turn), pn.sin(turn)])
                set_along(tile, text, line + aside, size, palette.SHEET)
            set_along(tile, text, line, size, palette.INK)
            continue
        length, height = (share * size for share in _NAME_GROUND)
        for piece in strokes(longer(line, length), height, 12):
            pygame.draw.polygon(tile, palette.ROAD, piece.tolist())
        set_along(tile, text, line, size, palette.STREET_NAME)


def box_around(path: Array, border: float) -> Box:
    """Returns the box around a path (n, 2) [px] with a border [px]."""
    (left, top), (right, bottom) = (path.min(axis=0) - border).tolist(), (path.max(axis=0) + border).tolist()
    return left, top, right - left, bottom - top


def overlap(one: Box, other: Box) -> float:
    """Returns the common area of two boxes [px2]."""
    wide = min(one[0] + one[2], other[0] + other[2]) - max(one[0], other[0])
    high = min(one[1] + one[3], other[1] + other[3]) - max(one[1], other[1])
    return max(0.0, wide) * max(0.0, high)


def _is_inside(path: Array, size: tuple[int, int], border: float) -> bool:
    return bool((path >= border).all() and (path <= np.array(size) - border).all())
