"""Recorded surroundings of the car: other road users, traffic lights and weather."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology.world_exceptions import WeatherParameter

Rows: TypeAlias = NDArray[np.void]
"""Structured array."""

ActorColumns: TypeAlias = Mapping[str, NDArray[np.generic] | Sequence[float | str]]
"""Columns of `ACTOR_DTYPE` by name; kinds may be names."""


class ActorKind(enum.IntEnum):
    """Kind of an actor around the car. Files hold the names in lower case."""

    OTHER = 0
    VEHICLE = 1
    CYCLIST = 2
    PEDESTRIAN = 3
    PROP = 4


LIGHT_STATES: Final = (LightColour.GREEN, LightColour.YELLOW, LightColour.RED)
"""States of lights, in the order of the numbers in the column `state`."""

_STATE_NUMBERS: Final[dict[str, int]] = {str(colour): number for number, colour in enumerate(LIGHT_STATES)}

ACTOR_DTYPE: Final = np.dtype(
    [
        ("key", np.int64),
        ("kind", np.int64),  # as wide as the others, so that rows can be seen as plain numbers
        *((name, np.float64) for name in ("x", "y", "heading", "speed", "length", "width")),
    ]
)
"""Persistent number of the actor, `ActorKind`, centre [m], heading [rad], speed [m/s], size [m]."""

_ACTOR_COLUMNS: Final = ACTOR_DTYPE.names or ()

LIGHT_DTYPE: Final = np.dtype([("signal", np.int64), ("state", np.int8)])
"""Id of the town's signal, and number in `LIGHT_STATES`."""

WEATHER_DTYPE: Final = np.dtype([(str(parameter), np.float64) for parameter in WeatherParameter])
"""The ten parameters, in the ontology's units."""

_WEATHER_NAMES: Final = frozenset(WEATHER_DTYPE.names or ())


@dataclass(frozen=True, eq=False)
class SceneTable:
    """Rows that were recorded at frames, any number per frame.

    Attributes:
        frames: the recorded frames (k,) int64, rising.
        offsets: (k + 1,) int64: the rows of frame `frames[i]` are `rows[offsets[i]:offsets[i + 1]]`.
        rows: structured array (m,).
    """

    frames: NDArray[np.int64]
    offsets: NDArray[np.int64]
    rows: Rows

    @classmethod
    def empty(cls, dtype: np.dtype[np.void]) -> Self:
        """Returns a table without records."""
        return cls(np.empty(0, dtype=np.int64), np.zeros(1, dtype=np.int64), np.empty(0, dtype=dtype))

    def __len__(self) -> int:
        """Number of recorded frames."""
        return len(self.frames)

    def at(self, frame: int) -> Rows | None:
        """Returns the rows of the last record at or before `frame`; None before the first."""
        k = int(np.searchsorted(self.frames, frame, side="right")) - 1
        return None if k < 0 else self.rows[self.offsets[k] : self.offsets[k + 1]]

    def at_frames(self, frames: NDArray[np.int64]) -> SceneTable:
        """Returns the records at the given frames."""
        kept = np.isin(self.frames, frames)
        sizes = np.diff(self.offsets)
        offsets = np.concatenate(([0], np.cumsum(sizes[kept]))).astype(np.int64)
        return SceneTable(self.frames[kept], offsets, self.rows[np.repeat(kept, sizes)])

    def equals(self, other: SceneTable) -> bool:
        """Returns whether two tables hold the same rows."""
        return (
            np.array_equal(self.frames, other.frames)
            and np.array_equal(self.offsets, other.offsets)
            and self.rows.dtype == other.rows.dtype
            and self.rows.tobytes() == other.rows.tobytes()
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Surroundings:
    """Surroundings of the car; each table may be empty.

    Attributes:
        actors: rows of `ACTOR_DTYPE`.
        lights: rows of `LIGHT_DTYPE`.
        weather: one row of `WEATHER_DTYPE` per record.
        columns: further columns of the frames, each (n,) like the trajectory: those of a newer minor version, or of
            another corpus (`road_id`, `lane_id`, `junction_id`).
    """

    actors: SceneTable = field(default_factory=partial(SceneTable.empty, ACTOR_DTYPE))
    lights: SceneTable = field(default_factory=partial(SceneTable.empty, LIGHT_DTYPE))
    weather: SceneTable = field(default_factory=partial(SceneTable.empty, WEATHER_DTYPE))
    columns: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)

    def at_frames(self, frames: NDArray[np.int64]) -> Surroundings:
        """Returns the records at the given frames, without further columns."""
        return Surroundings(
            actors=self.actors.at_frames(frames),
            lights=self.lights.at_frames(frames),
            weather=self.weather.at_frames(frames),
        )

    def equals(self, other: Surroundings) -> bool:
        """Returns whether two scenes hold the same records."""
        return (
            self.actors.equals(other.actors)
            and self.lights.equals(other.lights)
            and self.weather.equals(other.weather)
            and self.columns.keys() == other.columns.keys()
            and all(np.array_equal(column, other.columns[name]) for name, column in self.columns.items())
        )


def actor_rows(actors: Rows | ActorColumns) -> Rows:
    """Returns actors as rows of `ACTOR_DTYPE`.

    Args:
        actors: such rows, or a mapping of the eight columns; `kind` as `ActorKind`, its number or its name.

    Raises:
        SessionError: a column is missing, of another length or type, or not finite.
    """
    if isinstance(actors, Mapping):
        actors = _from_columns(actors)
    if actors.dtype != ACTOR_DTYPE or actors.ndim != 1:
        raise SessionError(f"actors have type {actors.dtype} and shape {actors.shape}; it must be {ACTOR_DTYPE}, (n,)")
    actors = np.ascontiguousarray(actors)
    finite = np.isfinite(actors.view(np.float64).reshape(-1, len(_ACTOR_COLUMNS))[:, 2:])
    if not finite.all():
        name = _ACTOR_COLUMNS[2 + int(np.argmin(finite.all(axis=0)))]
        raise SessionError(f"actors: field {name!r} has a value that is not finite")
    kinds = actors["kind"].view(np.uint64)  # negative numbers become large ones
    if len(kinds) and kinds.max() >= len(ActorKind):
        raise SessionError(f"actors: field 'kind' must be one of {', '.join(kind.name.lower() for kind in ActorKind)}")
    return actors


def _from_columns(columns: ActorColumns) -> Rows:
    if set(columns) != set(_ACTOR_COLUMNS):
        raise SessionError(f"actors have the columns {', '.join(columns)}; they must be {', '.join(_ACTOR_COLUMNS)}")
    rows = np.empty(len(columns["key"]), dtype=ACTOR_DTYPE)
    for name in _ACTOR_COLUMNS:
        values = [_kind(kind) for kind in columns[name]] if name == "kind" else columns[name]
        try:
            rows[name] = values
        except (TypeError, ValueError) as error:
            raise SessionError(f"actors: field {name!r}: {error}") from None
    return rows


def _kind(kind: float | str) -> int:
    if isinstance(kind, str):
        if kind.upper() not in ActorKind.__members__:
            known = ", ".join(member.name.lower() for member in ActorKind)
            raise SessionError(f"actors: field 'kind' is {kind!r}; it must be one of {known}")
        return ActorKind[kind.upper()]
    return int(kind)


def light_rows(lights: Mapping[int, LightColour | str]) -> Rows:
    """Returns states of lights as rows of `LIGHT_DTYPE`, in order of the ids of their signals.

    Raises:
        SessionError: an id is not a whole number, or a state is not a colour of a light.
    """
    rows = np.empty(len(lights), dtype=LIGHT_DTYPE)
    try:
        signals = sorted(lights)
        rows["signal"] = signals
        rows["state"] = [_STATE_NUMBERS[lights[signal]] for signal in signals]
    except (KeyError, TypeError, ValueError, OverflowError):
        states = ", ".join(f"signal {signal!r} is {str(state)!r}" for signal, state in lights.items())
        raise SessionError(f"lights: {states[:300]}; ids are whole numbers, states {', '.join(LIGHT_STATES)}") from None
    return rows


def weather_rows(weather: Mapping[WeatherParameter, float] | Mapping[str, float]) -> Rows:
    """Returns the ten parameters as one row of `WEATHER_DTYPE`.

    Raises:
        SessionError: the parameters are not the ten of the ontology, or a value is not finite.
    """
    values = {str(name): value for name, value in weather.items()}
    if values.keys() != _WEATHER_NAMES:
        raise SessionError(f"weather has {', '.join(sorted(values))}; it must have {', '.join(WeatherParameter)}")
    for name, value in values.items():
        if not math.isfinite(value):
            raise SessionError(f"weather: field {name!r} is {value}; it must be finite")
    return np.array([tuple(values[name] for name in WEATHER_DTYPE.names or ())], dtype=WEATHER_DTYPE)
