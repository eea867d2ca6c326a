"""Programs that print the same compiled and in plain Python."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numba
import pytest

ROOT = Path(__file__).parents[1]


def printed_compiled_and_plain(program: str) -> tuple[str, str]:
    """Returns what a program prints here, and in a process without the compiler and with another order of sets.

    Both run at the same time; here, what is imported and compiled is used again. Skips the test where this process has
    no compiler.
    """
    if numba.config.DISABLE_JIT:
        pytest.skip("nothing is compiled")
    with subprocess.Popen(
        [sys.executable, "-W", "error", "-c", program],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONHASHSEED": "1", "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        with redirect_stdout(io.StringIO()) as printed:
            exec(compile(program, "<program>", "exec"), {"__name__": "program"})
        plain, errors = process.communicate()
    assert process.returncode == 0, errors
    return printed.getvalue(), plain
