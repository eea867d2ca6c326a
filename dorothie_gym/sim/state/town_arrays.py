"""Arrays of a town for the compiled loops: built once, shared by all worlds, read only."""

from __future__ import annotations

import math
import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import NARROW, WIDTH, Array, Lane, LaneTable, LinkType, SignalKind
from dorothie_gym.maps.right_of_way import RightOfWay, right_of_way
from dorothie_gym.sim.network.lane_lookup import CELL_REACH, SLACK, build_cells
from dorothie_gym.sim.network.network import TownNetwork, build_exits
from dorothie_gym.sim.pedestrians.walkways import build_walkways
from dorothie_gym.sim.state.codes import NOBODY, Colour, Relation, TrafficControl
from dorothie_gym.sim.state.town_records import (
    CellEntryRecord,
    CrossingRecord,
    ExitRecord,
    LaneExitsRecord,
    LaneRecord,
    MouthRecord,
    PassageRecord,
    ProgrammeRecord,
    SiblingRecord,
    StopLineRecord,
    WalkwayRecord,
)
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, CURVE_ACCELERATION, CYCLIST_ROADS, VEHICLE_SPEEDS
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray, by_reference, empty_records, filled_records
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

PASSING_WIDTH = 2.5
"""Two vehicles whose centres are this far apart across their lanes pass each other [m]: they are 2 m wide."""

CAR_REAR = CAR_LENGTH / 2
"""Distance from the centre of a car to its rear [m]."""

LEVEL_TOWN = 2.0
"""In a town whose lanes are no further apart in height than this, heights have no effect [m]."""

OFF_ROAD_MARGIN = 0.5
"""Distance of the car's centre from all lanes and connectors at which the car counts as off the road [m]."""

WIDE_LANE = 2.0 * (CELL_REACH - 2.0 * OFF_ROAD_MARGIN - SLACK)
"""Width up to which cells list all lanes that a place is within `OFF_ROAD_MARGIN` of [m]."""

_CONTROLS = {
    None: TrafficControl.NONE,
    SignalKind.TRAFFIC_LIGHT: TrafficControl.LIGHT,
    SignalKind.STOP: TrafficControl.STOP,
    SignalKind.YIELD: TrafficControl.YIELD,
}


@by_reference
@shared
class TownArrays(NamedTuple):
    """A town in arrays; lanes have the town's own ids.

    Attributes:
        points: (p, 6) x, y, station, heading, height, width of all points of centre lines, the network's own table.
        lanes: lanes by their ids.
        neighbours: int32 lists of lanes that follow and precede others, and of those whose lights pedestrians obey.
        relations: uint8 rows of `codes.Relation` of each connector to those of its junction.
        siblings: lanes with a common start.
        programmes: light programmes.
        phase_ends: ends of the phases within the cycle [s].
        colours: uint8 `codes.Colour` by programme, phase and light.
        origin: (2,) corner of the cells [m].
        cells: (rows, columns, 2) int32, see `lane_lookup.LaneCells`.
        entries: lanes in the lists of the cells.
        walk_points: (q, 6) points of the footways, as `points`; of those beside streets the last column is the
            distance to the kerb across, 0 where the road is not crossed [m].
        walks: footways: the pavements with the town's own ids, the paths between their ends, the paths beside
            the lanes at the kerb.
        mouths: mouths of crosswalks, those of a pavement in the order of their stations.
        crossings: crosswalks.
        passages: passages of lanes over crosswalks, those of a lane in the order of their stations.
        junctions: (j, 3) centre [m] of each junction's connectors, and the radius in which they lie [m].
        lines: ends of lanes with a light or stop sign, in the order of the lanes.
        ways: continuations of each lane, by the lanes' ids.
        exits: exits from the ends of lanes.
        lane_lists: int32 lists of lanes, see `ways`.
        sign: factor from a distance towards the kerb to a distance to the right, that of the town's `DrivingSide`.
        flat: whether all lanes are so level that heights do not matter.
        wide: whether any lane is wider than `WIDE_LANE`.
    """

    points: Array
    lanes: RecordArray[LaneRecord]
    neighbours: NDArray[np.int32]
    relations: NDArray[np.uint8]
    siblings: RecordArray[SiblingRecord]
    programmes: RecordArray[ProgrammeRecord]
    phase_ends: Array
    colours: NDArray[np.uint8]
    origin: Array
    cells: NDArray[np.int32]
    entries: RecordArray[CellEntryRecord]
    walk_points: Array
    walks: RecordArray[WalkwayRecord]
    mouths: RecordArray[MouthRecord]
    crossings: RecordArray[CrossingRecord]
    passages: RecordArray[PassageRecord]
    junctions: Array
    lines: RecordArray[StopLineRecord]
    ways: RecordArray[LaneExitsRecord]
    exits: RecordArray[ExitRecord]
    lane_lists: NDArray[np.int32]
    sign: float
    flat: bool
    wide: bool

    @property
    def nbytes(self) -> int:
        """Memory of all arrays [bytes]."""
        return sum(array.nbytes for array in self if isinstance(array, np.ndarray))


_built: weakref.WeakKeyDictionary[TownNetwork, TownArrays] = weakref.WeakKeyDictionary()


def town_arrays(network: TownNetwork) -> TownArrays:
    """Returns the arrays of a town's network, built at their first use."""
    found = _built.get(network)
    if found is None:
        found = _built[network] = _build(network)
    return found


def empty_town() -> TownArrays:
    """Returns the arrays of a town without lanes: examples of the types of all others."""
    return TownArrays(
        points=np.zeros((0, 6)),
        lanes=empty_records(LaneRecord, 0),
        neighbours=np.zeros(0, dtype=np.int32),
        relations=np.zeros(0, dtype=np.uint8),
        siblings=empty_records(SiblingRecord, 0),
        programmes=empty_records(ProgrammeRecord, 0),
        phase_ends=np.zeros(0),
        colours=np.zeros(0, dtype=np.uint8),
        origin=np.zeros(2),
        cells=np.zeros((0, 0, 2), dtype=np.int32),
        entries=empty_records(CellEntryRecord, 0),
        walk_points=np.zeros((0, 6)),
        walks=empty_records(WalkwayRecord, 0),
        mouths=empty_records(MouthRecord, 0),
        crossings=empty_records(CrossingRecord, 0),
        passages=empty_records(PassageRecord, 0),
        junctions=np.zeros((0, 3)),
        lines=empty_records(StopLineRecord, 0),
        ways=empty_records(LaneExitsRecord, 0),
        exits=empty_records(ExitRecord, 0),
        lane_lists=np.zeros(0, dtype=np.int32),
        sign=1.0,
        flat=True,
        wide=False,
    )


def _build(network: TownNetwork) -> TownArrays:
    town = network.town
    lanes = empty_records(LaneRecord, len(town.lanes))
    for lane in town.lanes:
        _describe(lanes[lane.id], lane, network.row(network.index_of(lane.id)), network.table)
        lanes[lane.id].pace = 1.0 if town.cruise is not None else lane.speed_limit / VEHICLE_SPEEDS[1]
    neighbours = _link(town, lanes)
    _find_cycling(lanes, neighbours)
    relations = _relate(town, lanes, right_of_way(town))
    siblings = _siblings(town, lanes)
    programmes, phase_ends, colours = _lights(town, lanes)
    cells = build_cells(network.table.points, lanes)
    walkways = build_walkways(network, lanes)
    walkways.crossings["light"] += len(neighbours)
    neighbours = np.concatenate((neighbours, walkways.heeded))
    low, high = network.height_range
    return TownArrays(
        network.table.points, lanes, neighbours, relations, siblings, programmes, phase_ends, colours,
        cells.origin, cells.bounds, cells.entries,
        walkways.points, walkways.walks, walkways.mouths, walkways.crossings, walkways.passages, _mouths(town, lanes),
        _lines(town), *build_exits(town, lanes), float(town.traffic.sign), bool(high - low < LEVEL_TOWN),
        bool(network.table.points[:, WIDTH].max() > WIDE_LANE),
    )  # fmt: skip


def _describe(record: LaneRecord, lane: Lane, row: int, table: LaneTable) -> None:
    record.length = float(table.points[table.offsets[row + 1] - 1, 2])
    record.limit = lane.speed_limit
    record.curve_speed = curve_speed(lane)
    least = float(lane.widths.min())
    record.half_width = (least if least >= NARROW else float(np.median(lane.widths))) / 2
    record.cos_first, record.sin_first, record.cos_last, record.sin_last = table.ends[row]
    record.left_edge, record.low_edge, record.right_edge, record.high_edge = table.boxes[row]
    record.first, record.last = table.offsets[row], table.offsets[row + 1] - 1
    record.rank = row
    for name in ("left", "right", "inner", "outer", "junction", "exit", "programme", "place"):
        setattr(record, name, NOBODY)


def curve_speed(lane: Lane) -> float:
    """Returns the speed in the tightest bend of a lane, at most its limit [m/s].

    A bend is taken over three stretches between points: the last one of a lane may be as short as a few centimetres.
    """
    turned, lengths = np.abs(np.diff(lane.headings)), np.diff(lane.stations)
    window = np.ones(min(3, len(lengths)))
    bends = np.convolve(turned, window, mode="valid") / np.convolve(lengths, window, mode="valid")
    tightest = float(bends.max())
    return min(lane.speed_limit, math.sqrt(CURVE_ACCELERATION / max(tightest, 1e-4)))


def _link(town: Town, lanes: RecordArray[LaneRecord]) -> NDArray[np.int32]:
    pool: list[int] = []
    for lane in town.lanes:
        record = lanes[lane.id]
        after = [link.target for link in town.successors(lane.id)]
        before = list(town.predecessors(lane.id))
        record.successor, record.successors = len(pool), len(after)
        record.predecessor, record.predecessors = len(pool) + len(after), len(before)
        pool += after + before
        for name, side in (
            ("left", LinkType.LANE_CHANGE_LEFT),
            ("right", LinkType.LANE_CHANGE_RIGHT),
            ("inner", town.traffic.to_middle),
            ("outer", town.traffic.to_kerb),
        ):
            beside = town.neighbour(lane.id, side)
            setattr(record, name, NOBODY if beside is None else beside)
    return np.array(pool, dtype=np.int32)


def _find_cycling(lanes: RecordArray[LaneRecord], neighbours: NDArray[np.int32]) -> None:
    """Records the lanes on which cyclists ride: slow ones, unless all their exits lead to faster ones, as on ramps."""
    lanes["cycling"] = lanes["limit"] <= CYCLIST_ROADS
    changed = True
    while changed:
        changed = False
        for number in np.flatnonzero(lanes["cycling"] & (lanes["successors"] > 0)):
            lane = lanes[number]
            after = neighbours[lane.successor : lane.successor + lane.successors]
            if not lanes["cycling"][after].any():
                lane.cycling, changed = False, True


def _relate(town: Town, lanes: RecordArray[LaneRecord], rules: RightOfWay) -> NDArray[np.uint8]:
    """Numbers the junctions and connectors, and computes the relation of each pair of connectors of a junction."""
    rows: list[NDArray[np.uint8]] = []
    begin = 0
    numbers = dict(town.junction_indices)
    members: dict[int, list[int]] = {}
    for lane in town.lanes:
        lanes[lane.id].control = _CONTROLS[rules.control(lane.id)]
        if lane.in_junction:
            members.setdefault(numbers.setdefault(lane.junction_id, len(numbers)), []).append(lane.id)
    for junction, connectors in members.items():
        place = {connector: k for k, connector in enumerate(connectors)}
        for connector in connectors:
            row = np.full(len(connectors), Relation.APART, dtype=np.uint8)
            row[[place[foe] for foe in rules.foes(connector)]] = Relation.FOE
            row[[place[foe] for foe in rules.waits_for(connector)]] = Relation.WAITS
            record = lanes[connector]
            record.junction, record.place, record.relation = junction, place[connector], begin
            record.exit = _exit(town, connector)
            rows.append(row)
            begin += len(row)
    return np.concatenate(rows) if rows else np.zeros(1, dtype=np.uint8)


def _mouths(town: Town, lanes: RecordArray[LaneRecord]) -> Array:
    found = np.zeros((max(int(lanes["junction"].max()) + 1, 1), 3))
    for number in range(len(found)):
        points = [lane.points[:, :2] for lane in town.lanes if lanes[lane.id].junction == number]
        if points:
            every = np.concatenate(points)
            middle = (every.min(axis=0) + every.max(axis=0)) / 2
            found[number] = *middle, float(np.sqrt(((every - middle) ** 2).sum(axis=1)).max())
    return found


def _lines(town: Town) -> RecordArray[StopLineRecord]:
    rules = right_of_way(town)
    found = {
        lane: signal
        for signal in town.signals
        if signal.kind in (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP)
        for lane in signal.lanes
        if rules.control(lane) is signal.kind
    }
    records = empty_records(StopLineRecord, len(found))
    for record, lane in zip(records, sorted(found), strict=True):
        end, heading = town.lanes[lane].points[-1], float(town.lanes[lane].headings[-1])
        record.x, record.y, record.height = end
        record.cos, record.sin = pm.cos(heading), pm.sin(heading)
        record.half_width = float(town.lanes[lane].widths[-1]) / 2
        record.lane, record.signal = lane, found[lane].id
        record.is_stop = found[lane].kind is SignalKind.STOP
    return records


def _exit(town: Town, connector: int) -> int:
    seen = {connector}
    lane = connector
    while len(after := town.successors(lane)) == 1 and after[0].target not in seen:
        lane = after[0].target
        if not town.lanes[lane].in_junction:
            return lane
        seen.add(lane)
    return int(NOBODY)


def _siblings(town: Town, lanes: RecordArray[LaneRecord]) -> RecordArray[SiblingRecord]:
    """Lanes with a common start: the stretch on which each obstructs the others."""
    found: list[tuple[float, int]] = []
    for lane in town.lanes:
        beside = sorted(
            {link.target for before in town.predecessors(lane.id) for link in town.successors(before)} - {lane.id}
        )
        lanes[lane.id].sibling, lanes[lane.id].siblings = len(found), len(beside)
        found += [(_parting(lane, town.lanes[other]), other) for other in beside]
    return filled_records(SiblingRecord, found)


def _parting(lane: Lane, other: Lane) -> float:
    """Returns the station on the other lane at which it has separated from a lane with the same start [m]."""
    for station in np.arange(0.0, other.length, 1.0):
        if abs(lane.project(other.position(float(station)))[1]) > PASSING_WIDTH:
            return float(station) + CAR_REAR
    return other.length + CAR_REAR


def _lights(
    town: Town, lanes: RecordArray[LaneRecord]
) -> tuple[RecordArray[ProgrammeRecord], Array, NDArray[np.uint8]]:
    programmes = empty_records(ProgrammeRecord, max(len(town.programmes), 1))
    ends: list[float] = []
    colours: list[Sequence[int]] = []
    begin = 0
    slots: dict[int, tuple[int, int]] = {}
    for k, programme in enumerate(town.programmes):
        record = programmes[k]
        record.offset, record.cycle = programme.offset, programme.cycle
        record.phase, record.phases = len(ends), len(programme.phases)
        record.colour, record.slots = begin, len(programme.signals)
        total = 0.0
        for phase in programme.phases:
            total += phase.duration
            ends.append(total)
            shown = [
                Colour.GREEN if signal in phase.green else Colour.YELLOW if signal in phase.yellow else Colour.RED
                for signal in programme.signals
            ]
            colours.append(shown)
            begin += len(shown)
        slots.update({signal: (k, slot) for slot, signal in enumerate(programme.signals)})
    for signal in town.signals:
        for lane in signal.lanes if signal.id in slots else ():
            lanes[lane].programme, lanes[lane].slot = slots[signal.id]
    flat = np.concatenate([np.array(shown, dtype=np.uint8) for shown in colours] or [np.zeros(1, dtype=np.uint8)])
    return programmes, np.array(ends or [0.0]), flat
