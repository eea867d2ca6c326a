"""Sessions on a Ray cluster; `pytest -m integrations` with dorothie-gym[ray] installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.session.config import EnvConfig
from tests.evaluation.rollout.killing import contents

pytestmark = [pytest.mark.integrations, pytest.mark.timeout(900), pytest.mark.filterwarnings("ignore")]

SHORT = EnvConfig(max_seconds=40.0)


def test_corpus_of_a_cluster_that_loses_a_machine_has_the_bytes_of_a_local_one(cluster: Any, tmp_path: Path) -> None:
    seen: list[int] = []

    def lose_one(done: int, total: int) -> None:
        seen.append(done)
        if done == 2:
            cluster.remove_node(cluster.second, allow_graceful=False)

    generate_corpus(tmp_path / "far", sessions=6, seed=5, config=SHORT, ray=cluster.address, on_session=lose_one)
    generate_corpus(tmp_path / "near", sessions=6, seed=5, config=SHORT)
    assert seen == list(range(7))
    assert contents(tmp_path / "far") == contents(tmp_path / "near")


def test_rollout_of_a_cluster_goes_on_with_what_is_there(cluster: Any, tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    settings = RolloutSettings(towns=("brookside",), sessions=4, config=SHORT)
    with pytest.raises(KeyboardInterrupt):
        roll_out(settings, tmp_path / "far", on_session=stop)
    roll_out(settings, tmp_path / "far", ray=cluster.address)
    roll_out(settings, tmp_path / "near")
    results = [(tmp_path / name / "rollout.json").read_bytes() for name in ("far", "near")]
    assert results[0] == results[1]
    assert contents(tmp_path / "far" / "sessions") == contents(tmp_path / "near" / "sessions")


@pytest.mark.parametrize("address", ["127.0.0.1:1", "ray://127.0.0.1:1", "nowhere:in particular"])
def test_address_without_a_cluster_is_reported(address: str, tmp_path: Path) -> None:
    pytest.importorskip("ray")
    with pytest.raises(ProcessError, match=f"there is no Ray cluster at '{address}'"):
        generate_corpus(tmp_path, sessions=1, seed=0, ray=address)
