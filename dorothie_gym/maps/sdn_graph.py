"""The town graphs that come with SDN (`Town01.json` ...): written, and read with what is wrong in them put right.

A file holds two graphs as networkx writes adjacency data, and lists of streets:
`map` with nodes `{id, start, end, length, opendriveid, have_left, have_right}` and edges `{id, type}`,
`meta_map` with nodes `{id, x_axis, y_axis, neighbor_edge}` and edges `{id, ids, length}`, `num_streets`, and
`streets.road_id[i]` and `streets.junction_id[i]`. Its frame is ours: metres, x east, y south, yaw clockwise in degrees.

What the published files have that one would not expect: junction 0 means none; yaws run beyond a turn; a list of
streets is longer than there are streets; junctions are named that the map does not have; and the ends of the lanes are
wrong (`sdn_repair`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import TownError
from dorothie_gym.maps.lane_graph import (
    EDGE_TYPES,
    END,
    LANE_ID,
    LENGTH,
    START,
    EdgeType,
    GraphStreet,
    JunctionGraph,
    LaneGraph,
    Repair,
    first_street,
)
from dorothie_gym.maps.model import NO_JUNCTION, Array

TOUCHING = 1.0
"""Ends of lanes closer than this are one place [m]: lanes of well-formed files are millimetres apart, those of SDN's
faulty ones their whole length."""

MAJORITY = 0.5
"""A reading of a file holds if it fits more than this share of what it says something about."""

_ANGLES = (3, 4, 5, 9, 10, 11)

_SAMPLES = 33
"""Points at which a curve is measured."""


def repair(graph: LaneGraph) -> LaneGraph:
    """A lane graph as read from a file, with the known fault repaired if it has it.

    Returns:
        The same graph where the ends of linked lanes meet already. Else one with ends, starts and lengths set anew and
        `LaneGraph.repairs` telling what was done to each lane; where the ends do not fit with the fault either, the
        lanes stay as they are, flagged `Repair.UNRELIABLE`.
    """
    links = graph.edges_of(EdgeType.CONCAT)
    if not len(links):
        return (
            _noted(graph, "no lane is linked to another: whether their ends are right cannot be told")
            if len(graph)
            else graph
        )
    features = graph.features
    source, target = links.T
    gaps = np.hypot(*(features[source, 6:8] - features[target, 0:2]).T)
    if np.mean(gaps <= TOUCHING) > MAJORITY:
        apart = int(np.sum(gaps > TOUCHING))
        return (
            _noted(graph, f"{apart} links join lanes whose ends are more than {TOUCHING:g} m apart") if apart else graph
        )
    before = _predecessors(len(graph), links)
    agreeing = [_agree(features, lanes) for lanes in before if len(lanes) > 1]
    if agreeing and np.mean(agreeing) <= MAJORITY:
        note = "the ends of the lanes fit neither as they are written nor with the known fault; nothing was repaired"
        flags = np.full(len(graph), int(Repair.UNRELIABLE), dtype=np.int64)
        return _noted(replace(graph, repairs=flags), note)
    return _repaired(graph, before)


def _noted(graph: LaneGraph, note: str) -> LaneGraph:
    return graph if note in graph.notes else replace(graph, notes=(*graph.notes, note))


def _predecessors(count: int, links: NDArray[np.int64]) -> list[list[int]]:
    before: list[list[int]] = [[] for _ in range(count)]
    for source, target in links.tolist():
        if source != target:
            before[target].append(source)
    return before


def _agree(features: Array, lanes: list[int]) -> bool:
    """Whether lanes end, by what the file has as their starts, in one place."""
    ends = features[lanes, 0:2]
    return bool(np.all(np.hypot(*(ends - ends[0]).T) <= TOUCHING))


def _repaired(graph: LaneGraph, before: list[list[int]]) -> LaneGraph:
    stored = graph.features.copy()
    # the files' angles run beyond a turn
    stored[:, _ANGLES] = (stored[:, _ANGLES] + 180.0) % 360.0 - 180.0
    features = stored.copy()
    flags = np.full(len(graph), int(Repair.END_FROM_START), dtype=np.int64)
    features[:, END] = stored[:, START]
    road_lengths, whole = _road_lengths(graph), _whole(graph)
    for row, lanes in enumerate(before):
        known = bool(lanes) and _agree(stored, lanes)
        # where nothing leads to a lane, the walk back that went astray in SDN's files had nowhere to go
        features[row, START] = stored[lanes[0], START] if known else stored[row, END]
        flags[row] |= Repair.START_FROM_PREDECESSOR if known else Repair.START_UNKNOWN
        chord = math.dist(features[row, 0:2], features[row, 6:8])
        measured = whole[row] and road_lengths[row] >= chord - TOUCHING
        features[row, LENGTH] = road_lengths[row] if measured else _curve_length(features[row])
        flags[row] |= Repair.LENGTH_FROM_META_MAP if measured else Repair.LENGTH_ESTIMATED
    return replace(graph, features=features, repairs=flags)


def _road_lengths(graph: LaneGraph) -> Array:
    """Length of each lane's road where that leads from a junction to another alone, else NaN (n,) [m]."""
    given: dict[tuple[int, int], float] = {}
    meta_map = graph.meta_map
    for (_, target), roads, length in zip(meta_map.edges, meta_map.roads, meta_map.lengths.tolist(), strict=True):
        if len(roads) == 1:
            given[roads[0], int(meta_map.ids[target])] = length
    lengths = np.full(len(graph), np.nan)
    for source, target in graph.edges_of(EdgeType.CONCAT).tolist():
        key = int(graph.road_ids[source]), int(graph.junction_ids[target])
        lengths[source] = given.get(key, lengths[source])
    return lengths


def _whole(graph: LaneGraph) -> NDArray[np.bool_]:
    """Which lanes run along all of their road (n,): those outside junctions that other roads lead to and follow."""
    source, target = graph.edges_of(EdgeType.CONCAT).T
    same = graph.road_ids[source] == graph.road_ids[target]
    rows = np.arange(len(graph))
    whole: NDArray[np.bool_] = graph.junction_ids == NO_JUNCTION
    for ends in (source, target):
        whole = whole & np.isin(rows, ends) & ~np.isin(rows, ends[same])
    return whole


def _curve_length(row: Array) -> float:
    """Length of the cubic curve between both ends of a lane in their directions; that of an arc where it is one [m]."""
    start, end = row[0:2], row[6:8]
    chord = math.dist(start, end)
    yaws = np.radians((row[4], row[10]))
    half = abs((yaws[1] - yaws[0] + math.pi) % (2 * math.pi) - math.pi) / 2
    pull = chord * (half / math.sin(half) if half > 1e-6 else 1.0)
    tangents = pull * np.column_stack((np.cos(yaws), np.sin(yaws)))
    t = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    points = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * tangents[0]
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * tangents[1]
    )
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


# --- The town graphs that come with SDN (`Town01.json` ...): written, and read with what is wrong in them ------------

_LOCATION, _ROTATION = ("x", "y", "z"), ("pitch", "yaw", "roll")

# How SDN's files say that a lane is in no junction; only where the map has no junction of that number.
_SDN_NO_JUNCTION = 0

_LARGEST = 1e9
"""No number in a town is larger than this."""


def read_sdn_graph(path: str | Path) -> LaneGraph:
    """Reads a town graph in SDN's layout, with its known fault repaired where the graph allows it.

    Lanes that were repaired, or could not be, carry flags in `LaneGraph.repairs`; `LaneGraph.notes` tells of the rest.
    A file without the fault is taken as it is.

    Raises:
        TownError: the file cannot be read or is no such graph; names the file and the key.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise TownError(str(path), "file", f"cannot be read ({reason}); a JSON file is expected") from error
    return parse_sdn_graph(text, name=Path(path).stem, source=str(path))


def parse_sdn_graph(text: str, *, name: str, source: str = "<text>") -> LaneGraph:
    """The same from the text of a file.

    Args:
        text: JSON.
        name: of the town, if the file does not tell it.
        source: what errors name as the file.
    """
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise TownError(source, f"line {error.lineno}", f"is not JSON: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        raise TownError(source, "file", f"is no town graph: {error}") from error
    reader = _Reader(source)
    graph = _read_rest(reader, data, _read_map(reader, reader.get(data, "map", dict), name))
    # flags are only in files of ours, and say that the fault was seen to before
    return graph if graph.repairs.any() else repair(graph)


@dataclass(frozen=True)
class _Reader:
    """Takes values out of parsed JSON and names the key where one is not as it should be."""

    source: str

    def fail(self, key: str, reason: str) -> TownError:
        """The error to raise."""
        return TownError(self.source, key, reason)

    def get(self, data: Any, key: str, kind: type, within: str = "") -> Any:
        """`data[key]`, which is to be of a kind."""
        path = f"{within}.{key}" if within else key
        if not isinstance(data, dict):
            raise self.fail(within or "file", f"is {_kind(data)}; an object with the key {key!r} is expected")
        if key not in data:
            raise self.fail(path, "is missing")
        return self.check(data[key], kind, path)

    def check(self, value: Any, kind: type, path: str) -> Any:
        """A value that is to be of a kind."""
        number = isinstance(value, int | float) and not isinstance(value, bool)
        right = number if kind is float else isinstance(value, kind) and (kind is not int or number)
        if not right:
            raise self.fail(path, f"is {_kind(value)}; {_NAMES[kind]} is expected")
        if kind in (int, float) and not abs(value) <= _LARGEST:
            raise self.fail(path, f"is {value}; a number between -{_LARGEST:g} and {_LARGEST:g} is expected")
        return value

    def integers(self, data: Any, path: str) -> tuple[int, ...]:
        """A list of whole numbers."""
        rows = self.check(data, list, path)
        return tuple(int(self.check(value, int, f"{path}[{k}]")) for k, value in enumerate(rows))


_NAMES = {
    dict: "an object",
    list: "a list",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "text",
}


def _kind(value: Any) -> str:
    return "null" if value is None else _NAMES.get(type(value), type(value).__name__)


def _read_map(reader: _Reader, data: Any, name: str) -> LaneGraph:
    """Lanes and edges; streets and junctions are still missing."""
    nodes = reader.get(data, "nodes", list, "map")
    rows = _rows_of(reader, nodes, "map")
    features = np.array([_read_features(reader, node, f"map.nodes[{k}]") for k, node in enumerate(nodes)])
    ids = [reader.get(node, "opendriveid", dict, f"map.nodes[{k}]") for k, node in enumerate(nodes)]
    edges: list[tuple[int, int]] = []
    kinds: list[int] = []
    for source, target, edge, path in _read_adjacency(reader, data, rows, "map"):
        kind = reader.get(edge, "type", str, path)
        if kind not in EDGE_TYPES:
            raise reader.fail(f"{path}.type", f"is {kind!r}; one of {', '.join(EDGE_TYPES)} is expected")
        edges.append((source, target))
        kinds.append(EDGE_TYPES.index(EdgeType(kind)))
    told = _graph_attributes(reader, data)
    return LaneGraph(
        name=reader.check(told.get("name", name), str, "map.graph.name"),
        features=features.reshape(-1, LANE_ID + 1),
        road_ids=_column(reader, ids, "road_id"),
        junction_ids=_column(reader, ids, "junction_id"),
        have_left=_flags(reader, nodes, "have_left"),
        have_right=_flags(reader, nodes, "have_right"),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
        edge_types=np.array(kinds, dtype=np.int64),
        streets=(),
        meta_map=_EMPTY,
        repairs=np.array(
            [reader.check(node.get("repairs", 0), int, f"map.nodes[{k}].repairs") for k, node in enumerate(nodes)],
            dtype=np.int64,
        ),
        notes=tuple(
            reader.check(note, str, "map.graph.notes")
            for note in reader.check(told.get("notes", []), list, "map.graph.notes")
        ),
    )


def _column(reader: _Reader, ids: Sequence[Any], key: str) -> NDArray[np.int64]:
    values = [reader.get(row, key, int, f"map.nodes[{k}].opendriveid") for k, row in enumerate(ids)]
    return np.array(values, dtype=np.int64)


def _flags(reader: _Reader, nodes: Sequence[Any], key: str) -> NDArray[np.bool_]:
    return np.array([reader.get(node, key, bool, f"map.nodes[{k}]") for k, node in enumerate(nodes)], dtype=np.bool_)


def _graph_attributes(reader: _Reader, data: Any) -> dict[str, Any]:
    """What networkx keeps about a graph as a whole: pairs, of which SDN's files have none."""
    found = {}
    for k, pair in enumerate(reader.check(data.get("graph", []), list, "map.graph")):
        if len(reader.check(pair, list, f"map.graph[{k}]")) != 2 or not isinstance(pair[0], str):
            raise reader.fail(f"map.graph[{k}]", "is no pair of a name and a value")
        found[pair[0]] = pair[1]
    return found


def _read_features(reader: _Reader, node: Any, path: str) -> list[float]:
    row: list[float] = []
    for end in ("start", "end"):
        place = reader.get(node, end, dict, path)
        for part, keys in (("location", _LOCATION), ("rotation", _ROTATION)):
            values = reader.get(place, part, dict, f"{path}.{end}")
            row += [float(reader.get(values, key, float, f"{path}.{end}.{part}")) for key in keys]
    ids = reader.get(node, "opendriveid", dict, path)
    lane_id = reader.get(ids, "lane_id", int, f"{path}.opendriveid")
    return [*row, float(reader.get(node, "length", float, path)), float(lane_id)]


def _rows_of(reader: _Reader, nodes: Sequence[Any], within: str) -> dict[int, int]:
    """Row of each node by its id."""
    rows: dict[int, int] = {}
    for k, node in enumerate(nodes):
        number = reader.get(node, "id", int, f"{within}.nodes[{k}]")
        if rows.setdefault(number, k) != k:
            raise reader.fail(f"{within}.nodes[{k}].id", f"is {number} like that of nodes[{rows[number]}]; ids differ")
    return rows


def _read_adjacency(
    reader: _Reader, data: Any, rows: dict[int, int], within: str
) -> list[tuple[int, int, dict[str, Any], str]]:
    """Edges: rows of both nodes, what the file says of it, and where."""
    table = reader.get(data, "adjacency", list, within)
    if len(table) != len(rows):
        raise reader.fail(
            f"{within}.adjacency", f"has {len(table)} rows; one for each of {len(rows)} nodes is expected"
        )
    found: dict[tuple[int, int], tuple[int, int, dict[str, Any], str]] = {}
    for source, targets in enumerate(table):
        for k, edge in enumerate(reader.check(targets, list, f"{within}.adjacency[{source}]")):
            path = f"{within}.adjacency[{source}][{k}]"
            number = reader.get(edge, "id", int, path)
            if number not in rows:
                raise reader.fail(f"{path}.id", f"is {number}, which no node has")
            if found.setdefault((source, rows[number]), (source, rows[number], edge, path))[3] != path:
                raise reader.fail(f"{path}.id", f"is {number} a second time; an edge is written once")
    return list(found.values())


def _read_rest(reader: _Reader, data: Any, graph: LaneGraph) -> LaneGraph:
    """Adds streets and junctions, and tells lanes in no junction from those in junction 0."""
    streets, notes = _read_streets(reader, data, graph)
    meta_map = _read_meta_map(reader, reader.get(data, "meta_map", dict), streets)
    ids = graph.junction_ids
    if NO_JUNCTION not in ids and _SDN_NO_JUNCTION not in meta_map.ids:
        ids = np.where(ids == _SDN_NO_JUNCTION, NO_JUNCTION, ids)
    known = {*ids.tolist(), *meta_map.ids.tolist()}
    for index, street in enumerate(streets):
        unknown = [number for number in street.junctions if number not in known]
        if unknown:
            notes.append(f"streets.junction_id[{index}] names junctions that the map has not: {unknown}")
    told = [note for note in notes if note not in graph.notes]
    return replace(graph, junction_ids=ids, streets=streets, meta_map=meta_map, notes=(*graph.notes, *told))


def _read_streets(reader: _Reader, data: Any, graph: LaneGraph) -> tuple[tuple[GraphStreet, ...], list[str]]:
    """Streets, and what is wrong with their lists."""
    count = reader.get(data, "num_streets", int)
    if count < 0:
        raise reader.fail("num_streets", f"is {count}; a number from 0 on is expected")
    lists = reader.get(data, "streets", dict)
    notes: list[str] = []
    numbers = {"road_id": set(graph.road_ids.tolist()), "junction_id": set(graph.junction_ids.tolist())}
    columns: dict[str, list[tuple[int, ...]]] = {}
    for key, other in (("road_id", "junction_id"), ("junction_id", "road_id")):
        rows = reader.get(lists, key, list, "streets")
        column = [reader.integers(row, f"streets.{key}[{k}]") for k, row in enumerate(rows)]
        if len(column) < count:
            raise reader.fail(f"streets.{key}", f"has {len(column)} entries; num_streets is {count}")
        left_out = _surplus(column, count, numbers[other] - numbers[key])
        notes += [f"streets.{key}[{k}] is left out: there are {count} streets" for k in left_out]
        column = [row for k, row in enumerate(column) if k not in left_out]
        columns[key] = column
    pairs = zip(columns["road_id"], columns["junction_id"], strict=True)
    return tuple(GraphStreet(roads=roads, junctions=junctions) for roads, junctions in pairs), notes


def _surplus(column: Sequence[tuple[int, ...]], count: int, foreign: set[int]) -> list[int]:
    """Entries of a list of streets that are too many.

    Published files have an entry of junctions among those of roads, which shifts all after it; else the last are too
    many, which TOTO does not read.
    """
    extra = max(len(column) - count, 0)
    strays = [k for k, row in enumerate(column) if row and foreign.issuperset(row)]
    others = [k for k in reversed(range(len(column))) if k not in strays]
    return sorted([*strays, *others][:extra])


def _read_meta_map(reader: _Reader, data: Any, streets: Sequence[GraphStreet]) -> JunctionGraph:
    nodes = reader.get(data, "nodes", list, "meta_map")
    rows = _rows_of(reader, nodes, "meta_map")
    positions = [
        [float(reader.get(node, key, float, f"meta_map.nodes[{k}]")) for key in ("x_axis", "y_axis")]
        for k, node in enumerate(nodes)
    ]
    edges, lengths, roads = [], [], []
    for source, target, edge, path in _read_adjacency(reader, data, rows, "meta_map"):
        edges.append((source, target))
        lengths.append(float(reader.get(edge, "length", float, path)))
        roads.append(reader.integers(reader.get(edge, "ids", list, path), f"{path}.ids"))
    return JunctionGraph(
        ids=np.array(list(rows), dtype=np.int64),
        positions=np.array(positions, dtype=np.float64).reshape(-1, 2),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
        lengths=np.array(lengths, dtype=np.float64),
        roads=tuple(roads),
        streets=np.array([first_street(ids, streets) for ids in roads], dtype=np.int64),
    )


_EMPTY = JunctionGraph(
    ids=np.zeros(0, dtype=np.int64),
    positions=np.zeros((0, 2)),
    edges=np.zeros((0, 2), dtype=np.int64),
    lengths=np.zeros(0),
    roads=(),
    streets=np.zeros(0, dtype=np.int64),
)


# --- writing ------------------------------------------------------------------------------------------------------


def graph_to_json(graph: LaneGraph) -> str:
    """A lane graph in the layout of SDN's files; what it adds to that are the town's name, flags and notes."""
    # SDN's files say 0 for no junction; where a junction has that number, -1 does, as in SDN's trajectories
    used = 0 in graph.junction_ids or 0 in graph.meta_map.ids
    none = NO_JUNCTION if used else _SDN_NO_JUNCTION
    attributes: list[list[Any]] = [["name", graph.name]]
    if graph.notes:
        attributes.append(["notes", list(graph.notes)])
    edges: list[list[dict[str, Any]]] = [[] for _ in range(len(graph))]
    for (source, target), kind in zip(graph.edges.tolist(), graph.edge_types.tolist(), strict=True):
        edges[source].append({"id": target, "type": EDGE_TYPES[kind].value})
    data = {
        "map": _adjacency_data([_node(graph, row, none) for row in range(len(graph))], edges, attributes),
        "meta_map": _meta_data(graph.meta_map),
        "num_streets": graph.num_streets,
        "streets": {
            "junction_id": [list(street.junctions) for street in graph.streets],
            "road_id": [list(street.roads) for street in graph.streets],
        },
    }
    return json.dumps(data, indent=1, allow_nan=False)


def _adjacency_data(nodes: list[dict[str, Any]], edges: list[list[dict[str, Any]]], attributes: Any) -> dict[str, Any]:
    return {"directed": True, "multigraph": False, "graph": attributes, "nodes": nodes, "adjacency": edges}


def _node(graph: LaneGraph, row: int, none: int) -> dict[str, Any]:
    junction = int(graph.junction_ids[row])
    node = {
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
    return node | ({"repairs": int(graph.repairs[row])} if graph.repairs[row] else {})


def _transform(values: list[float]) -> dict[str, dict[str, float]]:
    return {
        "location": dict(zip(_LOCATION, values[:3], strict=True)),
        "rotation": dict(zip(_ROTATION, values[3:], strict=True)),
    }


def _meta_data(graph: JunctionGraph) -> dict[str, Any]:
    edges: list[list[dict[str, Any]]] = [[] for _ in range(len(graph))]
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
