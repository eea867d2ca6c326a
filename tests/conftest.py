"""Fixtures of all tests: a cache folder of this run, a compiled simulation, a Ray cluster."""

from __future__ import annotations

import fcntl
import os
import tempfile
import warnings
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import settings

from dorothie_gym.compilation import compiled_folder
from dorothie_gym.engine.warm_up import is_warm, warm_up
from dorothie_gym.envs import warm_up as navigation
from dorothie_gym.user_cache import CACHE_VARIABLE

settings.register_profile("patient", deadline=None)  # durations are no results: another process may use the cores
settings.load_profile("patient")

BATCHED = frozenset(["baselines", "envs"])
"""Folders of tests that step batches of the navigation environments."""

SIMULATED = frozenset(
    [
        "baselines",
        "bench",
        "benchmark",
        "engine",
        "envs",
        "policies",
        "recording",
        "rollout",
        "sim",
        "testing",
        "wrappers",
        "test_docs.py",
        "test_environment_pages.py",
        "test_readme.py",
    ]
)
"""Folders and files whose tests step the simulation."""

_FOLDER = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the size and the seed of the test of mutated files (`tests/malformed`)."""
    parser.addoption("--malformed-files", type=int, default=0, help="number of mutated files; default: a few")
    parser.addoption("--malformed-seed", type=int, default=0, help="seed of the mutations")


def pytest_configure(config: pytest.Config) -> None:
    """Points the package's cache at a folder of this run, which the parallel workers share."""
    if not hasattr(config, "workerinput"):
        config.stash[_FOLDER] = tempfile.TemporaryDirectory(prefix="dorothie_gym-")
        folder = compiled_folder()
        if folder is not None:
            os.environ["NUMBA_CACHE_DIR"] = str(folder)  # machine code is named by its content: later runs reuse it
        os.environ[CACHE_VARIABLE] = config.stash[_FOLDER].name


def pytest_unconfigure(config: pytest.Config) -> None:
    """Removes the folder."""
    folder = config.stash.get(_FOLDER, None)
    if folder is not None:
        folder.cleanup()


@pytest.fixture(scope="session", autouse=True)
def compiled_simulation(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> None:
    """Compiles the simulation before the first test, one worker at a time.

    With a cold cache this takes a minute or two. Time limits hold for the body of a test only
    (`timeout_func_only`), so that no test fails because it happens to be the first. Workers take turns: the later ones
    find the machine code of the first in the cache.
    """
    if not any(SIMULATED & set(item.path.parts) for item in request.session.items):
        return
    root = tmp_path_factory.getbasetemp()
    shared = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    with (shared / "compiling.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not is_warm():
            warm_up()
        if any(BATCHED & set(item.path.parts) for item in request.session.items) and not navigation.is_warm():
            navigation.warm_up()


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Starts a Ray cluster of two nodes with one processor each; `second` is the node that is not the head."""
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        made.second = made.add_node(num_cpus=1)
        made.wait_for_nodes()
    yield made
    ray.shutdown()  # a failed test is still connected, and the nodes would wait for it
    made.shutdown()
