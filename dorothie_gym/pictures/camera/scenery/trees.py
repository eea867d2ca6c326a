"""Trees where the map draws them, with crowns as wide as on the map."""

from __future__ import annotations

import zlib
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, Surface, joined
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on, stamped
from dorothie_gym.pictures.maps.shapes import disc, ribbon
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.maps.map_layers import MapLayers

_KINDS = (palette.TREE, palette.COUNTRY_TREE, palette.MEDIAN_TREE)
_FORMS = 4
_WIDEST = 1  # ring of a crown that reaches its radius
_GREENS = ((76, 106, 46), (90, 114, 52), (64, 98, 48), (100, 118, 58))
_BARK = (104, 86, 68)


def tree_places(layers: MapLayers) -> Array:
    """Returns centres and radii of crowns (n, 3) [m] of the trees that a map shows, none of them on a lane."""
    shapes = layers.shapes
    trees = np.array([k for k, shape in enumerate(shapes) if shape.colour in _KINDS], dtype=np.int64)
    centres = np.array([shapes[k].points.mean(axis=0) for k in trees]).reshape(-1, 2)
    radii = [pn.hypot(*(shapes[k].points - centre).T).max() for k, centre in zip(trees, centres, strict=True)]
    painted = shapely.STRtree([shapely.Polygon(shape.points) for shape in shapes])
    tree, over = painted.query(shapely.points(centres), predicate="intersects")
    later = (over > trees[tree]) & ~np.isin(over, trees)
    lanes = shapely.STRtree([shapely.Polygon(ribbon(lane)).buffer(0.0) for lane in layers.town.lanes])
    on_lanes = lanes.query(shapely.points(centres), predicate="intersects")[0]
    shown = np.setdiff1d(np.arange(len(trees)), np.concatenate((tree[later], on_lanes)))
    return np.asarray(np.column_stack((centres, np.array(radii).reshape(-1)))[shown])


def build_trees(layers: MapLayers, ground: Heights) -> Mesh:
    """Returns the trees of a map."""
    places = tree_places(layers)
    rng = np.random.default_rng(zlib.crc32(b"trees of " + layers.town.name.encode()))
    headings, tones = rng.uniform(0.0, 2.0 * np.pi, len(places)), rng.uniform(0.88, 1.12, len(places))
    forms = rng.integers(0, _FORMS, len(places))
    heights = feet_on(ground, places[:, :2])
    parts = []
    for form in range(_FORMS):
        chosen = forms == form
        feet = np.column_stack((places[chosen, :2], heights[chosen]))
        tints = np.repeat(tones[chosen, None], 3, axis=1)
        parts.append(stamped(tree_form(form), feet, headings[chosen], places[chosen, 2], tints))
    return joined(parts)


def tree_form(form: int) -> Mesh:
    """Returns a tree whose crown has a radius of 1 m."""
    rng = np.random.default_rng(form)
    builder = MeshBuilder()
    colour = np.array(_GREENS[form], dtype=np.float64)
    builder.prism(
        disc((0.0, 0.0), 0.085, 4),
        -0.1,
        1.3,
        top=disc((0.0, 0.0), 0.05, 4),
        colour=_BARK,
        kind=ObjectClass.VEGETATION,
        texture=Texture.BARK,
        closed=(False, False),
    )
    add_clump(builder, (0.0, 0.0, 1.75), (1.0, 0.85), colour, rng, sides=7)
    for k in range(2):
        heading = 2.6 * k + form
        at = (0.42 * pn.cos(heading), 0.42 * pn.sin(heading), 2.25 + 0.2 * k)
        add_clump(builder, at, (0.56, 0.52), colour * (1.06 + 0.06 * k), rng, sides=5, open_below=True)
    return builder.build()


def add_clump(
    builder: MeshBuilder,
    centre: tuple[float, float, float],
    radii: tuple[float, float],
    colour: Array,
    rng: np.random.Generator,
    sides: int,
    *,
    open_below: bool = False,
) -> None:
    """Adds an uneven ball of leaves, darker below.

    Args:
        builder: receives the triangles.
        centre: (x, y, z) [m].
        radii: across and upwards [m].
        colour: (3,).
        rng: chooses the unevenness.
        sides: number of sides.
        open_below: whether the lower end is left out, because it is hidden.
    """
    wide, high = radii
    levels = (0.0, 0.36, 0.68, 1.0)
    turns = np.arange(sides) * (2.0 * np.pi / sides)
    rings = []
    for k, level in enumerate(levels):
        out = pn.sin(np.pi * level) * wide * (1.0 - 0.18 * rng.random(sides))
        if k == _WIDEST:
            out[0] = wide
        up = np.full(sides, pn.cos(np.pi * level) * high)
        rings.append(np.column_stack((out * pn.cos(turns + 0.3 * k), out * pn.sin(turns + 0.3 * k), up)) + centre)
    corner = np.arange(sides)
    after = (corner + 1) % sides
    steps = corner / sides * 4.0
    for k, (upper, lower) in enumerate(pairwise(rings[:-1] if open_below else rings)):
        shade = colour * (1.08, 0.95, 0.72)[k]
        corners = np.concatenate(
            (np.stack((lower, lower[after], upper[after]), axis=1), np.stack((lower, upper[after], upper), axis=1))
        )
        u = np.concatenate(
            (
                np.stack((steps, steps + 4.0 / sides, steps + 4.0 / sides), axis=1),
                np.stack((steps, steps + 4.0 / sides, steps), axis=1),
            )
        )
        v = np.concatenate((np.tile((k, k, k + 0.6), (sides, 1)), np.tile((k, k + 0.6, k + 0.6), (sides, 1))))
        builder.triangles(
            corners,
            coordinates=np.stack((u, v), axis=-1),
            colour=shade,
            kind=ObjectClass.VEGETATION,
            texture=Texture.LEAVES,
            surface=Surface.LEAF,
        )
