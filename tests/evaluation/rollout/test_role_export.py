"""Datasets of one role for Minari and Hugging Face, loaded back with these libraries."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import dorothie_gym
from dorothie_gym.archive import Corpus
from dorothie_gym.cli.app import app
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.rollout.hugging_face_export import export_hugging_face
from dorothie_gym.evaluation.rollout.minari_export import STORAGES, export_minari
from dorothie_gym.evaluation.rollout.role_episodes import RoleEpisode, role_episodes
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import observation_fields


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("corpus")
    for seed, town in ((3, "brookside"), (4, "midtown")):
        engine = SessionEngine(town, config=EnvConfig(max_seconds=20.0))
        policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
        play_session(engine, policies, seed=seed, folder=root / f"seed_{seed}")
    return root


def episodes_of(corpus: Path, role: Role) -> list[RoleEpisode]:
    return sorted(role_episodes(Corpus.load(corpus).entries, role), key=lambda episode: episode.id)


def same(one: Any, other: Any) -> bool:
    return one == other if isinstance(one, str) else bool(np.array_equal(np.asarray(one), np.asarray(other)))


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_hugging_face_loads_equal_values(
    corpus: Path, tmp_path: Path, role: Role, monkeypatch: pytest.MonkeyPatch
) -> None:
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
            assert (row["session"], row["town"], row["decision"]) == (episode.id, episode.town, number)
            assert row["reward"] == episode.rewards[number]
            assert all(same(value, row[f"observation.{name}"]) for name, value in observation.items())
            assert all(same(value, row[f"action.{name}"]) for name, value in action.items())
    assert sum(rows["truncated"]) == 2 and not any(rows["terminated"])


def loaded(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    import minari

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
    return minari.load_dataset(name)


def needs_minari(storage: str) -> None:
    pytest.importorskip("minari", reason="needs the extra 'minari'")
    if storage == "hdf5":
        pytest.importorskip("h5py", reason="needs the extra 'minari'")


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("role", AGENT_ROLES)
def test_minari_loads_equal_values(
    corpus: Path, tmp_path: Path, role: Role, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_minari(storage)
    found = episodes_of(corpus, role)
    dataset = loaded(tmp_path, export_minari(found, role, tmp_path, storage=storage), monkeypatch)
    assert dataset.total_episodes == 2 and dataset.total_steps == sum(len(each.actions) for each in found)
    for episode, read in zip(found, dataset.iterate_episodes(), strict=True):
        assert list(read.rewards) == list(episode.rewards)
        assert bool(read.truncations[-1]) and not any(read.terminations)
        for rows, kept in ((episode.observations, read.observations), (episode.actions, read.actions)):
            for field in rows[0]:
                assert all(same(row[field], kept[field][k]) for k, row in enumerate(rows)), field
    assert dataset.observation_space.contains(found[0].observations[0])


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("role", AGENT_ROLES)
def test_minari_recovers_the_environment(
    corpus: Path, tmp_path: Path, role: Role, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_minari(storage)
    dataset = loaded(tmp_path, export_minari(episodes_of(corpus, role), role, tmp_path, storage=storage), monkeypatch)
    env = dataset.recover_environment()
    assert (env.observation_space, env.action_space) == (dataset.observation_space, dataset.action_space)
    assert env.unwrapped.engine.config.max_seconds == 20.0 and env.unwrapped.role == role
    assert set(env.spec.kwargs) == {"role", "town", "config"} and env.unwrapped.engine.template is None
    observation, info = env.reset(seed=1)
    assert observation in dataset.observation_space
    env.step(env.action_space.sample(mask=info["action_mask"]))


def test_minari_has_the_masks(corpus: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs_minari("hdf5")
    found = episodes_of(corpus, Role.CO_WIZARD)
    dataset = loaded(tmp_path, export_minari(found, Role.CO_WIZARD, tmp_path), monkeypatch)
    for episode, read in zip(found, dataset.iterate_episodes(), strict=True):
        kept = read.infos["action_mask"]
        assert set(kept) == {name for name, mask in episode.masks[0].items() if mask is not None}
        for k, masks in enumerate(episode.masks):
            assert all(same(masks[name], kept[name][k]) for name in kept if name != "plan")
            assert all(same(part, kept["plan"][f"_index_{i}"][k]) for i, part in enumerate(masks["plan"]))
        wrong = [k for k, action in enumerate(episode.actions) if not episode.masks[k]["physical"][action["physical"]]]
        assert not wrong, "the scripted Co-Wizard drives as the mask permits"


@pytest.mark.parametrize("storage", STORAGES)
def test_vectors_are_those_of_flatten(
    corpus: Path, tmp_path: Path, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_minari(storage)
    found, fields = episodes_of(corpus, Role.CO_WIZARD), ["physical", "angle"]
    name = export_minari(found, Role.CO_WIZARD, tmp_path, storage=storage, fields=fields)
    dataset = loaded(tmp_path, name, monkeypatch)
    env = dataset.recover_environment()
    flat = dorothie_gym.flatten(gym.make("dorothie_gym/CoWizard-v0", config=found[0].config, town="brookside"), fields)
    assert env.observation_space == dataset.observation_space == flat.observation_space["observation"]
    assert env.action_space == flat.action_space and env.action_space.sample() in dataset.action_space
    for episode, read in zip(found, dataset.iterate_episodes(), strict=True):
        assert same(read.observations[3], flat.flatten(episode.observations[3])["observation"])
        assert read.infos["action_mask"].shape == (len(episode.masks), int(flat.action_space.nvec.sum()))
        for taken, kept in zip(episode.actions, read.actions, strict=True):
            unflat = flat.env.unflatten(kept)
            assert all(same(taken[field], unflat[field]) for field in fields)
    assert env.reset(seed=3)[0] in dataset.observation_space
    env.step(env.action_space.sample())


def test_minari_refuses_unknown_fields(corpus: Path, tmp_path: Path) -> None:
    found = episodes_of(corpus, Role.CO_WIZARD)
    with pytest.raises(SessionError, match=r"fields: 'thrust' is none of angle, "):
        export_minari(found, Role.CO_WIZARD, tmp_path, storage="arrow", fields=["thrust"])
    with pytest.raises(SessionError, match="storage is 'csv'; it must be hdf5 or arrow"):
        export_minari(found, Role.CO_WIZARD, tmp_path, storage="csv")
    assert not any(tmp_path.iterdir())


def test_town_that_is_not_shipped_has_no_environment(
    corpus: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_minari("arrow")
    found = [replace(each, town="harbour") for each in episodes_of(corpus, Role.CO_WIZARD)]
    dataset = loaded(tmp_path, export_minari(found, Role.CO_WIZARD, tmp_path, storage="arrow"), monkeypatch)
    assert dataset.env_spec is None and dataset.total_episodes == 2


def test_view_is_that_of_the_role_as_it_was_played(corpus: Path) -> None:
    """Observations of a second play by policies are those that are exported."""
    episode = next(each for each in episodes_of(corpus, Role.CO_WIZARD) if each.town == "brookside")
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=20.0))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    seen: list[Any] = []
    play_session(engine, policies, seed=3, on_step=lambda engine: seen.append(dict(engine.observations["co_wizard"])))
    assert len(seen) == len(episode.observations)
    for one, other in zip(seen, episode.observations, strict=True):
        assert all(same(value, other[name]) for name, value in one.items())


def test_dataset_of_the_co_wizard_has_no_text_of_the_others(corpus: Path, tmp_path: Path) -> None:
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
    arrow = ("--to", "minari", "--storage", "arrow", "--field", "physical")
    done = call(corpus, tmp_path / "minari", *arrow)
    assert done.exit_code == 0, done.output
    assert "dataset dorothie-gym/co-wizard-v0" in done.stdout
    again = call(corpus, tmp_path / "minari", *arrow)
    assert again.exit_code == 2 and "exists already" in again.stderr
    wrong = call(corpus, tmp_path / "hf2", "--to", "hf", "--field", "move")
    assert wrong.exit_code == 2 and "belong to --to minari" in wrong.stderr
    with pytest.raises(SessionError, match="no sessions"):
        export_hugging_face((), Role.CO_WIZARD, tmp_path / "empty")
    assert not (tmp_path / "empty").exists()
