"""Export of lane graphs in the layout of the town files of SDN (`Town01.json` ...), as TOTO's published code reads.

A file holds two graphs as networkx writes adjacency data, and lists of streets:
`map` with nodes `{id, start, end, length, opendriveid, have_left, have_right}` and edges `{id, type}`,
`meta_map` with nodes `{id, x_axis, y_axis, neighbor_edge}` and edges `{id, ids, length}`, `num_streets`, and
`streets.road_id[i]` and `streets.junction_id[i]`. Frame: metres, x east, y south, yaw clockwise in degrees.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from dorothie_gym.maps.lane_graph import EDGE_TYPES, END, LANE_ID, LENGTH, START, JunctionGraph, LaneGraph
from dorothie_gym.maps.model import NO_JUNCTION

_LOCATION, _ROTATION = ("x", "y", "z"), ("pitch", "yaw", "roll")

_SDN_NO_JUNCTION = 0
"""Junction id of a lane outside junctions in SDN's files."""


def graph_to_json(graph: LaneGraph) -> str:
    """Returns a lane graph as the text of an SDN town file; the name of the town is added as a graph attribute.

    Lanes outside junctions have the junction id 0, as in SDN's files, or -1 if the map has a junction 0.
    """
    used = 0 in graph.junction_ids or 0 in graph.meta_map.ids
    none = NO_JUNCTION if used else _SDN_NO_JUNCTION
    edges: list[list[dict[str, object]]] = [[] for _ in range(len(graph))]
    for (source, target), kind in zip(graph.edges.tolist(), graph.edge_types.tolist(), strict=True):
        edges[source].append({"id": target, "type": EDGE_TYPES[kind].value})
    nodes = [_node(graph, row, none) for row in range(len(graph))]
    data = {
        "map": _adjacency_data(nodes, edges, [["name", graph.name]]),
        "meta_map": _meta_data(graph.meta_map),
        "num_streets": graph.num_streets,
        "streets": {
            "junction_id": [list(street.junctions) for street in graph.streets],
            "road_id": [list(street.roads) for street in graph.streets],
        },
    }
    return json.dumps(data, indent=1, allow_nan=False)


def _adjacency_data(
    nodes: Sequence[object], edges: Sequence[object], attributes: Sequence[Sequence[str]]
) -> dict[str, object]:
    return {"directed": True, "multigraph": False, "graph": attributes, "nodes": nodes, "adjacency": edges}


def _node(graph: LaneGraph, row: int, none: int) -> dict[str, object]:
    junction = int(graph.junction_ids[row])
    return {
        "id": row,
        "start": _transform(graph.features[row, START].tolist()),
        "end": _transform(graph.features[row, END].tolist()),
        "length": float(graph.features[row, LENGTH]),
        "opendriveid": {
            "road_id": int(graph.road_ids[row]),
            "lane_id": int(graph.features[row, LANE_ID]),
            "junction_id": none if junction == NO_JUNCTION else junction,
        },
        "have_left": bool(graph.have_left[row]),
        "have_right": bool(graph.have_right[row]),
    }


def _transform(values: list[float]) -> dict[str, dict[str, float]]:
    return {
        "location": dict(zip(_LOCATION, values[:3], strict=True)),
        "rotation": dict(zip(_ROTATION, values[3:], strict=True)),
    }


def _meta_data(graph: JunctionGraph) -> dict[str, object]:
    edges: list[list[dict[str, object]]] = [[] for _ in range(len(graph))]
    leaving: list[set[int]] = [set() for _ in range(len(graph))]
    rows = zip(graph.edges.tolist(), graph.roads, graph.lengths.tolist(), strict=True)
    for (source, target), roads, length in rows:
        edges[source].append({"id": int(graph.ids[target]), "ids": list(roads), "length": length})
        leaving[source].update(roads[:1])
    nodes = [
        {"id": int(number), "x_axis": float(x), "y_axis": float(y), "neighbor_edge": sorted(leaving[row])}
        for row, (number, (x, y)) in enumerate(zip(graph.ids, graph.positions, strict=True))
    ]
    return _adjacency_data(nodes, edges, [])
