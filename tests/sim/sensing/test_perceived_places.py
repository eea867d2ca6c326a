"""Perception is the same, byte by byte, compiled and in plain Python."""

from __future__ import annotations

import pytest

from tests.plain_python import printed_compiled_and_plain

SENSES = """
import hashlib
import numpy as np
from dorothie_gym.sim.sensing.visibility import Visibility
from tests.sim.driving import network
from tests.sim.state.plain_rules import lawless_way
from tests.sim.state.trajectory_watch import TrajectoryWatch
from tests.sim.sensing.odometer import CarriedLocalizer
from tests.sim.sensing.test_seen_bodies import Street
digest = hashlib.sha256()
for seed in range(4):
    view = Visibility(fog=0.02, rain=0.002, light=3.0, lamps=20200.0 * (seed % 2))
    digest.update(Street(seed).seen(view, 100 * seed, seed).tobytes())
roads = network("brookside")
way = lawless_way(roads, np.random.default_rng(2), 450)
watch, localizer = TrajectoryWatch(roads), CarriedLocalizer(*way[0, :3], np.random.default_rng(7))
for k in range(0, 450, 15):
    localizer.carry(way[k : k + 16], k, gps_from=200)
    digest.update(localizer.pose.tobytes() + localizer.covariance.tobytes())
    digest.update(repr(watch.look(way[k : k + 16], k)).encode())
print(digest.hexdigest())
"""


@pytest.mark.long
def test_senses_are_the_same_bytes_compiled_and_in_plain_python() -> None:
    compiled, plain = printed_compiled_and_plain(SENSES)
    assert compiled == plain != ""
