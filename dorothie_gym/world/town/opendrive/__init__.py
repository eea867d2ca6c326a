"""Towns from OpenDRIVE files (ASAM OpenDRIVE 1.4, as CARLA's towns)."""

from dorothie_gym.world.town.opendrive.compile import read_opendrive

__all__ = ["read_opendrive"]
