import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dorothie_gym.maps.opendrive.geometry import Arc, Cubics, Polynomial, Primitive, ReferenceLine, Spiral, poly3

curvatures = st.floats(-0.2, 0.2)


def _end(primitive: Primitive, length: float) -> tuple[float, float, float]:
    u, v, heading = primitive.place(np.array([length]), length)
    return float(u[0]), float(v[0]), float(heading[0])


def test_a_line_runs_straight() -> None:
    assert _end(Arc(), 12.5) == pytest.approx((12.5, 0.0, 0.0))


def test_a_quarter_circle_ends_beside_its_centre() -> None:
    assert _end(Arc(0.1), 5.0 * np.pi) == pytest.approx((10.0, 10.0, np.pi / 2))
    assert _end(Arc(-0.1), 5.0 * np.pi) == pytest.approx((10.0, -10.0, -np.pi / 2))


@given(start=curvatures, end=curvatures, length=st.floats(0.01, 80.0))
def test_a_spiral_is_the_integral_of_its_heading(start: float, end: float, length: float) -> None:
    def slope(s: float, _: np.ndarray) -> list[float]:
        heading = start * s + 0.5 * (end - start) / length * s * s
        return [np.cos(heading), np.sin(heading)]

    solved = solve_ivp(slope, (0.0, length), [0.0, 0.0], rtol=1e-9, atol=1e-9).y[:, -1]
    u, v, heading = _end(Spiral(start, end), length)
    assert (u, v) == pytest.approx(tuple(solved), abs=1e-5)
    assert heading == pytest.approx(0.5 * (start + end) * length)


@given(curvature=curvatures, length=st.floats(0.01, 60.0))
def test_a_spiral_of_constant_curvature_is_an_arc(curvature: float, length: float) -> None:
    assert _end(Spiral(curvature, curvature), length) == pytest.approx(_end(Arc(curvature), length), abs=1e-9)


def test_poly3_is_as_long_as_its_element() -> None:
    curve = poly3(0.0, 0.0, 0.02, -0.0005, 20.0)
    s = np.linspace(0.0, 20.0, 4001)
    u, v, heading = curve.place(s, 20.0)
    assert v == pytest.approx(0.02 * u**2 - 0.0005 * u**3, abs=1e-9)
    assert np.hypot(np.diff(u), np.diff(v)).sum() == pytest.approx(20.0, abs=1e-3)
    assert heading == pytest.approx(np.arctan(0.04 * u - 0.0015 * u**2), abs=1e-9)


def test_param_poly3_by_arc_length_takes_the_distance_itself() -> None:
    curve = Polynomial((0.0, 1.0, 0.0, -0.001), (0.0, 0.0, 0.03, 0.0))
    u, v, heading = curve.place(np.array([0.0, 5.0, 10.0]), 10.0)
    assert u == pytest.approx([0.0, 5.0 - 0.125, 10.0 - 1.0])
    assert v == pytest.approx([0.0, 0.75, 3.0])
    assert heading == pytest.approx(np.arctan2([0.0, 0.3, 0.6], [1.0, 1.0 - 0.075, 1.0 - 0.3]))


def test_normalised_param_poly3_ends_where_p_is_one_and_advances_evenly() -> None:
    curve = Polynomial((0.0, 10.0, 5.0, 2.0), (0.0, 0.0, 6.0, -1.0), span=1.0)
    grid = np.linspace(0.0, 1.0, 20001)
    x, y = 10 * grid + 5 * grid**2 + 2 * grid**3, 6 * grid**2 - grid**3
    length = float(np.hypot(np.diff(x), np.diff(y)).sum())
    s = np.linspace(0.0, length, 201)
    u, v, _ = curve.place(s, length)
    assert (u[-1], v[-1]) == pytest.approx((17.0, 5.0))
    assert np.hypot(np.diff(u), np.diff(v)) == pytest.approx(length / 200, rel=1e-3)


def test_a_reference_line_joins_its_elements_and_turns_them() -> None:
    starts = np.array(
        [
            [0.0, 1.0, 2.0, np.pi / 2, 10.0],
            [10.0, 1.0, 12.0, np.pi / 2, 5.0 * np.pi],
            [25.707963, -9.0, 22.0, np.pi, 4.0],
        ]
    )
    line = ReferenceLine(starts, (Arc(), Arc(0.1), Spiral(0.0, 0.0)))
    x, y, heading = line.place(np.array([0.0, 10.0, 10.0 + 5.0 * np.pi, 29.707963]))
    assert x == pytest.approx([1.0, 1.0, -9.0, -13.0], abs=1e-6)
    assert y == pytest.approx([2.0, 12.0, 22.0, 22.0], abs=1e-6)
    assert heading == pytest.approx([np.pi / 2, np.pi / 2, np.pi, np.pi])


def test_a_profile_uses_the_piece_that_was_picked() -> None:
    profile = Cubics(np.array([[0.0, 1.0, 0.5, 0.0, 0.0], [10.0, 100.0, 0.0, 1.0, 0.0]]))
    s = np.array([0.0, 4.0, 10.0, 12.0])
    assert profile.at(s) == pytest.approx([1.0, 3.0, 100.0, 104.0])
    assert profile.at(s[2:3], np.array([9.99])) == pytest.approx([6.0])


def test_a_missing_profile_is_zero() -> None:
    assert Cubics(np.empty((0, 5))).at(np.array([0.0, 7.0])) == pytest.approx([0.0, 0.0])
