"""The lane graph of a town as arrays."""

from __future__ import annotations

import numpy as np

from dorothie_gym.evaluation.features.columns import TownGraph
from dorothie_gym.world.town import NO_JUNCTION, Town
from dorothie_gym.world.town.graph import FEATURES


def town_graph(name: str, town: Town | None) -> TownGraph:
    """Returns the graph of a town; without lanes where it is not known."""
    if town is None:
        empty = np.empty(0, dtype=np.int32)
        return TownGraph(
            name=name, lanes=np.empty((0, len(FEATURES)), dtype=np.float32), road=empty, junction=empty, street=empty,
            edges=empty.reshape(2, 0), edge_types=empty, member_start=np.zeros(1, dtype=np.int32), members=empty,
        )  # fmt: skip
    graph = town.to_graph()
    members = [graph.members(street) for street in range(graph.num_streets)]
    inside = graph.junction_ids != NO_JUNCTION
    junction = np.zeros(len(graph), dtype=np.int32)
    junction[inside] = 1 + np.unique(graph.junction_ids[inside], return_inverse=True)[1]
    return TownGraph(
        name=name,
        lanes=graph.features.astype(np.float32),
        road=np.unique(graph.road_ids, return_inverse=True)[1].astype(np.int32),
        junction=junction,
        street=graph.street.astype(np.int32),
        edges=np.ascontiguousarray(graph.edges.T, dtype=np.int32),
        edge_types=graph.edge_types.astype(np.int32),
        member_start=np.concatenate(([0], np.cumsum([len(lanes) for lanes in members]))).astype(np.int32),
        members=np.concatenate([*members, np.empty(0)]).astype(np.int32),
    )
