"""Layouts of network inputs: fields of one number each, which compiled code writes on scales or as choices."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.learned_role.encoding import AWAY, TIME_SCALES
from dorothie_gym.support.compilation import compiled, fixed

MISSING: Final = math.nan
"""Value of a time, age or distance that there is not: its inputs are 0."""

DISTANCE_SCALES: Final = (1.0, 5.0, 25.0, 100.0)
"""Scales of distances [m]."""

NEAREST, FARTHEST = -50.0, 1000.0  # distances beyond count as these [m]

FADING: Final = 10.0
"""Time in which a recent event fades to 1/e [s]."""


class FieldKind(enum.IntEnum):
    """Form in which a field is written."""

    NUMBER = 0
    """One input, the number."""

    CHOICE = 1
    """One input for each choice: 1 at the number of the choice, 0 elsewhere; all are 0 for a number outside."""

    TIME = 2
    """A time [s] on several scales, see `time_scales`."""

    AGE = 3
    """A moment [s] as the time since, on the same scales."""

    DISTANCE = 4
    """A distance [m] on several scales."""

    FADED = 5
    """A moment [s] as a number that is 1 at the moment and fades."""


_NUMBER, _CHOICE, _TIME, _AGE, _DISTANCE = (int(kind) for kind in tuple(FieldKind)[:5])
_FIRST_TIME, _SECOND_TIME, _THIRD_TIME = TIME_SCALES
_D1, _D2, _D3, _D4 = DISTANCE_SCALES


@compiled
def _since(now: float, then: float) -> float:
    return min(max(now - then, 0.0), AWAY) if math.isfinite(then) else AWAY


@compiled
def _write_time(seconds: float, place: int, inputs: NDArray[np.float32]) -> None:
    seconds = min(max(seconds, 0.0), AWAY)
    inputs[place] = 1.0 if seconds <= 0.01 else 0.0
    inputs[place + 1] = math.exp(-seconds / _FIRST_TIME)
    inputs[place + 2] = math.exp(-seconds / _SECOND_TIME)
    inputs[place + 3] = math.exp(-seconds / _THIRD_TIME)


@compiled
def _write_distance(metres: float, place: int, inputs: NDArray[np.float32]) -> None:
    metres = min(max(metres, NEAREST), FARTHEST)
    inputs[place] = math.tanh(metres / _D1)
    inputs[place + 1] = math.tanh(metres / _D2)
    inputs[place + 2] = math.tanh(metres / _D3)
    inputs[place + 3] = math.tanh(metres / _D4)


@compiled
def write_fields(
    values: NDArray[np.float64],
    now: float,
    kinds: NDArray[np.int64],
    places: NDArray[np.int64],
    inputs: NDArray[np.float32],
) -> None:
    """Writes fields into inputs that are 0.

    Args:
        values: number of each field (f,).
        now: present time [s].
        kinds: kind of each field (f,), see `FieldKind`.
        places: place of the first input of each field, and the end (f + 1,).
        inputs: (n,), written.
    """
    for field in range(len(kinds)):
        kind, value, place = kinds[field], values[field], places[field]
        if kind == _NUMBER:
            inputs[place] = value
        elif kind == _CHOICE:
            if 0.0 <= value < places[field + 1] - place:
                inputs[place + int(value)] = 1.0
        elif not math.isnan(value):
            if kind == _TIME:
                _write_time(value, place, inputs)
            elif kind == _AGE:
                _write_time(_since(now, value), place, inputs)
            elif kind == _DISTANCE:
                _write_distance(value, place, inputs)
            else:
                inputs[place] = math.exp(-_since(now, value) / FADING)


_write_fields = fixed(write_fields)


@dataclass(frozen=True)
class Field:
    """Field of a layout: its form, and its number of inputs."""

    kind: FieldKind
    width: int


NUMBER: Final = Field(FieldKind.NUMBER, 1)
TIME: Final = Field(FieldKind.TIME, 1 + len(TIME_SCALES))
AGE: Final = Field(FieldKind.AGE, 1 + len(TIME_SCALES))
DISTANCE: Final = Field(FieldKind.DISTANCE, len(DISTANCE_SCALES))
FADED: Final = Field(FieldKind.FADED, 1)


def choice(size: int) -> Field:
    """Returns the field of a choice among a number of options."""
    return Field(FieldKind.CHOICE, size)


@dataclass(frozen=True)
class Layout:
    """Order of the fields of an input vector."""

    fields: tuple[Field, ...]

    @cached_property
    def size(self) -> int:
        """Number of inputs."""
        return sum(field.width for field in self.fields)

    @cached_property
    def _arrays(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        widths = [field.width for field in self.fields]
        return np.array([field.kind for field in self.fields], dtype=np.int64), np.cumsum([0, *widths], dtype=np.int64)

    def write(self, values: Sequence[float], now: float, inputs: NDArray[np.float32]) -> None:
        """Writes fields into inputs that are 0.

        Args:
            values: number of each field.
            now: present time [s].
            inputs: (size,), written.

        Raises:
            ValueError: the numbers of values, fields and inputs do not fit.
        """
        if len(values) != len(self.fields) or len(inputs) != self.size:
            raise ValueError(f"{len(values)} values for {len(self.fields)} fields with {len(inputs)} inputs")
        kinds, places = self._arrays
        _write_fields(np.array(values, dtype=np.float64), now, kinds, places, inputs)
