"""Lenses of traffic lights: the triangles that show their state, and the colours of these."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.halos import Halos, no_halos
from dorothie_gym.sim.state.codes import Colour

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.mesh import Mesh

LENS_ON: dict[Colour, tuple[int, int, int]] = {
    Colour.GREEN: (70, 255, 130),
    Colour.YELLOW: (255, 196, 40),
    Colour.RED: (255, 52, 40),
}
LENS_OFF: dict[Colour, tuple[int, int, int]] = {
    Colour.GREEN: (10, 38, 22),
    Colour.YELLOW: (46, 34, 10),
    Colour.RED: (48, 10, 8),
}
"""Colours of the lenses of traffic lights that are on and off."""


class Lenses(NamedTuple):
    """Triangles of a mesh that show the state of traffic lights.

    Attributes:
        ranges: (n, 2) first triangle of each lens and the one after its last.
        signals: (n,) id of the signal in the town.
        colours: (n,) `Colour` that it shows.
    """

    ranges: NDArray[np.int32]
    signals: NDArray[np.int32]
    colours: NDArray[np.int32]


def lens_rows(lenses: Lenses, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Returns the triangles of the given lenses."""
    parts = [np.arange(first, last) for first, last in lenses.ranges[chosen].tolist()]
    return np.concatenate([np.zeros(0, np.int64), *parts]).astype(np.int64)


def lit_lenses(lenses: Lenses, mesh: Mesh) -> Halos:
    """Returns the lenses of a mesh for their halos, all of them off."""
    halos = no_halos(len(lenses.signals))
    for k, (first, last) in enumerate(lenses.ranges.tolist()):
        corners = mesh.corners[first:last].reshape(-1, 3).astype(np.float64)
        low, high = corners.min(axis=0), corners.max(axis=0)
        halos.centres[k] = (low + high) / 2.0
        halos.radii[k] = (high[2] - low[2]) / 2.0
        halos.looks[k] = mesh.normals[first]
        halos.colours[k] = LENS_ON[Colour(int(lenses.colours[k]))]
    return halos
