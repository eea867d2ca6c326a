"""Traffic light programmes: the colour of each light of a junction as a function of time alone."""

from __future__ import annotations

import enum
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

from dorothie_gym.support.copying import shared

_SHORTLY = 1e-6  # [s] more than rounding moves the end of a phase


class LightColour(enum.StrEnum):
    """Colour of a traffic light."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"


@shared
@dataclass(frozen=True, kw_only=True)
class LightPhase:
    """Interval in which no light of the junction changes.

    Attributes:
        duration: [s], more than 0.
        green: ids of the green signals; signals in neither list are red.
        yellow: ids of the yellow signals.
    """

    duration: float
    green: tuple[int, ...] = ()
    yellow: tuple[int, ...] = ()

    def colour(self, signal: int) -> LightColour:
        """Returns the colour of a signal during the phase."""
        if signal in self.green:
            return LightColour.GREEN
        return LightColour.YELLOW if signal in self.yellow else LightColour.RED


@shared
@dataclass(frozen=True, kw_only=True)
class LightProgramme:
    """Cyclic programme of the lights of one junction.

    Attributes:
        junction_id: id of the junction.
        signals: ids of the signals that it controls.
        phases: phases in order, at least one.
        offset: start of the first phase in the first cycle [s].
    """

    junction_id: int
    signals: tuple[int, ...]
    phases: tuple[LightPhase, ...]
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not self.phases or any(phase.duration <= 0.0 for phase in self.phases):
            raise ValueError(f"junction {self.junction_id}: a light programme needs phases, each longer than 0 s")

    @cached_property
    def _ends(self) -> tuple[float, ...]:
        return tuple(accumulate(phase.duration for phase in self.phases))

    @property
    def cycle(self) -> float:
        """Length of a cycle [s]."""
        return self._ends[-1]

    def phase_at(self, time: float) -> LightPhase:
        """Returns the phase at a simulated time [s]."""
        ends = self._ends
        return self.phases[bisect_right(ends, (time - self.offset) % ends[-1]) % len(ends)]

    def change_after(self, time: float) -> float:
        """Returns a simulated time up to which the phase stays that of `time`: shortly before its end [s]."""
        ends = self._ends
        passed = (time - self.offset) % ends[-1]
        return time + ends[bisect_right(ends, passed) % len(ends)] - passed - _SHORTLY

    def colour(self, signal: int, time: float) -> LightColour:
        """Returns the colour of a signal at a simulated time [s]."""
        return self.phase_at(time).colour(signal)
