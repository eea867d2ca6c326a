"""Self-play on a Ray cluster; `pytest -m integrations` with dorothie-gym[ray] installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl.settings import SelfPlaySettings
from dorothie_gym.baselines.selfplay.training import SelfPlayTraining
from dorothie_gym.ontology import AGENT_ROLES

pytestmark = [pytest.mark.integrations, pytest.mark.timeout(900), pytest.mark.filterwarnings("ignore")]


def test_cluster_that_loses_a_machine_learns_the_weights_of_a_local_run(cluster: Any, tmp_path: Path) -> None:
    def lose_one(done: int, total: int, row: Any) -> None:
        if done >= 64 and cluster.second is not None:
            cluster.remove_node(cluster.second, allow_graceful=False)
            cluster.second = None

    settings = SelfPlaySettings(
        steps=128, environments=4, coached_environments=2, past_environments=1, evaluate_every=128, episodes=1,
        network=(8,), traffic="none", max_seconds=10.0, parameters={"n_steps": 8, "batch_size": 16, "n_epochs": 1},
    )  # fmt: skip
    far = SelfPlayTraining(settings, tmp_path / "far", lose_one, cluster.address).run()
    near = SelfPlayTraining(settings, tmp_path / "near").run()
    assert cluster.second is None and far.steps == near.steps == 128
    for role in AGENT_ROLES:
        one, other = ((tmp_path / place / role / "model.safetensors").read_bytes() for place in ("far", "near"))
        assert one == other, role
