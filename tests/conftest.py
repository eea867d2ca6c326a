"""What holds for all tests: nothing is written into the user's own folders. And a Ray cluster for who wants one."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterator
from typing import Any

import pytest

from dorothie_gym.user_cache import CACHE_VARIABLE

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


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A Ray cluster of two nodes with a processor each, the other one than the head being `second`."""
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        made.second = made.add_node(num_cpus=1)
        made.wait_for_nodes()
    yield made
    ray.shutdown()  # a test that failed is still connected, and the nodes would wait for it
    made.shutdown()
