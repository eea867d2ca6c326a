"""Processes of their own that do a piece of work whenever they are told to.

A worker is asked for by the name of a module of this package, whose function `prepare(**settings)` returns the work: a
function that returns what it took [s]. Workers talk over pipes; what the work prints by itself is kept apart.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from types import TracebackType
from typing import Any, Self

from dorothie_gym.errors import BenchmarkProcessError

_READY = "ready"


class Worker:
    """One such process; it gets ready while the caller goes on.

    Args:
        job: module of this package with a function `prepare`.
        settings: for it; what JSON can hold.
    """

    def __init__(self, job: str, **settings: Any) -> None:
        self._job = job
        self._noise = tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        command = [sys.executable, "-m", __name__, job, json.dumps(settings)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._noise, text=True
        )

    def __enter__(self) -> Self:
        """The worker itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.communicate()
        self._noise.close()

    def wait(self) -> None:
        """Waits until it is ready to work.

        Raises:
            BenchmarkProcessError: it will never be.
        """
        self._read()

    def go(self) -> None:
        """Lets it work once."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write("go\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._fail()

    def seconds(self) -> float:
        """Waits until it has worked; returns what that took [s].

        Raises:
            BenchmarkProcessError: it ended before.
        """
        return float(self._read())

    def run(self) -> float:
        """Lets it work once, and waits."""
        self.go()
        return self.seconds()

    def _read(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._fail()
        return line.strip()

    def _fail(self) -> None:
        code = self._process.wait()
        self._noise.seek(0)
        said = [line for line in self._noise.read().splitlines() if line.strip()]
        last = said[-1] if said else "it said nothing"
        raise BenchmarkProcessError(f"the process that measures {self._job!r} ended with code {code}: {last}")


def _work(job: str, settings: str) -> None:
    """Main loop of a worker; standard output carries answers only."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    work: Callable[[], float] = import_module(f"dorothie_gym.bench.{job}").prepare(**json.loads(settings))
    print(_READY, file=answers, flush=True)
    for _ in sys.stdin:
        print(work(), file=answers, flush=True)


if __name__ == "__main__":
    _work(*sys.argv[1:])
