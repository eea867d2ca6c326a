"""Ground under the scenery, and copies of a small mesh at many places."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.mesh import Mesh, new_mesh
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.maps.map_layers import MapLayers


class Heights(Hashable, Protocol):
    """Ground with heights."""

    def height_at(self, points: Array) -> Array:
        """Returns the heights (n,) [m] of the ground at points (n, 2) [m], NaN if there is none."""
        ...


_OTHER_LEVEL = 2.5  # [m] between a road and the ground above or below it


class FlatGround:
    """Ground of height 0."""

    def height_at(self, points: Array) -> Array:
        """Returns zeros (n,)."""
        return np.zeros(len(points))


def feet_on(ground: Heights, points: Array) -> Array:
    """Returns the heights (n,) [m] of the ground at points (n, 2) [m]; beyond its end the mean of the others."""
    heights = np.asarray(ground.height_at(points), dtype=np.float64)
    known = np.isfinite(heights)
    return np.where(known, heights, heights[known].mean() if known.any() else 0.0)


def stamped(
    template: Mesh,
    places: Array,
    headings: Array,
    scales: Array | None = None,
    tints: Array | None = None,
) -> Mesh:
    """Returns copies of a mesh, one after the other.

    Args:
        template: mesh around the origin, which looks along x.
        places: positions (n, 3) [m].
        headings: (n,) [rad].
        scales: (n,), 1 if omitted.
        tints: factors of the colours (n, 3), 1 if omitted.
    """
    count, size = len(places), template.size
    sizes = np.ones(count) if scales is None else np.asarray(scales, dtype=np.float64)
    cos, sin, zero, one = pn.cos(headings), pn.sin(headings), np.zeros(count), np.ones(count)
    turn = np.stack((cos, -sin, zero, sin, cos, zero, zero, zero, one), axis=-1).reshape(count, 3, 3)

    def turned(vectors: NDArray[np.float32]) -> Array:
        return np.asarray(np.einsum("nij,kj->nki", turn, vectors.reshape(-1, 3).astype(np.float64)))

    corners = turned(template.corners) * sizes[:, None, None] + np.asarray(places, dtype=np.float64)[:, None]
    axes = [np.empty((count, size, 4)), np.empty((count, size, 4))]
    for axis, given in zip(axes, (template.u_axes, template.v_axes), strict=True):
        axis[..., :3] = turned(np.ascontiguousarray(given[:, :3])) / sizes[:, None, None]
        axis[..., 3] = given[:, 3]
    factors = np.ones((count, 3)) if tints is None else np.asarray(tints, dtype=np.float64)
    colours = np.clip(np.rint(template.colours.astype(np.float64) * factors[:, None]), 0, 255)

    def repeated(column: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.tile(column, count)

    return new_mesh(
        corners.reshape(-1, 3, 3).astype(np.float32),
        turned(template.normals).reshape(-1, 3).astype(np.float32),
        axes[0].reshape(-1, 4).astype(np.float32),
        axes[1].reshape(-1, 4).astype(np.float32),
        colours.reshape(-1, 3).astype(np.uint8),
        *(repeated(column) for column in (template.textures, template.surfaces, template.classes)),
        repeated(template.instances),
    )


def foot_beside_road(layers: MapLayers, ground: Heights, at: tuple[float, float], road: float) -> float:
    """Returns the height of the ground, or on bridges and in tunnels that of the road beside [m]."""
    height = float(ground.height_at(np.array([at]))[0])
    raised = layers.raised.hold(np.array([(*at, road)]))[0]
    return road if raised or not math.isfinite(height) or abs(height - road) > _OTHER_LEVEL else height
