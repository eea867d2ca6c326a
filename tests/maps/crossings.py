"""Hand-made junctions for tests: arms that meet in a point, or individual lanes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dorothie_gym.maps import Lane, LaneLink, LinkType, Town
from dorothie_gym.maps.model import Array, Junction, Signal, SignalKind
from dorothie_gym.support.portable_math import wrap_degrees

WIDTH = 3.5
LIGHT, STOP, YIELD = SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD


@dataclass(frozen=True)
class Arm:
    """A road that meets the others: where it lies, seen from the junction [degrees clockwise from east], and its lanes.

    A turn lane is the innermost of the lanes in; left turns are made from it alone. `lanes_out` defaults to `lanes_in`
    without the turn lane.
    """

    angle: float
    sign: SignalKind | None = None
    lanes_in: int = 1
    lanes_out: int | None = None
    turn_lane: bool = False
    median: float = 0.0

    @property
    def exits(self) -> int:
        return self.lanes_in - self.turn_lane if self.lanes_out is None else self.lanes_out


@dataclass
class Crossing:
    """A town of one junction.

    Attributes:
        approaches: lane in by arm and place, 0 the innermost.
        connectors: by arm that one comes from, place of the lane in, and arm that one goes to.
        signals: ids of what stands at an arm; a turn lane has its own, the first of two.
    """

    town: Town
    approaches: dict[tuple[int, int], int] = field(default_factory=dict)
    connectors: dict[tuple[int, int, int], int] = field(default_factory=dict)
    signals: dict[int, tuple[int, ...]] = field(default_factory=dict)


def lane(number: int, points: Iterable[Sequence[float]], junction: int = -1, *, road: int | None = None) -> Lane:
    rows = np.array([[*point, 0.0][:3] for point in points], dtype=float)
    return Lane(
        id=number,
        road_id=number if road is None else road,
        lane_id=-1,
        junction_id=junction,
        points=rows,
        widths=np.full(len(rows), WIDTH),
        speed_limit=11.0,
    )


def curve(start: Array, start_heading: float, end: Array, end_heading: float) -> Array:
    """A cubic Bezier curve between two places and directions (17, 2)."""
    reach = 0.4 * float(np.hypot(*(end - start)))
    a = start + reach * np.array([math.cos(start_heading), math.sin(start_heading)])
    b = end - reach * np.array([math.cos(end_heading), math.sin(end_heading)])
    t = np.linspace(0.0, 1.0, 17)[:, None]
    result: Array = (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * a + 3 * (1 - t) * t**2 * b + t**3 * end
    return result


def turn_of(change: float, *, alone: bool = True) -> LinkType:
    """Type of a turn by the change of heading [degrees], positive right; only the straightest way is straight on."""
    if abs(change) < 35.0 and alone:
        return LinkType.STRAIGHT
    return LinkType.RIGHT if change > 0 else LinkType.LEFT


def meeting(*arms: Arm, radius: float = 15.0, forbidden: Iterable[tuple[int, int]] = ()) -> Crossing:
    """Junction of arms; `forbidden` are pairs of arms without a movement between them."""
    lanes: list[Lane] = []
    places: dict[tuple[str, int, int], Lane] = {}
    for a, arm in enumerate(arms):
        outward = math.radians(arm.angle)
        axis, side = np.array([math.cos(outward), math.sin(outward)]), np.array([-math.sin(outward), math.cos(outward)])
        for kind, count, sign in (("in", arm.lanes_in, -1), ("out", arm.exits, 1)):
            for k in range(count):
                # A turn lane lies in the median: the lanes beside it are where they would be without it.
                offset = (k - (arm.turn_lane and kind == "in") + 0.5) * WIDTH + arm.median / 2.0
                ends = (
                    [(radius + 60.0) * axis, radius * axis] if kind == "in" else [radius * axis, (radius + 60) * axis]
                )
                made = lane(len(lanes), [end + sign * offset * side for end in ends], road=1000 + 2 * a + (sign > 0))
                lanes.append(made)
                places[kind, a, k] = made
    links, connectors = [], {}
    ways = [*_ways(arms, set(forbidden))]
    for a, k, b, j in ways:
        before, after = places["in", a, k], places["out", b, j]
        line = curve(before.points[-1, :2], before.headings[-1], after.points[0, :2], after.headings[0])
        made = lane(len(lanes), line, 1)
        lanes.append(made)
        changes = {to: wrap_degrees(arms[to].angle - arms[a].angle + 180.0) for f, n, to, _ in ways if (f, n) == (a, k)}
        straightest = min(changes, key=lambda to: abs(changes[to]))
        links.append(LaneLink(before.id, made.id, turn_of(changes[b], alone=b == straightest)))
        links.append(LaneLink(made.id, after.id, LinkType.STRAIGHT))
        connectors[a, k, b] = made.id
    signals: list[Signal] = []
    at: dict[int, tuple[int, ...]] = {}
    for a, arm in enumerate(arms):
        if arm.sign is not None:
            groups = [[0], [*range(1, arm.lanes_in)]] if arm.turn_lane else [[*range(arm.lanes_in)]]
            rows = [_signal(len(signals) + n, arm.sign, [places["in", a, k] for k in g]) for n, g in enumerate(groups)]
            signals.extend(rows)
            at[a] = tuple(signal.id for signal in rows)
    crossing = Junction(id=1, position=(0.0, 0.0), connectors=tuple(connectors.values()))
    town = Town(name="meeting", lanes=lanes, links=links, junctions=[crossing], signals=signals)
    approaches = {(a, k): made.id for (kind, a, k), made in places.items() if kind == "in"}
    return Crossing(town, approaches, connectors, at)


def _ways(arms: Sequence[Arm], forbidden: set[tuple[int, int]]) -> Iterable[tuple[int, int, int, int]]:
    """Arm and lane in, arm and lane out: right turns outermost, left turns innermost, straight on side by side."""
    for (a, arm), (b, other) in itertools.permutations(enumerate(arms), 2):
        if (a, b) in forbidden or not arm.lanes_in or not other.exits:
            continue
        turn = turn_of(wrap_degrees(other.angle - arm.angle + 180.0))
        through = arm.lanes_in - arm.turn_lane
        if turn is LinkType.LEFT:
            yield a, 0, b, 0
        elif turn is LinkType.RIGHT:
            yield a, arm.lanes_in - 1, b, other.exits - 1
        else:
            for k in range(1, min(through, other.exits) + 1):
                yield a, arm.lanes_in - k, b, other.exits - k


def _signal(number: int, kind: SignalKind, ruled: Sequence[Lane]) -> Signal:
    x, y, z = ruled[0].points[-1]
    return Signal(id=number, kind=kind, position=(x, y, z), heading=0.0, lanes=tuple(lane.id for lane in ruled))


def town_of(
    lines: Sequence[tuple[int, Iterable[Sequence[float]]]],
    links: Iterable[tuple[int, int, LinkType]],
    signs: Mapping[int, SignalKind] | None = None,
) -> Town:
    """Town of individual lanes, each with its junction (-1 for none); `signs` stand at the ends of lanes."""
    lanes = [lane(k, points, junction) for k, (junction, points) in enumerate(lines)]
    numbers = sorted({lane.junction_id for lane in lanes if lane.in_junction})
    return Town(
        name="drawn",
        lanes=lanes,
        links=[LaneLink(*link) for link in links],
        junctions=[
            Junction(id=n, position=(0.0, 0.0), connectors=tuple(k.id for k in lanes if k.junction_id == n))
            for n in numbers
        ],
        signals=[_signal(n, kind, [lanes[at]]) for n, (at, kind) in enumerate((signs or {}).items())],
    )
