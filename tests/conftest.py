"""Set-up of all tests: their order, a cache folder of this run, a compiled simulation, a Ray cluster."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from dorothie_gym.envs import warm_up as navigation
from dorothie_gym.pictures.camera import warm_up as camera
from dorothie_gym.session.warm_up import is_warm
from dorothie_gym.support.compilation import compiled_folder
from dorothie_gym.support.user_cache import CACHE_VARIABLE

settings.register_profile("patient", deadline=None)  # durations are no results: another process may use the cores
settings.load_profile("patient")

UNCOMPILED = frozenset(
    [
        "analysis", "dialogue", "maps", "ontology", "support", "tasks", "test_errors.py", "test_package.py",
    ]
)  # fmt: skip
"""Folders and files whose tests step no simulation."""

SESSIONS = frozenset(
    [
        "archive", "closed_loop", "console", "rollout", "session", "studies", "teacher_forced", "test_console.py",
        "test_floods.py", "test_study.py", "test_routing.py",
    ]
)  # fmt: skip
"""Folders and files whose tests step sessions; those of all others may step batches as well."""

PICTURES = "camera", "picture", "video", "film"
"""Words in the names of folders and files whose tests draw first-person pictures, besides sessions."""

COMPILE = """
import os, subprocess, sys
from dorothie_gym.session.warm_up import warm_up
warm_up()
os.close(int(sys.argv[1]))
if "2" in sys.argv[4:]:
    batches = "from dorothie_gym.envs.warm_up import warm_up; warm_up()"
    with subprocess.Popen([sys.executable, "-c", batches]):
        warm_up(everything=True)
os.close(int(sys.argv[2]))
if "3" in sys.argv[4:]:
    from dorothie_gym.pictures.camera.warm_up import warm_up
    warm_up()
"""
"""Program that compiles sessions, then batches, then the camera, and gives a lock back after each.

Arguments: the locks, and the stages that are needed.
"""

_COMPILER = pytest.StashKey[subprocess.Popen[bytes]]()
_COMPILED = pytest.StashKey[set[int]]()
_FOLDER = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the size and the seed of the test of mutated files (`tests/malformed`)."""
    parser.addoption("--malformed-files", type=int, default=0, help="number of mutated files; default: a few")
    parser.addoption("--malformed-seed", type=int, default=0, help="seed of the mutations")


def pytest_configure(config: pytest.Config) -> None:
    """Points the package's cache at a folder of this run, which the parallel workers share."""
    if not hasattr(config, "workerinput"):
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of some hundred processes would compile the sources anew
        config.stash[_FOLDER] = tempfile.TemporaryDirectory(prefix="dorothie_gym-")
        folder = compiled_folder()
        if folder is not None:
            os.environ["NUMBA_CACHE_DIR"] = str(folder)  # machine code is named by its content: later runs reuse it
        os.environ[CACHE_VARIABLE] = config.stash[_FOLDER].name


def pytest_unconfigure(config: pytest.Config) -> None:
    """Ends the compilation and removes the folder."""
    compiler, folder = config.stash.get(_COMPILER, None), config.stash.get(_FOLDER, None)
    if compiler is not None:
        compiler.kill()
        compiler.wait()
    if folder is not None:
        folder.cleanup()


# --- Compilation ------------------------------------------------------------------------------------------------------


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts tests first that need little compilation: they run while the rest is compiled.

    Of those that need equally much, files with long tests come first, so that no worker waits for a long last test.
    """
    long = {item.path for item in items if item.get_closest_marker("long")}
    items.sort(key=lambda item: (_stage(item), item.path not in long))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_finish(session: pytest.Session) -> None:
    """Starts to compile what the tests need and is not in the cache: in one process, also for parallel workers.

    The process holds a lock for each stage, until that is compiled.
    """
    stages = {_stage(item) for item in session.items} - {0}
    warm = all(_is_warm(stage) for stage in stages)
    first = os.environ.get("PYTEST_XDIST_WORKER", "gw0") == "gw0" and not session.config.option.collectonly
    if warm or not first or compiled_folder() is None:
        return
    with ExitStack() as stack:
        locks = [stack.enter_context(_lock(stage).open("w")).fileno() for stage in (1, 2, 3)]
        for lock in locks:
            fcntl.flock(lock, fcntl.LOCK_EX)
        session.config.stash[_COMPILER] = subprocess.Popen(
            [sys.executable, "-c", COMPILE, *map(str, locks), *map(str, stages)],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(entry or os.getcwd() for entry in sys.path)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=locks,
        )


def _is_warm(stage: int) -> bool:
    if stage == 3:
        return is_warm() and camera.is_warm()
    return is_warm() and (stage == 1 or navigation.is_warm())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Waits for the compilation of what a test and its fixtures need.

    With a cold cache this takes a minute or two. Time limits hold for the body of a test only (`timeout_func_only`), so
    that no test fails because it happens to be the first.
    """
    stage, compiled = _stage(item), item.config.stash.setdefault(_COMPILED, {0})
    if stage not in compiled:
        with _lock(stage).open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH)
        compiled.add(stage)


def _stage(item: pytest.Item) -> int:
    """Returns 0 for a test that steps no simulation, or 1, 2, 3 for one of sessions, batches, pictures."""
    path = item.nodeid.partition("::")[0]
    names = set(path.split("/"))
    if any(word in path for word in PICTURES):
        return 3
    return 1 if names & SESSIONS else 0 if names & UNCOMPILED else 2


def _lock(stage: int) -> Path:
    return Path(os.environ[CACHE_VARIABLE], f"compiling-{stage}.lock")


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
