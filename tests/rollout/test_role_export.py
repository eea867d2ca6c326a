"""Datasets of one role for Minari and Hugging Face, loaded back with these libraries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.recording import Corpus
from dorothie_gym.rollout import play_session
from dorothie_gym.rollout.role_export import RoleEpisode, export_hugging_face, export_minari, role_episodes
from dorothie_gym.spaces import observation_fields


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("corpus")
    for seed, town in ((3, "brookside"), (4, "midtown")):
        engine = SessionEngine(town, config=EnvConfig(max_seconds=20.0))
        policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
        play_session(engine, policies, seed=seed, folder=root / f"seed_{seed}")
    return root


def episodes_of(corpus: Path, role: Role) -> list[RoleEpisode]:
    return list(role_episodes(Corpus.load(corpus).entries, role))


def same(one: Any, other: Any) -> bool:
    return one == other if isinstance(one, str) else bool(np.array_equal(np.asarray(one), np.asarray(other)))


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_hugging_face_loads_equal_values(
    corpus: Path, tmp_path: Path, role: Role, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets", reason="needs the extra 'hf'")
    found = episodes_of(corpus, role)
    export_hugging_face(found, role, tmp_path / "out")
    rows = datasets.load_dataset(str(tmp_path / "out"), cache_dir=str(tmp_path / "cache"))["train"]
    assert len(rows) == sum(len(episode.actions) for episode in found)
    k = 0
    for episode in found:
        for number, (observation, action) in enumerate(zip(episode.observations, episode.actions, strict=False)):
            row = rows[k]
            k += 1
            assert (row["session"], row["seed"], row["decision"]) == (episode.session, episode.seed, number)
            assert row["reward"] == episode.rewards[number]
            assert all(same(value, row[f"observation.{name}"]) for name, value in observation.items())
            assert all(same(value, row[f"action.{name}"]) for name, value in action.items())
    assert sum(rows["truncated"]) == 2 and not any(rows["terminated"])


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_minari_loads_equal_values(
    corpus: Path, tmp_path: Path, role: Role, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    minari = pytest.importorskip("minari", reason="needs the extra 'minari'")
    found = episodes_of(corpus, role)
    name = export_minari(found, role, tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset(name)
    assert dataset.total_episodes == 2 and dataset.total_steps == sum(len(each.actions) for each in found)
    for episode, read in zip(found, dataset.iterate_episodes(), strict=True):
        assert list(read.rewards) == list(episode.rewards)
        assert bool(read.truncations[-1]) and not any(read.terminations)
        for rows, kept in ((episode.observations, read.observations), (episode.actions, read.actions)):
            for field in rows[0]:
                assert all(same(row[field], kept[field][k]) for k, row in enumerate(rows)), field
    assert dataset.observation_space.contains(found[0].observations[0])


def test_view_is_that_of_the_role_as_it_was_played(corpus: Path) -> None:
    """Observations of a second play by policies are those that are exported."""
    episode = episodes_of(corpus, Role.CO_WIZARD)[0]
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=20.0))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    seen: list[Any] = []
    play_session(engine, policies, seed=3, on_step=lambda engine: seen.append(dict(engine.observations["co_wizard"])))
    assert len(seen) == len(episode.observations)
    for one, other in zip(seen, episode.observations, strict=True):
        assert all(same(value, other[name]) for name, value in one.items())


def test_dataset_of_the_co_wizard_has_nothing_of_the_others(corpus: Path, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    export_hugging_face(episodes_of(corpus, Role.CO_WIZARD), Role.CO_WIZARD, tmp_path / "out")
    table = pq.read_table(tmp_path / "out" / "data" / "train-00000-of-00001.parquet")
    observed = {name.partition(".")[2] for name in table.column_names if name.startswith("observation.")}
    own = {field.name for field in observation_fields(Role.CO_WIZARD, episodes_of(corpus, Role.CO_WIZARD)[0].limits)}
    assert observed == own
    assert not observed & {"story", "tasks", "subgoals", "hidden", "message"}
    content = json.dumps(table.to_pylist())
    for session in Corpus.load(corpus):
        goals = session.header.subgoals
        assert goals and not any(str(goal["description"]) in content for goal in goals)
        assert str(session.header.to_json().get("story", "no story"))[:60] not in content


def test_card_describes_every_field(corpus: Path, tmp_path: Path) -> None:
    export_hugging_face(episodes_of(corpus, Role.PARTICIPANT), Role.PARTICIPANT, tmp_path / "out")
    card = (tmp_path / "out" / "README.md").read_text()
    assert card.startswith("---\nlicense: mit")
    limits = episodes_of(corpus, Role.PARTICIPANT)[0].limits
    for field in observation_fields(Role.PARTICIPANT, limits):
        assert f"| `observation.{field.name}` |" in card


def test_command_exports_and_refuses(corpus: Path, tmp_path: Path) -> None:
    def call(*arguments: object) -> Any:
        return CliRunner().invoke(app, ["convert", *map(str, arguments)])

    done = call(corpus, tmp_path / "hf", "--to", "hf", "--role", "ad_wizard", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["role"] == "ad_wizard"
    done = call(corpus, tmp_path / "minari", "--to", "minari")
    assert done.exit_code == 0, done.output
    assert "dataset dorothie-gym/co-wizard-v0" in done.stdout
    again = call(corpus, tmp_path / "minari", "--to", "minari")
    assert again.exit_code == 2 and "exists already" in again.stderr
    with pytest.raises(SessionError, match="no sessions"):
        export_hugging_face((), Role.CO_WIZARD, tmp_path / "empty")
    assert not (tmp_path / "empty").exists()
