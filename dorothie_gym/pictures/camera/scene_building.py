"""Building of the scenes of towns. A scene from the cache needs none of the imports of this module."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.pictures.camera.cells import sorted_by_cell
from dorothie_gym.pictures.camera.ground.ground import Ground
from dorothie_gym.pictures.camera.ground.town_ground import build_ground
from dorothie_gym.pictures.camera.lighting import lamp_map
from dorothie_gym.pictures.camera.mesh import joined
from dorothie_gym.pictures.camera.road_slopes import road_slopes
from dorothie_gym.pictures.camera.scenery.town_scenery import build_scenery
from dorothie_gym.pictures.camera.town_scene import TownScene
from dorothie_gym.pictures.maps.map_layers import MapLayers

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town


def build_town_scene(town: Town) -> TownScene:
    """Returns the scene of a town; it depends on the town and its name only."""
    layers = MapLayers(town)
    ground = build_ground(layers)
    scenery = build_scenery(layers, ground)
    mesh, cells, _ = sorted_by_cell(joined([ground.mesh, scenery.mesh]))
    return TownScene(
        ground=Ground(mesh, ground.arrays),
        mesh=mesh,
        cells=cells,
        signals=scenery.signals,
        lenses=scenery.lenses,
        lamps=lamp_map(scenery.lights.astype(np.float64)),
        slopes=road_slopes(town),
        lots=scenery.lots,
        programmes=tuple(town.programmes),
    )
