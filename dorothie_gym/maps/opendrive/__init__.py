"""Towns from OpenDRIVE files (ASAM OpenDRIVE 1.4, as CARLA's towns)."""

from dorothie_gym.maps.opendrive.compile import read_opendrive

__all__ = ["read_opendrive"]
