from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl.settings import SelfPlaySettings
from dorothie_gym.baselines.selfplay.demonstrations import decisions_of, read_demonstrations
from dorothie_gym.baselines.selfplay.participant import ParticipantPhrase
from dorothie_gym.baselines.selfplay.training import SelfPlayTraining
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.recording import Corpus
from dorothie_gym.rollout import play_session

PARTICIPANT, CO_WIZARD, AD_WIZARD = range(3)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six sessions of the scripted roles, one of them held out."""
    root = tmp_path_factory.mktemp("corpus")
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=150.0))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    for seed in range(6):
        play_session(env, policies, seed=seed, folder=root / ("train" if seed < 5 else "val/seen") / f"{seed:04}")
    return root


def test_decisions_of_all_roles_are_read_from_sessions(corpus: Path) -> None:
    town = load_town("brookside")
    done = [Counter[int](), Counter[int](), Counter[int]()]
    for entry in Corpus.load(corpus).filter(fold="train").entries:
        for role, decisions in decisions_of(entry.load(), town).items():
            assert all(mask[choice] for _, mask, choice in decisions)
            done[role].update(choice for *_, choice in decisions)
    assert done[PARTICIPANT][ParticipantPhrase.NAME_GOAL] >= 3  # a goal or more a session
    assert sum(done[CO_WIZARD][NavigationAction.turn(sector)] for sector in range(8)) >= 4
    assert done[CO_WIZARD][NavigationAction.STOP] >= 3
    assert sum(count for macro, count in done[AD_WIZARD].items() if macro) >= 3


@pytest.mark.long
@pytest.mark.parametrize("shared", [False, True])
def test_warm_start_clones_all_roles_and_is_evaluated_first(shared: bool, corpus: Path, tmp_path: Path) -> None:
    settings = SelfPlaySettings(
        steps=16, environments=2, evaluate_every=16, episodes=1, network=(16,), traffic="none", max_seconds=10.0,
        parameters={"n_steps": 8, "batch_size": 16, "n_epochs": 1}, shared=shared, warm_start=str(corpus),
    )  # fmt: skip
    run = SelfPlayTraining(settings, tmp_path).run()
    assert [row.steps for row in run.rows] == [0, 16] and run.rows[0].seconds > 0.0
    results = json.loads((tmp_path / "cloned.json").read_text(encoding="utf-8"))
    assert set(results) == ({"all"} if shared else set(AGENT_ROLES))
    for cloned in results.values():
        assert cloned["losses"][1] < 0.5 * cloned["losses"][0] and cloned["decisions"] > 600
    again = SelfPlayTraining(settings, tmp_path).run()
    assert again.rows == run.rows  # a resumed run is not cloned again


@pytest.mark.long
def test_cloned_actor_is_frozen_at_first(corpus: Path, tmp_path: Path) -> None:
    settings = SelfPlaySettings(
        steps=16, environments=2, evaluate_every=16, episodes=1, network=(8,), traffic="none", max_seconds=10.0,
        parameters={"n_steps": 8, "batch_size": 16, "n_epochs": 1}, warm_start=str(corpus),
    )  # fmt: skip
    play = SelfPlayTraining(settings, tmp_path)
    before = [{k: v.clone() for k, v in each.model.policy.state_dict().items()} for each in play.rollout.learners]
    play.run()
    for learner, old in zip(play.rollout.learners, before, strict=True):
        for name, value in learner.model.policy.state_dict().items():
            acts = name.startswith(("action_net", "mlp_extractor.policy_net"))
            assert bool((value == old[name]).all()) is acts, name


def test_progress_of_reading_a_corpus_is_reported(corpus: Path) -> None:
    reported: list[tuple[str, int, int]] = []
    read_demonstrations(corpus, "train", lambda *so_far: reported.append(so_far))
    assert reported == [("Sessions of train", k, 5) for k in range(5)]


def test_corpus_without_sessions_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="no session"):
        read_demonstrations(tmp_path, "train")
