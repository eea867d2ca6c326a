"""Environments and states that were pickled: they go on as the original does, and fit where the original fits."""

from __future__ import annotations

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pettingzoo
import pytest

from dorothie_gym import DuoWizardEnv, DuoWizardVectorEnv, load_town
from dorothie_gym.errors import StateError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import noop
from tests.envs.test_copies import Player, assert_equal
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of sessions, as they are read from files: their mappings are read-only."""
    folder = tmp_path_factory.mktemp("corpus")
    for name in ("one", "two"):
        session(talk(), name=name).save(folder / name)
    return folder


def made(name: str, corpus: Any, **other: Any) -> Any:
    """Makes an environment of each kind; `other` are arguments of another town or of settings."""
    if name[:3] in ("UfN", "RfN", "NfD"):
        return gym.make(f"dorothie_gym/{name}", corpus=corpus)
    if name.startswith("Town"):
        config = {"pedestrians": 4, **({"duration": other["seconds"]} if "seconds" in other else {})}
        return gym.make(f"dorothie_gym/{name}", config=config, town=other.get("town", "brookside"))
    town, seconds = other.get("town", "brookside"), other.get("seconds", 60.0)
    if name.startswith("Navigation"):
        return gym.make(f"dorothie_gym/{name}", town=town, max_seconds=seconds)
    config = EnvConfig(max_seconds=seconds)
    if name.startswith("DuoWizard"):
        return pettingzoo.make(name.split()[1], "dorothie_gym/DuoWizard-v0", town=town, config=config)
    return gym.make(f"dorothie_gym/{name}", town=town, config=config)


NAMES = (
    *sorted(name.split("/")[1] for name in gym.registry if name.startswith("dorothie_gym/")),
    "DuoWizard-v0 parallel",
    "DuoWizard-v0 aec",
)


class TurnPlayer:
    """Plays random legal actions of one agent after the other."""

    def __init__(self, env: Any, seed: int) -> None:
        self.env, self.spaces = env, {agent: copy.deepcopy(env.action_space(agent)) for agent in env.possible_agents}
        env.reset(seed=seed)
        for number, space in enumerate(self.spaces.values()):
            space.seed(seed + number)

    def over(self, env: Any) -> TurnPlayer:
        other = copy.copy(self)
        other.env, other.spaces = env, copy.deepcopy(self.spaces)
        return other

    def play(self, turns: int) -> list[Any]:
        found = []
        for _ in range(turns):
            agent = self.env.agent_selection
            self.env.step(self.spaces[agent].sample(mask=self.env.infos[agent]["action_mask"]))
            found.append((agent, self.env.agent_selection, self.env.last()))
        return found


def player(name: str, corpus: Path) -> Any:
    env = made(name, corpus)
    return TurnPlayer(env, 3) if name.endswith("aec") else Player(env, 3)


def again(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("moment", [0, 1, 5])
@pytest.mark.parametrize("name", NAMES)
def test_pickled_environment_goes_on(name: str, moment: int, corpus: Path) -> None:
    original = player(name, corpus)
    original.play(moment)
    twin = original.over(again(original.env))
    assert_equal(twin.play(6), original.play(6), name)


@pytest.mark.parametrize("moment", [0, 4])
@pytest.mark.parametrize("name", NAMES)
def test_pickled_state_fits_its_own_environment_and_a_new_one(name: str, moment: int, corpus: Path) -> None:
    original = player(name, corpus)
    original.play(moment)
    state, ahead = again(original.env.unwrapped.clone_state()), original.over(original.env)
    later = [original.over(original.env), original.over(made(name, corpus))]
    found = ahead.play(6)
    for each in later:
        each.env.reset(seed=9)
        each.env.unwrapped.restore_state(state)
        assert_equal(each.play(6), found, name)


@pytest.mark.parametrize("name", [name for name in NAMES if name[:3] not in ("UfN", "RfN", "NfD")])
def test_pickled_state_of_another_town_or_setting_is_refused_with_the_difference(name: str, corpus: Path) -> None:
    state = again(player(name, corpus).env.unwrapped.clone_state())
    with pytest.raises(StateError, match="one of the town, name 'brookside', not 'midtown': restore it"):
        made(name, corpus, town="midtown").unwrapped.restore_state(state)
    with pytest.raises(StateError, match=r"one of the settings, (max_seconds|duration) \d+(\.0)?, not 61\.0: restore"):
        made(name, corpus, seconds=61.0).unwrapped.restore_state(state)


def test_pickled_state_of_other_sessions_is_refused_with_the_difference(corpus: Path) -> None:
    state = again(player("UfN-v0", corpus).env.unwrapped.clone_state())
    with pytest.raises(StateError, match="the state is one of the sessions, item 1 'two', not 'three': restore it"):
        made("UfN-v0", [session(talk(), name=name) for name in ("one", "three")]).unwrapped.restore_state(state)
    with pytest.raises(StateError, match="the state is one of a 'UfNEnv', not 'RfNEnv'"):
        made("RfN-v0", corpus).unwrapped.restore_state(state)


def test_differences_inside_settings_and_towns_are_named() -> None:
    engine = SessionEngine("brookside", config=EnvConfig())
    engine.reset(seed=1)
    state = again(engine.clone_state())
    busy = EnvConfig(world=type(EnvConfig().world)(vehicles=3))
    with pytest.raises(StateError, match=r"the settings, world\.vehicles \d+, not 3: "):
        SessionEngine("brookside", config=busy).restore_state(state)
    with pytest.raises(StateError, match="the town, content '[0-9a-f]{64}', not '[0-9a-f]{64}'"):
        SessionEngine(without_a_site(load_town("brookside"))).restore_state(state)


def without_a_site(town: Town) -> Town:
    names = ("name", "lanes", "links", "junctions", "streets", "signals", "crosswalks", "sidewalks", "programmes")
    return Town(**{name: getattr(town, name) for name in names}, sites=town.sites[:-1])


@pytest.mark.parametrize("kind", ["Navigation-v0", "DuoWizard-v0"])
def test_pickled_states_of_batches(kind: str) -> None:
    def make(count: int = 2, town: str = "brookside") -> Any:
        if kind == "DuoWizard-v0":
            return DuoWizardVectorEnv(count, town, threads=1)
        arguments: dict[str, Any] = {"town": town, "vectorization_mode": "vector_entry_point"}
        return gym.make_vec(f"dorothie_gym/{kind}", count, **arguments)

    env = make()
    env.reset(seed=4)
    whole = {agent: env.action_space(agent) for agent in env.possible_agents} if kind == "DuoWizard-v0" else {}
    for number, space in enumerate(whole.values() or [env.action_space]):
        space.seed(number)
    actions = [
        {agent: space.sample() for agent, space in whole.items()} if whole else env.action_space.sample()
        for _ in range(6)
    ]
    state = again(env.unwrapped.clone_state() if hasattr(env, "unwrapped") else env.clone_state())
    found = [env.step(action) for action in actions]
    fresh = make()
    fresh.reset(seed=11)
    for later in (env, fresh):
        (later.unwrapped if hasattr(later, "unwrapped") else later).restore_state(state)
        assert_equal([later.step(action) for action in actions], found)
    for other, difference in ((make(3), "the number of environments 2, not 3"), (make(town="midtown"), "'midtown'")):
        with pytest.raises(StateError, match=difference):
            (other.unwrapped if hasattr(other, "unwrapped") else other).restore_state(state)
        other.close()
    env.close()
    fresh.close()


@pytest.mark.parametrize("turns", [1, 2, 3, 4])
@pytest.mark.parametrize("by", ["wrapper", "unwrapped"])
def test_turns_and_pending_actions_go_back(turns: int, by: str, corpus: Path) -> None:
    original = TurnPlayer(made("DuoWizard-v0 aec", corpus), 5)
    original.play(turns)
    holder = original.env if by == "wrapper" else original.env.unwrapped
    state, agent, seen = holder.clone_state(), original.env.agent_selection, original.env.last()
    later = original.over(original.env)
    found = original.play(8)
    holder.restore_state(state)
    assert later.env.agent_selection == agent
    assert_equal(later.env.last(), seen)
    assert_equal(later.play(8), found)


def test_states_of_the_two_forms_do_not_fit_each_other(corpus: Path) -> None:
    turns, parallel = made("DuoWizard-v0 aec", corpus), made("DuoWizard-v0 parallel", corpus)
    turns.reset(seed=1)
    parallel.reset(seed=1)
    for one, other, kinds in ((turns, parallel, "turn-based"), (parallel, turns, "parallel")):
        with pytest.raises(StateError, match=f"the state is one of the form '{kinds}', not "):
            other.unwrapped.restore_state(one.unwrapped.clone_state())


SCRIPT = """
import hashlib, pickle, sys
import numpy as np
from dorothie_gym import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.session.spaces import noop
state = pickle.load(sys.stdin.buffer)
env = DuoWizardEnv("brookside")
env.reset(seed=1)
env.restore_state(state)
quiet = {str(role): noop(role, env.limits) for role in AGENT_ROLES}
digest = hashlib.sha256()
for _ in range(5):
    for seen in env.step(quiet)[0].values():
        digest.update(b"".join(np.asarray(value).tobytes() for value in seen.values()))
print(digest.hexdigest())
"""


@pytest.mark.long
def test_pickled_state_goes_on_in_another_process() -> None:
    env = DuoWizardEnv("brookside")
    env.reset(seed=4)
    quiet = {str(role): noop(role, env.limits) for role in AGENT_ROLES}
    for _ in range(5):
        env.step(quiet)
    state = pickle.dumps(env.clone_state())
    digest = hashlib.sha256()
    for _ in range(5):
        for seen in env.step(quiet)[0].values():
            digest.update(b"".join(np.asarray(value).tobytes() for value in seen.values()))
    done = subprocess.run([sys.executable, "-c", SCRIPT], input=state, capture_output=True, env=os.environ, check=True)
    assert done.stdout.decode().strip() == digest.hexdigest()
