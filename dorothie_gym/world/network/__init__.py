"""The town's lanes as highway-env roads: lanes, network, the index for the closest lane, and the road on it."""

from dorothie_gym.world.network.lane import PolylineLane
from dorothie_gym.world.network.network import LaneIndex, Route, TownNetwork
from dorothie_gym.world.network.road import TownRoad

__all__ = ["LaneIndex", "PolylineLane", "Route", "TownNetwork", "TownRoad"]
