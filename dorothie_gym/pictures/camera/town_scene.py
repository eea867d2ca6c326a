"""Scenes: objects of a town in every session, and the objects that a session adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from dorothie_gym.maps.town import LightProgramme
from dorothie_gym.pictures.camera.assets import camera_assets
from dorothie_gym.pictures.camera.atlas import STREET_NAMES, with_street_names
from dorothie_gym.pictures.camera.cells import CellTable
from dorothie_gym.pictures.camera.first_person_camera import CameraScene
from dorothie_gym.pictures.camera.ground.ground import Ground
from dorothie_gym.pictures.camera.lighting import LampMap
from dorothie_gym.pictures.camera.mesh import Mesh, joined
from dorothie_gym.pictures.camera.road_slopes import RoadSlopes
from dorothie_gym.pictures.camera.scenery.landmarks import build_landmarks
from dorothie_gym.pictures.camera.scenery.lenses import Lenses
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.storyboard import Landmark


@shared
@dataclass(frozen=True, kw_only=True, eq=False)
class TownScene:
    """Objects of a town in every session.

    Attributes:
        ground: lookups of heights, materials and colours of the ground.
        mesh: ground and scenery, sorted by cell.
        cells: cells of the mesh.
        signals: lights and signs; the lenses show another state in each session.
        lenses: triangles of `signals` that show the state of traffic lights.
        lamps: light of street lamps.
        slopes: slopes of the roads.
        lots: ground reserved for the landmarks of the sites, by their ids.
        programmes: programmes of the traffic lights.
    """

    ground: Ground
    mesh: Mesh
    cells: CellTable
    signals: Mesh
    lenses: Lenses
    lamps: LampMap
    slopes: RoadSlopes
    lots: tuple[Lot, ...]
    programmes: tuple[LightProgramme, ...]

    @property
    def nbytes(self) -> int:
        """Size of all arrays [bytes]."""
        parts = (self.mesh, self.cells, self.ground.arrays, self.signals, self.lenses, self.lamps, self.slopes)
        return sum(array.nbytes for part in parts for array in part)


@dataclass(frozen=True, eq=False)
class SessionScene:
    """Objects that a session adds to the scene of its town: street names and landmarks.

    Attributes:
        town: objects of every session.
        street_names: on the blades, by the indices of the streets; blades without a name are empty.
        landmarks: landmarks of the session.
    """

    town: TownScene
    street_names: Sequence[str] = field(default=())
    landmarks: Sequence[Landmark] = field(default=())

    @cached_property
    def camera_scene(self) -> CameraScene:
        """Data that a camera needs besides the overlay."""
        town, assets = self.town, camera_assets()
        blades = int(town.mesh.textures.max(initial=0)) + 1 - STREET_NAMES
        names = [*self.street_names, *[""] * (blades - len(self.street_names))]
        return CameraScene(
            town=town.mesh,
            cells=town.cells,
            ground=town.ground.arrays,
            lamps=town.lamps,
            bank=assets.bank,
            atlas=with_street_names(assets.atlas, names),
            noise=assets.noise,
        )

    @cached_property
    def overlay(self) -> Mesh:
        """Signals and landmarks, the rows of signals first."""
        town = self.town
        return joined([town.signals, build_landmarks(self.landmarks, town.lots, town.ground)])
