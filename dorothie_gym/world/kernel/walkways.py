"""Where people walk: along the pavements of a town and over its crosswalks."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dorothie_gym.world.kernel.records import CROSSING, MOUTH, NOBODY, PASSAGE, WALKWAY, Records
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town.model import Array, Crosswalk, Lane, Sidewalk, Town

JOINT = 1.5
"""Ends of pavements that are this close are one place [m]."""

KERB_REACH = 6.0
"""A crosswalk belongs to a pavement that comes this close to its end [m]."""

SAMPLE = 0.5
"""Step in which lanes are searched for crosswalks [m]."""

CROSSWALK_DEPTH = 3.0
"""Along the road (MUTCD 2009, section 3B.18: at least 6 feet) [m]."""

LEVEL = 2.5
"""Lanes further above or below a crosswalk do not pass it [m]."""


class Walkways(NamedTuple):
    """Arrays of the pavements and crosswalks; see `TownArrays`."""

    points: Array
    walks: Records
    mouths: Records
    crossings: Records
    passages: Records


def build_walkways(network: TownNetwork, lanes: Records) -> Walkways:
    """Pavements joined at their ends, and the crosswalks that join two of them; notes passages in `lanes`."""
    town = network.town
    rows = [_columns(walk) for walk in town.sidewalks]
    firsts = np.concatenate(([0], np.cumsum([len(row) for row in rows]))).astype(int)
    walks = np.zeros(max(len(rows), 1), dtype=WALKWAY).view(np.recarray)
    walks.next_walk = NOBODY
    for k, walk in enumerate(town.sidewalks):
        walks[k].first, walks[k].last = firsts[k], firsts[k + 1] - 1
        walks[k].length, walks[k].half_width = rows[k][-1, 2], walk.width / 2
    _join_ends(town.sidewalks, walks)
    crossings, mouths = _crossings(network, walks)
    passages = _passages(town, lanes, crossings)
    points = np.concatenate(rows) if rows else np.zeros((1, 6))
    return Walkways(np.ascontiguousarray(points), walks, mouths, crossings, passages)


def _columns(walk: Sidewalk) -> Array:
    """x, y, station, heading, height, width of a pavement's points."""
    steps = np.diff(walk.points[:, :2], axis=0)
    stations = np.concatenate(([0.0], np.cumsum(np.sqrt((steps * steps).sum(axis=1)))))
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    heading = np.concatenate((headings, headings[-1:]))
    return np.column_stack(
        (walk.points[:, :2], stations, heading, walk.points[:, 2], np.full(len(stations), walk.width))
    )


def _join_ends(sidewalks: Sequence[Sidewalk], walks: Records) -> None:
    """Notes for each end of a pavement the closest end of another one, if they are one place."""
    ends = [(k, end, walk.points[(0, -1)[end]]) for k, walk in enumerate(sidewalks) for end in (0, 1)]
    for k, end, place in ends:
        near = [
            (float(np.linalg.norm(place - other)), walk, which)
            for walk, which, other in ends
            if (walk, which) != (k, end)
        ]
        gap, walk, which = min(near, default=(math.inf, NOBODY, 0))
        if gap < JOINT:
            walks[k].next_walk[end], walks[k].next_end[end] = walk, which


def _crossings(network: TownNetwork, walks: Records) -> tuple[Records, Records]:
    town = network.town
    found: list[tuple[Array, list[tuple[float, int, float]]]] = []
    for crosswalk in town.crosswalks:
        ends = _ends(network, crosswalk)
        sides = [_nearest_walk(town.sidewalks, end) for end in ends]
        if all(side[0] < KERB_REACH for side in sides):
            found.append((ends, sides))
    crossings = np.zeros(max(len(found), 1), dtype=CROSSING).view(np.recarray)
    by_walk: defaultdict[int, list[tuple[float, int, int]]] = defaultdict(list)
    for k, (_, sides) in enumerate(found):
        # one walks from pavement to pavement, not from kerb to kerb
        ends = np.array([_at(town.sidewalks[walk], s) for _, walk, s in sides])
        across = ends[1, :2] - ends[0, :2]
        length = float(np.hypot(*across))
        crossings[k].x, crossings[k].y = ends[:, 0], ends[:, 1]
        crossings[k].length, crossings[k].height = length, float(ends[:, 2].mean())
        crossings[k].cos, crossings[k].sin = across / max(length, 1e-6)
        for end, (_, walk, station) in enumerate(sides):
            crossings[k].walk[end], crossings[k].station[end] = walk, station
            by_walk[walk].append((station, k, end))
    mouths: list[tuple[float, int, int]] = []
    for walk in range(len(walks)):
        walks[walk].mouth, walks[walk].mouths = len(mouths), len(by_walk[walk])
        mouths += sorted(by_walk[walk])
    return crossings, np.array(mouths or [(0.0, 0, 0)], dtype=MOUTH).view(np.recarray)


def _ends(network: TownNetwork, crosswalk: Crosswalk) -> Array:
    """The two ends of a crosswalk (2, 2) [m]: it leads across the lane that is closest to its middle."""
    middle = crosswalk.outline.mean(axis=0)[:2]
    lane = network.get_lane(network.get_closest_lane_index(middle)).town_lane
    heading = lane.heading_at(lane.project(middle)[0])
    across = np.array([-math.sin(heading), math.cos(heading)])
    reach = (crosswalk.outline[:, :2] - middle) @ across
    ends: Array = middle + np.array([reach.min(), reach.max()])[:, None] * across
    return ends


def _nearest_walk(sidewalks: Sequence[Sidewalk], place: Array) -> tuple[float, int, float]:
    """Distance [m], number and station [m] of the closest pavement."""
    found = []
    for k, walk in enumerate(sidewalks):
        a, d = walk.points[:-1, :2], np.diff(walk.points[:, :2], axis=0)
        squared = np.maximum((d * d).sum(axis=1), 1e-12)
        share = np.clip(((place - a) * d).sum(axis=1) / squared, 0.0, 1.0)
        gaps = np.linalg.norm(a + share[:, None] * d - place, axis=1)
        at = int(gaps.argmin())
        lengths = np.sqrt((d * d).sum(axis=1))
        found.append((float(gaps[at]), k, float(lengths[:at].sum() + share[at] * lengths[at])))
    return min(found, default=(math.inf, NOBODY, 0.0))


def _at(walk: Sidewalk, station: float) -> Array:
    lengths = np.sqrt((np.diff(walk.points[:, :2], axis=0) ** 2).sum(axis=1))
    stations = np.concatenate(([0.0], np.cumsum(lengths)))
    return np.array([np.interp(station, stations, walk.points[:, column]) for column in range(3)])


def _passages(town: Town, lanes: Records, crossings: Records) -> Records:
    """Where lanes pass crosswalks: within half a crosswalk's depth of the line on which one walks."""
    found: list[tuple[float, float, float, int]] = []
    reach = crossings.length / 2 + CROSSWALK_DEPTH
    middles = np.column_stack((crossings.x.mean(axis=1), crossings.y.mean(axis=1)))
    for lane in town.lanes:
        low, high = lane.points[:, :2].min(axis=0), lane.points[:, :2].max(axis=0)
        near = (middles > low - reach[:, None]).all(axis=1) & (middles < high + reach[:, None]).all(axis=1)
        passages = [(_passage(lane, crossings[k]), k) for k in np.flatnonzero(near & (crossings.length > 0.0))]
        own = sorted((*passage, int(k)) for passage, k in passages if passage is not None)
        lanes[lane.id].passage, lanes[lane.id].passages = len(found), len(own)
        found += own
    return np.array(found or [(0.0, 0.0, 0.0, 0)], dtype=PASSAGE).view(np.recarray)


def _passage(lane: Lane, crossing: Records) -> tuple[float, float, float] | None:
    """First and last station of a lane on a crosswalk [m], and where along the crosswalk that is [m]."""
    stations = np.linspace(0.0, lane.length, int(lane.length / SAMPLE) + 2)
    x, y, z = (np.interp(stations, lane.stations, lane.points[:, column]) for column in range(3))
    dx, dy = x - crossing.x[0], y - crossing.y[0]
    along = dx * crossing.cos + dy * crossing.sin
    aside = np.abs(dy * crossing.cos - dx * crossing.sin)
    on = (aside < CROSSWALK_DEPTH / 2) & (along > 0.0) & (along < crossing.length)
    on &= np.abs(z - crossing.height) < LEVEL
    if not on.any():
        return None
    return float(stations[on][0]), float(stations[on][-1]), float(along[on].mean())
