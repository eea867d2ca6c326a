"""All scenery of a town that every session shares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.mesh import Mesh, joined
from dorothie_gym.pictures.camera.scenery.buildings import build_buildings, plan_buildings
from dorothie_gym.pictures.camera.scenery.clearance import Clearance
from dorothie_gym.pictures.camera.scenery.guard_rails import build_rails, rail_lines
from dorothie_gym.pictures.camera.scenery.lawns import build_lawns
from dorothie_gym.pictures.camera.scenery.lenses import Lenses
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.camera.scenery.signals import build_signals
from dorothie_gym.pictures.camera.scenery.street_lamps import build_lamps, lamp_places, lot_lamps
from dorothie_gym.pictures.camera.scenery.street_signs import build_blades, build_boards, plan_blades, plan_boards
from dorothie_gym.pictures.camera.scenery.trees import build_trees

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.scenery.placing import Heights
    from dorothie_gym.pictures.maps.map_layers import MapLayers


@dataclass(frozen=True, eq=False)
class Scenery:
    """Scenery of a town.

    Attributes:
        mesh: triangles that look the same in every session.
        signals: lights and signs; the lenses show another state in each session.
        lenses: triangles of `signals` that show the state of traffic lights.
        lights: positions of the lights of street lamps (n, 3) float32 [m].
        lots: ground reserved for the landmarks of the sites.
    """

    mesh: Mesh
    signals: Mesh
    lenses: Lenses
    lights: NDArray[np.float32]
    lots: tuple[Lot, ...]


def build_scenery(layers: MapLayers, ground: Heights) -> Scenery:
    """Returns the scenery of a town; it depends on the town and its name only.

    Args:
        layers: layers of its map.
        ground: heights of the ground.
    """
    clearance = Clearance(layers)
    signals, lenses = build_signals(layers, clearance, ground)
    lamp_feet, blades = lamp_places(layers, clearance), plan_blades(layers, clearance)
    lamps, lights = build_lamps(np.concatenate((lamp_feet, lot_lamps(clearance))), ground)
    lit = np.array([post.at for post in layers.posts]).reshape(-1, 2)
    corners = np.array([blade.at for blade in blades]).reshape(-1, 2)
    boards = plan_boards(layers, clearance, np.concatenate((lit, lamp_feet[:, :2], corners)))
    buildings = plan_buildings(layers, clearance)
    parts = [
        lamps,
        build_blades(layers, blades, ground),
        build_boards(layers, boards, ground),
        build_rails(rail_lines(layers, clearance, ground)),
        build_trees(layers, ground),
        build_buildings(buildings, ground),
        build_lawns(layers, clearance, buildings, ground),
    ]
    return Scenery(joined(parts), signals, lenses, lights.astype(np.float32), clearance.lots)
