"""What holds for all tests: nothing is written into the user's own folders."""

from __future__ import annotations

import os
import tempfile

import pytest

from dorothie_gym.world.town.store import CACHE_VARIABLE

_FOLDER = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_configure(config: pytest.Config) -> None:
    """Towns are kept in a folder of this run, which its parallel workers share."""
    if not hasattr(config, "workerinput"):
        config.stash[_FOLDER] = tempfile.TemporaryDirectory(prefix="dorothie_gym-")
        os.environ[CACHE_VARIABLE] = config.stash[_FOLDER].name


def pytest_unconfigure(config: pytest.Config) -> None:
    """The folder goes with the run."""
    folder = config.stash.get(_FOLDER, None)
    if folder is not None:
        folder.cleanup()
