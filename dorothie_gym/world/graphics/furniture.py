"""Where lights and signs are shown: beside the stop lines of the drivers who must heed them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dorothie_gym.world.graphics.borders import Borders
from dorothie_gym.world.town.model import Signal, SignalKind, Town

_ASIDE = 1.5  # [m] from the edge of the lane
SHOWN = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)
"""Kinds of signals that are drawn."""


@dataclass(frozen=True)
class Post:
    """A light or sign on the map.

    Attributes:
        kind: what it is.
        at: where it is drawn (x, y) [m].
        lanes: the lanes that it rules.
    """

    kind: SignalKind
    at: tuple[float, float]
    lanes: tuple[int, ...]


def posts(town: Town, borders: Borders, stops: Mapping[int, float]) -> tuple[Post, ...]:
    """The lights and signs of a town, one for every approach and kind.

    A map may put a light on the far side of its junction, or several on one approach; a reader looks for one at the
    stop line. A light for inner lanes alone stands on their left. One that rules no lane stands where the map says.
    """
    found: dict[tuple[SignalKind, tuple[float, float]], Post] = {}
    for signal in town.signals:
        if signal.kind in SHOWN:
            for post in _posts(town, borders, stops, signal):
                found.setdefault((post.kind, post.at), post)
    return tuple(found.values())


def _posts(town: Town, borders: Borders, stops: Mapping[int, float], signal: Signal) -> Iterator[Post]:
    lanes = [lane for lane in signal.lanes if not town.lanes[lane].in_junction]
    if not lanes:
        yield Post(signal.kind, signal.position[:2], signal.lanes)
        return
    own = frozenset(lanes)
    for number in lanes:
        beside = borders.right_neighbour.get(number)
        if beside in own:
            continue
        lane, sign = town.lanes[number], 1.0
        if beside is not None:
            # The outermost lanes have a light of their own.
            lane, sign = town.lanes[_leftmost(borders, own, number)], -1.0
        station = stops.get(lane.id, lane.length)
        x, y = lane.position(station, sign * (lane.width_at(station) / 2.0 + _ASIDE)).tolist()
        yield Post(signal.kind, (round(x, 2), round(y, 2)), signal.lanes)


def _leftmost(borders: Borders, lanes: frozenset[int], lane: int) -> int:
    left = {right: k for k, right in borders.right_neighbour.items()}
    seen = {lane}
    while (beside := left.get(lane, -1)) in lanes and beside not in seen:
        seen.add(beside)
        lane = beside
    return lane
