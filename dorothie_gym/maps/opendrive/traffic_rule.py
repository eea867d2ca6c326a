"""Side of the road on which the traffic of an OpenDRIVE file drives: by its rule, and by its oncoming lanes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.errors import TownError
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.lane_neighbours import MAX_HEIGHT, MIN_GAP, MIN_OPPOSITION, WIDEST_MEDIAN
from dorothie_gym.maps.two_way_roads import STEP, VERGE
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dorothie_gym.maps.import_notes import ImportNotes
    from dorothie_gym.maps.model import Array, Lane
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords, RoadRecord

# Maximum number of points whose oncoming lane is looked up.
MOST_POINTS = 4000


def refuse_mixed_rules(source: str, roads: Mapping[int, RoadRecord]) -> None:
    """Raises `TownError` if a file has driving lanes under both rules."""
    driven = [road for road in roads.values() if any(lane.drives for s in road.sections for lane in s.lanes.values())]
    right, left = ([road.name for road in driven if road.right_hand is side] for side in (True, False))
    if right and left:
        reason = (
            f"traffic keeps to the right on {len(right)} roads (such as road {right[0]}) and to the left on {len(left)}"
            f" (such as road {left[0]}); a town has one side: give all roads the same 'rule'"
        )
        raise TownError(source, "OpenDRIVE", reason)


def driving_side(records: OpenDriveRecords, lanes: Sequence[Lane]) -> DrivingSide:
    """Returns the side on which the traffic of a file drives.

    The lanes decide: oncoming traffic lies on the left of lanes of right-hand traffic. SUMO's maps of left-hand traffic
    have no rule, and a road for each direction. A map without lanes that face each other follows the rule of its roads.

    Args:
        records: the file.
        lanes: its lanes, with the direction of their traffic.
    """
    ruled = DrivingSide.RIGHT if all(road.right_hand for road in records.roads.values()) else DrivingSide.LEFT
    rows = [_points(lane) for lane in lanes if not lane.in_junction]
    if not rows:
        return ruled
    table = np.concatenate(rows)
    sides = _oncoming_sides(table, VERGE) or _oncoming_sides(table, WIDEST_MEDIAN)
    if sides == 0:
        return ruled
    found = DrivingSide.RIGHT if sides < 0 else DrivingSide.LEFT
    if found is not ruled:
        _note(records.notes, found)
    return found


def _note(notes: ImportNotes, side: DrivingSide) -> None:
    across = "right" if side is DrivingSide.LEFT else "left"
    notes.assumed(
        NoteKind.TRAFFIC, "OpenDRIVE", f"oncoming traffic is on the {across} of most lanes: {side}-hand traffic"
    )


def _points(lane: Lane) -> Array:
    """Returns points along a lane: x, y, height, heading, width and the number of the lane (n, 6)."""
    at = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / STEP) + 1))
    columns = (*lane.points.T, lane.headings, lane.widths)
    number = np.full(len(at), float(lane.id))
    return np.column_stack([*(np.interp(at, lane.stations, column) for column in columns), number])


def _oncoming_sides(table: Array, gap: float) -> int:
    """Returns by how many points the nearest oncoming lane is more often on the right than on the left.

    Args:
        table: points of all lanes (n, 6), see `_points`.
        gap: largest distance between the edges of a lane and the oncoming one [m].
    """
    reach = float(table[:, 4].max()) + gap + STEP
    balance = 0
    sample = table[:: math.ceil(len(table) / MOST_POINTS)]
    for row, near in zip(sample, cKDTree(table[:, :2]).query_ball_point(sample[:, :2], reach), strict=True):
        others = table[np.asarray(near, dtype=np.intp)]
        dx, dy = (others[:, k] - row[k] for k in (0, 1))
        c, n = pn.cos(row[3]), pn.sin(row[3])
        along, across = dx * c + dy * n, dy * c - dx * n  # positive right
        turn = np.abs((others[:, 3] - row[3] + math.pi) % (2.0 * math.pi) - math.pi)
        faces = (turn >= MIN_OPPOSITION) & (np.abs(along) <= STEP) & (np.abs(others[:, 2] - row[2]) <= MAX_HEIGHT)
        faces &= (np.abs(across) >= MIN_GAP) & (np.abs(across) - 0.5 * (others[:, 4] + row[4]) <= gap)
        if faces.any():
            balance += 1 if across[faces][np.argmin(np.abs(across[faces]))] > 0.0 else -1
    return balance
