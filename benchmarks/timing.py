"""Timing of functions: alternating repetitions with median, best and spread, in this process and in worker processes.

A worker process is started for a module of this package, whose function `prepare(**settings)` returns the work: a
function that returns its own duration [s]. The processes talk over pipes; output of the work itself is kept apart.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NoReturn, Self, TypeAlias

from dorothie_gym.errors import ProcessError
from dorothie_gym.support.interruption import starting_process
from dorothie_gym.support.processors import available_processors

Progress: TypeAlias = Callable[[str, float], None]
"""Callback with the name of the present part of a measurement, and the share of the whole that is done, in [0, 1]."""

Figures: TypeAlias = dict[str, Any]
"""Figures of a measurement in JSON types, by name; `report` knows the type of each."""

PACKAGES: Final = ("numba", "numpy", "highway-env")
"""Packages whose versions belong to a measurement."""


def ignore_progress(part: str, share: float) -> None:
    """Ignores the progress of a measurement."""


@dataclass(frozen=True)
class Timing:
    """Durations of the repetitions of one function.

    Attributes:
        seconds: duration of one unit of the work, by repetition [s].
    """

    seconds: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.seconds or min(self.seconds) <= 0.0:
            raise ValueError(f"Timing.seconds are {self.seconds}; there must be some, and all above 0")

    @property
    def median(self) -> float:
        """Median duration [s]."""
        return statistics.median(self.seconds)

    @property
    def rate(self) -> float:
        """Units per second, by the median."""
        return 1.0 / self.median

    @property
    def best(self) -> float:
        """Units per second in the fastest repetition."""
        return 1.0 / min(self.seconds)

    @property
    def spread(self) -> float:
        """Interquartile range divided by the median, to three places; 0 for a single repetition."""
        if len(self.seconds) < 2:
            return 0.0
        low, _, high = statistics.quantiles(self.seconds, n=4, method="inclusive")
        return round((high - low) / self.median, 3)


def cpu_seconds(work: Callable[[], object]) -> float:
    """Returns the CPU time of a function with one thread [s], which other programs on the machine disturb little."""
    start = time.process_time()
    work()
    return time.process_time() - start


def wall_seconds(work: Callable[[], object]) -> float:
    """Returns the wall-clock time of a function [s]."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def alternate(
    works: Mapping[str, Callable[[], float]], repeats: int, progress: Progress = ignore_progress
) -> dict[str, Timing]:
    """Measures functions alternately, so that a slow moment of the machine affects all of them.

    Args:
        works: functions by name, each of which returns the duration of one unit of its work [s].
        repeats: number of repetitions of each.
        progress: callback for the progress.
    """
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(repeats):
        for k, (name, work) in enumerate(works.items()):
            progress(name, (turn + k / len(works)) / repeats)
            seconds[name].append(work())
    return {name: Timing(tuple(times)) for name, times in seconds.items()}


def machine() -> dict[str, str | int]:
    """Returns the environment of a measurement: processor, cores, system and versions."""
    return {
        "processor": _processor(),
        "cores": available_processors(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{package.replace("-", "_"): version(package) for package in PACKAGES},
    }


def _processor() -> str:
    """Returns the model of the processor, as the system names it."""
    described = Path("/proc/cpuinfo")
    if described.is_file():
        for line in described.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()


def rounded(value: float, digits: int = 4) -> float:
    """Returns a number with some significant digits: more would be noise."""
    return float(f"{value:.{digits}g}")


# --- Worker processes -------------------------------------------------------------------------------------------------

_READY: Final = "ready"

_ROOT: Final = Path(__file__).parents[1]
"""Folder of this package, which is not installed and therefore on the path of workers."""


class BenchmarkProcessError(ProcessError):
    """A measuring process ended before it reported a result."""


class Worker:
    """Process that does a piece of work on request; it prepares in the background.

    Args:
        job: module of this package with a function `prepare`.
        settings: arguments of `prepare`, in JSON types.
    """

    def __init__(self, job: str, **settings: object) -> None:
        self._job = job
        self._noise = tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        command = [sys.executable, "-m", __name__, job, json.dumps(settings)]
        folders = [str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
        with starting_process():
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._noise, text=True, env=environment
            )

    def __enter__(self) -> Self:
        """Returns the worker."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.communicate()
        self._noise.close()

    def wait(self) -> None:
        """Waits until the process is ready to work.

        Raises:
            BenchmarkProcessError: the process ended before.
        """
        self._read()

    def start(self) -> None:
        """Requests the work once, without waiting."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write("run\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._fail()

    def seconds(self) -> float:
        """Waits for the end of the work and returns its duration [s].

        Raises:
            BenchmarkProcessError: the process ended before.
        """
        return float(self._read())

    def run(self) -> float:
        """Requests the work once, waits for it, and returns its duration [s]."""
        self.start()
        return self.seconds()

    def _read(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._fail()
        return line.strip()

    def _fail(self) -> NoReturn:
        code = self._process.wait()
        self._noise.seek(0)
        lines = [line for line in self._noise.read().splitlines() if line.strip()]
        last = lines[-1] if lines else "no message"
        raise BenchmarkProcessError(f"the process that measures {self._job!r} ended with code {code}: {last}")


def _serve(job: str, settings: str) -> None:
    """Does the work of a job for each line of standard input; standard output carries the durations only."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    work: Callable[[], float] = import_module(f"benchmarks.{job}").prepare(**json.loads(settings))
    print(_READY, file=answers, flush=True)
    for _ in sys.stdin:
        print(work(), file=answers, flush=True)


if __name__ == "__main__":
    _serve(*sys.argv[1:])
