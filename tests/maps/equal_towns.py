"""Comparison of a town with what was read back from its OpenDRIVE file: lanes by their places, all else by lanes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dorothie_gym.maps import Town

CENTIMETRE = 0.01

PAVEMENT = 0.02  # the reader draws the sharp bends of sidewalks as coarse as this


def differences(one: Town, other: Town) -> list[str]:
    """Returns the differences of two towns; lanes, streets, crosswalks and sidewalks may have other numbers."""
    found = [f"{len(one.lanes)} lanes, not {len(other.lanes)}"] if len(one.lanes) != len(other.lanes) else []
    of = same_lines([lane.points for lane in one.lanes], [lane.points for lane in other.lanes])
    found += [f"lane {k} has no equal" for k, lane in enumerate(of) if lane is None]
    if found:
        return found
    number = [k for k in of if k is not None]
    found += [] if len(set(number)) == len(number) else ["two lanes became one"]
    for lane, k in zip(one.lanes, number, strict=True):
        twin = other.lanes[k]
        if abs(lane.speed_limit - twin.speed_limit) > 1e-9 or lane.junction_id != twin.junction_id:
            found.append(f"lane {lane.id}: {lane.speed_limit}, junction {lane.junction_id}; not {twin}")
        width = np.interp(lane.stations / lane.length, twin.stations / twin.length, twin.widths)
        if np.max(np.abs(width - lane.widths)) > 0.1:
            found.append(f"lane {lane.id}: width {lane.widths} not {width}")
        names = [
            t.streets[t_lane.street].name if t_lane.street >= 0 else "" for t, t_lane in ((one, lane), (other, twin))
        ]
        if names[0] != names[1]:
            found.append(f"lane {lane.id}: street {names[0]}, not {names[1]}")
    links = {(number[link.source], number[link.target], link.type) for link in one.links}
    others = {(link.source, link.target, link.type) for link in other.links}
    found += [f"link {link} is missing" for link in sorted(links - others)]
    found += [f"link {link} is new" for link in sorted(others - links)]
    found += [] if [s.name for s in one.streets] == [s.name for s in other.streets] else ["names of streets"]
    return [*found, *_signals(one, other, number), *_beside(one, other)]


def _signals(one: Town, other: Town, number: Sequence[int]) -> list[str]:
    twins = {signal.id: signal for signal in other.signals}
    found = [] if len(one.signals) == len(other.signals) else [f"{len(other.signals)} signals"]
    for signal in one.signals:
        twin = twins[signal.id]
        lanes = {number[k] for k in signal.lanes}
        if signal.kind is not twin.kind or lanes != set(twin.lanes):
            found.append(f"signal {signal}, with lanes {lanes}, not {twin}")
        if np.max(np.abs(np.subtract(signal.position, twin.position))) > CENTIMETRE:
            found.append(f"signal {signal.id} at {signal.position}, not {twin.position}")
        if abs((signal.heading - twin.heading + np.pi) % (2 * np.pi) - np.pi) > 0.02:
            found.append(f"signal {signal.id} faces {signal.heading}, not {twin.heading}")
        if (signal.value is None) != (twin.value is None) or abs((signal.value or 0) - (twin.value or 0)) > 1e-9:
            found.append(f"signal {signal.id} says {signal.value}, not {twin.value}")
    programmes = [{p.junction_id: (p.phases, p.offset) for p in town.programmes} for town in (one, other)]
    return [*found, *([] if programmes[0] == programmes[1] else ["light programmes"])]


def _beside(one: Town, other: Town) -> list[str]:
    found = []
    outlines = [Counter(tuple(np.round(c.outline, 3).ravel() + 0.0) for c in town.crosswalks) for town in (one, other)]
    if outlines[0] != outlines[1]:
        found.append(f"crosswalks {outlines[0] - outlines[1]} not {outlines[1] - outlines[0]}")
    of = same_lines([s.points for s in one.sidewalks], [s.points for s in other.sidewalks], PAVEMENT, turned=True)
    if len(one.sidewalks) != len(other.sidewalks):
        found.append(f"{len(one.sidewalks)} sidewalks, not {len(other.sidewalks)}")
    for sidewalk, k in zip(one.sidewalks, of, strict=True):
        if k is None:
            found.append(f"sidewalk {sidewalk.id} has no equal")
            continue
        twin = other.sidewalks[k]
        names = [t.streets[s.street].name if s.street >= 0 else "" for t, s in ((one, sidewalk), (other, twin))]
        if abs(sidewalk.width - twin.width) > 0.02 or names[0] != names[1]:
            found.append(f"sidewalk {sidewalk.id}: {sidewalk.width}, {names}, not {twin.width}")
    return found


def same_lines(
    ones: Sequence[NDArray[np.float64]],
    others: Sequence[NDArray[np.float64]],
    within: float = CENTIMETRE,
    *,
    turned: bool = False,
) -> list[int | None]:
    """Returns for each line (n, 3) the one within a distance of it; `turned` ones may run the other way."""
    if not others:
        return [None] * len(ones)
    ends = np.array([np.concatenate((line[0], line[-1])) for line in others])
    if turned:
        ends = np.concatenate((ends, ends[:, [3, 4, 5, 0, 1, 2]]))
    tree = cKDTree(ends)
    found: list[int | None] = []
    for line in ones:
        near = tree.query_ball_point(np.concatenate((line[0], line[-1])), 2.0 * CENTIMETRE)
        rows = [
            (max(farthest(line, others[k % len(others)]), farthest(others[k % len(others)], line)), k) for k in near
        ]
        best = min(rows, default=(np.inf, 0))
        found.append(best[1] % len(others) if best[0] <= within else None)
    return found


def farthest(line: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Returns the largest distance of the points of a line (n, 3) from another one (m, 3) [m]."""
    start, step = other[None, :-1], np.diff(other, axis=0)[None]
    share = np.clip(((line[:, None] - start) * step).sum(axis=2) / (step**2).sum(axis=2), 0.0, 1.0)
    gaps = np.linalg.norm(line[:, None] - (start + share[:, :, None] * step), axis=2)
    return float(gaps.min(axis=1).max())
