"""A town in figures."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.world.town.model import LaneLink, SignalKind, Town


def describe(town: Town) -> dict[str, Any]:
    """What a town has, in numbers and names that go into JSON.

    Returns:
        name: of the town;
        lanes, links: counts, connectors included, lane changes excluded from the links;
        components: sizes of the strongly connected components of lanes by links alone, largest first;
        components_with_lane_changes: the same when lane changes count;
        kilometres: of all lanes, to 10 m;
        junctions: count;
        streets: their names;
        signals: count of traffic lights;
        crosswalks, sites: counts.
    """
    onward = [link for link in town.links if not link.type.is_lane_change]
    return {
        "name": town.name,
        "lanes": len(town.lanes),
        "links": len(onward),
        "components": _component_sizes(len(town.lanes), onward),
        "components_with_lane_changes": _component_sizes(len(town.lanes), town.links),
        "kilometres": round(town.kilometres, 2),
        "junctions": len(town.junctions),
        "streets": [street.name for street in town.streets],
        "signals": sum(signal.kind is SignalKind.TRAFFIC_LIGHT for signal in town.signals),
        "crosswalks": len(town.crosswalks),
        "sites": len(town.sites),
    }


def _component_sizes(lanes: int, links: Iterable[LaneLink]) -> list[int]:
    """Sizes of the strongly connected components, largest first."""
    if lanes == 0:
        return []
    pairs = np.array([(link.source, link.target) for link in links], dtype=np.intp).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(lanes, lanes)).tocsr()
    _, labels = connected_components(graph, directed=True, connection="strong")
    return sorted((int(size) for size in np.bincount(labels)), reverse=True)
