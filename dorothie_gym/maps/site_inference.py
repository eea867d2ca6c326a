"""Landmark sites inferred for maps that do not define them.

They depend on lanes and links alone, so that a map always yields the same sites.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.model import NARROW, Array, Lane, LaneLink, Site
from dorothie_gym.maps.routing import Router, router
from dorothie_gym.maps.town import Town
from dorothie_gym.support import portable_arrays as pn

# Distance from the lane's edge to a landmark [m].
SITE_OFFSET = 6.0
# Spacing of the candidate sites [m].
SITE_STEP = 5.0
# (shortest lane, distance from both of its ends) [m]: the next pair is tried if there are too few candidates.
SITE_RULES = ((40.0, 15.0), (25.0, 10.0), (12.0, 5.0), (2.0, 1.0))
# Largest speed limit of a lane with a site [m/s]: just above 70 km/h.
FASTEST_STOP = 20.0
# Smallest difference between the distances of a landmark to the nearest other lane and to its own [m].
SITE_CLEARANCE = 0.5
# Stretch before the end of a lane in which cars leave it, without sites [m].
MERGING_STRETCH = 130.0
# Stretch at the beginning of a lane without sites, and its largest share of the lane [m]: who has just turned cannot
# be told in time to stop there.
APPROACH, APPROACH_SHARE = 45.0, 0.4


def lay_sites(
    lanes: Sequence[Lane],
    links: Sequence[LaneLink],
    count: int = 24,
    avoid: Collection[int] = (),
    traffic: DrivingSide = DrivingSide.RIGHT,
    approach: float = 0.0,
) -> tuple[Site, ...]:
    """Places landmark sites at the kerb, spread over the town by farthest-point sampling.

    A site lies on the kerb's side of the outermost lane of a road, at half the lane width plus 6 m, where no other lane
    is as close. All sites can be reached from each other: on the links of the town if its kerb lanes are strongly
    connected, else by all manoeuvres of a car, U-turns at dead ends included. A map without such places, of one-way
    roads that lead nowhere, has sites along its largest part.

    Args:
        lanes: lanes of the town, with streets.
        links: links between them, lane changes included.
        count: number of sites.
        avoid: lanes without sites.
        traffic: side of the road on which vehicles drive.
        approach: stretch at the beginning of a lane without sites, at most 40 % of the lane [m].

    Returns:
        At most `count` sites; fewer if the map has no room.
    """
    outermost = [lane for lane in _outermost(lanes) if lane.id not in avoid]
    part, stretches = _parts(lanes, links), _Stretches(_ending(links), approach, traffic)
    closed = _is_closed(outermost, links, part)
    places = _places(lanes, outermost, count, stretches) if closed else np.empty((0, 6))
    if len(places) < count:  # an open network, or a small one
        around = _Surroundings(lanes, links, traffic)
        for group in (outermost, [lane for lane in lanes if not lane.in_junction and lane.id not in avoid]):
            places = max(places, _places(lanes, group, count, stretches, around), key=len)
            if len(places) >= count:
                break
    if not len(places):  # no car can return to any place
        largest = [lane for lane in outermost if part[lane.id] == _largest(part)]
        places = _places(lanes, largest, count, stretches)
    chosen = _spread(places[:, 2:4], count) if len(places) else []
    return tuple(_site(k, lanes[int(places[row, 0])], places[row]) for k, row in enumerate(sorted(chosen)))


@dataclass(frozen=True)
class _Stretches:
    """Stretches of lanes that have sites.

    Attributes:
        ending: lanes that cars must leave before they end.
        approach: stretch at the beginning of a lane without sites, if it is no larger share than `APPROACH_SHARE` [m].
        traffic: side of the road on which vehicles drive; sites lie there.
    """

    ending: frozenset[int]
    approach: float
    traffic: DrivingSide

    def of(self, lane: Lane, margin: float) -> tuple[float, float]:
        """Returns the stations between which a lane has sites, at a distance from both of its ends [m]."""
        begin = max(margin, min(self.approach, APPROACH_SHARE * lane.length))
        return begin, lane.length - (MERGING_STRETCH if lane.id in self.ending else 0.0) - margin


class _Surroundings:
    """Groups of places that a car can reach from each other."""

    def __init__(self, lanes: Sequence[Lane], links: Sequence[LaneLink], traffic: DrivingSide) -> None:
        self._router = Router(Town(name="", lanes=lanes, links=links, junctions=(), traffic=traffic))
        self._labels = self._router.parts()

    def largest(self, places: Array) -> Array:
        """Returns the largest group of places (n, 6) that can be reached from each other."""
        cells = np.array([self._router.cell(int(lane), station) for lane, station in places[:, :2]], dtype=np.int64)
        labels = self._labels[cells]
        counts = np.bincount(labels[labels >= 0], minlength=1)
        found: Array = places[labels == np.argmax(counts)]
        return found


def _ending(links: Sequence[LaneLink]) -> frozenset[int]:
    """Returns the lanes that cars must leave for a lane beside them before they end."""
    leading = {link.source for link in links if not link.type.is_lane_change}
    changes = [(link.source, link.target) for link in links if link.type.is_lane_change]
    found: set[int] = set()
    while more := {a for a, b in changes if a not in leading and a not in found and (b in leading or b in found)}:
        found |= more
    return frozenset(found)


def _places(
    lanes: Sequence[Lane],
    kerbs: list[Lane],
    count: int,
    stretches: _Stretches,
    around: _Surroundings | None = None,
) -> Array:
    """Returns candidate sites (n, 6) by the first rule that gives enough of them; see `_candidates`."""
    usable, best = _calm(kerbs), np.empty((0, 6))
    for shortest, margin in SITE_RULES:
        places = _candidates([lane for lane in usable if lane.length >= shortest], margin, stretches)
        if len(places):
            places = places[_is_clear(lanes, places)]
        best = places if around is None else around.largest(places)
        if len(best) >= count:
            break
    return best


def _parts(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> np.ndarray[tuple[int], np.dtype[np.int32]]:
    """Returns the strongly connected part of each lane (n,)."""
    pairs = np.array([(link.source, link.target) for link in links], dtype=int).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(lanes), len(lanes)))
    result: np.ndarray[tuple[int], np.dtype[np.int32]] = connected_components(
        graph, directed=True, connection="strong"
    )[1]
    return result


def _is_closed(kerbs: list[Lane], links: Sequence[LaneLink], part: np.ndarray[tuple[int], np.dtype[np.int32]]) -> bool:
    """Returns whether all kerb lanes belong to the largest part, in which each lane leads to the others and back."""
    largest = _largest(part)
    leads_on = (link for link in links if not link.type.is_lane_change and part[link.source] == part[link.target])
    return any(part[link.source] == largest for link in leads_on) and all(part[lane.id] == largest for lane in kerbs)


def _largest(part: np.ndarray[tuple[int], np.dtype[np.int32]]) -> int:
    return int(np.argmax(np.bincount(part)))


def _outermost(lanes: Sequence[Lane]) -> list[Lane]:
    """Returns the outermost lanes of each road outside junctions."""
    outermost: dict[tuple[int, bool], int] = defaultdict(int)
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        outermost[side] = max(outermost[side], abs(lane.lane_id))
    return [
        lane
        for lane in lanes
        if not lane.in_junction and abs(lane.lane_id) == outermost[lane.road_id, lane.lane_id > 0]
    ]


def _calm(lanes: list[Lane]) -> list[Lane]:
    """Returns the lanes that are slow enough for stops, or all lanes if most of the map is fast."""
    calm = [lane for lane in lanes if lane.speed_limit <= FASTEST_STOP]
    return calm if 2 * len(calm) >= len(lanes) else lanes


def _candidates(lanes: Iterable[Lane], margin: float, stretches: _Stretches) -> Array:
    """Returns candidate sites along lanes: rows of lane, station, landmark x, y, waypoint x, y [m].

    There are none where a lane opens or tapers away, and none where cars leave one of those that end.
    """
    tables = [np.empty((0, 6))]
    for lane in lanes:
        begin, end = stretches.of(lane, margin)
        room = end - begin
        if room <= 0.0:
            continue
        s = np.linspace(begin, end, int(room / SITE_STEP) + 1) if room > SITE_STEP else [begin]
        station = np.asarray(s, dtype=float)
        station = station[np.interp(station, lane.stations, lane.widths) >= NARROW]
        x, y, heading, width = (
            np.interp(station, lane.stations, column)
            for column in (lane.points[:, 0], lane.points[:, 1], lane.headings, lane.widths)
        )
        aside = stretches.traffic.sign * (0.5 * width + SITE_OFFSET)
        number = np.full(len(station), float(lane.id))
        place = (x - aside * pn.sin(heading), y + aside * pn.cos(heading))
        tables.append(np.column_stack((number, station, *place, x, y)))
    return np.concatenate(tables)


def _is_clear(lanes: Sequence[Lane], places: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns which candidates have their own waypoint as the closest point of all lanes (n,)."""
    points, owner = [], []
    for lane in lanes:
        s = np.linspace(0.0, lane.length, int(np.ceil(lane.length)) + 1)
        points.append([np.interp(s, lane.stations, lane.points[:, k]) for k in (0, 1)])
        owner.append(np.full(len(s), lane.id))
    tree, owners = cKDTree(np.concatenate(points, axis=1).T), np.concatenate(owner)
    aside = pn.hypot(*(places[:, 2:4] - places[:, 4:6]).T)
    # Lanes are sampled every metre, which is at most 2 cm off their true distance: the waypoint must be closest.
    near, index = tree.query(places[:, 2:4], k=1)
    clear = (owners[index] == places[:, 0].astype(int)) & (near >= aside - 0.05)
    rows = np.flatnonzero(clear)
    around = tree.query_ball_point(places[rows, 2:4], aside[rows] + SITE_CLEARANCE)
    clear[rows] = [bool(np.all(owners[found] == place)) for found, place in zip(around, places[rows, 0], strict=True)]
    result: np.ndarray[tuple[int], np.dtype[np.bool_]] = clear
    return result


def _spread(positions: Array, count: int) -> list[int]:
    """Returns rows of positions (n, 2) by farthest-point sampling."""
    middle = positions.mean(axis=0)
    chosen = [int(np.argmax(pn.hypot(*(positions - middle).T)))]
    distance = pn.hypot(*(positions - positions[chosen[0]]).T)
    while len(chosen) < min(count, len(positions)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, pn.hypot(*(positions - positions[chosen[-1]]).T))
    return chosen


def _site(number: int, lane: Lane, row: Array) -> Site:
    """Returns the site of a candidate; its waypoint is projected exactly."""
    station, _ = lane.project(row[2:4])
    x, y = lane.position(station)
    return Site(
        id=number,
        lane=lane.id,
        station=station,
        position=(float(row[2]), float(row[3])),
        waypoint=(float(x), float(y)),
        street=lane.street,
    )


# --- Sites of a town --------------------------------------------------------------------------------------------------


@lru_cache(maxsize=16)
def connected_sites(town: Town) -> tuple[Site, ...]:
    """Returns the largest group of sites that a car can reach from each other, by U-turns too: all, in most towns."""
    search = router(town)
    parts = search.parts()
    labels = [int(parts[search.cell(site.lane, site.station)]) for site in town.sites]
    most = Counter(label for label in labels if label >= 0).most_common(1)
    return tuple(site for site, label in zip(town.sites, labels, strict=True) if most and label == most[0][0])
