"""Lane graphs of several towns as one graph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import torch
from torch import Tensor, nn

from dorothie_gym.baselines.point_tensors import tensor
from dorothie_gym.maps.lane_graph import FEATURES

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.columns import TownGraph

POSITION_UNIT: Final = 100.0
"""Unit of places in a model [m]: towns are some hundred metres wide."""

ANGLE_UNIT: Final = 180.0
"""Unit of angles in a model [degrees]."""

_LENGTH_UNIT: Final = 50.0
_LANE_ID_UNIT: Final = 4.0


class Towns(nn.Module):
    """Lane graphs of several towns, concatenated (L lanes, E edges, s streets, all towns together).

    They are not part of a model's weights: a model can be used in towns that it was not trained in.

    Attributes:
        lanes: (L, 14) columns as in `FEATURES`, each about 1.
        road, junction: (L,) numbers within the town.
        street: (L,) street within the town, -1 for none.
        town: (L,) town of each lane.
        edges: (2, E) from and to.
        edge_types: (E,).
        lane_start, street_start, street_count: (towns,) first lane, first street and number of streets of each town.
        members, member_street: (m,) a lane of a street, and the street.
    """

    lanes: Tensor
    road: Tensor
    junction: Tensor
    street: Tensor
    town: Tensor
    edges: Tensor
    edge_types: Tensor
    lane_start: Tensor
    street_start: Tensor
    street_count: Tensor
    members: Tensor
    member_street: Tensor

    def __init__(self, graphs: Sequence[TownGraph]):
        super().__init__()
        lanes = [len(graph.lanes) for graph in graphs]
        streets = [len(graph.member_start) - 1 for graph in graphs]
        first_lane, first_street = np.cumsum([0, *lanes]), np.cumsum([0, *streets])
        self.count = len(graphs)
        self.streets = int(first_street[-1])
        parts = {
            "lanes": [graph.lanes / _scale() for graph in graphs],
            "road": [graph.road for graph in graphs],
            "junction": [graph.junction for graph in graphs],
            "street": [graph.street for graph in graphs],
            "town": [np.full(count, town) for town, count in enumerate(lanes)],
            "edges": [(graph.edges + first).T for graph, first in zip(graphs, first_lane, strict=False)],
            "edge_types": [graph.edge_types for graph in graphs],
            "members": [graph.members + first for graph, first in zip(graphs, first_lane, strict=False)],
            "member_street": [
                np.repeat(np.arange(count), np.diff(graph.member_start)) + first
                for graph, count, first in zip(graphs, streets, first_street, strict=False)
            ],
        }
        values = {name: tensor(np.concatenate(arrays)) for name, arrays in parts.items()}
        values["lanes"] = values["lanes"].float()
        values["edges"] = values["edges"].T.contiguous()
        values["lane_start"], values["street_start"] = tensor(first_lane[:-1]), tensor(first_street[:-1])
        values["street_count"] = tensor(np.array(streets))
        for name, value in values.items():
            self.register_buffer(name, value, persistent=False)

    def lane_rows(self, town: Tensor, lane: Tensor) -> Tensor:
        """Returns the rows of lanes of the towns (...), -1 where a lane is not known.

        Args:
            town: (B,) town of each point.
            lane: (B, ...) lane of its town, -1 unknown.
        """
        first = self.lane_start[town].view(-1, *(1,) * (lane.dim() - 1))
        return torch.where(lane < 0, lane, first + lane)


def _scale() -> np.ndarray:
    """Returns the divisors of the columns of lanes (14,)."""
    units = {"length": _LENGTH_UNIT, "lane_id": _LANE_ID_UNIT}
    angles = ("pitch", "yaw", "roll")
    return np.array([units.get(name, ANGLE_UNIT if name.endswith(angles) else POSITION_UNIT) for name in FEATURES])
