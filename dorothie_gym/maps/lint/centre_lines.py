"""Whether a lane by itself can be driven: kinks, curves, steps and width along its centre line."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lint.fault import CAR_WIDTH, SMALLEST_RADIUS, Fault, FaultKind
from dorothie_gym.maps.model import Array, Lane
from dorothie_gym.maps.town import Town

MAX_GAP = 0.05
"""Largest distance in the plane between the ends of linked lanes [m]; demanded of the towns."""

MAX_STEP = 0.05
"""Largest step in the road [m]: more is felt as a lowered kerb is, which is built 2 to 5 cm high."""

MAX_KINK = math.radians(5.0)
"""Largest sudden change of direction [rad]; demanded of the towns."""

_SLACK = 1e-9
"""Rounding that is no fault [m or rad]."""


def continuity_faults(town: Town) -> Iterator[Fault]:
    """Gaps, steps and kinks between lanes that are linked, lane changes left out."""
    for link in town.links:
        if link.type.is_lane_change:
            continue
        source, target = town.lanes[link.source], town.lanes[link.target]
        (x, y, z), (u, v, w) = source.points[-1], target.points[0]
        lanes, position = (source.id, target.id), (float(x), float(y))
        pair = f"lane {target.id} begins"
        gap = math.hypot(u - x, v - y)
        if gap > MAX_GAP + _SLACK:
            message = f"{pair} {gap:.2f} m from the end of lane {source.id}"
            yield Fault(kind=FaultKind.GAP, lanes=lanes, position=position, message=message)
        if abs(w - z) > MAX_STEP + _SLACK:
            message = f"{pair} {abs(w - z):.2f} m {'above' if w > z else 'below'} the end of lane {source.id}"
            yield Fault(kind=FaultKind.HEIGHT_STEP, lanes=lanes, position=position, message=message)
        turn = math.remainder(float(target.headings[0] - source.headings[-1]), math.tau)
        if abs(turn) > MAX_KINK + _SLACK:
            side = "right" if turn > 0 else "left"
            message = f"{pair} {math.degrees(abs(turn)):.1f} degrees to the {side} of the end of lane {source.id}"
            yield Fault(kind=FaultKind.KINK, lanes=lanes, position=position, message=message)


# --- Whether a lane by itself can be driven: kinks, curves, steps and width along its centre line --------------------

MAX_DEPARTURE = 0.5
"""A car on its smallest turning circle may leave the centre line of a tighter curve by this [m]; demanded of drives.
Tight curves that turn by little are no fault by that: Town05 has right turns on 1.7 m, which the car takes well."""

MAX_CHORD_ERROR = 0.1
"""Largest distance of a polyline from the arc that it stands for [m]; a coarser one is driven corner by corner."""

MAX_GRADE = 0.35
"""Steepest street [m/m]: that of Baldwin Street in Dunedin, said to be the steepest in the world."""

_ROOM_BETWEEN = 5.0
"""Kinks closer than this are told as one [m]."""


def centre_line_faults(town: Town) -> Iterator[Fault]:
    """Kinks, tight curves, steps and narrow places within lanes."""
    for lane in town.lanes:
        yield from _bends(lane)
        yield from _steps(lane)
        yield from _narrow(town, lane)


def _bends(lane: Lane) -> Iterator[Fault]:
    if len(lane.points) < 3:
        return
    steps = np.diff(lane.points[:, :2], axis=0)
    length = np.hypot(*steps.T)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))  # (n-2,) at the inner points, positive right
    kinks = _kinks(turns, length)
    for run in _runs(np.flatnonzero(kinks), lane.stations[1:-1]):
        worst = int(run[np.argmax(np.abs(turns[run]))])
        message = f"lane {lane.id} turns by {np.degrees(abs(turns[worst])):.1f} degrees in one point"
        if len(run) > 1:
            message += f", and in {len(run) - 1} more near it"
        yield _fault(lane, FaultKind.KINK, worst + 1, message)
    yield from _tight_curves(lane, np.where(kinks, 0.0, turns), length)


def _kinks(turns: Array, length: Array) -> NDArray[np.bool_]:
    """Inner points where the line turns by more than the arcs before and behind it explain.

    Args:
        turns: change of direction at the inner points (n,) [rad].
        length: of the segments (n + 1,) [m].
    """
    before, after = length[:-1], length[1:]
    curvature = turns / _share(before, after)
    # A point at the end has one neighbour, a single one has none: then the curve is taken to go on as it is.
    ends = curvature[[min(1, len(turns) - 1), max(len(turns) - 2, 0)]]
    previous, following = np.append(ends[0], curvature[:-1]), np.append(curvature[1:], ends[1])
    # Each half of the segments beside the point lies on the arc of its own side.
    explained = 0.5 * (previous * before + following * after)
    # What the arcs would add the other way, or beyond the turn itself, is not held against the point.
    low, high = np.minimum(explained, 0.0), np.maximum(explained, 0.0)
    left_over = turns - np.clip(turns, low, high)
    coarse = np.abs(turns) * np.minimum(before, after) / 8.0 > MAX_CHORD_ERROR
    kinks: NDArray[np.bool_] = np.abs(np.where(coarse, turns, left_over)) > MAX_KINK + 1e-9
    return kinks


def _share(before: Array, after: Array) -> Array:
    """Length of line that an inner point stands for [m]; beside a long straight that is what the shorter side tells."""
    share: Array = np.minimum(0.5 * (before + after), 1.5 * np.minimum(before, after))
    return share


def _tight_curves(lane: Lane, turns: Array, length: Array) -> Iterator[Fault]:
    """Stretches of curve in which a car at full lock would be carried too far from the centre line."""
    share = _share(length[:-1], length[1:])
    side = np.where(np.abs(turns) > share / SMALLEST_RADIUS, np.sign(turns), 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0.0], side, [0.0]))))
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        if side[begin] == 0.0:
            continue
        turn = float(np.sum(np.abs(turns[begin:end])))
        radius = float(np.sum(share[begin:end])) / turn
        # The car swings out, cuts the corner by as much, and its arc still turns by the same angle: of the arcs of its
        # radius the best one stays within this.
        apart = (SMALLEST_RADIUS - radius) * np.tan(0.25 * min(turn, 2.0 * np.pi - 0.1)) ** 2
        if apart > MAX_DEPARTURE:
            message = (
                f"lane {lane.id} turns by {np.degrees(turn):.0f} degrees on a radius of {radius:.1f} m,"
                f" tighter than the {SMALLEST_RADIUS:.1f} m of the car at full lock"
            )
            yield _fault(lane, FaultKind.TIGHT_CURVE, (begin + end - 1) // 2 + 1, message)


def _steps(lane: Lane) -> Iterator[Fault]:
    """Places where the lane rises or falls faster than any street does."""
    length = np.diff(lane.stations)
    rise = np.abs(np.diff(lane.points[:, 2]))
    steep = np.flatnonzero(rise > MAX_GRADE * length + MAX_STEP)
    for run in _runs(steep, lane.stations):
        worst = int(run[np.argmax(rise[run])])
        message = f"lane {lane.id} rises or falls by {rise[worst]:.2f} m within {length[worst]:.2f} m"
        yield _fault(lane, FaultKind.HEIGHT_STEP, worst, message)


def _narrow(town: Town, lane: Lane) -> Iterator[Fault]:
    """The narrowest place of a lane, unless that is where a lane opens or runs out and nobody has to drive."""
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
    """Rows with less than `_ROOM_BETWEEN` from one to the next."""
    return [run for run in np.split(rows, np.flatnonzero(np.diff(stations[rows]) > _ROOM_BETWEEN) + 1) if len(run)]


def _fault(lane: Lane, kind: FaultKind, point: int, message: str) -> Fault:
    x, y = lane.points[point, :2]
    return Fault(kind=kind, lanes=(lane.id,), position=(float(x), float(y)), message=message)
