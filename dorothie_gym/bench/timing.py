"""Timing of functions: alternating repetitions with median, best and spread."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TypeAlias

Progress: TypeAlias = Callable[[str, float], None]
"""Is told what is being done, and which share of all is done, in [0, 1]."""

PACKAGES = ("numba", "numpy", "highway-env")
"""Packages whose versions belong to a measurement."""


def quiet(doing: str, share: float) -> None:
    """Progress that nobody looks at."""


@dataclass(frozen=True)
class Timing:
    """Durations of the repetitions of one function.

    Attributes:
        seconds: for one unit of the work, by repeat [s].
    """

    seconds: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.seconds or min(self.seconds) <= 0.0:
            raise ValueError(f"Timing.seconds are {self.seconds}; there must be some, and all above 0")

    @property
    def median(self) -> float:
        """Of the repeats [s]."""
        return statistics.median(self.seconds)

    @property
    def rate(self) -> float:
        """Units a second, by the median."""
        return 1.0 / self.median

    @property
    def best(self) -> float:
        """Units a second in the fastest repeat."""
        return 1.0 / min(self.seconds)

    @property
    def spread(self) -> float:
        """Interquartile range over the median, to three places; 0 for a single repeat."""
        if len(self.seconds) < 2:
            return 0.0
        low, _, high = statistics.quantiles(self.seconds, n=4, method="inclusive")
        return round((high - low) / self.median, 3)


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU time of a piece of work with one thread [s]: other programs on the machine count little."""
    start = time.process_time()
    work()
    return time.process_time() - start


def in_turns(
    works: Mapping[str, Callable[[], float]], repeats: int, progress: Progress = quiet
) -> dict[str, Timing]:  # fmt: skip
    """Measures pieces of work in turns, so that a slow moment of the machine meets all of them.

    Args:
        works: by name, functions that work and return what one unit took [s].
        repeats: how often each is done.
        progress: is told what is being measured.
    """
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(repeats):
        for k, (name, work) in enumerate(works.items()):
            progress(name, (turn + k / len(works)) / repeats)
            seconds[name].append(work())
    return {name: Timing(tuple(times)) for name, times in seconds.items()}


def cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine() -> dict[str, str | int]:
    """Returns the environment of a measurement: processor, cores, system and versions."""
    return {
        "processor": _processor(),
        "cores": cores(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{package.replace("-", "_"): version(package) for package in PACKAGES},
    }


def _processor() -> str:
    """Model of the processor, as the system names it."""
    described = Path("/proc/cpuinfo")
    if described.is_file():
        for line in described.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()


def rounded(value: float, digits: int = 4) -> float:
    """A number to so many significant digits: more would be noise."""
    return float(f"{value:.{digits}g}")
