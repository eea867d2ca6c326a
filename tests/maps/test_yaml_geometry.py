import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dorothie_gym.maps.yaml.centrelines import STEEPEST, height_profile
from dorothie_gym.maps.yaml.geometry import (
    CHORD_ERROR,
    CLOSEST,
    Curve,
    CurveSegment,
    bend_stations,
    connect,
    line,
    rounded,
)
from dorothie_gym.support.portable_math import wrap_radians

RIGHT_ARC = CurveSegment(0.0, 0.0, 0.0, 10.0 * math.pi / 2.0, 0.1)
HOOK = rounded([(0.0, 0.0), (60.0, 0.0), (60.0, 50.0), (0.0, 50.0)], [20.0, 10.0])


def test_an_arc_that_bends_to_the_right_goes_south_from_east() -> None:
    assert RIGHT_ARC.at(RIGHT_ARC.length) == pytest.approx((10.0, 10.0, math.pi / 2.0))
    assert RIGHT_ARC.points(np.array([0.0, RIGHT_ARC.length]))[1] == pytest.approx((10.0, 10.0))


def test_a_piece_driven_the_other_way_has_the_same_places() -> None:
    back = RIGHT_ARC.reversed()
    assert back.at(0.0) == pytest.approx((10.0, 10.0, 1.5 * math.pi))
    assert back.at(back.length)[:2] == pytest.approx((0.0, 0.0))


def test_a_parallel_path_keeps_its_distance_and_its_stations() -> None:
    beside, stations = HOOK.sample(3.0)
    middle = np.array([np.interp(stations, HOOK.every(0.05)[1], column) for column in HOOK.every(0.05)[0].T]).T
    assert np.hypot(*(beside - middle).T) == pytest.approx(3.0, abs=0.01)
    assert stations[0] == 0.0 and stations[-1] == pytest.approx(HOOK.length)


def test_a_part_of_a_path_is_what_lies_between() -> None:
    part = HOOK.part(30.0, 75.0)
    assert part.length == pytest.approx(45.0)
    assert part.start == pytest.approx(HOOK.part(0.0, 30.0).end)
    assert part.end == pytest.approx(HOOK.part(75.0, HOOK.length).start)


def test_stations_of_bends_are_the_middles_of_their_arcs() -> None:
    first, second = bend_stations([(0.0, 0.0), (60.0, 0.0), (60.0, 50.0), (0.0, 50.0)], [20.0, 10.0])
    half = math.pi / 4.0
    assert first == pytest.approx(40.0 + 20.0 * half)
    assert second == pytest.approx(40.0 + 40.0 * half + 20.0 + 10.0 * half)


def test_no_two_samples_are_nearly_the_same_place() -> None:
    path = Curve((line((0.0, 0.0), (0.02, 0.0)), CurveSegment(0.02, 0.0, 0.0, 8.0, 0.1)))
    points, _ = path.sample()
    assert np.hypot(*np.diff(points, axis=0).T).min() >= CLOSEST
    assert points[0] == pytest.approx((0.0, 0.0)) and points[-1] == pytest.approx(path.end[:2])


@given(
    x=st.floats(8.0, 60.0),
    y=st.floats(-40.0, 40.0),
    turn=st.floats(-2.2, 2.2),
)
def test_a_connection_is_smooth_from_end_to_end(x: float, y: float, turn: float) -> None:
    assume(x * math.cos(turn) + y * math.sin(turn) > 1.0)  # the exit is not driven towards the entry
    path = connect((0.0, 0.0, 0.0), (x, y, turn))
    assert path.start == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert path.end[:2] == pytest.approx((x, y), abs=1e-5)
    assert wrap_radians(path.end[2] - turn) == pytest.approx(0.0, abs=1e-6)
    for before, after in zip(path.pieces, path.pieces[1:], strict=False):
        there = before.at(before.length)
        assert after.at(0.0)[:2] == pytest.approx(there[:2], abs=1e-5)
        assert wrap_radians(after.heading - there[2]) == pytest.approx(0.0, abs=1e-6)


@given(before=st.floats(0.5, 60.0), after=st.floats(0.5, 60.0), turn=st.floats(-2.2, 2.2))
def test_a_connection_between_lines_that_meet_does_not_swing_out(before: float, after: float, turn: float) -> None:
    assume(abs(turn) > 0.01)
    path = connect((0.0, 0.0, 0.0), (before + after * math.cos(turn), after * math.sin(turn), turn))
    assert all(piece.curvature * turn >= 0.0 for piece in path.pieces)
    assert path.smallest_radius == pytest.approx(min(before, after) / math.tan(abs(turn) / 2.0))


@given(radius=st.floats(5.5, 500.0), angle=st.floats(0.1, 3.0))
def test_chords_stay_within_a_centimetre_of_their_arc(radius: float, angle: float) -> None:
    points, _ = Curve((CurveSegment(0.0, 0.0, 0.0, radius * angle, 1.0 / radius),)).sample()
    middles = (points[:-1] + points[1:]) / 2.0
    assert np.max(radius - np.hypot(middles[:, 0], middles[:, 1] - radius)) <= CHORD_ERROR + 1e-9


def test_a_level_street_is_level() -> None:
    profile = height_profile([0.0, 50.0, 100.0], [3.0, None, 3.0])
    assert profile.is_flat and profile.steepest() == 0.0
    assert profile.at(np.array([10.0, 90.0])) == pytest.approx(3.0)


def test_a_climb_starts_and_ends_flat_and_never_falls() -> None:
    profile = height_profile([0.0, 100.0, 200.0, 260.0], [0.0, 2.0, 6.0, 6.0])
    s = np.linspace(0.0, 260.0, 521)
    z = profile.at(s)
    assert z[[0, 200, 400, 520]] == pytest.approx((0.0, 2.0, 6.0, 6.0))
    assert np.all(np.diff(z) >= -1e-12)
    slope = np.diff(z) / 0.5
    assert abs(slope[0]) < 1e-3 and abs(slope[-1]) < 1e-3 and np.max(np.abs(np.diff(slope))) < 0.005
    assert profile.steepest() == pytest.approx(slope.max(), abs=0.002)


def test_the_steepest_place_of_a_plain_climb_is_half_as_steep_again_as_its_mean() -> None:
    assert height_profile([0.0, 75.0], [0.0, 6.0]).steepest() == pytest.approx(STEEPEST, abs=1e-3)
