import copy
import json
import pickle

import numpy as np
import pytest
from highway_env.road.lane import AbstractLane, LineType, StraightLane, lane_from_config
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.sim.network.lane import PolylineLane

from .towns import curve_points, lane

STRAIGHT = [(float(x), 0.0, 1.0) for x in range(-20, 0)]
CURVE = PolylineLane(lane(0, [*STRAIGHT, *((x, y, 1.0 + x / 10) for x, y in curve_points())]))
coordinate = st.floats(-200, 200)


def test_straight_lane_measures_like_highway_envs():
    ours = PolylineLane(lane(0, [(3, 4), (43, 34)]))
    stock = StraightLane([3, 4], [43, 34])
    rng = np.random.default_rng(0)
    assert ours.length == pytest.approx(stock.length)
    for place in rng.uniform(-80, 80, size=(200, 2)):
        assert ours.local_coordinates(place) == pytest.approx(stock.local_coordinates(place))
        assert ours.distance(place) == pytest.approx(stock.distance(place))
        assert ours.on_lane(place) == stock.on_lane(place)
        assert ours.after_end(place) == stock.after_end(place)
        heading = rng.uniform(-9, 9)
        expected = stock.distance_with_heading(place, heading)
        assert ours.distance_with_heading(place, heading) == pytest.approx(expected)
    for station in (-12.0, 0.0, 20.0, 50.0, 61.0):
        assert ours.position(station, 1.5) == pytest.approx(stock.position(station, 1.5))


@given(station=st.floats(-30, 100), lateral=st.floats(-6, 6))
def test_position_and_local_coordinates_invert_one_another(station, lateral):
    back = CURVE.local_coordinates(CURVE.position(longitudinal=station, lateral=lateral))
    assert back == pytest.approx((station, lateral), abs=0.1)


@given(x=coordinate, y=coordinate, heading=st.floats(-20, 20), weight=st.floats(0, 3))
def test_distance_is_highway_envs_formula_to_the_last_bit(x, y, heading, weight):
    place = np.array([x, y])
    assert CURVE.distance(place) == AbstractLane.distance(CURVE, place)
    expected = AbstractLane.distance_with_heading(CURVE, place, heading, weight)
    assert CURVE.distance_with_heading(place, heading, weight) == expected


@given(x=coordinate, y=coordinate)
def test_distance_is_at_least_that_to_the_centre_line(x, y):
    _, offset = CURVE.town_lane.project(np.array([x, y]))
    assert CURVE.distance(np.array([x, y])) >= abs(offset) - 1e-9


@given(x=coordinate, y=coordinate)
def test_inside_the_lane_the_closest_place_is_the_towns(x, y):
    station, lateral = CURVE.local_coordinates(np.array([x, y]))
    if 0 <= station <= CURVE.length:
        assert (station, lateral) == pytest.approx(CURVE.town_lane.project(np.array([x, y])), abs=1e-6)


def test_lane_continues_straight_beyond_its_ends():
    assert CURVE.local_coordinates(np.array([-27.0, 2.0])) == pytest.approx((-7.0, 2.0), abs=0.1)
    end = CURVE.position(CURVE.length, 0)
    assert CURVE.position(CURVE.length + 10, 0) == pytest.approx(end + [0, 10], abs=0.2)
    assert CURVE.after_end(end + [0, 5])
    assert CURVE.heading_at(CURVE.length + 10) == CURVE.heading_at(CURVE.length)


def test_many_at_once_equal_one_at_a_time():
    rng = np.random.default_rng(1)
    stations = rng.uniform(-20, CURVE.length + 20, size=100)
    points = rng.uniform(-60, 60, size=(100, 2))
    assert (CURVE.positions(stations, 1.0) == [CURVE.position(s, 1.0) for s in stations]).all()
    assert (CURVE.local_coordinates_many(points) == [CURVE.local_coordinates(p) for p in points]).all()


def test_width_height_and_heading_are_the_town_lanes():
    town_lane = lane(4, [(0, 0, 1.0), (10, 0, 2.0), (10, 10, 4.0)])
    town_lane.widths[:] = 3.0, 4.0, 6.0
    ours = PolylineLane(town_lane)
    for s in (-3.0, 0.0, 4.0, 10.0, 16.0, 20.0, 30.0):
        assert ours.width_at(s) == pytest.approx(town_lane.width_at(s))
        assert ours.height_at(s) == pytest.approx(town_lane.height_at(s))
        assert ours.heading_at(s) == pytest.approx(town_lane.heading_at(s))
        assert ours.position(s, 0.7) == pytest.approx(town_lane.position(s, 0.7))


def test_config_round_trip_through_json():
    marked = PolylineLane(CURVE.town_lane, line_types=[LineType.STRIPED, LineType.NONE], forbidden=True, priority=3)
    config = json.loads(json.dumps(marked.to_config()))
    for back in (lane_from_config(config), PolylineLane.from_config(config["config"])):
        assert isinstance(back, PolylineLane)
        assert (back.line_types, back.forbidden, back.priority) == ([LineType.STRIPED, LineType.NONE], True, 3)
        assert (back.town_lane.points == CURVE.town_lane.points).all()
        assert back.local_coordinates([3.0, 4.0]) == CURVE.local_coordinates([3.0, 4.0])
        assert back.to_config() == config


def test_lanes_are_shared_by_copies_and_survive_pickling():
    assert copy.deepcopy(CURVE) is CURVE
    again = pickle.loads(pickle.dumps(CURVE))
    assert again.local_coordinates([3.0, 4.0]) == CURVE.local_coordinates([3.0, 4.0])


def test_connectors_carry_no_marks():
    connector = PolylineLane(lane(0, [(0, 0), (10, 0)], junction=3))
    assert connector.line_types == [LineType.NONE, LineType.NONE]


@given(s=st.floats(-5, 25))
def test_shortest_lane_of_two_points_works(s):
    tiny = PolylineLane(lane(0, [(0.0, 0.0), (0.01, 0.0)]))
    assert tiny.local_coordinates(np.array([s, 1.0])) == pytest.approx((s, 1.0))
