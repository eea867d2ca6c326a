"""Whether a car that follows the lanes stays off kerbs: those around junctions, and pavements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.town.check.car import HALF_WIDTH
from dorothie_gym.world.town.check.fault import Fault, FaultKind
from dorothie_gym.world.town.check.ground import corners, end_of, mouths, outside
from dorothie_gym.world.town.check.samples import SAME_LEVEL, SPACING, LaneSamples
from dorothie_gym.world.town.model import Array, Junction, Lane, Sidewalk, Town

KERB_SLACK = 0.15
"""The car's side may come this far over a kerb before it is told [m]: kerbs are estimated, and curves are polylines."""

LOOP = np.radians(190.0)
"""A connector that turns by more is a loop [rad]; of U-turns some turn by a little more than a half circle."""

_SIDES = HALF_WIDTH * np.array([-1.0, 0.0, 1.0])


def kerb_faults(town: Town, samples: LaneSamples) -> Iterator[Fault]:
    """Connectors that lead off the junction's ground or across a corner, and lanes that run over a pavement."""
    beside_kerb = _kerb_lanes(town.lanes)
    faulty: set[int] = set()
    for junction in town.junctions:
        for fault in _junction_faults(town, junction, samples, beside_kerb):
            faulty.update(fault.lanes)
            yield fault
    for fault in _pavement_faults(town.sidewalks, samples):
        if faulty.isdisjoint(fault.lanes):
            yield fault


def _kerb_lanes(lanes: Sequence[Lane]) -> frozenset[int]:
    """Lanes outside junctions that run beside the kerb on their right, as their numbers tell."""
    widest: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        if not lane.in_junction:
            widest[side] = max(widest.get(side, 0), abs(lane.lane_id))
    return frozenset(
        lane.id
        for lane in lanes
        if not lane.in_junction and widest[lane.road_id, lane.lane_id > 0] == abs(lane.lane_id)
    )


def _junction_faults(
    town: Town, junction: Junction, samples: LaneSamples, beside_kerb: frozenset[int]
) -> Iterator[Fault]:
    edges = mouths(town, junction)
    kerbs = corners(town, junction.connectors, beside_kerb, edges)
    for number in junction.connectors:
        rows = samples.rows(number)
        sides = _car_sides(samples, rows).reshape(-1, 2)  # (3 n, 2)
        off = np.zeros(len(sides))
        if abs(float(town.lanes[number].headings[-1] - town.lanes[number].headings[0])) <= LOOP:
            off = outside(edges, end_of(town, number, 0), end_of(town, number, -1), HALF_WIDTH, sides)
        if off.max() > KERB_SLACK:
            off[_on_lanes(town, samples, sides, samples.heights[rows])] = 0.0
        if off.max() > KERB_SLACK:
            yield _fault(samples, rows, off, "the edge of the junction's ground")
            continue
        over = np.max([np.zeros(len(sides)), *(kerb.depth(sides, number) for kerb in kerbs)], axis=0)
        if over.max() > KERB_SLACK:
            yield _fault(samples, rows, over, "the kerb of a corner")


def _fault(samples: LaneSamples, rows: slice, over: Array, what: str) -> Fault:
    """Fault of the lane at some rows, of which `over` (n, 3) or (3 n,) tells how far the car's sides get [m]."""
    worst = rows.start + int(np.argmax(over)) // len(_SIDES)
    lane, (x, y) = int(samples.owner[worst]), samples.points[worst]
    message = f"a car on lane {lane} gets {over.max():.1f} m over {what}"
    return Fault(kind=FaultKind.KERB, lanes=(lane,), position=(float(x), float(y)), message=message)


def _car_sides(samples: LaneSamples, rows: slice) -> Array:
    """Left side, middle and right side of a car along a lane (n, 3, 2) [m]."""
    sides: Array = samples.points[rows, None] + _SIDES[:, None] * samples.right[rows, None]
    return sides


def _on_lanes(town: Town, samples: LaneSamples, places: Array, heights: Array) -> Array:
    """Which places (3 n, 2) at heights (n,) lie on lanes outside junctions (3 n,): those are paved, too."""
    road = np.flatnonzero(~np.array([lane.in_junction for lane in town.lanes])[samples.owner])
    if len(road) == 0:
        return np.zeros(len(places), dtype=np.bool_)
    _, index = cKDTree(samples.points[road]).query(places)
    row = road[index]
    offset = places - samples.points[row]
    along = np.abs(np.einsum("ij,ij->i", offset, samples.along[row]))
    across = np.abs(np.einsum("ij,ij->i", offset, samples.right[row]))
    level = np.abs(np.repeat(heights, len(_SIDES)) - samples.heights[row]) < SAME_LEVEL
    paved: Array = level & (along <= SPACING) & (across <= 0.5 * samples.widths[row])
    return paved


def _pavement_faults(sidewalks: Sequence[Sidewalk], samples: LaneSamples) -> Iterator[Fault]:
    """Lanes on which a car gets onto a pavement of the same height."""
    if not sidewalks:
        return
    places = np.concatenate([_along(sidewalk) for sidewalk in sidewalks])  # (m, 6)
    sides = _car_sides(samples, slice(0, len(samples.points)))  # (n, 3, 2)
    _, index = cKDTree(places[:, :2]).query(sides, distance_upper_bound=0.5 * places[:, 5].max() + SPACING)
    found = index < len(places)
    place = places[np.where(found, index, 0)]  # (n, 3, 6)
    offset = sides - place[..., :2]
    along = np.abs(offset[..., 0] * place[..., 3] + offset[..., 1] * place[..., 4])
    across = np.abs(offset[..., 1] * place[..., 3] - offset[..., 0] * place[..., 4])
    level = np.abs(samples.heights[:, None] - place[..., 2]) < SAME_LEVEL
    depth = np.where(found & level & (along <= 0.75 * SPACING), 0.5 * place[..., 5] - across, 0.0)
    for lane in dict.fromkeys(samples.owner[np.max(depth, axis=1) > KERB_SLACK].tolist()):
        yield _fault(samples, samples.rows(lane), depth[samples.rows(lane)], "the edge of a pavement")


def _along(sidewalk: Sidewalk) -> Array:
    """Places along a pavement, at most `SPACING` apart: rows of x, y, z, direction x, y, and width."""
    steps = np.diff(sidewalk.points[:, :2], axis=0)
    length = np.hypot(*steps.T)
    station = np.concatenate(([0.0], np.cumsum(length)))
    s = np.linspace(0.0, station[-1], max(2, int(np.ceil(station[-1] / SPACING)) + 1))
    segment = np.clip(np.searchsorted(station, s, side="right") - 1, 0, len(length) - 1)
    place = [np.interp(s, station, column) for column in sidewalk.points.T]
    return np.column_stack((*place, steps[segment] / length[segment, None], np.full(len(s), sidewalk.width)))
