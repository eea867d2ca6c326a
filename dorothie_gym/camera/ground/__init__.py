"""Ground of the camera: materials under every point, and a mesh of the surface with kerbs, bridges and tunnels."""

from dorothie_gym.camera.ground.lookup import GroundArrays
from dorothie_gym.camera.ground.town_ground import Ground, build_ground

__all__ = ["Ground", "GroundArrays", "build_ground"]
