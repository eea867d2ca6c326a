"""Guard rails beside roads from which the ground falls away: on embankments and at elevated roads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder
from dorothie_gym.pictures.maps.borders import BorderKind
from dorothie_gym.pictures.maps.shapes import disc, polyline_stations
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.scenery.clearance import Clearance
    from dorothie_gym.pictures.camera.scenery.placing import Heights
    from dorothie_gym.pictures.maps.map_layers import MapLayers

DROP = 2.0
"""Height by which the ground beside a road must be lower [m]."""

BESIDE = 16.0
"""Distance from the edge of the road within which it must be [m]."""

_STEP = 4.0  # [m] between posts
_ASIDE = (0.5, 1.0, 1.6, 2.2, 2.8, 3.4, 4.2, 5.0)  # [m] from the edge of the road; the first place off pavements
_LOW, _HIGH = 0.42, 0.76  # [m] edges of the beam
_METAL, _POST = (168, 172, 174), (120, 124, 126)


def rail_lines(layers: MapLayers, clearance: Clearance, ground: Heights) -> list[Array]:
    """Returns the lines (n, 3) [m] of guard rails at the height of their road, the road on their left or right."""
    found: list[Array] = []
    for line in layers.borders.lines:
        if line.kind is not BorderKind.EDGE or not line.outer:
            continue
        stations = polyline_stations(line.points)
        count = int(stations[-1] // _STEP) + 1
        if count < 2:
            continue
        at = np.linspace(0.0, stations[-1], count)
        x, y, z, heading = (
            np.interp(at, stations, column) for column in (*line.points.T[:3], np.asarray(line.heading))
        )
        edge = np.column_stack((x, y, z))
        out = line.sign * np.stack((-pn.sin(heading), pn.cos(heading)), axis=-1)
        high = _is_high(ground, edge, out) & ~layers.raised.hold(edge)
        if not high.any():
            continue
        places, free = _beside(clearance, edge, out)
        rail = high.copy()
        rail[1:] |= high[:-1]
        rail[:-1] |= high[1:]  # it begins before the ground falls away
        rail &= free & ~layers.raised.hold(edge)
        bounds = np.flatnonzero(np.diff(np.concatenate(([0], rail.astype(np.int64), [0]))))
        for first, last in bounds.reshape(-1, 2).tolist():
            if last - first > 1:
                found.append(np.column_stack((places[first:last], z[first:last])))
    return found


def _is_high(ground: Heights, edge: Array, out: Array) -> NDArray[np.bool_]:
    """Returns beside which places on the edge of a road (n, 3) [m] the ground is much lower."""
    reach = np.arange(2.0, BESIDE + 0.1, 2.0)
    places = edge[:, None, :2] + reach[:, None] * out[:, None]
    heights = np.asarray(ground.height_at(places.reshape(-1, 2)), dtype=np.float64).reshape(len(edge), -1)
    lowest = np.where(np.isfinite(heights), heights, np.inf).min(axis=1)
    return np.asarray(lowest < edge[:, 2] - DROP)


def _beside(clearance: Clearance, edge: Array, out: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns places (n, 2) [m] behind the pavements beside a road, and which of them are free of other roads."""
    places, free = edge[:, :2] + _ASIDE[0] * out, np.zeros(len(edge), dtype=bool)
    for aside in _ASIDE:
        spots = edge[:, :2] + aside * out
        good = ~free & ~clearance.on_footway(spots) & ~clearance.on_asphalt(spots, 0.2)
        places[good] = spots[good]
        free |= good
    return places, free


def build_rails(lines: list[Array]) -> Mesh:
    """Returns guard rails: beams that are seen from both sides, on posts."""
    builder = MeshBuilder()
    for line in lines:
        low, high = line + (0.0, 0.0, _LOW), line + (0.0, 0.0, _HIGH)
        for k in range(len(line) - 1):
            builder.quad(
                [low[k], high[k], high[k + 1], low[k + 1]], colour=_METAL, kind=ObjectClass.GUARD_RAIL, two_sided=True
            )
        for x, y, z in line.tolist():
            builder.prism(disc((x, y), 0.07, 4), z - 1.0, z + _HIGH, colour=_POST, kind=ObjectClass.GUARD_RAIL)
    return builder.build()
