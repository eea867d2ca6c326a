"""Ground of a town: mesh, lookup of materials and colours, and the height at a place."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from dorothie_gym.pictures.camera.ground.lookup import GROUND_SHEET, GroundArrays
from dorothie_gym.pictures.camera.mesh import Mesh, Surface

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

_FEW = 1 << 16
"""Maximum number of pairs of a place and a triangle that are compared without a search tree."""

_EDGE = 1e-9
"""Share of a triangle by which a place may be outside: by rounding, a place on a common edge could be in neither."""


@dataclass(frozen=True, eq=False)
class Ground:
    """Ground of a town.

    Attributes:
        mesh: surfaces of all sheets (`Surface.GROUND`, the texture is the sheet), kerbs, walls, bridges and tunnels.
        arrays: lookup of materials and colours.
    """

    mesh: Mesh
    arrays: GroundArrays
    _trees: dict[int, shapely.STRtree] = field(default_factory=dict, init=False, repr=False)

    def height_at(self, points: ArrayLike, sheet: int = GROUND_SHEET) -> Array:
        """Returns the height of a sheet (n,) at positions (n, 2) [m]; on pavements that of their kerbs.

        NaN where the sheet has no surface: beyond the horizon, or beside a bridge.
        """
        places = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        corners = self._triangles.get(sheet)
        heights = np.full(len(places), -np.inf)
        if corners is not None and len(places):
            at, found = self._pairs(places, corners, sheet)
            a, b, c = (corners[found, k] for k in range(3))
            ab, ac, ap = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2], places[at] - a[:, :2]
            with np.errstate(divide="ignore", invalid="ignore"):  # upright triangles
                area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
                u = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / area
                v = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / area
                inside = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE)
                height = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
            np.maximum.at(heights, at[inside], height[inside])
        return np.where(np.isfinite(heights), heights, np.nan)

    def _pairs(self, places: Array, corners: Array, sheet: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Returns the pairs of a place and a triangle whose box it lies in, by their rows."""
        tree = self._trees.get(sheet)
        if tree is None:
            low, high = places.min(axis=0), places.max(axis=0)
            reached = (corners[..., :2] >= low).any(axis=1) & (corners[..., :2] <= high).any(axis=1)
            near = np.flatnonzero(reached.all(axis=1))
            if len(near) * len(places) <= _FEW:
                least, most = corners[near, :, :2].min(axis=1), corners[near, :, :2].max(axis=1)
                at, row = ((least <= places[:, None]) & (places[:, None] <= most)).all(axis=2).nonzero()
                return at, near[row]
            tree = self._trees[sheet] = shapely.STRtree(np.asarray(shapely.polygons(corners[..., :2])))
        at, found = tree.query(shapely.points(places))
        return at, found

    @cached_property
    def _triangles(self) -> dict[int, Array]:
        """Corners (n, 3, 3) of the triangles of each sheet [m]."""
        ground = self.mesh.surfaces & int(Surface.GROUND) != 0
        return {
            sheet: self.mesh.corners[ground & (self.mesh.textures == sheet)].astype(np.float64)
            for sheet in np.unique(self.mesh.textures[ground]).tolist()
        }
