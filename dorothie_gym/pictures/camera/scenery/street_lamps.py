"""Street lamps beside the roads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, Surface
from dorothie_gym.pictures.camera.scenery.clearance import Clearance, free_of
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on, stamped
from dorothie_gym.pictures.maps.borders import BorderKind
from dorothie_gym.pictures.maps.shapes import disc, polyline_stations
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.maps.map_layers import MapLayers

LIGHT_HEIGHT = 6.3
"""Height of the light of a street lamp [m]."""

_ARM = 1.6  # [m] from the pole to the light, over the road
_ASIDE = 0.7  # [m] from the edge of the road
_SPACING, _FIRST = 30.0, 14.0  # [m] along the road
_APART = 9.0  # [m] between lamps on different edges, and from the posts of signs
_LOT_SPOTS = ((-0.4, 1.5), (0.6, 1.6), (1.6, 1.6), (3.0, 1.6), (0.6, 0.8))  # [m] behind the front, beside the lot
_METAL = (88, 92, 94)


def lamp_places(layers: MapLayers, clearance: Clearance) -> Array:
    """Returns feet and headings (n, 3) of street lamps [m, rad]; they look over their road."""
    rows: list[tuple[float, float, float]] = []
    posts = np.array([post.at for post in layers.posts]).reshape(-1, 2)
    kept = np.zeros((0, 2))
    for line in layers.borders.lines:
        if line.kind is not BorderKind.EDGE or not line.outer:
            continue
        stations = polyline_stations(line.points)
        at = np.arange(_FIRST, stations[-1] - 5.0, _SPACING)
        if not len(at):
            continue
        x, y, z, heading = (
            np.interp(at, stations, column) for column in (*line.points.T[:3], np.asarray(line.heading))
        )
        out = line.sign * np.stack((-pn.sin(heading), pn.cos(heading)), axis=-1)
        feet = np.stack((x, y), axis=-1) + _ASIDE * out
        free = free_of(np.asarray(shapely.buffer(shapely.points(feet), 0.2), dtype=np.object_), clearance.lanes)
        free &= ~layers.raised.hold(np.column_stack((x, y, z)))
        free[free] = ~clearance.on_asphalt(feet[free], 0.2)  # a lay-by has its lamps before and behind it
        for foot, way in zip(feet[free], (-out)[free], strict=True):
            others = np.concatenate((posts, kept))
            if not len(others) or pn.hypot(*(others - foot).T).min() > _APART:
                kept = np.concatenate((kept, foot[None]))
                rows.append((float(foot[0]), float(foot[1]), pm.atan2(way[1], way[0])))
    return np.array(rows).reshape(-1, 3)


def lot_lamps(clearance: Clearance) -> Array:
    """Returns feet and headings (n, 3) of the lamps of lots [m, rad]: on both sides of the front, where there is room.

    All lots have them, whether a session has a landmark there or not.
    """
    rows: list[tuple[float, float, float]] = []
    for lot in clearance.lots:
        for side in (-1.0, 1.0):
            for deep, beyond in _LOT_SPOTS:
                x, y = lot.at(deep, side * (lot.length / 2.0 + beyond))
                if clearance.has_room(x, y, 0.2) and not clearance.on_footway(np.array([(x, y)]))[0]:
                    front = lot.at(0.0, 0.0)
                    rows.append((x, y, pm.atan2(front[1] - y, front[0] - x)))
                    break
    return np.array(rows).reshape(-1, 3)


def build_lamps(places: Array, ground: Heights) -> tuple[Mesh, Array]:
    """Returns street lamps, and the positions of their lights (n, 3) [m]."""
    heights = feet_on(ground, places[:, :2])
    mesh = stamped(_lamp(), np.column_stack((places[:, :2], heights)), places[:, 2])
    over = _ARM * np.stack((pn.cos(places[:, 2]), pn.sin(places[:, 2])), axis=-1)
    return mesh, np.column_stack((places[:, :2] + over, heights + LIGHT_HEIGHT))


def _lamp() -> Mesh:
    """Returns a lamp whose arm points along x."""
    builder, kind = MeshBuilder(), ObjectClass.POLE
    top = LIGHT_HEIGHT + 0.16
    builder.prism(
        disc((0.0, 0.0), 0.09, 5),
        -0.1,
        top,
        top=disc((0.0, 0.0), 0.055, 5),
        colour=_METAL,
        kind=kind,
        closed=(False, False),
    )
    builder.box((_ARM / 2.0, 0.0), 0.0, _ARM, 0.09, top - 0.12, top, colour=_METAL, kind=kind, closed=(True, True))
    builder.box((_ARM, 0.0), 0.0, 0.62, 0.26, LIGHT_HEIGHT, top - 0.04, colour=_METAL, kind=kind)
    x, half = (_ARM - 0.29, _ARM + 0.29), 0.11
    z = LIGHT_HEIGHT
    lens = [(x[0], -half, z), (x[0], half, z), (x[1], half, z), (x[1], -half, z)]
    builder.quad(lens, colour=(255, 238, 205), kind=kind, surface=Surface.EMISSIVE)
    return builder.build()
