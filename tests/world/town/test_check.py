"""Each fault is made by damaging a sound town: exactly that fault has to be found, where it was made."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from highway_env.vehicle.kinematics import Vehicle
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.world.car.control import MAX_STEERING
from dorothie_gym.world.town.catalogue import load_town, town_names
from dorothie_gym.world.town.check import Fault, FaultKind, check_town
from dorothie_gym.world.town.check.car import CAR_WIDTH, SMALLEST_RADIUS
from dorothie_gym.world.town.model import (
    Array,
    Junction,
    Lane,
    LaneLink,
    LinkType,
    Sidewalk,
    Signal,
    SignalKind,
    Town,
)

from .opendrive_text import shared_map
from .yaml_plans import TIGHT_RAMPS, compiled, star

LEFT, RIGHT, STRAIGHT, U_TURN = LinkType.LEFT, LinkType.RIGHT, LinkType.STRAIGHT, LinkType.U_TURN


def rebuilt(
    town: Town,
    *,
    lanes: Sequence[Lane] | None = None,
    links: Sequence[LaneLink] | None = None,
    signals: Sequence[Signal] | None = None,
    sidewalks: Sequence[Sidewalk] | None = None,
) -> Town:
    return Town(
        name=town.name,
        lanes=town.lanes if lanes is None else lanes,
        links=town.links if links is None else links,
        junctions=town.junctions,
        signals=town.signals if signals is None else signals,
        sidewalks=town.sidewalks if sidewalks is None else sidewalks,
        programmes=town.programmes,
    )


def with_lane(town: Town, lane: Lane) -> Town:
    return rebuilt(town, lanes=[lane if old.id == lane.id else old for old in town.lanes])


def retyped(town: Town, link: LaneLink, kind: LinkType) -> Town:
    return rebuilt(town, links=[replace(old, type=kind) if old == link else old for old in town.links])


def resampled(lane: Lane, spacing: float = 0.5) -> Lane:
    s = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / spacing) + 1))
    points = np.column_stack([np.interp(s, lane.stations, column) for column in lane.points.T])
    return replace(lane, points=points, widths=np.interp(s, lane.stations, lane.widths))


def pushed(lane: Lane, aside: Callable[[Array, float], Array]) -> Lane:
    """The lane with its points moved to the right by a function of their stations and the lane's length."""
    lane = resampled(lane)
    right = np.column_stack((-np.sin(lane.headings), np.cos(lane.headings)))
    points = lane.points.copy()
    points[:, :2] += aside(lane.stations, lane.length)[:, None] * right
    return replace(lane, points=points)


def bulge(size: float) -> Callable[[Array, float], Array]:
    return lambda s, length: size * np.sin(np.pi * s / length) ** 2


def lane(number: int, points: Array, *, road: int | None = None, lane_id: int = -1, width: float = 3.5) -> Lane:
    points = points if points.shape[1] == 3 else np.column_stack((points, np.zeros(len(points))))
    road = number if road is None else road
    widths = np.full(len(points), width)
    return Lane(id=number, road_id=road, lane_id=lane_id, points=points, widths=widths, speed_limit=10.0)


def ring() -> Town:
    """Two lanes around a circle, in two halves: 0 and 2 outside, 1 and 3 inside; driven clockwise as seen."""
    lanes, links = [], []
    for half in (0, 1):
        angle = np.linspace(np.pi * half, np.pi * (half + 1), 120)
        circle = np.column_stack((np.cos(angle), np.sin(angle)))
        lanes += [lane(2 * half + k, circle * (60.0 - 3.5 * k), road=half, lane_id=-2 + k) for k in (0, 1)]
        outer, inner = 2 * half, 2 * half + 1
        links += [LaneLink(k, (k + 2) % 4, STRAIGHT) for k in (outer, inner)]
        links += [
            LaneLink(outer, inner, LinkType.LANE_CHANGE_RIGHT),  # the middle of a clockwise circle is on the right
            LaneLink(inner, outer, LinkType.LANE_CHANGE_LEFT),
        ]
    return Town(name="ring", lanes=lanes, links=links, junctions=[])


def eight(height: float = 6.0, *, crossing: int | None = None) -> Town:
    """Four lanes along a figure of eight; 0 passes `height` above 2, and may be said to be a connector."""
    lanes = []
    for k in range(4):
        t = np.linspace(-0.25 + 0.5 * k, 0.25 + 0.5 * k, 100) * np.pi
        points = np.column_stack((80.0 * np.sin(t), 80.0 * np.sin(t) * np.cos(t), 0.5 * height * (1.0 + np.cos(t))))
        lanes.append(replace(lane(k, points), junction_id=5 if k == crossing else -1))
    junctions = [] if crossing is None else [Junction(id=5, position=(0.0, 0.0), connectors=(crossing,))]
    links = [LaneLink(k, (k + 1) % 4, STRAIGHT) for k in range(4)]
    return Town(name="eight", lanes=lanes, links=links, junctions=junctions)


def paperclip(radius: float, *, step: float = 8.0) -> Town:
    """Two straights joined by half circles: each lane is a straight and a half circle in steps of so many degrees."""
    turn = np.radians(np.linspace(0.0, 180.0, round(180.0 / step) + 1)) - 0.5 * np.pi
    half = np.column_stack((20.0 + radius * np.cos(turn), radius * np.sin(turn)))
    points = np.concatenate(([[-20.0, -radius]], half))
    links = [LaneLink(0, 1, STRAIGHT), LaneLink(1, 0, STRAIGHT)]
    return Town(name="clip", lanes=[lane(0, points), lane(1, -points)], links=links, junctions=[])


@lru_cache(maxsize=1)
def brookside() -> Town:
    return load_town("brookside")


def a_connector(kind: LinkType) -> LaneLink:
    """A way into a junction of brookside, of the junction that has most connectors."""
    town = brookside()
    busiest = max(town.junctions, key=lambda junction: len(junction.connectors))
    return next(link for link in town.links if link.target in busiest.connectors and link.type is kind)


def a_street() -> Lane:
    """The longest lane of brookside outside junctions."""
    return max((lane for lane in brookside().lanes if not lane.in_junction), key=lambda lane: lane.length)


def only(faults: Sequence[Fault], kind: FaultKind) -> Sequence[Fault]:
    assert faults, "nothing is found"
    assert {fault.kind for fault in faults} == {kind}, faults
    return faults


def near(fault: Fault, place: Array, within: float = 1.0) -> bool:
    return math.dist(fault.position, place[:2]) <= within


@pytest.mark.parametrize("town", [ring(), eight(), paperclip(4.0)], ids=lambda town: town.name)
def test_small_sound_towns_have_no_faults(town: Town) -> None:
    assert check_town(town) == ()


@pytest.mark.parametrize("name", town_names())
def test_towns_that_are_shipped_have_no_faults(name: str) -> None:
    assert check_town(load_town(name)) == ()


@pytest.mark.parametrize("name", ["Town01", "Town02", "Town05"])
def test_published_maps_have_no_faults(name: str) -> None:
    assert check_town(load_town(shared_map(name))) == ()


def test_a_town_without_lanes_has_no_faults() -> None:
    assert check_town(Town(name="void", lanes=[], links=[], junctions=[])) == ()


class TestReach:
    def test_a_connector_that_nothing_leads_into_is_unreachable(self) -> None:
        way = a_connector(RIGHT)
        town = brookside()
        faults = check_town(rebuilt(town, links=[link for link in town.links if link.target != way.target]))
        (fault,) = only(faults, FaultKind.UNREACHABLE)
        assert fault.lanes == (way.target,) and "reached" in fault.message
        assert near(fault, town.lanes[way.target].points[0], within=town.lanes[way.target].length)

    def test_a_lane_that_goes_on_nowhere_is_a_dead_end_and_what_leads_there_has_no_way_back(self) -> None:
        town, street = brookside(), a_street()
        links = [link for link in town.links if link.source != street.id]
        found = {fault.kind: fault for fault in check_town(rebuilt(town, links=links))}
        assert set(found) == {FaultKind.DEAD_END, FaultKind.NO_RETURN, FaultKind.UNREACHABLE}
        assert found[FaultKind.DEAD_END].lanes == (street.id,)
        assert near(found[FaultKind.DEAD_END], street.points[-1])
        no_return = [f.lanes for f in check_town(rebuilt(town, links=links)) if f.kind is FaultKind.NO_RETURN]
        assert sorted(sum(no_return, ())) == sorted(town.predecessors(street.id))

    def test_a_lane_that_runs_out_beside_another_is_no_dead_end(self) -> None:
        town = ring()
        assert (
            check_town(rebuilt(town, links=[link for link in town.links if (link.source, link.target) != (0, 2)])) == ()
        )

    def test_a_part_that_hangs_together_is_one_fault(self) -> None:
        first, second = ring(), ring()
        away = [replace(row, id=row.id + 4, road_id=row.road_id + 4, points=row.points + 500.0) for row in second.lanes]
        links = [*first.links, *(LaneLink(k.source + 4, k.target + 4, k.type) for k in second.links)]
        (fault,) = only(check_town(rebuilt(first, lanes=[*first.lanes, *away], links=links)), FaultKind.UNREACHABLE)
        assert fault.lanes == (4, 5, 6, 7) and "nor left" in fault.message


class TestJoints:
    @pytest.mark.parametrize(("shift", "faulty"), [(0.04, False), (0.06, True), (0.4, True)])
    def test_linked_lanes_that_do_not_touch(self, shift: float, faulty: bool) -> None:
        street = a_street()
        moved = replace(street, points=street.points + np.array([0.0, shift, 0.0]))
        faults = check_town(with_lane(brookside(), moved))
        if not faulty:
            assert faults == ()
            return
        ends = moved.points[[0, -1]]
        for fault in only(faults, FaultKind.GAP):
            assert street.id in fault.lanes and f"{shift:.2f} m" in fault.message
            assert any(near(fault, end) for end in ends)

    @pytest.mark.parametrize(("rise", "faulty"), [(0.04, False), (0.06, True), (-2.0, True)])
    def test_steps_between_linked_lanes(self, rise: float, faulty: bool) -> None:
        street = a_street()
        faults = check_town(with_lane(brookside(), replace(street, points=street.points + np.array([0.0, 0.0, rise]))))
        if not faulty:
            assert faults == ()
            return
        assert all(street.id in fault.lanes for fault in only(faults, FaultKind.HEIGHT_STEP))

    @pytest.mark.parametrize(("degrees", "faulty"), [(4.5, False), (-4.5, False), (6.0, True), (-6.0, True)])
    def test_a_lane_that_begins_in_another_direction(self, degrees: float, faulty: bool) -> None:
        street, slope = a_street(), math.tan(math.radians(degrees))
        town = with_lane(brookside(), pushed(street, lambda s, length: slope * s * np.maximum(1.0 - s / 9.0, 0.0) ** 2))
        faults = check_town(town)
        if not faulty:
            assert faults == ()
            return
        assert {fault.lanes for fault in only(faults, FaultKind.KINK)} == {
            (before, street.id) for before in brookside().predecessors(street.id)
        }
        assert all(near(fault, street.points[0]) for fault in faults)
        assert all(("right" if degrees > 0 else "left") in fault.message for fault in faults)


class TestCentreLines:
    @pytest.mark.parametrize("spacing", [0.5, 5.0])
    def test_a_point_out_of_line_is_a_kink(self, spacing: float) -> None:
        street = resampled(a_street(), spacing)
        points, middle = street.points.copy(), len(street.points) // 2
        heading = street.headings[middle]
        points[middle, :2] += 0.1 * spacing * np.array([-math.sin(heading), math.cos(heading)])
        (fault,) = only(check_town(with_lane(brookside(), replace(street, points=points))), FaultKind.KINK)
        assert fault.lanes == (street.id,) and near(fault, points[middle], within=spacing + 0.1)

    def test_arcs_are_no_kinks_however_coarse_their_steps_within_reason(self) -> None:
        assert check_town(paperclip(4.0, step=12.0)) == ()
        assert check_town(paperclip(10.0, step=6.0)) == ()

    def test_a_polygon_is_no_arc(self) -> None:
        faults = check_town(paperclip(30.0, step=15.0))
        assert {fault.kind for fault in faults} == {FaultKind.KINK} and len(faults) >= 20

    def test_a_curve_tighter_than_the_car_can_turn(self) -> None:
        faults = only(check_town(paperclip(2.0)), FaultKind.TIGHT_CURVE)
        assert [fault.lanes for fault in faults] == [(0,), (1,)]
        assert near(faults[0], np.array([22.0, 0.0])) and "radius of 2.0 m" in faults[0].message

    def test_the_smallest_radius_is_the_cars(self) -> None:
        slip = math.atan(0.5 * math.tan(MAX_STEERING))
        assert SMALLEST_RADIUS == pytest.approx(0.5 * Vehicle.LENGTH / math.sin(slip), abs=0.005)
        assert CAR_WIDTH == Vehicle.WIDTH

    def test_a_step_within_a_lane(self) -> None:
        street = resampled(a_street(), 1.0)
        points, middle = street.points.copy(), len(street.points) // 2
        points[middle:, 2] += 1.0
        points[:, 2] -= np.linspace(0.0, 1.0, len(points))  # back to the ground until the end, gently
        (fault,) = only(check_town(with_lane(brookside(), replace(street, points=points))), FaultKind.HEIGHT_STEP)
        assert fault.lanes == (street.id,) and near(fault, points[middle], within=1.1)

    def test_a_lane_narrower_than_the_car(self) -> None:
        street = resampled(a_street(), 1.0)
        widths = street.widths.copy()
        widths[20:30] = 1.8
        (fault,) = only(check_town(with_lane(brookside(), replace(street, widths=widths))), FaultKind.NARROW)
        assert "1.80 m" in fault.message and any(near(fault, point) for point in street.points[20:30])

    def test_a_lane_that_runs_out_may_be_narrow_at_its_end(self) -> None:
        town = ring()
        outer = town.lanes[0]
        widths = outer.widths * np.linspace(1.0, 0.0, len(outer.widths))
        tapered = with_lane(town, replace(outer, widths=widths))
        only(check_town(tapered), FaultKind.NARROW)
        ended = [link for link in tapered.links if (link.source, link.target) != (0, 2)]
        assert check_town(rebuilt(tapered, links=ended)) == ()


class TestKerbs:
    def test_a_turn_that_cuts_the_corner(self) -> None:
        turn = brookside().lanes[a_connector(RIGHT).target]
        (fault,) = only(check_town(with_lane(brookside(), pushed(turn, bulge(2.0)))), FaultKind.KERB)
        assert fault.lanes == (turn.id,) and "corner" in fault.message
        assert near(fault, turn.position(0.5 * turn.length), within=3.5)

    def test_another_turns_corner_is_a_kerb_too(self) -> None:
        way = a_connector(STRAIGHT)
        turn = brookside().lanes[way.target]
        (fault,) = only(check_town(with_lane(brookside(), pushed(turn, bulge(6.0)))), FaultKind.KERB)
        assert fault.lanes == (turn.id,) and "corner" in fault.message

    def test_a_way_off_the_ground_of_a_junction_with_three_arms(self) -> None:
        town = brookside()
        junction = next(j for j in town.junctions if len(j.connectors) == 6)
        middle = np.mean([town.lanes[k].position(0.5 * town.lanes[k].length) for k in junction.connectors], axis=0)
        straight = next(
            town.lanes[link.target]
            for link in town.links
            if link.target in junction.connectors
            and link.type is STRAIGHT
            and town.lanes[link.target].project(middle)[1] < 0
        )
        # The arm that goes off is on the side of the middle, so the other side of this lane is a kerb.
        (fault,) = only(check_town(with_lane(town, pushed(straight, bulge(3.0)))), FaultKind.KERB)
        assert fault.lanes == (straight.id,) and "ground" in fault.message

    @pytest.mark.parametrize(
        "text",
        [
            star({0: "lanes: 3, median: 8", 45: "", 90: "", 180: ""}),
            star({0: "lanes: 3", 90: "lanes: 2, median: 4", 180: "", 270: "", 315: "lanes: 2, median: 4"}),
            star({45: "", 90: "lanes: 3", 135: "", 225: "", 315: "lanes: 2"}),
            TIGHT_RAMPS,
        ],
        ids=["mouth far behind its neighbours", "mouth far before its neighbour", "both", "ramps"],
    )
    def test_mouths_of_one_junction_may_lie_at_very_different_distances(self, tmp_path: Path, text: str) -> None:
        assert check_town(compiled(tmp_path, text)) == ()

    def test_a_turn_that_cuts_the_corner_of_a_junction_with_five_arms(self, tmp_path: Path) -> None:
        town = compiled(tmp_path, star({0: "lanes: 2, median: 4", 72: "", 144: "lanes: 2", 216: "", 288: "lanes: 2"}))
        junction = max(town.junctions, key=lambda junction: len(junction.connectors))
        ways = [town.lanes[k] for k in junction.connectors]
        turns = [way for way in ways if math.radians(100.0) < way.headings[-1] - way.headings[0] < math.radians(115.0)]
        assert len(turns) == 5
        for turn in turns:
            (fault,) = only(check_town(with_lane(town, pushed(turn, bulge(2.0)))), FaultKind.KERB)
            assert fault.lanes == (turn.id,) and "corner" in fault.message

    @pytest.mark.parametrize(("offset", "faulty"), [(1.75 + 1.0, False), (1.5, True)])
    def test_a_lane_that_runs_over_a_pavement(self, offset: float, faulty: bool) -> None:
        street = a_street()
        beside = pushed(street, lambda s, length: np.full(len(s), offset))
        path = Sidewalk(id=0, points=beside.points, width=2.0)
        faults = check_town(rebuilt(brookside(), sidewalks=[path]))
        if faulty:
            assert street.id in {lanes for fault in only(faults, FaultKind.KERB) for lanes in fault.lanes}
        else:
            assert faults == ()

    def test_a_pavement_on_a_bridge_is_in_nobodys_way(self) -> None:
        street = a_street()
        path = Sidewalk(id=0, points=street.points + np.array([0.0, 0.0, 6.0]), width=2.0)
        assert check_town(rebuilt(brookside(), sidewalks=[path])) == ()


class TestSpace:
    def test_lanes_in_the_same_place(self) -> None:
        town = ring()
        moved = with_lane(town, pushed(town.lanes[1], bulge(-0.9)))  # the outer lane is on the left of the inner one
        (fault,) = only(check_town(moved), FaultKind.OVERLAP)
        assert fault.lanes == (0, 1) and "0.9 m" in fault.message

    def test_a_crossing_without_a_junction(self) -> None:
        (fault,) = only(check_town(eight(0.0)), FaultKind.OVERLAP)
        assert fault.lanes == (0, 2) and near(fault, np.zeros(2), within=4.0)

    def test_a_connector_that_runs_over_a_lane_of_another_street(self) -> None:
        (fault,) = only(check_town(eight(0.0, crossing=0)), FaultKind.OVERLAP)
        assert "a car on lane 0 runs" in fault.message and "into lane 2" in fault.message

    @pytest.mark.parametrize("crossing", [None, 0])
    @pytest.mark.parametrize(("height", "faulty"), [(2.0, True), (3.8, True), (4.2, False)])
    def test_a_bridge_too_low_to_pass_under(self, height: float, faulty: bool, crossing: int | None) -> None:
        faults = check_town(eight(height, crossing=crossing))
        if faulty:
            (fault,) = only(faults, FaultKind.CLEARANCE)
            assert fault.lanes == (0, 2) and near(fault, np.zeros(2), within=6.0)
        else:
            assert faults == ()


class TestPromises:
    @pytest.mark.parametrize(
        ("was", "called"),
        [(LEFT, RIGHT), (RIGHT, LEFT), (LEFT, STRAIGHT), (RIGHT, STRAIGHT), (LEFT, U_TURN), (STRAIGHT, U_TURN)],
    )
    def test_a_turn_called_what_it_is_not(self, was: LinkType, called: LinkType) -> None:
        way = a_connector(was)
        (fault,) = only(check_town(retyped(brookside(), way, called)), FaultKind.TURN_TYPE)
        assert fault.lanes == (way.source, way.target) and f"called {called}" in fault.message
        assert near(fault, brookside().lanes[way.target].points[0])

    def test_a_lane_that_merely_goes_on_is_no_turn(self) -> None:
        town = ring()
        (fault,) = only(check_town(retyped(town, LaneLink(0, 2, STRAIGHT), LEFT)), FaultKind.TURN_TYPE)
        assert fault.lanes == (0, 2)

    @pytest.mark.parametrize(
        ("link", "words"),
        [
            (LaneLink(0, 1, LinkType.LANE_CHANGE_LEFT), "on its other side"),
            (LaneLink(0, 3, LinkType.LANE_CHANGE_RIGHT), "degrees to it"),
        ],
    )
    def test_a_lane_change_to_where_no_lane_runs(self, link: LaneLink, words: str) -> None:
        town = ring()
        (fault,) = only(check_town(rebuilt(town, links=[*town.links, link])), FaultKind.LANE_CHANGE)
        assert fault.lanes == (link.source, link.target) and words in fault.message

    @pytest.mark.parametrize(("gap", "faulty"), [(0.8, False), (4.0, True)])
    def test_a_lane_change_across_what_lies_between(self, gap: float, faulty: bool) -> None:
        town = ring()
        inner = [
            replace(row, points=row.points * np.array([1 - gap / 56.5, 1 - gap / 56.5, 1.0])) for row in town.lanes
        ]
        moved = rebuilt(town, lanes=[row if row.id % 2 == 0 else inner[row.id] for row in town.lanes])
        faults = check_town(moved)
        if faulty:
            assert len(only(faults, FaultKind.LANE_CHANGE)) == 4 and "4.0 m away" in faults[0].message
        else:
            assert faults == ()

    @pytest.mark.parametrize("kind", [SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD])
    def test_a_sign_that_nobody_has_to_heed(self, kind: SignalKind) -> None:
        sign = Signal(id=99, kind=kind, position=(3.0, 4.0, 2.0), heading=0.0)
        (fault,) = only(check_town(rebuilt(ring(), signals=[sign])), FaultKind.SIGNAL)
        assert fault.position == (3.0, 4.0) and "99 rules no lane" in fault.message

    @pytest.mark.parametrize("kind", [SignalKind.SPEED, SignalKind.OTHER])
    def test_signs_that_rule_no_lane_by_themselves(self, kind: SignalKind) -> None:
        sign = Signal(id=99, kind=kind, position=(3.0, 4.0, 2.0), heading=0.0)
        assert check_town(rebuilt(ring(), signals=[sign])) == ()


def damaged() -> Town:
    """Brookside with a fault of every kind that one town can have without others hiding it."""
    town, street = brookside(), a_street()
    right, left = a_connector(RIGHT), a_connector(LEFT)
    town = retyped(town, left, STRAIGHT)
    town = with_lane(town, pushed(town.lanes[right.target], bulge(2.0)))
    widths = np.full(len(street.widths), 1.9)
    return with_lane(town, replace(street, widths=widths, points=street.points + np.array([0.1, 0.0, 0.1])))


@pytest.mark.parametrize("make", [brookside, damaged, lambda: eight(3.0), lambda: paperclip(2.0)])
@settings(max_examples=5, deadline=None)
@given(
    turn=st.floats(-math.pi, math.pi),
    shift=st.tuples(*[st.floats(-2000.0, 2000.0)] * 2),
    rise=st.floats(-50.0, 50.0),
)
def test_faults_do_not_depend_on_where_the_town_lies(
    make: Callable[[], Town], turn: float, shift: tuple[float, float], rise: float
) -> None:
    def moved(points: Array) -> Array:
        c, s = math.cos(turn), math.sin(turn)
        x, y = points[:, 0], points[:, 1]
        return np.column_stack((c * x - s * y + shift[0], s * x + c * y + shift[1], points[:, 2] + rise))

    town = make()
    lanes = [replace(row, points=moved(row.points)) for row in town.lanes]
    sidewalks = [replace(row, points=moved(row.points)) for row in town.sidewalks]
    there = check_town(rebuilt(town, lanes=lanes, sidewalks=sidewalks, signals=()))
    here = check_town(rebuilt(town, signals=()))
    assert [(fault.kind, fault.lanes) for fault in there] == [(fault.kind, fault.lanes) for fault in here]
    for fault, other in zip(here, there, strict=True):
        place = moved(np.array([[*fault.position, 0.0]]))[0]
        assert near(other, place, within=1.5)
