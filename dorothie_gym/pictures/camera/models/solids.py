"""Builder of models from limbs, balls and hulls, whose parts are coloured afterwards by their slots."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh, MeshBuilder, Surface
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import ObjectClass

Rgb: TypeAlias = tuple[int, int, int]
Point: TypeAlias = Sequence[float] | Array

_SHADES = 200.0  # shades from 0 to 1.275 in the green channel of a model without colours


class Part(enum.IntEnum):
    """Parts of models that share a colour."""

    PAINT = 0
    TRIM = 1
    """Bumpers, mirrors, frames of bicycles' saddles."""
    GLASS = 2
    TYRE = 3
    RIM = 4
    HEAD_LAMP = 5
    BRAKE_LAMP = 6
    PLATE = 7
    SKIN = 8
    HAIR = 9
    TOP = 10
    TROUSERS = 11
    SHOES = 12
    EXTRA = 13
    """Bags, hats, helmets."""
    METAL = 14
    ORANGE = 15
    WHITE = 16


Palette: TypeAlias = Mapping[Part, Rgb]


class ModelBuilder:
    """Collects triangles of a model, all of one semantic class."""

    def __init__(self, kind: ObjectClass) -> None:
        self._kind = kind
        self._builder = MeshBuilder()
        # triangles that are turned to their visible side when the model is built
        self._triangles: dict[Surface, list[Array]] = {}
        self._insides: dict[Surface, list[Array]] = {}
        self._codes: dict[Surface, list[Array]] = {}

    def build(self) -> Mesh:
        """Returns the model without colours; `dressed` gives it some."""
        for surface, parts in self._triangles.items():
            corners = np.concatenate(parts)
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            away = corners.mean(axis=1) - np.concatenate(self._insides[surface])
            inwards = (across * away).sum(axis=1) < 0.0
            corners[inwards] = corners[inwards][:, [0, 2, 1]]
            codes = np.concatenate(self._codes[surface])
            self._builder.triangles(corners, colour=codes, kind=self._kind, surface=surface)
        self._triangles.clear()
        return self._builder.build()

    def panel(
        self,
        corners: ArrayLike,
        slot: Part,
        *,
        texture: int = PLAIN,
        repeats: tuple[float, float] = (1.0, 1.0),
        shade: float = 1.0,
        two_sided: bool = False,
    ) -> None:
        """Adds a quadrilateral (4, 3): lower left, upper left, upper right, lower right, seen from its visible side."""
        self._builder.quad(
            corners, colour=_code(slot, shade), kind=self._kind, texture=texture, repeats=repeats, two_sided=two_sided
        )

    def face(
        self, corners: ArrayLike, slot: Part, inside: Point, *, shade: float = 1.0, surface: Surface = Surface.NONE
    ) -> None:
        """Adds a flat convex polygon (n, 3) that is visible from the side away from a point inside the model."""
        points = np.asarray(corners, dtype=np.float64)
        fan = np.array([[0, k, k + 1] for k in range(1, len(points) - 1)])
        self.hull(points[fan], slot, inside, shade=shade, surface=surface)

    def hull(
        self, triangles: ArrayLike, slot: Part, inside: Point, *, shade: float = 1.0, surface: Surface = Surface.NONE
    ) -> None:
        """Adds triangles (n, 3, 3), each visible from the side that faces away from a point inside the model."""
        corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
        shape = len(corners), 3
        self._triangles.setdefault(surface, []).append(corners)
        self._insides.setdefault(surface, []).append(np.broadcast_to(np.asarray(inside, dtype=np.float64), shape))
        self._codes.setdefault(surface, []).append(np.broadcast_to(np.array(_code(slot, shade)), shape))

    def limb(
        self, start: Point, end: Point, radii: tuple[float, float], slot: Part, *, sides: int = 4, shade: float = 1.0,
        closed: bool = False, flat: float = 1.0,
    ) -> None:  # fmt: skip
        """Adds a cone between two points.

        Args:
            start: centre of one end [m].
            end: centre of the other end [m].
            radii: at both ends [m].
            slot: slot of its colour.
            sides: number of its sides.
            shade: brightness.
            closed: whether its ends are closed.
            flat: extent along x (forward), relative to that across, of an upright limb.
        """
        first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        dx, dy, dz = (last - first).tolist()
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        # two directions across it: one as close to the y axis as can be, for limbs along y to the x axis
        other = np.array([-dz, 0.0, dx] if abs(dy) < 0.9 else [0.0, dz, -dy])
        other /= math.sqrt(float(pn.dot(other, other)))
        ox, oy, oz = other.tolist()
        across = np.array([oy * dz - oz * dy, oz * dx - ox * dz, ox * dy - oy * dx])
        turns = _turns(sides) + math.pi / sides
        ring = pn.cos(turns)[:, None] * across + flat * pn.sin(turns)[:, None] * other
        rings = first + radii[0] * ring, last + radii[1] * ring
        self._tube(np.stack(rings), slot, (first + last) / 2.0, shade)
        if closed:
            for points in rings:
                self.face(points, slot, (first + last) / 2.0, shade=shade)

    def ball(
        self, centre: Point, radii: Sequence[float], slot: Part, *, sides: int = 6, rings: int = 2,
        part: tuple[float, float] = (0.0, 1.0), shade: float = 1.0,
    ) -> None:  # fmt: skip
        """Adds an ellipsoid, or its part between two heights, given as shares of the distance from top to bottom."""
        middle = np.asarray(centre, dtype=np.float64)
        heights = np.pi * np.linspace(*part, rings + 2)[:, None]
        turns = _turns(sides)
        points = np.stack(
            np.broadcast_arrays(pn.sin(heights) * pn.cos(turns), pn.sin(heights) * pn.sin(turns), pn.cos(heights)),
            axis=-1,
        )
        self._tube(middle + points * np.asarray(radii, dtype=np.float64), slot, middle, shade)

    def box(self, low: Point, high: Point, slot: Part, *, shade: float = 1.0, bottom: bool = False) -> None:
        """Adds an upright box between two corners."""
        (x0, y0, z0), (x1, y1, z1) = np.asarray(low).tolist(), np.asarray(high).tolist()
        ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        rings = np.stack([np.column_stack((ring, np.full(4, z))) for z in (z0, z1)])
        middle = (np.array([x0, y0, z0]) + np.array([x1, y1, z1])) / 2.0
        self._tube(rings, slot, middle, shade)
        self.face(rings[1], slot, middle, shade=shade)
        if bottom:
            self.face(rings[0], slot, middle, shade=shade)

    def _tube(self, rings: Array, slot: Part, inside: Array, shade: float) -> None:
        """Adds the surface between successive rings (n, sides, 3)."""
        after = rings[:, [*range(1, rings.shape[1]), 0]]
        parts = (rings[:-1], after[:-1], after[1:], rings[1:])
        quads = np.stack(parts, axis=2).reshape(-1, 4, 3)
        self.hull(quads[:, _QUAD].reshape(-1, 3, 3), slot, inside, shade=shade)


_QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def _turns(count: int) -> Array:
    return np.asarray(np.arange(count) * (2.0 * math.pi / count))


def dressed(model: Mesh, palette: Palette, glowing: frozenset[Part] = frozenset()) -> Mesh:
    """Returns a model with the colours of a palette; slots that glow give off their own light."""
    colours = np.zeros((len(Part), 3))
    for slot, colour in palette.items():
        colours[slot] = colour
    slots = model.colours[:, 0].astype(np.int64)
    shades = model.colours[:, 1].astype(np.float64) / _SHADES
    lit = np.isin(slots, [int(slot) for slot in sorted(glowing)])
    surfaces = model.surfaces | np.where(lit, np.uint8(Surface.EMISSIVE), np.uint8(0)).astype(np.uint8)
    tinted = np.clip(np.rint(colours[slots] * shades[:, None]), 0, 255).astype(np.uint8)
    return model._replace(colours=tinted, surfaces=surfaces)


def _code(slot: Part, shade: float) -> tuple[float, float, float]:
    return float(slot), shade * _SHADES, 0.0
