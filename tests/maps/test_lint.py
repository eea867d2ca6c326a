"""Each test damages a sound town and expects exactly that fault at that place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from highway_env.vehicle.kinematics import Vehicle
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.lint import FaultKind, check_town
from dorothie_gym.maps.lint.fault import CAR_WIDTH, SMALLEST_TURN
from dorothie_gym.maps.model import Array, LaneLink, LinkType, Signal, SignalKind
from dorothie_gym.maps.town import Town
from dorothie_gym.sim.ego.limits import MAX_STEERING
from tests.maps.damaged_towns import (
    LEFT,
    RIGHT,
    STRAIGHT,
    U_TURN,
    a_connector,
    a_street,
    brookside,
    bulge,
    eight,
    near,
    only,
    paperclip,
    pushed,
    rebuilt,
    resampled,
    retyped,
    ring,
    with_lane,
)

from .opendrive_text import shared_map


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
    def test_a_connector_without_predecessors_is_unreachable(self) -> None:
        way = a_connector(RIGHT)
        town = brookside()
        faults = check_town(rebuilt(town, links=[link for link in town.links if link.target != way.target]))
        (fault,) = only(faults, FaultKind.UNREACHABLE)
        assert fault.lanes == (way.target,) and "reached" in fault.message
        assert near(fault, town.lanes[way.target].points[0], within=town.lanes[way.target].length)

    def test_a_lane_without_successors_is_a_dead_end_and_lanes_before_it_have_no_return(self) -> None:
        town, street = brookside(), a_street()
        links = [link for link in town.links if link.source != street.id]
        found = {fault.kind: fault for fault in check_town(rebuilt(town, links=links))}
        assert set(found) == {FaultKind.DEAD_END, FaultKind.NO_RETURN, FaultKind.UNREACHABLE}
        assert found[FaultKind.DEAD_END].lanes == (street.id,)
        assert near(found[FaultKind.DEAD_END], street.points[-1])
        no_return = [f.lanes for f in check_town(rebuilt(town, links=links)) if f.kind is FaultKind.NO_RETURN]
        assert sorted(sum(no_return, ())) == sorted(town.predecessors(street.id))

    def test_a_lane_that_ends_beside_another_is_no_dead_end(self) -> None:
        town = ring()
        assert (
            check_town(rebuilt(town, links=[link for link in town.links if (link.source, link.target) != (0, 2)])) == ()
        )

    def test_connected_lanes_are_one_fault(self) -> None:
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

    def test_coarsely_sampled_arcs_are_no_kinks(self) -> None:
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
        assert pytest.approx(0.5 * Vehicle.LENGTH / math.sin(slip), abs=0.005) == SMALLEST_TURN
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


class TestPromises:
    @pytest.mark.parametrize(
        ("was", "called"),
        [(LEFT, RIGHT), (RIGHT, LEFT), (LEFT, STRAIGHT), (RIGHT, STRAIGHT), (LEFT, U_TURN), (STRAIGHT, U_TURN)],
    )
    def test_turn_type_that_contradicts_the_geometry(self, was: LinkType, called: LinkType) -> None:
        way = a_connector(was)
        (fault,) = only(check_town(retyped(brookside(), way, called)), FaultKind.TURN_TYPE)
        assert fault.lanes == (way.source, way.target) and f"called {called}" in fault.message
        assert near(fault, brookside().lanes[way.target].points[0])

    def test_a_continuing_lane_is_no_turn(self) -> None:
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
    def test_lane_change_to_a_lane_that_is_not_parallel(self, link: LaneLink, words: str) -> None:
        town = ring()
        (fault,) = only(check_town(rebuilt(town, links=[*town.links, link])), FaultKind.LANE_CHANGE)
        assert fault.lanes == (link.source, link.target) and words in fault.message

    @pytest.mark.parametrize(("gap", "faulty"), [(0.8, False), (4.0, True)])
    def test_lane_change_across_another_lane(self, gap: float, faulty: bool) -> None:
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
    def test_a_sign_that_applies_to_no_lane(self, kind: SignalKind) -> None:
        sign = Signal(id=99, kind=kind, position=(3.0, 4.0, 2.0), heading=0.0)
        (fault,) = only(check_town(rebuilt(ring(), signals=[sign])), FaultKind.SIGNAL)
        assert fault.position == (3.0, 4.0) and "99 rules no lane" in fault.message

    @pytest.mark.parametrize("kind", [SignalKind.SPEED, SignalKind.OTHER])
    def test_signs_without_lanes_of_their_own(self, kind: SignalKind) -> None:
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
