"""The reusable checks pass for what the package ships, and fail for what breaks a contract."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.policy import policy_inputs
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.spaces import ActionDict, noop
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.testing import check_observations_do_not_leak, check_policy, check_session, check_town
from dorothie_gym.testing.playing import first_unequal
from tests.maps.damaged_towns import with_lane

QUIET = EnvConfig(world=WorldConfig(vehicles=2, pedestrians=1))


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("scripted", Role.CO_WIZARD),
        ("scripted", Role.PARTICIPANT),
        ("scripted", Role.AD_WIZARD),
        ("random", Role.CO_WIZARD),
        ("lane-follow", Role.CO_WIZARD),
    ],
)
def test_shipped_policies_keep_the_contract(name: str, role: Role) -> None:
    check_policy(make_policy(name, role), decisions=25, config=QUIET)


class Obedient(Policy[None]):
    """Takes the first physical action that the mask allows, and notes the masks."""

    reads_mask = True

    def __init__(self) -> None:
        super().__init__(Role.CO_WIZARD)
        self.masks: list[Mapping[str, Any]] = []

    def initial_state(self, seed: int, town: Town) -> None:
        return None

    def step(self, observation: Mapping[str, Any], state: None) -> tuple[ActionDict, None]:
        self.masks.append(observation["action_mask"])
        allowed = np.flatnonzero(observation["action_mask"]["physical"])
        return {**noop(Role.CO_WIZARD, self.limits), "physical": int(allowed[-1])}, None


def test_policy_that_reads_the_mask_keeps_the_contract() -> None:
    check_policy(Obedient(), decisions=10, config=QUIET)


def test_policy_gets_the_mask_of_its_role_only_if_it_reads_it() -> None:
    env = DuoWizardEnv("brookside", config=QUIET, max_cycles=3)
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    _, infos = env.reset(seed=4)
    inputs = policy_inputs(env.engine, {**policies, Role.CO_WIZARD: Obedient()})
    assert first_unequal(inputs[Role.CO_WIZARD]["action_mask"], infos["co_wizard"]["action_mask"]) is None
    assert "action_mask" not in inputs[Role.PARTICIPANT]
    obedient = Obedient()
    play_session(env, {**policies, Role.CO_WIZARD: obedient}, seed=4)
    assert len(obedient.masks) == 3
    assert first_unequal(obedient.masks[0], infos["co_wizard"]["action_mask"]) is None


class Forgetful(Policy[int]):
    """Acts by a counter in the object, which two sessions share."""

    def __init__(self) -> None:
        super().__init__(Role.CO_WIZARD)
        self.calls = 0

    def initial_state(self, seed: int, town: Town) -> int:
        return 0

    def step(self, observation: Mapping[str, Any], state: int) -> tuple[ActionDict, int]:
        self.calls += 1
        return {**noop(Role.CO_WIZARD, self.limits), "angle": self.calls % 360}, state


class Scribbler(Forgetful):
    """Writes into its observation."""

    def step(self, observation: Mapping[str, Any], state: int) -> tuple[ActionDict, int]:
        observation["speed"][0] = 99.0
        return noop(Role.CO_WIZARD, self.limits), state


class Outsider(Forgetful):
    """Leaves its action space."""

    def step(self, observation: Mapping[str, Any], state: int) -> tuple[ActionDict, int]:
        return {**noop(Role.CO_WIZARD, self.limits), "angle": 4000}, state


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (Forgetful(), "angle of the action differs when step is called again"),
        (Scribbler(), "step changed the observation's speed"),
        (Outsider(), "the action's angle is not in the action space"),
    ],
)
def test_policies_that_break_the_contract_are_found(policy: Policy[Any], message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_policy(policy, decisions=5, config=QUIET)


def test_policy_that_remembers_outside_its_state_is_found() -> None:
    class Rememberer(Forgetful):
        """Repeats an action for equal observations, but remembers the last session that it saw."""

        def initial_state(self, seed: int, town: Town) -> int:
            self.calls = seed
            return seed

        def step(self, observation: Mapping[str, Any], state: int) -> tuple[ActionDict, int]:
            return {**noop(Role.CO_WIZARD, self.limits), "angle": self.calls % 360}, state

    with pytest.raises(AssertionError, match="second session in between"):
        check_policy(Rememberer(), decisions=5, config=QUIET)


def test_co_wizard_observes_no_secrets() -> None:
    check_observations_do_not_leak(DuoWizardEnv("brookside", config=QUIET), decisions=25)


class LeakingEnv(DuoWizardEnv):
    """Shows the Co-Wizard the length of the story."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        observations, infos = super().reset(seed, options)
        return self._leak(observations), infos

    def step(self, actions: Any) -> Any:
        observations, *rest = super().step(actions)
        return (self._leak(observations), *rest)

    def _leak(self, observations: Any) -> Any:
        if observations:
            observations["co_wizard"]["hint"] = len(observations["participant"]["story"])
        return observations


def test_observation_that_leaks_the_story_is_found() -> None:
    with pytest.raises(AssertionError, match="the Co-Wizard's observation hint differs"):
        check_observations_do_not_leak(LeakingEnv(config=QUIET), decisions=25)


def test_shipped_town_is_sound() -> None:
    check_town("brookside", sessions=1, decisions=5)


def test_town_with_a_fault_is_found() -> None:
    town = load_town("brookside")
    lane = next(lane for lane in town.lanes if len(lane.points) > 3)
    points = lane.points.copy()
    points[1, 2] += 2.0  # a step of two metres in the road
    with pytest.raises(AssertionError, match="height_step at"):
        check_town(with_lane(town, dataclasses.replace(lane, points=points)), sessions=0)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded") / "session"
    env = DuoWizardEnv("brookside", config=QUIET, max_cycles=20)
    play_session(env, {role: make_policy("scripted", role, env.limits) for role in
                       (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)}, seed=3, folder=folder)  # fmt: skip
    return folder


def test_recorded_session_is_sound_and_replays(recorded: Path) -> None:
    check_session(recorded)


def test_altered_session_is_found(recorded: Path) -> None:
    session = Session.load(recorded)
    trajectory = session.trajectory.copy()
    trajectory["x"][10] += 1e-9
    with pytest.raises(AssertionError, match=r"replay differs at frame \d+: frames.x"):
        check_session(dataclasses.replace(session, trajectory=trajectory))


@pytest.mark.parametrize(
    ("one", "other", "where"),
    [
        ({"a": 1, "b": {"c": (1, 2)}}, {"a": 1, "b": {"c": (1, 2)}}, None),
        ({"a": 1, "b": {"c": (1, 2)}}, {"a": 1, "b": {"c": (1, 3)}}, "b.c[1]"),
        ({"a": 1}, {}, "a"),
        ({"a": float("nan")}, {"a": float("nan")}, "a"),
    ],
)
def test_first_difference_of_nested_values(one: Any, other: Any, where: str | None) -> None:
    assert first_unequal(one, other) == where
