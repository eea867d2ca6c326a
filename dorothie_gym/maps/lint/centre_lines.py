"""Centre lines: checks for kinks, tight curves, steps and narrow places, within lanes and between linked lanes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lint.fault import CAR_WIDTH, SMALLEST_TURN, Fault, FaultKind
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane
    from dorothie_gym.maps.town import Town

MAX_LINK_GAP = 0.05
"""Largest distance in the plane between the ends of linked lanes [m]; a requirement of all towns."""

MAX_STEP = 0.05
"""Largest step in height [m]: lowered kerbs, 2 to 5 cm high, are noticeable."""

MAX_KINK = math.radians(5.0)
"""Largest sudden change of direction [rad]; a requirement of all towns."""

_ROUNDING = 1e-9
"""Tolerance for rounding [m or rad]."""


def continuity_faults(town: Town) -> Iterator[Fault]:
    """Yields gaps, steps and kinks between linked lanes, lane changes excluded."""
    for link in town.links:
        if link.type.is_lane_change:
            continue
        source, target = town.lanes[link.source], town.lanes[link.target]
        (x, y, z), (u, v, w) = source.points[-1], target.points[0]
        lanes, position = (source.id, target.id), (float(x), float(y))
        pair = f"lane {target.id} begins"
        gap = pm.hypot(u - x, v - y)
        if gap > MAX_LINK_GAP + _ROUNDING:
            message = f"{pair} {gap:.2f} m from the end of lane {source.id}"
            yield Fault(kind=FaultKind.GAP, lanes=lanes, position=position, message=message)
        if abs(w - z) > MAX_STEP + _ROUNDING:
            message = f"{pair} {abs(w - z):.2f} m {'above' if w > z else 'below'} the end of lane {source.id}"
            yield Fault(kind=FaultKind.HEIGHT_STEP, lanes=lanes, position=position, message=message)
        turn = math.remainder(float(target.headings[0] - source.headings[-1]), math.tau)
        if abs(turn) > MAX_KINK + _ROUNDING:
            side = "right" if turn > 0 else "left"
            message = f"{pair} {math.degrees(abs(turn)):.1f} degrees to the {side} of the end of lane {source.id}"
            yield Fault(kind=FaultKind.KINK, lanes=lanes, position=position, message=message)


# --- Faults within a lane --------------------------------------------------------------------------------------------

MAX_DEPARTURE = 0.5
"""Largest deviation from the centre line of a car on its smallest turning circle [m]; a requirement of all drives.
Short tight curves are acceptable: Town05 has right turns with a radius of 1.7 m that the car can follow."""

MAX_CHORD_ERROR = 0.1
"""Largest distance between a polyline and the arc that it approximates [m]; the corners of a coarser one are kinks."""

MAX_GRADE = 0.35
"""Largest slope [m/m]: Baldwin Street in Dunedin, said to be the steepest street in the world."""

_ROOM_BETWEEN = 5.0
"""Kinks closer than this are reported as one [m]."""


def centre_line_faults(town: Town) -> Iterator[Fault]:
    """Yields kinks, tight curves, steps and narrow places within lanes."""
    for lane in town.lanes:
        yield from _bends(lane)
        yield from _steps(lane)
        yield from _narrow(town, lane)


def _bends(lane: Lane) -> Iterator[Fault]:
    if len(lane.points) < 3:
        return
    steps = np.diff(lane.points[:, :2], axis=0)
    length = pn.hypot(*steps.T)
    turns = np.diff(np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0])))  # (n-2,) at the inner points, positive right
    kinks = _kinks(turns, length)
    for run in _runs(np.flatnonzero(kinks), lane.stations[1:-1]):
        worst = int(run[np.argmax(np.abs(turns[run]))])
        message = f"lane {lane.id} turns by {np.degrees(abs(turns[worst])):.1f} degrees in one point"
        if len(run) > 1:
            message += f", and in {len(run) - 1} more near it"
        yield _fault(lane, FaultKind.KINK, worst + 1, message)
    yield from _tight_curves(lane, np.where(kinks, 0.0, turns), length)


def _kinks(turns: Array, length: Array) -> NDArray[np.bool_]:
    """Returns the inner points at which the line turns by more than the arcs before and after them explain (n,).

    Args:
        turns: changes of direction at the inner points (n,) [rad].
        length: lengths of the segments (n + 1,) [m].
    """
    before, after = length[:-1], length[1:]
    curvature = turns / _share(before, after)
    # The curvature is extrapolated at points with one neighbour or none.
    ends = curvature[[min(1, len(turns) - 1), max(len(turns) - 2, 0)]]
    previous, following = np.append(ends[0], curvature[:-1]), np.append(curvature[1:], ends[1])
    # Each half of the segments beside the point lies on the arc of its own side.
    explained = 0.5 * (previous * before + following * after)
    # The arcs explain at most the turn itself, and nothing in the opposite direction.
    low, high = np.minimum(explained, 0.0), np.maximum(explained, 0.0)
    left_over = turns - np.clip(turns, low, high)
    coarse = np.abs(turns) * np.minimum(before, after) / 8.0 > MAX_CHORD_ERROR
    kinks: NDArray[np.bool_] = np.abs(np.where(coarse, turns, left_over)) > MAX_KINK + 1e-9
    return kinks


def _share(before: Array, after: Array) -> Array:
    """Returns the length of line of each inner point [m], limited by the shorter side beside a long straight."""
    share: Array = np.minimum(0.5 * (before + after), 1.5 * np.minimum(before, after))
    return share


def _tight_curves(lane: Lane, turns: Array, length: Array) -> Iterator[Fault]:
    """Yields curves on which a car at full lock would leave the centre line too far."""
    share = _share(length[:-1], length[1:])
    side = np.where(np.abs(turns) > share / SMALLEST_TURN, np.sign(turns), 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0.0], side, [0.0]))))
    for begin, end in itertools.pairwise(edges.tolist()):
        if side[begin] == 0.0:
            continue
        turn = float(np.sum(np.abs(turns[begin:end])))
        radius = float(np.sum(share[begin:end])) / turn
        # The car swings out and cuts the corner equally while its arc turns by the same angle: the best of the
        # arcs of its radius deviates by this distance.
        apart = (SMALLEST_TURN - radius) * pn.tan(0.25 * min(turn, 2.0 * np.pi - 0.1)) ** 2
        if apart > MAX_DEPARTURE:
            message = (
                f"lane {lane.id} turns by {np.degrees(turn):.0f} degrees on a radius of {radius:.1f} m,"
                f" tighter than the {SMALLEST_TURN:.1f} m of the car at full lock"
            )
            yield _fault(lane, FaultKind.TIGHT_CURVE, (begin + end - 1) // 2 + 1, message)


def _steps(lane: Lane) -> Iterator[Fault]:
    """Yields places where a lane is steeper than any street."""
    length = np.diff(lane.stations)
    rise = np.abs(np.diff(lane.points[:, 2]))
    steep = np.flatnonzero(rise > MAX_GRADE * length + MAX_STEP)
    for run in _runs(steep, lane.stations):
        worst = int(run[np.argmax(rise[run])])
        message = f"lane {lane.id} rises or falls by {rise[worst]:.2f} m within {length[worst]:.2f} m"
        yield _fault(lane, FaultKind.HEIGHT_STEP, worst, message)


def _narrow(town: Town, lane: Lane) -> Iterator[Fault]:
    """Yields the narrowest place of a lane, except where the lane opens or closes."""
    narrow = lane.widths < CAR_WIDTH - 1e-9
    wide = np.flatnonzero(~narrow)
    if len(wide):
        if not town.predecessors(lane.id):
            narrow[: wide[0]] = False
        if not town.successors(lane.id):
            narrow[wide[-1] + 1 :] = False
    if narrow.any():
        place = int(np.argmin(np.where(narrow, lane.widths, np.inf)))
        message = f"lane {lane.id} is {lane.widths[place]:.2f} m wide, the car {CAR_WIDTH:.1f} m"
        yield _fault(lane, FaultKind.NARROW, place, message)


def _runs(rows: NDArray[np.intp], stations: Array) -> list[NDArray[np.intp]]:
    """Returns groups of rows less than `_ROOM_BETWEEN` apart."""
    return [run for run in np.split(rows, np.flatnonzero(np.diff(stations[rows]) > _ROOM_BETWEEN) + 1) if len(run)]


def _fault(lane: Lane, kind: FaultKind, point: int, message: str) -> Fault:
    x, y = lane.points[point, :2]
    return Fault(kind=kind, lanes=(lane.id,), position=(float(x), float(y)), message=message)
