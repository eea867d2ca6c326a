"""Triangles with colours, textures and semantic classes, and a builder of meshes from boxes, prisms and panels.

A triangle (a, b, c) is visible from the side that the vector (b - a) x (c - a) points to. The world's y axis points
south, so that its corners appear clockwise on the map when it is seen from above.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.ontology.slots import ObjectClass

PLAIN = 0
"""Index of the texture without a pattern."""

PADDING = 8
"""Columns of `Mesh.components` after the last triangle, so that vectors of the processor may end there."""

TOWN = 0
"""Instance of triangles that belong to no body."""

_FLAT = 1e-9  # [m2]; smaller triangles are left out


class Surface(enum.IntFlag):
    """Kinds of surfaces, which are shaded differently."""

    NONE = 0
    GROUND = 1
    """Colour and class come from the map at the place; the texture is the index of the sheet of ground."""
    EMISSIVE = 2
    """Gives off its own colour: lamps, lit signs."""
    GLASS = 4
    """Reflects the sky."""
    LEAF = 8
    """Lets light through: crowns of trees."""


@by_reference
@shared
class Mesh(NamedTuple):
    """Triangles.

    Attributes:
        corners: (n, 3, 3) float32 positions of the corners [m].
        normals: (n, 3) float32 unit vectors that point to the visible side.
        u_axes: (n, 4) float32: u = axis[:3] . (position - first corner) + axis[3], in repeats of the texture.
        v_axes: (n, 4) float32, of the other texture coordinate.
        colours: (n, 3) uint8; the texture is multiplied with it.
        textures: (n,) int16 index in the atlas, for ground the index of its sheet.
        surfaces: (n,) uint8 `Surface`.
        classes: (n,) uint8 semantic class, `ObjectClass`.
        instances: (n,) int32 key of the body, `TOWN` for none.
        components: (12, n + PADDING) float32 corners and normals again, one row for each component, which the
            projection reads: neighbours in memory become vectors of the processor.
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]
    u_axes: NDArray[np.float32]
    v_axes: NDArray[np.float32]
    colours: NDArray[np.uint8]
    textures: NDArray[np.int16]
    surfaces: NDArray[np.uint8]
    classes: NDArray[np.uint8]
    instances: NDArray[np.int32]
    components: NDArray[np.float32]

    @property
    def size(self) -> int:
        """Number of triangles."""
        return len(self.corners)

    def part(self, rows: slice | NDArray[np.generic]) -> Mesh:
        """Returns some of the triangles."""
        return new_mesh(*(np.ascontiguousarray(column[rows]) for column in self[:-1]))


def new_mesh(*columns: NDArray[Any]) -> Mesh:
    """Returns a mesh of all columns of `Mesh` but its components."""
    corners, normals, *others = columns
    count = len(corners)
    components = np.zeros((12, count + PADDING), np.float32)
    components[:9, :count], components[9:, :count] = corners.reshape(count, 9).T, normals.T
    return Mesh._make((corners, normals, *others, components))


def empty_mesh(count: int = 0) -> Mesh:
    """Returns a mesh of `count` triangles without extent."""
    return new_mesh(
        np.zeros((count, 3, 3), np.float32),
        np.zeros((count, 3), np.float32),
        np.zeros((count, 4), np.float32),
        np.zeros((count, 4), np.float32),
        np.zeros((count, 3), np.uint8),
        np.zeros(count, np.int16),
        np.zeros(count, np.uint8),
        np.zeros(count, np.uint8),
        np.zeros(count, np.int32),
    )


def joined(meshes: Iterable[Mesh]) -> Mesh:
    """Returns a mesh with the triangles of several, in their order."""
    parts = [empty_mesh(), *meshes]
    return new_mesh(*(np.concatenate(columns) for columns in zip(*(part[:-1] for part in parts), strict=True)))


class MeshBuilder:
    """Collects triangles of a mesh.

    Colours are RGB in 0..255; fractions are rounded, larger and smaller values clipped. Headings are those of bodies
    [rad], clockwise from above; a box of a heading h has its length along (cos h, sin h).
    """

    def __init__(self) -> None:
        self._corners: list[Array] = []
        self._coordinates: list[Array] = []
        self._colours: list[Array] = []
        self._numbers: list[NDArray[np.int64]] = []  # texture, surface, class, instance

    def __len__(self) -> int:
        return sum(map(len, self._corners))

    def triangles(
        self,
        corners: ArrayLike,
        *,
        colour: ArrayLike,
        kind: ObjectClass,
        coordinates: ArrayLike | None = None,
        texture: int = PLAIN,
        surface: Surface = Surface.NONE,
        instance: int = TOWN,
    ) -> None:
        """Adds triangles.

        Args:
            corners: (n, 3, 3) [m].
            colour: (3,) of all, or (n, 3).
            kind: semantic class.
            coordinates: (n, 3, 2) texture coordinates u, v of the corners; v points up. Zeros if omitted.
            texture: index in the atlas.
            surface: kind of surface.
            instance: key of the body.
        """
        points = np.asarray(corners, dtype=np.float64).reshape(-1, 3, 3)
        count = len(points)
        given = np.zeros((count, 3, 2)) if coordinates is None else np.asarray(coordinates, dtype=np.float64)
        self._corners.append(points)
        self._coordinates.append(np.broadcast_to(given, (count, 3, 2)))
        self._colours.append(np.broadcast_to(np.asarray(colour, dtype=np.float64), (count, 3)))
        row = np.array([texture, int(surface), kind.value, instance], dtype=np.int64)
        self._numbers.append(np.broadcast_to(row, (count, 4)))

    def quad(
        self,
        corners: ArrayLike,
        *,
        colour: ArrayLike,
        kind: ObjectClass,
        repeats: tuple[float, float] = (1.0, 1.0),
        texture: int = PLAIN,
        surface: Surface = Surface.NONE,
        instance: int = TOWN,
        two_sided: bool = False,
    ) -> None:
        """Adds a flat convex quadrilateral.

        Args:
            corners: (4, 3) [m]: lower left, upper left, upper right, lower right, seen from its visible side.
            colour: (3,).
            kind: semantic class.
            repeats: repeats of the texture to the right and upwards.
            texture: index in the atlas.
            surface: kind of surface.
            instance: key of the body.
            two_sided: whether the back shows the same picture, readable as well.
        """
        points = np.asarray(corners, dtype=np.float64)
        u, v = repeats
        places = np.array([[0.0, 0.0], [0.0, v], [u, v], [u, 0.0]])
        faces = [points, points[[3, 2, 1, 0]]] if two_sided else [points]
        for face in faces:
            self.triangles(
                face[_QUAD],
                colour=colour,
                kind=kind,
                coordinates=places[_QUAD],
                texture=texture,
                surface=surface,
                instance=instance,
            )

    def panel(
        self,
        centre: Sequence[float],
        heading: float,
        width: float,
        height: float,
        *,
        colour: ArrayLike,
        kind: ObjectClass,
        texture: int = PLAIN,
        surface: Surface = Surface.NONE,
        instance: int = TOWN,
        two_sided: bool = False,
    ) -> None:
        """Adds an upright rectangle with one repeat of a texture, to be read by a viewer who looks along a heading."""
        right = np.array([-pm.sin(heading), pm.cos(heading), 0.0]) * (width / 2.0)
        up, middle = np.array([0.0, 0.0, height / 2.0]), np.asarray(centre, dtype=np.float64)
        corners = [middle - right - up, middle - right + up, middle + right + up, middle + right - up]
        self.quad(
            corners, colour=colour, kind=kind, texture=texture, surface=surface, instance=instance, two_sided=two_sided
        )

    def prism(
        self,
        base: ArrayLike,
        low: float,
        high: float,
        *,
        colour: ArrayLike,
        kind: ObjectClass,
        top: ArrayLike | None = None,
        top_colour: ArrayLike | None = None,
        repeat: tuple[float, float] | None = None,
        texture: int = PLAIN,
        surface: Surface = Surface.NONE,
        instance: int = TOWN,
        closed: tuple[bool, bool] = (False, True),
    ) -> None:
        """Adds the walls of a convex prism or frustum, and its top and bottom.

        Args:
            base: (n, 2) corners [m], clockwise on the map (as x east and y south give it, from x towards y).
            low: height of its base [m].
            high: height of its top [m].
            colour: (3,) of the walls.
            kind: semantic class.
            top: (n, 2) corners of the top, those of the base if omitted.
            top_colour: (3,) of top and bottom, that of the walls if omitted.
            repeat: width and height of one repeat of the texture [m]; whole repeats per wall. One if omitted.
            texture: index in the atlas, for the walls.
            surface: kind of surface.
            instance: key of the body.
            closed: whether there are a bottom and a top.
        """
        foot = np.asarray(base, dtype=np.float64)
        head = foot if top is None else np.asarray(top, dtype=np.float64)
        count, cap = len(foot), colour if top_colour is None else top_colour
        lower = np.column_stack((foot, np.full(count, low)))
        upper = np.column_stack((head, np.full(count, high)))
        for k in range(count):
            after = (k + 1) % count
            width = float(pn.hypot(*(foot[after] - foot[k])))
            repeats = (1.0, 1.0) if repeat is None else (_whole(width, repeat[0]), _whole(high - low, repeat[1]))
            # seen from outside, the wall runs from the later corner on the left to the earlier one on the right
            self.quad(
                [lower[after], upper[after], upper[k], lower[k]],
                colour=colour,
                kind=kind,
                repeats=repeats,
                texture=texture,
                surface=surface,
                instance=instance,
            )
        fan = np.array([[0, k, k + 1] for k in range(1, count - 1)])
        if closed[1]:
            self.triangles(upper[fan], colour=cap, kind=kind, surface=surface, instance=instance)
        if closed[0]:
            self.triangles(lower[fan[:, ::-1]], colour=cap, kind=kind, surface=surface, instance=instance)

    def box(
        self,
        centre: Sequence[float],
        heading: float,
        length: float,
        width: float,
        low: float,
        high: float,
        *,
        colour: ArrayLike,
        kind: ObjectClass,
        top_colour: ArrayLike | None = None,
        repeat: tuple[float, float] | None = None,
        texture: int = PLAIN,
        surface: Surface = Surface.NONE,
        instance: int = TOWN,
        closed: tuple[bool, bool] = (False, True),
    ) -> None:
        """Adds an upright box around a centre (2,) [m]; other arguments as in `prism`."""
        self.prism(
            oriented(_UNIT * (length, width), centre, heading),
            low,
            high,
            colour=colour,
            kind=kind,
            top_colour=top_colour,
            repeat=repeat,
            texture=texture,
            surface=surface,
            instance=instance,
            closed=closed,
        )

    def add(self, mesh: Mesh) -> None:
        """Adds the triangles of a mesh."""
        first = mesh.corners[:, :1].astype(np.float64)
        offsets = mesh.corners.astype(np.float64) - first
        coordinates = np.stack(
            [
                np.einsum("nkj,nj->nk", offsets, axes[:, :3].astype(np.float64)) + axes[:, 3:].astype(np.float64)
                for axes in (mesh.u_axes, mesh.v_axes)
            ],
            axis=-1,
        )
        self._corners.append(mesh.corners.astype(np.float64))
        self._coordinates.append(coordinates)
        self._colours.append(mesh.colours.astype(np.float64))
        columns = (mesh.textures, mesh.surfaces, mesh.classes, mesh.instances)
        self._numbers.append(np.stack([column.astype(np.int64) for column in columns], axis=-1))

    def build(self) -> Mesh:
        """Returns the mesh; triangles without extent are left out."""
        if not self._corners:
            return empty_mesh()
        corners = np.concatenate(self._corners)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice = np.linalg.norm(across, axis=1)
        keep = twice > 2.0 * _FLAT
        corners, normals = corners[keep], across[keep] / twice[keep, None]
        coordinates = np.concatenate(self._coordinates)[keep]
        numbers = np.concatenate(self._numbers)[keep]
        colours = np.clip(np.rint(np.concatenate(self._colours)[keep]), 0, 255)
        u, v = (_axes(corners, normals, coordinates[..., k]) for k in (0, 1))
        return new_mesh(
            corners.astype(np.float32), normals.astype(np.float32), u.astype(np.float32), v.astype(np.float32),
            colours.astype(np.uint8), numbers[:, 0].astype(np.int16), numbers[:, 1].astype(np.uint8),
            numbers[:, 2].astype(np.uint8), numbers[:, 3].astype(np.int32),
        )  # fmt: skip


_QUAD = np.array([[0, 1, 2], [0, 2, 3]])
_UNIT = np.array([[0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]])


def oriented(points: ArrayLike, centre: Sequence[float] | Array, heading: float) -> Array:
    """Returns world positions (n, 2) [m] of points (forward, right) (n, 2) [m] relative to a pose."""
    local = np.asarray(points, dtype=np.float64)
    c, s = pm.cos(heading), pm.sin(heading)
    turned = np.stack((local[:, 0] * c - local[:, 1] * s, local[:, 0] * s + local[:, 1] * c), axis=-1)
    return np.asarray(centre, dtype=np.float64)[:2] + turned


def _whole(length: float, repeat: float) -> float:
    return max(1.0, float(round(length / repeat)))


def _axes(corners: Array, normals: Array, values: Array) -> Array:
    """Returns (n, 4): the gradients in the planes of triangles, and the values at first corners, of values (n, 3)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    along, across = (values[:, k, None] - values[:, :1] for k in (1, 2))
    volume = (np.cross(first, second) * normals).sum(axis=1, keepdims=True)
    gradient = (along * np.cross(second, normals) + across * np.cross(normals, first)) / volume  # Cramer's rule
    return np.column_stack((gradient, values[:, 0]))
