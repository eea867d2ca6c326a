"""Commands of the command line in processes of their own that share the time of the imports.

A server process imports the package once; a command is a fork of it (`multiprocessing`'s method `forkserver`). It
behaves as one that was started by a shell, but for signals that arrive during the imports
(see `tests/cli/test_signals.py`).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.context import ForkServerProcess
from pathlib import Path

IMPORTED = (
    "dorothie_gym.cli.app",
    "dorothie_gym.baselines.rl",
    "dorothie_gym.envs.navigation_vector_env",
    "dorothie_gym.cli.generate",
    "matplotlib.figure",
    "sb3_contrib",
    "torch._dynamo",
)
"""Modules that the server imports, if they are installed."""


def start_command(words: Sequence[str], folder: Path, errors: Path) -> ForkServerProcess:
    """Starts a command of `dorothie-gym` in a folder, with its standard error in a file."""
    context = get_context("forkserver")
    context.set_forkserver_preload(list(IMPORTED))
    process = context.Process(target=_run, args=(list(words), folder, errors))
    process.start()
    return process


def _run(words: list[str], folder: Path, errors: Path) -> None:
    os.chdir(folder)
    for number, path in ((1, os.devnull), (2, errors)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    sys.argv = ["dorothie-gym", *words]
    from dorothie_gym.cli import main

    main()
