"""Import time of the package and of a first environment against highway-env's, each in a new process."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from typing import Final

from benchmarks.timing import Figures, Progress, alternate, ignore_progress, machine

TOWN: Final = "brookside"
"""Town of the first environment."""

PACKAGE, FIRST_ENV, FIRST_STEP, HIGHWAY_ENV = (
    "import dorothie_gym",
    "first environment",
    "first step",
    "import highway_env",
)
"""Names of the measured programs."""

_START_CLOCK = "import time; start = time.perf_counter()\n"
_PRINT_SECONDS = "\nprint(time.perf_counter() - start)"
_CODE = {
    HIGHWAY_ENV: "import highway_env",
    PACKAGE: "import dorothie_gym",
    FIRST_ENV: f"import dorothie_gym; env = dorothie_gym.DuoWizardEnv({TOWN!r}); env.reset(seed=0)",
    FIRST_STEP: f"""
import dorothie_gym
env = dorothie_gym.DuoWizardEnv({TOWN!r})
env.reset(seed=0)
actions = {{agent: dorothie_gym.noop(dorothie_gym.Role(agent), env.limits) for agent in env.agents}}
env.step(actions)""",
}


def measure(*, repeats: int = 7, progress: Progress = ignore_progress) -> Figures:
    """Measures all programs alternately in wall-clock time, from the start of a new interpreter.

    The very first run is not counted: it compiles the simulation if it is not in the cache yet, and fills the disk
    cache.

    Args:
        repeats: number of processes of each kind.
        progress: callback for the progress.
    """
    progress("warming the caches", 0.0)
    for code in (_CODE[HIGHWAY_ENV], _CODE[FIRST_STEP]):
        _seconds(code)
    timings = alternate({name: partial(_seconds, code) for name, code in _CODE.items()}, repeats, progress)
    reference, first = timings[HIGHWAY_ENV], timings[FIRST_ENV]
    return {
        "town": TOWN,
        "seconds": {
            "package": round(timings[PACKAGE].median, 4),
            "first_environment": round(first.median, 4),
            "first_step": round(timings[FIRST_STEP].median, 4),
        },
        "highway_env_seconds": round(reference.median, 4),
        "ratio": round(first.median / reference.median, 3),
        "spread": first.spread,
        "package_spread": timings[PACKAGE].spread,
        "highway_env_spread": reference.spread,
        "repeats": repeats,
        "machine": machine(),
    }


def _seconds(code: str) -> float:
    """Returns the time that a new interpreter takes to run some code [s]."""
    environment = {**os.environ, "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
    program = [sys.executable, "-c", _START_CLOCK + code + _PRINT_SECONDS]
    done = subprocess.run(program, env=environment, capture_output=True, check=True, text=True)
    return float(done.stdout.splitlines()[-1])
