"""Fields of inputs are written as the functions of `encoding` say, in the order of the layout."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.baselines.roles.learned_role.encoding import AWAY, age_scales, distance_scales, one_hot, time_scales
from dorothie_gym.baselines.roles.learned_role.input_layout import (
    AGE,
    DISTANCE,
    DISTANCE_SCALES,
    FADED,
    MISSING,
    NUMBER,
    TIME,
    Layout,
    choice,
)

LAYOUT = Layout((NUMBER, choice(4), TIME, AGE, DISTANCE, FADED, NUMBER))
NOW = 50.0


def written(*values: float) -> np.ndarray:
    inputs = np.zeros(LAYOUT.size, dtype=np.float32)
    LAYOUT.write(values, NOW, inputs)
    return inputs


@pytest.mark.parametrize("seconds", [0.0, 0.01, 0.3, 7.0, 1e4])
@pytest.mark.parametrize("then", [50.0, 49.5, 3.25, -AWAY, -math.inf])
@pytest.mark.parametrize("metres", [-90.0, 0.0, 33.3, 1e6, math.inf])
def test_fields_are_written_as_encoded(seconds: float, then: float, metres: float) -> None:
    faded = math.exp(-(min(NOW - then, AWAY) if math.isfinite(then) else AWAY) / 10.0)
    wanted = [
        True, *one_hot(2, 4), *time_scales(seconds), *age_scales(NOW, then), *distance_scales(metres, DISTANCE_SCALES),
        faded, 0.25,
    ]  # fmt: skip
    assert np.array_equal(written(True, 2, seconds, then, metres, then, 0.25), np.array(wanted, dtype=np.float32))


@pytest.mark.parametrize("outside", [-1, 4])
def test_what_is_missing_or_outside_is_zero(outside: int) -> None:
    inputs = written(0.0, outside, MISSING, MISSING, MISSING, MISSING, 1.0)
    assert inputs[-1] == 1.0 and not inputs[:-1].any()


def test_values_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="3 values for 7 fields"):
        written(1.0, 2.0, 3.0)
