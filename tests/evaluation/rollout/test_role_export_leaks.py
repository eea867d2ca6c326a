"""What is exported of a role follows from what the role observed and did, and from nothing else of the session."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.rollout.hugging_face_export import export_hugging_face
from dorothie_gym.evaluation.rollout.minari_export import export_minari
from dorothie_gym.evaluation.rollout.role_episodes import RoleEpisode, lived_through, role_episodes
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import Scenario, draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.tasks import template_names
from dorothie_gym.testing.leaks import with_hidden_landmarks_moved, with_other_tasks

SECONDS = 25.0
SEEDS = (1003, 1004, 1005)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("corpus")
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=SECONDS))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    for seed in SEEDS:
        folder = root / f"brookside_{draw_scenario(engine.town, None, seed).storyboard.name}_{seed}"
        play_session(engine, policies, seed=seed, folder=folder)
    return root


def variants() -> Iterator[Scenario]:
    """Yields scenarios that the Co-Wizard cannot tell apart: other storyboards, stories, errands and hidden places."""
    town = load_town("brookside")
    seed = next(
        seed
        for seed in range(50, 500)
        if any(mark.hidden for mark in draw_scenario(town, None, seed).storyboard.landmarks)
    )
    first = draw_scenario(town, None, seed)
    yield first
    yield with_hidden_landmarks_moved(first, town, np.random.default_rng(1))
    other = with_other_tasks(first)
    yield replace(other, storyboard=replace(other.storyboard, name="another_story"))


def episode_of(scenario: Scenario, decisions: list[dict[str, Any]]) -> RoleEpisode:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=SECONDS))
    engine.reset(scenario=scenario)
    name = f"brookside_{scenario.storyboard.name}_{scenario.seed}"
    return lived_through(engine, Role.CO_WIZARD, decisions, source=name)


@pytest.fixture(scope="module")
def alike() -> list[RoleEpisode]:
    """Episodes of sessions that differ only in what the Co-Wizard must not know."""
    scenarios = list(variants())
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=SECONDS))
    engine.reset(scenario=scenarios[0])
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(1, engine.town) for role, policy in policies.items()}
    decisions = []
    while not engine.over:
        actions = {}
        for role, policy in policies.items():
            seen = {**engine.observations[str(role)], "action_mask": engine.mask(role)}
            actions[str(role)], states[role] = policy.step(seen, states[role])
        actions["ad_wizard"] = {**actions["ad_wizard"], "exception": 0, "message": ""}
        decisions.append(actions)
        engine.step(actions)
    return [episode_of(scenario, decisions) for scenario in scenarios]


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def exported(episodes: list[RoleEpisode], folder: Path) -> dict[str, bytes]:
    """Returns names and contents of all files that the exports of the Co-Wizard write."""
    export_hugging_face(episodes, Role.CO_WIZARD, folder / "hf")
    if pytest.importorskip("minari", reason="needs the extra 'minari'"):
        export_minari(episodes, Role.CO_WIZARD, folder / "dicts", storage="arrow")
        export_minari(episodes, Role.CO_WIZARD, folder / "vectors", storage="arrow", fields=["physical", "move"])
    return files_of(folder)


def test_sessions_that_the_co_wizard_cannot_tell_apart_are_exported_alike(
    alike: list[RoleEpisode], tmp_path: Path
) -> None:
    assert len({episode.source for episode in alike}) == 2, "the storyboards have different names"
    found = [exported([episode], tmp_path / str(number)) for number, episode in enumerate(alike)]
    assert len(found[0]) >= 5
    for other in found[1:]:
        assert list(other) == list(found[0])
        for name, content in other.items():
            assert content == found[0][name], name


def test_hdf5_of_sessions_that_look_alike_has_equal_content(alike: list[RoleEpisode], tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py", reason="needs the extra 'minari'")
    pytest.importorskip("minari", reason="needs the extra 'minari'")

    def content(number: int) -> dict[str, Any]:
        folder = tmp_path / str(number)
        export_minari([alike[number]], Role.CO_WIZARD, folder)
        found: dict[str, Any] = {}

        def visit(name: str, item: Any) -> None:
            found[name] = item[()].tolist() if isinstance(item, h5py.Dataset) else None
            found[f"{name} attributes"] = {key: str(value) for key, value in item.attrs.items()}

        data = folder / "dorothie-gym" / "co-wizard-v0" / "data"
        with h5py.File(data / "main_data.hdf5") as file:
            file.visititems(visit)
        return {**found, "metadata": (data / "metadata.json").read_text(), "files": list(files_of(folder))}

    first = content(0)
    assert first["episode_0 attributes"] == {"id": "0", "total_steps": str(len(alike[0].actions))}, "no seed"
    assert all(content(number) == first for number in range(1, len(alike)))


def test_what_distinguishes_a_session_does_not_belong_to_an_episode() -> None:
    assert {field.name for field in fields(RoleEpisode)} == {
        "source", "town", "config", "limits", "observation_space", "action_space", "observations", "masks", "actions",
        "rewards", "terminated",
    }  # fmt: skip


def test_names_of_sessions_and_their_order_do_not_matter(corpus: Path, tmp_path: Path) -> None:
    """Sessions lie in the order of their seeds; a corpus of known seeds would tell which one an episode is."""
    episodes = list(role_episodes(Corpus.load(corpus).entries, Role.CO_WIZARD))
    assert len(episodes) == len(SEEDS)
    first = exported(episodes, tmp_path / "first")
    mixed = [replace(episodes[k], source=f"session {k}") for k in (2, 0, 1)]
    assert exported(mixed, tmp_path / "second") == first
    rows = pq.read_table(tmp_path / "first" / "hf" / "data" / "train-00000-of-00001.parquet")["session"].to_pylist()
    assert rows == sorted(rows) and set(rows) == {episode.id for episode in episodes}
    assert all(re.fullmatch("[0-9a-f]{16}", name) for name in rows)


def test_nothing_names_storyboards_seeds_or_errands(corpus: Path, tmp_path: Path) -> None:
    sessions = list(Corpus.load(corpus))
    files = exported(list(role_episodes(Corpus.load(corpus).entries, Role.CO_WIZARD)), tmp_path)
    whole = b"\n".join([*(name.encode() for name in files), *files.values()]).decode("latin-1")
    table = pq.read_table(tmp_path / "hf" / "data" / "train-00000-of-00001.parquet")
    whole += json.dumps(table.drop_columns(["action.meaning", "action.utterance"]).to_pylist())
    secrets = [*template_names(), *(f"seed_{seed}" for seed in SEEDS)]
    secrets += [session.name for session in sessions] + [session.header.story[:60] for session in sessions]
    secrets += [str(goal["description"]) for session in sessions for goal in session.header.subgoals]
    assert not [secret for secret in secrets if secret in whole]
    assert "seed" not in table.column_names
    for name, content in files.items():
        if name.endswith("metadata.json"):
            assert not {"seed", "seeds", "options"} & set(json.loads(content)), name


def test_equal_sessions_have_distinct_ids(corpus: Path, tmp_path: Path) -> None:
    episode = next(role_episodes(Corpus.load(corpus).entries, Role.CO_WIZARD))
    export_hugging_face([episode, episode], Role.CO_WIZARD, tmp_path / "hf")
    rows = pq.read_table(tmp_path / "hf" / "data" / "train-00000-of-00001.parquet")["session"].to_pylist()
    assert dict.fromkeys(rows) == {episode.id: None, f"{episode.id}-2": None}
