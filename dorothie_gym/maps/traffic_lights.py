"""Programmes of traffic lights: which of a junction's lights shows which colour, as a function of time alone."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate


class LightColour(enum.StrEnum):
    """What a traffic light shows."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"


@dataclass(frozen=True, kw_only=True)
class LightPhase:
    """A time during which no light of the junction changes.

    Attributes:
        duration: [s], more than 0.
        green: ids of the signals that are green; what is neither green nor yellow is red.
        yellow: ids of the signals that are yellow.
    """

    duration: float
    green: tuple[int, ...] = ()
    yellow: tuple[int, ...] = ()

    def colour(self, signal: int) -> LightColour:
        """What a signal shows while the phase lasts."""
        if signal in self.green:
            return LightColour.GREEN
        return LightColour.YELLOW if signal in self.yellow else LightColour.RED


@dataclass(frozen=True, kw_only=True)
class LightProgramme:
    """What the lights of one junction do, over and over again.

    Attributes:
        junction_id: the junction.
        signals: ids of the signals that it switches.
        phases: one after the other, at least one.
        offset: time at which the first phase begins for the first time [s].
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
        """Time after which it begins again [s]."""
        return self._ends[-1]

    def phase_at(self, time: float) -> LightPhase:
        """The phase at a simulated time [s]."""
        now = (time - self.offset) % self.cycle
        return next((phase for phase, end in zip(self.phases, self._ends, strict=True) if now < end), self.phases[0])

    def colour(self, signal: int, time: float) -> LightColour:
        """What a signal shows at a simulated time [s]."""
        return self.phase_at(time).colour(signal)
