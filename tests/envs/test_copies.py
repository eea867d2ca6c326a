"""Copies of environments in the middle of a session: exact, and without effect on each other."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dorothie_gym.envs import duo_wizard_v0
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import StateError
from dorothie_gym.ontology import AGENT_ROLES, DialogueAct, DialogueMove, ExceptionKind, Sensor
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import AdWizardAction, ParticipantAction, Speech, noop
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.world import World
from dorothie_gym.support.copying import taken
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

CONFIG = EnvConfig(world=WorldConfig(vehicles=20, pedestrians=20), word_error_rate=0.2, max_seconds=600.0)

Outcome = Any
"""Everything that a step returns."""


class Player:
    """Plays random legal actions, which depend on its seed and the infos only."""

    def __init__(self, env: Any, seed: int) -> None:
        self.env, self._rng = env, np.random.default_rng(seed)
        self.last: Outcome = env.reset(seed=seed)
        self._agents = list(getattr(env, "possible_agents", ()))
        found = {agent: env.action_space(agent) for agent in self._agents} or {"": env.action_space}
        self._spaces = copy.deepcopy(found)
        for number, space in enumerate(self._spaces.values()):
            space.seed(seed + number)

    def over(self, env: Any) -> Player:
        """Returns a player of another environment that goes on as this one does."""
        other = copy.copy(self)
        other.env, other._rng, other._spaces = env, copy.deepcopy(self._rng), copy.deepcopy(self._spaces)
        return other

    def play(self, decisions: int) -> list[Outcome]:
        """Plays decisions, and sessions one after the other."""
        found = []
        for _ in range(decisions):
            self.last = self._step()
            found.append(self.last)
        return found

    def _step(self) -> Outcome:
        if self._agents:
            if not self.env.agents:
                return self.env.reset(seed=int(self._rng.integers(1000)))
            infos = self.last[-1]
            return self.env.step({agent: self._action(agent, infos[agent]) for agent in infos})
        if len(self.last) == 5 and (self.last[2] or self.last[3]):
            return self.env.reset()
        return self.env.step(self._action("", self.last[-1]))

    def _action(self, agent: str, info: Mapping[str, Any]) -> Any:
        space = self._spaces[agent]
        return space.sample(mask=info["action_mask"]) if "action_mask" in info else space.sample()


def assert_equal(one: object, other: object, where: str = "") -> None:
    """Asserts that two outcomes are equal to the bit."""
    assert type(one) is type(other), where
    if isinstance(one, Mapping):
        assert isinstance(other, Mapping) and list(one) == list(other), where
        for name in one:
            assert_equal(one[name], other[name], f"{where}.{name}")
    elif isinstance(one, list | tuple):
        assert isinstance(other, list | tuple) and len(one) == len(other), where
        for number, (this, that) in enumerate(zip(one, other, strict=True)):
            assert_equal(this, that, f"{where}[{number}]")
    elif isinstance(one, np.ndarray) and one.dtype == object:
        assert_equal(one.tolist(), np.asarray(other).tolist(), where)
    elif isinstance(one, np.ndarray | np.generic):
        assert one.tobytes() == other.tobytes(), where  # type: ignore[attr-defined]  # of one type
    elif isinstance(one, float):
        assert np.float64(one).tobytes() == np.float64(other).tobytes(), where  # type: ignore[arg-type]  # a float
    else:
        assert one == other, where


def duo(town: str) -> Callable[[], Any]:
    return lambda: DuoWizardEnv(town, config=CONFIG)


def make(name: str, **arguments: Any) -> Callable[[], Any]:
    return lambda: gym.make(f"dorothie_gym/{name}", **arguments)


TALK = [session(talk())]

ENVIRONMENTS: dict[str, Callable[[], Any]] = {
    "DuoWizard-v0 brookside": duo("brookside"),
    "DuoWizard-v0 northgate": duo("northgate"),
    "Participant-v0": make("Participant-v0", config=CONFIG),
    "CoWizard-v0": make("CoWizard-v0", config=CONFIG),
    "AdWizard-v0": make("AdWizard-v0", config=CONFIG),
    "Navigation-v0": make("Navigation-v0", traffic="heavy", exceptions=4.0),
    "Navigation-continuous-v0": make("Navigation-continuous-v0", traffic="heavy", exceptions=4.0),
    "UfN-v0": make("UfN-v0", corpus=TALK),
    "RfN-v0": make("RfN-v0", corpus=TALK),
    "NfD-v0": make("NfD-v0", corpus=TALK),
    "Town-v0": make("Town-v0", config={"pedestrians": 10, "show_trajectories": True}),
    "Town-v0 pictures": make(
        "Town-v0",
        config={
            "observation": {
                "type": "GrayscaleObservation",
                "observation_shape": (32, 32),
                "stack_size": 2,
                "weights": [0.3, 0.6, 0.1],
            },
        },
    ),
}


COPIES: dict[str, Callable[[Any], Any]] = {
    "deepcopy": copy.deepcopy,
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
}


@pytest.mark.long
@pytest.mark.parametrize("by", COPIES)
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_copy_goes_on_as_the_original_does(name: str, by: str) -> None:
    moments = np.random.default_rng(5).integers(1, 60, 3)
    player = Player(ENVIRONMENTS[name](), seed=int(moments[0]))
    for moment, steps in zip(moments.tolist(), (200, 40, 40) if by == "deepcopy" else (40, 20, 20), strict=True):
        player.play(moment)
        twin = player.over(COPIES[by](player.env))
        ahead = twin.play(steps)  # first: what the copy does must not reach the original
        assert_equal(player.play(steps), ahead, name)


@pytest.mark.long
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_environment_goes_back_to_a_state_any_number_of_times(name: str) -> None:
    player = Player(ENVIRONMENTS[name](), seed=3)
    player.play(40)
    state = player.env.unwrapped.clone_state()
    again, another = player.over(player.env), player.over(ENVIRONMENTS[name]())
    found = player.play(60)
    another.env.reset(seed=17)
    for later, steps in ((again.over(again.env), 60), (again, 10), (another, 30)):
        later.env.unwrapped.restore_state(state)
        assert_equal(later.play(steps), found[:steps], name)


def test_every_registered_environment_is_copied_here() -> None:
    registered = {name.split("/")[1] for name in gym.registry if name.startswith("dorothie_gym/")}
    assert registered | {"DuoWizard-v0"} == {name.split()[0] for name in ENVIRONMENTS}


def test_turn_based_environment_is_copied() -> None:
    env = duo_wizard_v0.env(config=CONFIG)
    env.reset(seed=1)
    for _ in range(30):
        env.step(env.action_space(env.agent_selection).sample(mask=env.infos[env.agent_selection]["action_mask"]))
    twin = copy.deepcopy(env)
    for _ in range(60):
        action = env.action_space(env.agent_selection).sample(mask=env.infos[env.agent_selection]["action_mask"])
        env.step(copy.deepcopy(action))
        twin.step(action)
        assert_equal(env.last(), twin.last())


def test_utterances_and_faults_in_progress_go_on_in_the_copy() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    env.reset(seed=2)
    quiet = {str(role): noop(role, env.limits) for role in AGENT_ROLES}
    speech = Speech(act=DialogueAct.of(DialogueMove.INSTRUCT), text="please turn left at the next junction " * 4)
    talking = ParticipantAction(speech=speech).encode(env.limits)
    fault = AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=Sensor.BLUR, on=True).encode(env.limits)
    env.step({**quiet, "participant": talking, "ad_wizard": fault})
    assert env.session.world.faults and not env.session.dialogue.said
    twin = copy.deepcopy(env)
    for _ in range(80):
        assert_equal(env.step(quiet), twin.step(quiet))
    assert len(env.session.dialogue.said) == len(twin.session.dialogue.said) == 1
    assert not twin.session.world.faults


def test_environment_in_which_a_picture_was_drawn_is_copied_without_it() -> None:
    env = gym.make("dorothie_gym/CoWizard-v0", render_mode="rgb_array", town="brookside")
    env.reset(seed=1)
    picture = np.asarray(env.render())
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert np.array_equal(np.asarray(twin.render()), picture)


def test_copies_share_the_town_and_nothing_that_changes() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    env.reset(seed=1)
    twin = copy.deepcopy(env)
    assert twin.town is env.town and twin.session.world.network is env.session.world.network
    ours, theirs = env.session.world.actors.arrays, twin.session.world.actors.arrays
    assert not any(np.shares_memory(one, other) for one, other in zip(ours, theirs, strict=True))


def test_engine_and_world_go_back_to_a_state() -> None:
    engine = SessionEngine("brookside", config=CONFIG)
    engine.reset(seed=4)
    noops = {str(role): noop(role, engine.limits) for role in AGENT_ROLES}
    state = engine.clone_state()
    before = [engine.step(noops) for _ in range(20)][-1], dict(engine.observations)
    engine.restore_state(state)
    assert_equal(([engine.step(noops) for _ in range(20)][-1], dict(engine.observations)), before)

    world = engine.session.world
    place = world.clone_state()
    there = [_frames(world) for _ in range(10)]
    world.restore_state(place)
    assert [_frames(world) for _ in range(10)] == there


def _frames(world: World) -> bytes:
    world.step(15)
    return world.frames.tobytes()


@pytest.mark.parametrize(
    ("other", "what"),
    [
        (lambda: DuoWizardEnv("northgate", config=CONFIG), "the town"),
        (lambda: DuoWizardEnv("brookside"), "the settings"),
        (lambda: SessionEngine("brookside", config=CONFIG), "a"),
    ],
)
def test_state_of_another_town_or_of_other_settings_is_refused(other: Callable[[], Any], what: str) -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    env.reset(seed=1)
    with pytest.raises(StateError, match=f"the state is one of {what}[, ].*: restore it in an environment") as refusal:
        other().restore_state(env.clone_state())
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 500
    with pytest.raises(StateError, match="a value that clone_state"):
        env.restore_state(b"bytes" * 1000)  # type: ignore[arg-type]  # what a user may try


def test_values_of_another_class_are_refused() -> None:
    values: dict[str, object] = {"engine": {"time": 1.0}, "batches": (1, 2)}
    assert taken(values, "engine", dict) == {"time": 1.0} and set(values) == {"batches"}
    with pytest.raises(StateError, match=r"batches is \(1, 2\), not of the type list"):
        taken(values, "batches", list)
