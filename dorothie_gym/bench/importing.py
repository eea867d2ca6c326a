"""Import time of the package and of a first environment against highway-env's, each in a fresh process."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from typing import Any

from dorothie_gym.bench.timing import Progress, in_turns, machine, quiet

TOWN = "brookside"
"""Town of the first environment."""

PACKAGE, ENVIRONMENT, STEP, STOCK = "import dorothie_gym", "first environment", "first step", "import highway_env"

_CLOCK = "import time; start = time.perf_counter()\n"
_TELL = "\nprint(time.perf_counter() - start)"
_CODE = {
    STOCK: "import highway_env",
    PACKAGE: "import dorothie_gym",
    ENVIRONMENT: f"import dorothie_gym; env = dorothie_gym.DuoWizardEnv({TOWN!r}); env.reset(seed=0)",
    STEP: f"""
import dorothie_gym
env = dorothie_gym.DuoWizardEnv({TOWN!r})
env.reset(seed=0)
actions = {{agent: dorothie_gym.noop(dorothie_gym.Role(agent), env.limits) for agent in env.agents}}
env.step(actions)""",
}


def measure(*, repeats: int = 7, progress: Progress = quiet) -> dict[str, Any]:
    """Measures all in turns, by the clock on the wall, from the start of an interpreter that has imported nothing.

    The first run of all is not counted: it compiles the kernel where that is not in the cache yet, and warms the disk.

    Args:
        repeats: processes of each kind.
        progress: is told what is being done.
    """
    progress("warming the caches", 0.0)
    for code in (_CODE[STOCK], _CODE[STEP]):
        _seconds(code)
    timings = in_turns({name: partial(_seconds, code) for name, code in _CODE.items()}, repeats, progress)
    stock, first = timings[STOCK], timings[ENVIRONMENT]
    return {
        "town": TOWN,
        "seconds": {
            "package": round(timings[PACKAGE].median, 4),
            "first_environment": round(first.median, 4),
            "first_step": round(timings[STEP].median, 4),
        },
        "highway_env_seconds": round(stock.median, 4),
        "ratio": round(first.median / stock.median, 3),
        "spread": first.spread,
        "package_spread": timings[PACKAGE].spread,
        "highway_env_spread": stock.spread,
        "repeats": repeats,
        "machine": machine(),
    }


def _seconds(code: str) -> float:
    """Returns the time that a fresh interpreter takes to run some code [s]."""
    environment = {**os.environ, "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", _CLOCK + code + _TELL], env=environment, capture_output=True, check=True, text=True
    )
    return float(done.stdout.splitlines()[-1])
