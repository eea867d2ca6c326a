"""Things that the Ad-Wizard puts on the road."""

from __future__ import annotations

from highway_env.vehicle.objects import Obstacle

from dorothie_gym.ontology import PropKind
from dorothie_gym.world.network.road import TownRoad

PROP_KINDS = tuple(PropKind)
"""Kinds in the order of their numbers in observations and actions."""


class Prop(Obstacle):
    """A prop on a lane: it stands across it, so that its width blocks the lane.

    Attributes:
        kind: what it is.
        key: tells it apart from other bodies; a prop that is moved keeps it.
        lane_id: lane it stands on; `station` [m] how far along it.
        height: of the road under it [m].
    """

    def __init__(self, road: TownRoad, kind: PropKind, lane_id: int, station: float, *, key: int) -> None:
        lane = road.network.town.lanes[lane_id]
        self.kind, self.lane_id, self.station, self.key = kind, lane_id, station, key
        self.height = lane.height_at(station)
        self.LENGTH, self.WIDTH = kind.length, kind.width
        super().__init__(road, lane.position(station), lane.heading_at(station))
        self.lane_index = road.network.index_of(lane_id)
        self.lane = road.network.get_lane(self.lane_index)
