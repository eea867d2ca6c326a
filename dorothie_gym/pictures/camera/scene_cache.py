"""Cache of the scenes of towns: one archive for each town, in the folder `scenes` of the user's cache."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.cache import pack
from dorothie_gym.pictures.camera.array_cache import Arrays, columns, table_of, through_cache
from dorothie_gym.pictures.camera.cells import CellTable
from dorothie_gym.pictures.camera.ground.ground import Ground
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays
from dorothie_gym.pictures.camera.lighting import LampMap
from dorothie_gym.pictures.camera.mesh import Mesh
from dorothie_gym.pictures.camera.road_slopes import RoadSlopes
from dorothie_gym.pictures.camera.scenery.lenses import Lenses
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.camera.town_scene import TownScene
from dorothie_gym.tasks.landmark_designs import site_key

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

SCENES_KEPT = 16
"""Maximum number of entries; the oldest are removed beyond it. A scene takes 10 to 30 MB."""


@functools.lru_cache(maxsize=4)
def town_scene(town: Town) -> TownScene:
    """Returns the scene of a town, from memory or the user's cache, or built now.

    A cache that cannot be read or written is logged at level DEBUG and otherwise ignored.
    """

    def build() -> TownScene:
        from dorothie_gym.pictures.camera.scene_building import build_town_scene  # here: most scenes are read

        return build_town_scene(town)

    return through_cache(
        "scenes",
        pack(town, ""),
        SCENES_KEPT,
        build=build,
        pack=scene_arrays,
        unpack=lambda arrays: scene_of(arrays, town),
    )


def scene_arrays(scene: TownScene) -> Arrays:
    """Returns the arrays of a scene."""
    lots = [(lot.site, *lot.place, lot.heading, *lot.front, lot.length, lot.depth) for lot in scene.lots]
    return {
        "lots": np.array(lots, dtype=np.float64).reshape(-1, 8),
        **columns("mesh", scene.mesh),
        **columns("cells", scene.cells),
        **columns("ground", scene.ground.arrays),
        **columns("signals", scene.signals),
        **columns("lenses", scene.lenses),
        **columns("lamps", scene.lamps),
        **columns("slopes", scene.slopes),
    }


def scene_of(arrays: Arrays, town: Town) -> TownScene:
    """Returns the scene of a town from its arrays.

    Raises:
        KeyError, ValueError: the arrays are not a scene.
    """
    mesh = table_of(arrays, "mesh", Mesh)
    lots = tuple(
        Lot(int(site), (x, y), heading, (front_x, front_y), length, depth, site_key(town.name, int(site)))
        for site, x, y, heading, front_x, front_y, length, depth in arrays["lots"].tolist()
    )
    return TownScene(
        ground=Ground(mesh, table_of(arrays, "ground", GroundArrays)),
        mesh=mesh,
        cells=table_of(arrays, "cells", CellTable),
        signals=table_of(arrays, "signals", Mesh),
        lenses=table_of(arrays, "lenses", Lenses),
        lamps=table_of(arrays, "lamps", LampMap),
        slopes=table_of(arrays, "slopes", RoadSlopes),
        lots=lots,
        programmes=tuple(town.programmes),
    )
