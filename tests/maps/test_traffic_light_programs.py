from __future__ import annotations

import itertools
import random
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from dorothie_gym.maps import Lane, LinkType, Town, load_town
from dorothie_gym.maps.model import Signal, SignalKind
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.town import LightColour, LightPhase, LightProgramme
from dorothie_gym.maps.traffic_light_programs import (
    ALL_RED,
    LEFT_GREEN,
    LONE_RED,
    SHORTEST_GREEN,
    STAGGER,
    THROUGH_GREEN,
    YELLOW,
    derive_programmes,
    yellow_time,
)
from dorothie_gym.support.portable_math import wrap_degrees
from tests.maps.crossings import LIGHT, STOP, Arm, Crossing, meeting, town_of
from tests.maps.opendrive_text import shared_map


def programmes(town: Town, signals: Sequence[Signal] | None = None) -> tuple[LightProgramme, ...]:
    return derive_programmes(town.lanes, town.links, town.junctions, town.signals if signals is None else signals)


def the_programme(crossing: Crossing) -> LightProgramme:
    (programme,) = programmes(crossing.town)
    return programme


def arms_at_green(crossing: Crossing, programme: LightProgramme) -> list[tuple[int, ...]]:
    """Arms that are green together, in the order of the phases."""
    arm_of = {signal: arm for arm, signals in crossing.signals.items() for signal in signals}
    return [tuple(sorted(arm_of[signal] for signal in phase.green)) for phase in programme.phases if phase.green]


def greens(programme: LightProgramme) -> list[float]:
    return [phase.duration for phase in programme.phases if phase.green]


def crossing_of(angles: Iterable[float]) -> Crossing:
    return meeting(*(Arm(angle, LIGHT) for angle in angles), radius=20.0)


def test_facing_approaches_of_a_crossing_share_a_phase() -> None:
    crossing = crossing_of((0, 90, 180, 270))
    programme = the_programme(crossing)
    assert sorted(arms_at_green(crossing, programme)) == [(0, 2), (1, 3)]
    assert greens(programme) == [THROUGH_GREEN] * 2
    assert programme.cycle == 2 * (THROUGH_GREEN + YELLOW + ALL_RED)


def test_stem_of_a_t_junction_has_its_own_phase() -> None:
    crossing = crossing_of((10, 95, 190))
    assert sorted(arms_at_green(crossing, the_programme(crossing))) == [(0, 2), (1,)]


def test_roads_that_meet_at_equal_angles_take_turns() -> None:
    crossing = crossing_of((0, 120, 240))
    programme = the_programme(crossing)
    assert sorted(arms_at_green(crossing, programme)) == [(0,), (1,), (2,)]
    assert greens(programme) == [15.0] * 3  # shorter, so that nobody waits too long


def test_five_roads_need_three_phases() -> None:
    crossing = crossing_of((0, 60, 120, 180, 270))
    groups = arms_at_green(crossing, the_programme(crossing))
    assert sorted(itertools.chain(*groups)) == [0, 1, 2, 3, 4]
    assert (0, 3) in groups  # the street that goes straight through
    assert len(groups) == 3
    even = crossing_of((0, 72, 144, 216, 288))
    assert sorted(len(group) for group in arms_at_green(even, the_programme(even))) == [1, 2, 2]


def test_many_phases_are_never_shorter_than_drivers_need() -> None:
    fan = crossing_of((0, 40, 80, 120))  # none faces another
    assert greens(the_programme(fan)) == [SHORTEST_GREEN] * 4


def test_every_green_is_followed_by_yellow_and_by_red_for_all() -> None:
    phases = the_programme(crossing_of((0, 90, 180, 270))).phases
    for green, yellow, red in zip(phases[::3], phases[1::3], phases[2::3], strict=True):
        assert yellow == LightPhase(duration=YELLOW, yellow=green.green)
        assert red == LightPhase(duration=ALL_RED)


def test_turn_lanes_have_green_of_their_own_before_those_beside_them() -> None:
    plain = [Arm(angle, LIGHT) for angle in (90, 270)]
    crossing = meeting(*plain, *(Arm(angle, LIGHT, lanes_in=3, turn_lane=True, median=5.0) for angle in (0, 180)))
    programme = the_programme(crossing)
    (east_left, east), (west_left, west) = crossing.signals[2], crossing.signals[3]
    shown = [phase for phase in programme.phases if phase.green]
    turns = next(k for k, phase in enumerate(shown) if east_left in phase.green)
    assert set(shown[turns].green) == {east_left, west_left}
    assert shown[turns].duration == LEFT_GREEN
    assert set(shown[(turns + 1) % len(shown)].green) == {east, west}
    assert len(shown) == 3


def test_turn_lane_without_another_that_faces_it_has_its_green_too() -> None:
    crossing = meeting(Arm(0, LIGHT, lanes_in=2, turn_lane=True), Arm(90, LIGHT), Arm(180, LIGHT), Arm(270, LIGHT))
    programme = the_programme(crossing)
    turn, through = crossing.signals[0]
    shown = [(phase.green, phase.duration) for phase in programme.phases if phase.green]
    assert ((turn,), LEFT_GREEN) in shown
    assert (tuple(sorted((through, *crossing.signals[2]))), THROUGH_GREEN) in shown


def test_turn_lane_without_facing_traffic_is_green_with_the_lane_beside_it() -> None:
    crossing = meeting(Arm(0, LIGHT), Arm(90, LIGHT, lanes_in=2, turn_lane=True), Arm(180, LIGHT))
    programme = the_programme(crossing)
    assert sorted(arms_at_green(crossing, programme)) == [(0, 2), (1, 1)]
    assert greens(programme) == [THROUGH_GREEN] * 2


def test_road_that_can_only_turn_left_is_an_approach_like_others() -> None:
    # a T with a one-way street: whoever comes from the stem has to turn left into it
    arms = (Arm(0, LIGHT), Arm(90, LIGHT, lanes_out=0), Arm(180, lanes_in=0, lanes_out=1))
    crossing = meeting(*arms, forbidden=[(1, 0)])
    assert [link.type for link in crossing.town.successors(crossing.approaches[1, 0])] == [LinkType.LEFT]
    assert greens(the_programme(crossing)) == [THROUGH_GREEN] * 2


@pytest.mark.parametrize("order", [*itertools.permutations((0, 30, 150, 180))])
def test_best_aligned_approaches_share_a_phase(order: tuple[int, ...]) -> None:
    crossing = crossing_of(order)
    groups = arms_at_green(crossing, the_programme(crossing))
    assert tuple(sorted((order.index(0), order.index(180)))) in groups


def two_one_way_streets(line: list[tuple[float, float]], *, joins: bool = False) -> list[tuple[int, ...]]:
    """Lights that are green together where a straight road from west to east meets a line.

    Of the line's places, the first two are the road that leads to the junction and the last two the one behind it.
    """
    places = [(-1, [(-60, 0), (-20, 0)]), (1, [(-20, 0), (20, 0)]), (-1, [(20, 0), (60, 0)])]
    places += [(-1, line[:2]), (1, line[1:] if joins else line[1:-1])] + ([] if joins else [(-1, line[-2:])])
    links = [(0, 1), (1, 2), (3, 4), (4, 2 if joins else 5)]
    town = town_of(places, [(a, b, LinkType.STRAIGHT) for a, b in links], {0: LIGHT, 3: LIGHT})
    (programme,) = programmes(town)
    return [phase.green for phase in programme.phases if phase.green]


def test_roads_at_a_small_angle_take_turns_if_their_ways_meet() -> None:
    beside = [(-60.0, 5.0), (-20.0, 5.0), (20.0, 5.0), (60.0, 5.0)]
    across = [(-60.0, 18.0), (-20.0, 6.0), (20.0, -6.0), (60.0, -18.0)]
    joining = [(-60.0, 18.0), (-20.0, 6.0), (20.0, 0.2)]
    assert two_one_way_streets(beside) == two_one_way_streets(beside[::-1]) == [(0, 1)]
    assert two_one_way_streets(across) == two_one_way_streets(across[::-1]) == [(0,), (1,)]
    assert two_one_way_streets(joining, joins=True) == [(0,), (1,)]


def test_roads_from_aside_take_turns_even_where_their_ways_do_not_meet() -> None:
    from_the_south = [(-20.0, 60.0), (-20.0, 20.0), (-15.0, 10.0), (20.0, 8.0), (60.0, 8.0)]
    assert two_one_way_streets(from_the_south) == [(0,), (1,)]


@pytest.mark.parametrize("turn_lane", [False, True])
def test_lights_that_share_a_lane_show_the_same(turn_lane: bool) -> None:
    crossing = meeting(*(Arm(90.0 * k, LIGHT, lanes_in=2, turn_lane=turn_lane) for k in range(4)), radius=20.0)
    inner, outer = crossing.approaches[0, 0], crossing.approaches[0, 1]
    place = crossing.town.signals[0].position
    more = [
        Signal(id=50 + k, kind=LIGHT, position=place, heading=0.0, lanes=lanes)
        for k, lanes in enumerate(((outer,), (inner,), (inner, outer)))
    ]
    (programme,) = programmes(crossing.town, [*more, *crossing.town.signals])
    assert {50, 51, 52} < set(programme.signals)
    same = {*crossing.signals[0], 50, 51, 52}
    for phase in programme.phases:
        for shown in (phase.green, phase.yellow):
            assert same <= set(shown) or same.isdisjoint(shown)


def test_signals_that_rule_no_approach_are_left_out() -> None:
    crossing = crossing_of((0, 90, 180, 270))
    away = next(lane.id for lane in crossing.town.lanes if not crossing.town.successors(lane.id))
    more = [
        Signal(id=60, kind=LIGHT, position=(0.0, 0.0, 0.0), heading=0.0),
        Signal(id=61, kind=LIGHT, position=(0.0, 0.0, 0.0), heading=0.0, lanes=(away,)),
        Signal(id=62, kind=STOP, position=(0.0, 0.0, 0.0), heading=0.0, lanes=(crossing.approaches[0, 0],)),
    ]
    assert programmes(crossing.town, [*crossing.town.signals, *more]) == programmes(crossing.town)
    assert programmes(crossing.town, more) == ()


def test_light_for_both_directions_of_a_road_belongs_to_the_junction_it_stands_at() -> None:
    town = load_town("brookside")
    ends = {lane.id: {link.target for link in town.successors(lane.id)} for lane in town.lanes if not lane.in_junction}
    road = next(road for road, n in Counter(town.lanes[k].road_id for k in ends).items() if n == 2)
    here, there = (lane for lane in ends if town.lanes[lane].road_id == road)
    for near in (here, there):
        x, y, z = town.lanes[near].points[-1]
        light = Signal(id=1, kind=LIGHT, position=(x + 2.0, y, z), heading=0.0, lanes=(here, there))
        (programme,) = programmes(town, [light])
        assert programme.junction_id == town.exits(near)[0].junction_id


@pytest.mark.parametrize("lit", [(1,), (0, 2)])
def test_lights_with_a_single_phase_still_cycle(lit: tuple[int, ...]) -> None:
    crossing = meeting(*(Arm(90.0 * k, LIGHT if k in lit else None) for k in range(4)))
    programme = the_programme(crossing)
    assert greens(programme) == [THROUGH_GREEN]
    for signal in programme.signals:
        shown = Counter(programme.colour(signal, t) for t in np.arange(0.0, programme.cycle, 0.5))
        seconds = {colour: n * 0.5 for colour, n in shown.items()}
        assert seconds == {
            LightColour.GREEN: THROUGH_GREEN,
            LightColour.YELLOW: YELLOW,
            LightColour.RED: ALL_RED + LONE_RED,
        }


def test_programmes_follow_the_junctions_and_not_all_change_at_once() -> None:
    town = load_town("brookside")
    found = programmes(town)
    ruled = {lane for signal in town.signals if signal.kind is LIGHT for lane in signal.lanes}
    with_lights = {way.junction_id for lane in ruled for way in town.exits(lane)}
    assert [p.junction_id for p in found] == [j.id for j in town.junctions if j.id in with_lights]
    assert len(found) > 1
    assert [p.offset for p in found] == [k * STAGGER % p.cycle for k, p in enumerate(found)]


def test_order_of_the_signals_does_not_matter() -> None:
    town = load_town("brookside")
    mixed = list(town.signals)
    random.Random(5).shuffle(mixed)
    assert programmes(town, mixed) == programmes(town)


# What holds in every town


def lit(town: Town, *, each_lane: bool) -> Town:
    """The town with lights at every approach: one for each lane, or for all lanes of a road that lead to a junction."""
    groups: defaultdict[tuple[int, ...], list[Lane]] = defaultdict(list)
    for lane in town.lanes:
        for junction in sorted({town.lanes[k.target].junction_id for k in town.successors(lane.id)} - {-1}):
            groups[junction, *((lane.id,) if each_lane else (lane.road_id, lane.lane_id < 0))].append(lane)
    signals = [
        Signal(
            id=k,
            kind=SignalKind.TRAFFIC_LIGHT,
            position=tuple(group[0].points[-1]),
            heading=0.0,
            lanes=tuple(lane.id for lane in group),
        )
        for k, group in enumerate(groups.values())
    ]
    return Town(name=town.name, lanes=town.lanes, links=town.links, junctions=town.junctions, signals=signals)


def start(lane: Lane) -> float:
    return float(np.degrees(lane.headings[0]))


def meet(one: Lane, other: Lane) -> bool:
    """Whether centre lines cross or join, looked at every 10 cm."""
    places = [
        np.column_stack([np.interp(np.arange(0.0, k.length + 0.1, 0.1), k.stations, k.points[:, i]) for i in (0, 1)])
        for k in (one, other)
    ]
    near, _ = cKDTree(places[0]).query(places[1])
    return bool(near.min() < 0.08)


def check(town: Town) -> int:
    """Checks the programmes of a town; gives how many pairs of ways meet and never are green together.

    Ways that turn left are let off: they wait for who comes towards them.
    """
    found = programmes(town)
    table, ruled = right_of_way(town), {signal.id: signal.lanes for signal in town.signals}
    lights = {signal.id for signal in town.signals if signal.kind is LIGHT}
    assert sorted(itertools.chain(*(programme.signals for programme in found))) == sorted(lights)
    kinds = {link.target: link.type for link in town.links}
    kept_apart = 0
    for programme in found:
        green = Counter(itertools.chain(*(phase.green for phase in programme.phases)))
        assert green == Counter(programme.signals)  # each once in a cycle
        together = {frozenset(pair) for phase in programme.phases for pair in itertools.permutations(phase.green, 2)}
        for pair in itertools.combinations(programme.signals, 2):
            ways = [
                [k for lane in ruled[signal] for k in town.successors(lane) if k.type is not LinkType.LEFT]
                for signal in pair
            ]
            for a, b in itertools.product(*ways):
                one, other = town.lanes[a.target], town.lanes[b.target]
                if a.source == b.source:
                    continue
                aside = 45.0 < abs(wrap_degrees(start(one) - start(other))) < 135.0
                straight = kinds[one.id] is kinds[other.id] is LinkType.STRAIGHT
                if meet(one, other) or (straight and aside and other.id in table.foes(one.id)):
                    assert frozenset(pair) not in together, (programme.junction_id, pair)
                    kept_apart += 1
    return kept_apart


@pytest.mark.parametrize("name", ["brookside", "Town01", "Town02", "Town05"])
def test_ways_that_meet_are_never_green_together(name: str) -> None:
    town = load_town(shared_map(name) if name.startswith("Town") else name)
    for each_lane in (False, True):
        assert check(lit(town, each_lane=each_lane)) >= 8
    check(town)


ARMS = st.lists(
    st.tuples(st.integers(0, 23), st.sampled_from([LIGHT, LIGHT, LIGHT, None]), st.integers(1, 2), st.booleans()),
    min_size=3,
    max_size=5,
    unique_by=lambda arm: arm[0],
)


@settings(max_examples=40, deadline=None)
@given(ARMS)
def test_every_light_has_its_green_at_any_meeting_of_roads(
    rows: list[tuple[int, SignalKind | None, int, bool]],
) -> None:
    arms = [
        Arm(15.0 * place, sign, lanes_in=lanes + turn_lane, turn_lane=turn_lane, median=4.0 * turn_lane)
        for place, sign, lanes, turn_lane in rows
    ]
    crossing = meeting(*arms, radius=40.0)
    leading = {lane for (arm, k), lane in crossing.approaches.items() if crossing.town.successors(lane)}
    signals = [s for s in crossing.town.signals if leading.intersection(s.lanes)]
    town = crossing.town
    check(Town(name="t", lanes=town.lanes, links=town.links, junctions=town.junctions, signals=signals))


@pytest.mark.parametrize(("kmh", "seconds"), [(30, 3.0), (40, 3.0), (50, 3.5), (60, 4.0), (90, 5.5), (130, 6.0)])
def test_yellow_is_longer_where_cars_are_faster(kmh: float, seconds: float) -> None:
    assert yellow_time(kmh / 3.6) == seconds
    # who is too near to stop at 3 m/s2 after a second is over the line before red
    assert seconds == 6.0 or 1.0 + kmh / 3.6 / 6.0 <= seconds


@pytest.mark.parametrize("offset", [0.0, 7.3, -41.9])
def test_phase_stays_until_its_change(offset: float) -> None:
    phases = tuple(LightPhase(duration=duration, green=(k,)) for k, duration in enumerate((0.1, 12.0, 3.3, 8.7)))
    programme = LightProgramme(junction_id=1, signals=(0, 1, 2, 3), phases=phases, offset=offset)
    for time in np.linspace(0.0, 97.0, 991).tolist():
        change = programme.change_after(time)
        assert change < time + 12.0
        if change > time:
            assert programme.phase_at(change) == programme.phase_at(0.5 * (time + change)) == programme.phase_at(time)
            assert programme.phase_at(change + 1e-5) != programme.phase_at(time)
