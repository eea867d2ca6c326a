from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from dorothie_gym.maps import Lane, LinkType, Town, load_town
from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.maps.right_of_way import RightOfWay, right_of_way
from tests.maps.crossings import LIGHT, STOP, YIELD, Arm, Crossing, curve, meeting, town_of
from tests.maps.opendrive_text import shared_map

EAST, SOUTH, WEST, NORTH = 0, 1, 2, 3
TOWNS = ("brookside", "Town01", "Town02", "Town05")


def town_named(name: str) -> Town:
    return load_town(shared_map(name) if name.startswith("Town") else name)


def four_way(*signs: tuple[int, SignalKind | None]) -> Crossing:
    at = dict(signs)
    return meeting(*(Arm(90.0 * k, at.get(k)) for k in range(4)))


def waits(crossing: Crossing, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Returns whether a movement between two arms (of one lane each) waits for another one."""
    table, way = right_of_way(crossing.town), crossing.connectors
    return way[other[0], 0, other[1]] in table.waits_for(way[one[0], 0, one[1]])


def meets(crossing: Crossing, one: tuple[int, int], other: tuple[int, int]) -> bool:
    table, way = right_of_way(crossing.town), crossing.connectors
    return way[other[0], 0, other[1]] in table.foes(way[one[0], 0, one[1]])


def test_ways_that_cross_or_join_are_foes_and_those_that_pass_are_not() -> None:
    crossing = four_way()
    assert meets(crossing, (WEST, EAST), (SOUTH, NORTH))  # cross
    assert meets(crossing, (WEST, EAST), (SOUTH, EAST))  # join
    assert meets(crossing, (WEST, NORTH), (EAST, WEST))  # left across the oncoming
    assert not meets(crossing, (WEST, EAST), (EAST, WEST))  # pass each other
    assert not meets(crossing, (WEST, SOUTH), (EAST, NORTH))  # right turns at opposite corners


def test_connectors_from_the_same_lane_do_not_conflict() -> None:
    crossing = four_way()
    table = right_of_way(crossing.town)
    ways = [crossing.connectors[WEST, 0, to] for to in (NORTH, EAST, SOUTH)]
    assert all(b not in table.foes(a) for a, b in itertools.permutations(ways, 2))


def test_neighbouring_lanes_may_be_driven_together_until_one_of_them_turns_across() -> None:
    crossing = meeting(Arm(180, lanes_in=2), Arm(0, lanes_in=2), Arm(270, lanes_in=2))
    table, way = right_of_way(crossing.town), crossing.connectors
    inner, outer, left = way[0, 0, 1], way[0, 1, 1], way[0, 0, 2]
    assert outer not in table.foes(inner)
    assert outer in table.foes(left)  # they begin 3.5 m apart, and who turns cuts corners
    assert outer not in table.waits_for(left)


@pytest.mark.parametrize(("gap", "straight", "turning"), [(3.0, True, True), (3.7, False, True), (4.2, False, False)])
def test_turns_need_more_room_beside_them(gap: float, straight: bool, turning: bool) -> None:
    starts = [(-1, [(-60, y), (0, y)]) for y in (0.0, gap)]
    links = [(0, 2, LinkType.STRAIGHT), (1, 3, LinkType.STRAIGHT)]
    right = curve(np.array([0.0, gap]), 0.0, np.array([15.0, gap + 15.0]), np.pi / 2)
    for way, meets in (([(0, gap), (20, gap)], straight), (right, turning)):
        table = right_of_way(town_of([*starts, (1, [(0, 0), (20, 0)]), (1, way)], links))
        assert table.foes(2) == ((3,) if meets else ())


def test_parts_of_one_way_through_a_junction_follow_each_other() -> None:
    lines = [(-1, [(-60, 0), (-10, 0)]), (1, [(-10, 0), (0, 0)]), (1, [(0, 0), (10, 0)])]
    table = right_of_way(town_of(lines, [(0, 1, LinkType.STRAIGHT), (1, 2, LinkType.STRAIGHT)]))
    assert table.foes(1) == table.foes(2) == ()


def test_yielding_lane_for_right_turns_does_not_wait_for_the_lane_beside_it() -> None:
    lines = [
        (-1, [(-60, 0), (0, 0)]),
        (-1, [(-60, 3.5), (0, 3.5)]),
        (1, [(0, 0), (20, 0)]),
        (1, [(0, 3.5), (7, 4.5), (12, 8), (14, 15)]),
    ]
    table = right_of_way(town_of(lines, [(0, 2, LinkType.STRAIGHT), (1, 3, LinkType.RIGHT)], {1: YIELD}))
    assert table.foes(3) == (2,)
    assert table.waits_for(3) == ()


def test_a_bridge_is_no_crossing() -> None:
    line, across = [(-20, 0), (20, 0)], [(0, -20), (0, 20)]

    def crossing_at(height: float) -> Town:
        lines = [(-1, [(-60, 0), (-20, 0)]), (1, line), (-1, [(0, -60), (0, -20)])]
        bridge = (1, [(*point, height) for point in across])
        return town_of([*lines, bridge], [(0, 1, LinkType.STRAIGHT), (2, 3, LinkType.STRAIGHT)])

    assert right_of_way(crossing_at(0.0)).foes(1) == (3,)
    assert right_of_way(crossing_at(5.0)).foes(1) == ()


def test_left_turn_waits_for_oncoming_traffic() -> None:
    crossing = four_way()
    assert waits(crossing, (WEST, NORTH), (EAST, WEST))
    assert waits(crossing, (WEST, NORTH), (EAST, NORTH))
    assert not waits(crossing, (EAST, WEST), (WEST, NORTH))
    assert not waits(crossing, (WEST, NORTH), (EAST, SOUTH))  # left turns pass each other
    assert not waits(crossing, (WEST, NORTH), (SOUTH, NORTH))  # from aside: the first to come is the first to go


@pytest.mark.parametrize("sign", [None, LIGHT, STOP, YIELD])
def test_left_turn_waits_under_any_sign_that_both_have(sign: SignalKind | None) -> None:
    crossing = four_way(*((k, sign) for k in range(4)))
    assert waits(crossing, (WEST, NORTH), (EAST, WEST))
    assert not waits(crossing, (WEST, EAST), (SOUTH, NORTH))


@pytest.mark.parametrize("sign", [STOP, YIELD])
def test_signed_approach_waits_for_unsigned_approach(sign: SignalKind | None) -> None:
    crossing = meeting(Arm(0), Arm(90, sign), Arm(180))
    east, stem, west = 0, 1, 2
    assert waits(crossing, (stem, west), (west, east))
    assert waits(crossing, (stem, west), (east, west))
    assert waits(crossing, (stem, east), (west, east))
    assert not waits(crossing, (stem, east), (east, west))  # it ends beside them
    assert waits(crossing, (east, stem), (west, east))  # left from the main street: as ever
    assert not waits(crossing, (east, stem), (stem, west))
    assert not waits(crossing, (west, east), (stem, west))


def test_a_sign_weighs_more_than_a_turn() -> None:
    crossing = four_way((EAST, STOP))
    assert waits(crossing, (EAST, WEST), (WEST, NORTH))
    assert not waits(crossing, (WEST, NORTH), (EAST, WEST))


def test_stop_and_yield_signs_are_equals() -> None:
    crossing = four_way((EAST, STOP), (SOUTH, YIELD))
    assert meets(crossing, (EAST, WEST), (SOUTH, NORTH))
    assert not waits(crossing, (EAST, WEST), (SOUTH, NORTH))
    assert not waits(crossing, (SOUTH, NORTH), (EAST, WEST))


@pytest.mark.parametrize("sign", [None, YIELD])
def test_merging_ramp_waits_if_it_has_a_sign(sign: SignalKind | None) -> None:
    lines = [
        (-1, [(-60, 0), (0, 0)]),
        (-1, [(-60, 15), (0, 5)]),
        (1, [(0, 0), (40, 0)]),
        (1, [(0, 5), (20, 1.5), (40, 0)]),
    ]
    links = [(0, 2, LinkType.STRAIGHT), (1, 3, LinkType.STRAIGHT)]
    table = right_of_way(town_of(lines, links, {1: sign} if sign else {}))
    assert table.foes(3) == (2,) and table.foes(2) == (3,)
    assert table.waits_for(3) == ((2,) if sign else ())
    assert table.waits_for(2) == ()


def test_entry_of_a_roundabout_waits_for_its_ring() -> None:
    angles = np.linspace(2.2, 0.9, 12)  # one comes along the ring counter-clockwise, from west to east in the south
    ring = np.column_stack((20 * np.cos(angles), 20 * np.sin(angles)))
    middle, end = ring[2:10], ring[9]
    lines = [
        (-1, ring[:3]),
        (-1, [(0, 60), (0, 30)]),
        (1, middle),
        (1, [(0, 30), (2, 25), (6, 20.5), tuple(end)]),
        (-1, ring[9:]),
    ]
    turns = (LinkType.STRAIGHT, LinkType.RIGHT, LinkType.STRAIGHT, LinkType.STRAIGHT)
    links = [(a, b, turn) for (a, b), turn in zip(((0, 2), (1, 3), (2, 4), (3, 4)), turns, strict=True)]
    table = right_of_way(town_of(lines, links, {1: YIELD}))
    assert table.waits_for(3) == (2,)
    assert table.waits_for(2) == ()


def abutting(*, signed: int) -> Town:
    """Two crossings of one-way streets 20 m apart: the main one's connector goes on in the next junction's."""
    lines = [
        (-1, [(-60, 0), (-10, 0)]),
        (1, [(-10, 0), (10, 0)]),
        (2, [(10, 0), (30, 0)]),
        (-1, [(0, 60), (0, 10)]),
        (1, [(0, 10), (0, -10)]),
        (-1, [(20, 60), (20, 10)]),
        (2, [(20, 10), (20, -10)]),
    ]
    pairs = ((0, 1), (1, 2), (3, 4), (5, 6))
    return town_of(lines, [(a, b, LinkType.STRAIGHT) for a, b in pairs], {signed: STOP})


def test_junctions_that_abut_each_have_their_own_right_of_way() -> None:
    table = right_of_way(abutting(signed=5))
    assert table.foes(1) == (4,) and table.foes(2) == (6,)  # 1 and 2 follow each other
    assert table.waits_for(6) == (2,) and table.waits_for(2) == ()
    assert table.waits_for(1) == table.waits_for(4) == ()
    # a sign between the two junctions stands at the end of a connector
    assert right_of_way(abutting(signed=1)).waits_for(2) == (6,)
    assert right_of_way(abutting(signed=1)).waits_for(1) == ()


def test_left_turn_out_of_a_junction_that_abuts_waits_too() -> None:
    line = np.array([(0.0, 0.0), (6.0, -1.0), (11.0, -5.0), (13.0, -15.0)])
    lines = [
        (-1, [(-60, 0), (-20, 0)]),
        (1, [(-20, 0), (0, 0)]),
        (2, line),
        (-1, [(60, -3.5), (20, -3.5)]),
        (2, [(20, -3.5), (0, -3.5)]),
    ]
    table = right_of_way(town_of(lines, [(a, b, LinkType.STRAIGHT) for a, b in ((0, 1), (1, 2), (3, 4))]))
    assert table.waits_for(2) == (4,)
    assert table.waits_for(4) == ()


def test_a_light_overrules_a_sign() -> None:
    crossing = four_way((EAST, STOP), (WEST, LIGHT))
    lanes = [crossing.approaches[k, 0] for k in range(4)]
    table = right_of_way(crossing.town)
    assert [table.control(lane) for lane in lanes] == [STOP, None, LIGHT, None]
    lines = [(-1, [(0, 0), (9, 0)]), (1, [(9, 0), (20, 0)])]
    for kinds in itertools.permutations((YIELD, LIGHT, STOP)):
        one = town_of(lines, [(0, 1, LinkType.STRAIGHT)], {0: kinds[0]})
        more = [*one.signals, *(town_of(lines, [], {0: kind}).signals[0] for kind in kinds[1:])]
        signed = Town(name="t", lanes=one.lanes, links=one.links, junctions=one.junctions, signals=more)
        assert RightOfWay(signed).control(0) is LIGHT


def test_lanes_outside_junctions_have_no_foes() -> None:
    crossing = four_way()
    table = right_of_way(crossing.town)
    for lane in crossing.town.lanes:
        assert bool(table.foes(lane.id)) == lane.in_junction


def test_right_of_way_is_found_once_for_a_town() -> None:
    town = four_way().town
    assert right_of_way(town) is right_of_way(town)


# What holds in every town


def check_order(town: Town) -> int:
    """Checks that conflicts are symmetric, priorities are not, and waiting has no cycles; returns the waits."""
    table = RightOfWay(town)
    follows: dict[int, tuple[int, ...]] = {}
    for lane in town.lanes:
        foes, first = table.foes(lane.id), table.waits_for(lane.id)
        assert foes == tuple(sorted(set(foes))) and first == tuple(sorted(set(first)))
        assert lane.id not in foes and set(first) <= set(foes)
        for other in foes:
            assert lane.id in table.foes(other)
            assert town.lanes[other].junction_id == lane.junction_id
        for other in first:
            assert lane.id not in table.waits_for(other)
        follows[lane.id] = first
    free = {lane for lane, first in follows.items() if not first}
    while len(free) < len(follows):  # let those go who wait for nobody, again and again
        more = {lane for lane, first in follows.items() if lane not in free and free.issuperset(first)}
        assert more, "some wait for one another in a circle"
        free |= more
    return sum(bool(first) for first in follows.values())


@pytest.mark.parametrize("name", TOWNS)
def test_no_mutual_waiting(name: str) -> None:
    assert check_order(town_named(name)) > 5


ARMS = st.lists(
    st.tuples(
        st.integers(0, 17),
        st.sampled_from([None, None, LIGHT, STOP, YIELD]),
        st.integers(1, 2),
        st.booleans(),
    ),
    min_size=3,
    max_size=5,
    unique_by=lambda arm: arm[0],
)


def arms_of(rows: list[tuple[int, SignalKind | None, int, bool]]) -> list[Arm]:
    return [
        Arm(20.0 * place, sign, lanes_in=lanes + turn_lane, turn_lane=turn_lane, median=4.0 * turn_lane)
        for place, sign, lanes, turn_lane in rows
    ]


@settings(max_examples=40, deadline=None)
@given(ARMS)
def test_no_mutual_waiting_at_any_junction(
    rows: list[tuple[int, SignalKind | None, int, bool]],
) -> None:
    check_order(meeting(*arms_of(rows), radius=25.0).town)


# Foes against an exhaustive search


def swept(lane: Lane) -> Array:
    """Circles that cover a car of 5 m x 2 m, every metre: the definition, place by place."""
    places = []
    for station in np.linspace(0.0, lane.length, int(lane.length) + 2):
        heading = lane.heading_at(station)
        for offset in (-1.7, 0.0, 1.7):
            places.append(lane.position(station) + offset * np.array([np.cos(heading), np.sin(heading)]))
    return np.array(places)


def touch(one: Lane, other: Lane) -> bool:
    turning = any(abs(lane.headings[-1] - lane.headings[0]) > np.radians(20.0) for lane in (one, other))
    level = abs(one.height_at(one.length / 2) - other.height_at(other.length / 2)) <= 2.5
    return level and float(cdist(swept(one), swept(other)).min()) < (3.9 if turning else 3.1)


@pytest.mark.parametrize(("name", "every"), [("brookside", 1), ("Town05", 7)])
def test_foes_are_those_that_an_exhaustive_search_finds(name: str, every: int) -> None:
    town = town_named(name)
    table, found = right_of_way(town), [0, 0]
    pairs = [p for junction in town.junctions for p in itertools.combinations(junction.connectors, 2)]
    for one, other in pairs[::every]:
        expected = touch(town.lanes[one], town.lanes[other])
        expected &= not set(town.predecessors(one)) & set(town.predecessors(other))
        assert (other in table.foes(one)) == expected, (one, other)
        found[expected] += 1
    assert min(found) > 20


def outline(lane: Lane, station: float) -> Array:
    heading = lane.heading_at(station)
    along, aside = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    return np.array(
        [lane.position(station) + 2.5 * a * along + b * aside for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    )


def overlap(one: Array, other: Array) -> bool:
    """Whether two rectangles (4, 2) overlap: no side of either separates them."""
    for box in (one, other):
        axes = np.diff(box[:3], axis=0)
        a, b = one @ axes.T, other @ axes.T
        if np.any((a.max(axis=0) < b.min(axis=0)) | (b.max(axis=0) < a.min(axis=0))):
            return False
    return True


def test_cars_on_ways_that_are_no_foes_never_touch() -> None:
    crossing = meeting(Arm(0, lanes_in=2), Arm(80), Arm(180, lanes_in=2), Arm(270))
    town, table, checked = crossing.town, right_of_way(crossing.town), 0
    for a, b in itertools.combinations(crossing.connectors.values(), 2):
        if b in table.foes(a) or set(town.predecessors(a)) & set(town.predecessors(b)):
            continue
        checked += 1
        here, there = ([outline(town.lanes[k], s) for s in np.arange(0.0, town.lanes[k].length, 1.0)] for k in (a, b))
        assert not any(overlap(p, q) for p in here for q in there)
    assert checked >= 5


def test_a_town_of_five_hundred_lanes_takes_a_quarter_of_a_second() -> None:
    town = town_named("Town05")
    spent = []
    for _ in range(3):  # other programs on the machine only ever make it slower
        begin = time.process_time()
        RightOfWay(town)
        spent.append(time.process_time() - begin)
    assert min(spent) < 0.25
