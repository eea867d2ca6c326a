"""Navigation-v0 is the same, byte by byte, compiled and in plain Python."""

from __future__ import annotations

import pytest

from tests.plain_python import printed_compiled_and_plain

EPISODE = """
import hashlib
import numpy as np
from dorothie_gym.envs.navigation_v0 import NavigationEnv
for guidance in ("turns", "goals"):
    env = NavigationEnv("brookside", guidance=guidance, exceptions=4.0)
    rng = np.random.default_rng(0)
    observation, info = env.reset(seed=3)
    digest = hashlib.sha256()
    for _ in range(8):
        digest.update(observation.tobytes() + info["action_mask"].tobytes() + repr(info["reward_terms"]).encode())
        observation, *_, info = env.step(rng.choice(np.flatnonzero(info["action_mask"])))
    print(digest.hexdigest(), hashlib.sha256(env.session.world.actors.arrays.tobytes()).hexdigest())
"""


@pytest.mark.long
def test_episodes_are_the_same_bytes_compiled_and_in_plain_python() -> None:
    compiled, plain = printed_compiled_and_plain(EPISODE)
    assert compiled == plain != ""
