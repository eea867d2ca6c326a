"""Small towns made by hand, and all towns at hand, to test roads with."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import Lane, LaneLink, LinkType, Town, load_town, town_names
from dorothie_gym.sim.network.network import TownNetwork

MAPS = Path(__file__).resolve().parents[3] / "../shared/maps"
LEFT, RIGHT = LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT


def lane(id: int, points: Sequence[Sequence[float]], *, road: int = 0, number: int = -1, junction: int = -1) -> Lane:
    """A lane 4 m wide through points (x, y) or (x, y, z)."""
    places = np.array([(*p, 0.0)[:3] for p in points], dtype=float)
    widths = np.full(len(places), 4.0)
    return Lane(
        id=id, road_id=road, lane_id=number, junction_id=junction, points=places, widths=widths, speed_limit=14.0
    )


def town(lanes: Sequence[Lane], links: Sequence[tuple[int, int, LinkType]] = (), name: str = "hand-made") -> Town:
    return Town(name=name, lanes=lanes, links=[LaneLink(*link) for link in links], junctions=[])


def straight_town(lanes: int = 3, roads: int = 3, length: float = 100.0) -> Town:
    """Roads one after the other to the east, lanes 0, 1, ... from left to right."""
    made, links = [], []
    for road in range(roads):
        for number in range(lanes):
            id = road * lanes + number
            ends = [(road * length, 4.0 * number), ((road + 1) * length, 4.0 * number)]
            made.append(lane(id, ends, road=road, number=-1 - number))
            if road:
                links.append((id - lanes, id, LinkType.STRAIGHT))
            if number:
                links += [(id, id - 1, LEFT), (id - 1, id, RIGHT)]
    return town(made, links)


def curve_points(radius: float = 30.0, angle: float = np.pi / 2, step: float = 1.0) -> list[tuple[float, float]]:
    """An arc to the right that starts in the origin to the east."""
    turns = np.linspace(0.0, angle, int(radius * angle / step) + 2)
    return [(radius * np.sin(a), radius * (1 - np.cos(a))) for a in turns]


def curve_town() -> Town:
    """A quarter circle to the right and on to the south."""
    return town([lane(0, curve_points()), lane(1, [(30, 30), (30, 90)], road=1)], [(0, 1, LinkType.STRAIGHT)])


def overpass_town() -> Town:
    """A road to the east, and one to the south that crosses it on a bridge 6 m high."""
    under = [(-100.0, 0.0, 0.0), (100.0, 0.0, 0.0)]
    over = [(0.0, -100.0, 0.0), (0.0, -40.0, 6.0), (0.0, 40.0, 6.0), (0.0, 100.0, 0.0)]
    return town([lane(0, under), lane(1, over, road=1)])


def bend(
    start: tuple[float, float], corner: tuple[float, float], end: tuple[float, float]
) -> list[tuple[float, float]]:
    """A turn: points of a quadratic Bezier curve."""
    a, b, c = (np.array(p, dtype=float) for p in (start, corner, end))
    return [tuple((1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c) for t in np.linspace(0, 1, 13)]


# Lanes of the T: to the junction from the west, east and south, away from it to the west, east and south, connectors
WEST_IN, EAST_IN, SOUTH_IN, WEST_OUT, EAST_OUT, SOUTH_OUT = range(6)
WEST_EAST, WEST_SOUTH, EAST_WEST, EAST_SOUTH, SOUTH_WEST, SOUTH_EAST = range(6, 12)


def t_junction_town() -> Town:
    """A street from west to east with one from the south, one lane in each direction, driving on the right."""
    made = [
        lane(WEST_IN, [(-90, 2), (-10, 2)], road=0),
        lane(EAST_IN, [(90, -2), (10, -2)], road=1),
        lane(SOUTH_IN, [(2, 90), (2, 10)], road=2),
        lane(WEST_OUT, [(-10, -2), (-90, -2)], road=0, number=1),
        lane(EAST_OUT, [(10, 2), (90, 2)], road=1, number=1),
        lane(SOUTH_OUT, [(-2, 10), (-2, 90)], road=2, number=1),
        lane(WEST_EAST, [(-10, 2), (10, 2)], road=3, junction=7),
        lane(WEST_SOUTH, bend((-10, 2), (-2, 2), (-2, 10)), road=4, junction=7),
        lane(EAST_WEST, [(10, -2), (-10, -2)], road=5, junction=7),
        lane(EAST_SOUTH, bend((10, -2), (-2, -2), (-2, 10)), road=6, junction=7),
        lane(SOUTH_WEST, bend((2, 10), (2, -2), (-10, -2)), road=7, junction=7),
        lane(SOUTH_EAST, bend((2, 10), (2, 2), (10, 2)), road=8, junction=7),
    ]
    turns = [
        (WEST_IN, WEST_EAST, EAST_OUT, LinkType.STRAIGHT),
        (WEST_IN, WEST_SOUTH, SOUTH_OUT, LinkType.RIGHT),
        (EAST_IN, EAST_WEST, WEST_OUT, LinkType.STRAIGHT),
        (EAST_IN, EAST_SOUTH, SOUTH_OUT, LinkType.LEFT),
        (SOUTH_IN, SOUTH_WEST, WEST_OUT, LinkType.LEFT),
        (SOUTH_IN, SOUTH_EAST, EAST_OUT, LinkType.RIGHT),
    ]
    links = [(a, b, kind) for a, b, _, kind in turns] + [(b, c, LinkType.STRAIGHT) for _, b, c, _ in turns]
    return town(made, links)


HAND_MADE = {
    "straight": straight_town,
    "curve": curve_town,
    "overpass": overpass_town,
    "t-junction": t_junction_town,
}
EVERY_TOWN = [*HAND_MADE, *town_names(), "Town01.xodr", "Town02.xodr", "Town05.xodr"]


def find_town(name: str) -> Town:
    """A town by name; skips the test where a map is not at hand."""
    if name in HAND_MADE:
        return HAND_MADE[name]()
    if not name.endswith(".xodr"):
        return load_town(name)
    if not (MAPS / name).exists():
        pytest.skip(f"needs {name} in ../shared/maps")
    return load_town(str(MAPS / name))


def places(network: TownNetwork, count: int, seed: int) -> Iterator[tuple[np.ndarray, float, float]]:
    """Positions, headings and heights: on lanes, at their ends, anywhere in and around the town, and far away."""
    rng = np.random.default_rng(seed)
    lanes = network.lanes_list()
    low, high = network.table.boxes[:, :2].min(axis=0), network.table.boxes[:, 2:].max(axis=0)
    for i in range(count):
        chosen = lanes[rng.integers(len(lanes))]
        station = rng.uniform(0, chosen.length) if i % 4 else rng.choice([0.0, chosen.length])
        place = chosen.position(station, rng.normal(scale=1.5) if i % 3 else 0.0)
        heading, height = chosen.heading_at(station), chosen.height_at(station)
        if i % 5 == 1:
            place = rng.uniform(low - 100, high + 100)
        if i % 50 == 2:
            place = rng.uniform(-1e6, 1e6, size=2)
        yield place, heading + rng.normal(scale=(0.0, 0.2, 3.0)[i % 3]), height + rng.normal(scale=2.0)
