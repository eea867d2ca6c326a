from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.envs.single_role_v0 import SingleRole
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.session.spaces import NO_MOVE, SpaceLimits, action_space, decode_action
from dorothie_gym.wrappers.flatten import FlattenAction, FlattenObservation, flatten

QUIET: dict[str, str] = {role: "silent" for role in AGENT_ROLES}


def single(role: str, **arguments: Any) -> SingleRole:
    return SingleRole(role, partners={name: "silent" for name in QUIET if name != role}, **arguments)


class Echo(gym.Env[Any, Any]):
    """Environment that stores the action taken."""

    def __init__(self, action_space: spaces.Space[Any], observation_space: spaces.Space[Any], mask: Any = None) -> None:
        self.action_space, self.observation_space, self.mask = action_space, observation_space, mask

    def _info(self) -> dict[str, Any]:
        return {} if self.mask is None else {"action_mask": self.mask}

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.observation_space.seed(seed)
        return self.observation_space.sample(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.taken = action
        return self.observation_space.sample(), 0.0, False, False, self._info()


MIXED = spaces.Dict(
    {
        "angle": spaces.Discrete(4, start=-2),
        "plan": spaces.MultiDiscrete([3, 2]),
        "slots": spaces.MultiBinary(3),
        "words": spaces.Text(10, min_length=0),
    }
)
NUMBERS = spaces.Dict(
    {
        "lane": spaces.Discrete(5),
        "pose": spaces.Box(-np.inf, np.inf, (2, 2), dtype=np.float64),
        "story": spaces.Text(5),
    }
)


def test_actions_are_a_vector_of_choices() -> None:
    env = FlattenAction(Echo(MIXED, NUMBERS))
    assert env.action_space == spaces.MultiDiscrete([4, 3, 2, 2, 2, 2])
    env.reset(seed=0)
    env.step(np.array([3, 2, 1, 0, 1, 1]))
    taken = env.unwrapped.taken  # type: ignore[attr-defined]  # `unwrapped` is declared as `Env`
    assert MIXED.contains(taken)
    assert taken["angle"] == 1
    assert taken["plan"].tolist() == [2, 1]
    assert taken["slots"].tolist() == [0, 1, 1]
    assert taken["words"] == ""


def test_omitted_fields_have_neutral_values() -> None:
    env = FlattenAction(Echo(MIXED, NUMBERS), fields=("plan",))
    assert env.action_space == spaces.MultiDiscrete([3, 2])
    taken = env.unflatten(np.array([1, 1]))
    assert MIXED.contains(taken)
    assert (taken["angle"], taken["slots"].tolist(), taken["words"]) == (0, [0, 0, 0], "")


def test_neutral_action_of_each_role_does_nothing() -> None:
    env = FlattenAction(gym.wrappers.TimeLimit(single("co_wizard"), 5), fields=["physical", "angle"])
    assert env.action_space == spaces.MultiDiscrete([360, 9])
    action = env.unflatten(np.array([270, 3]))
    assert (action["angle"], action["physical"], action["move"], action["mental"]) == (90, 3, NO_MOVE, 0)


@pytest.mark.parametrize("role", AGENT_ROLES)
@given(data=st.data())
def test_every_flat_action_of_a_role_is_well_formed(role: Role, data: st.DataObject) -> None:
    limits = SpaceLimits()
    env = FlattenAction(Echo(action_space(role, limits), NUMBERS))
    assert isinstance(env.action_space, spaces.MultiDiscrete)
    env.action_space.seed(data.draw(st.integers(0, 2**31)))
    decode_action(role, env.unflatten(env.action_space.sample()), limits)


def test_masks_are_one_vector() -> None:
    mask = {
        "angle": np.array([1, 0, 0, 1], dtype=np.int8),
        "plan": (np.array([0, 1, 0], dtype=np.int8), np.array([1, 0], dtype=np.int8)),
        "slots": None,
        "words": None,
    }
    env = FlattenAction(Echo(MIXED, NUMBERS, mask))
    env.reset(seed=0)
    assert env.action_masks().dtype == np.bool_
    assert env.action_masks().astype(int).tolist() == [1, 0, 0, 1, 0, 1, 0, 1, 0, 1, 1, 1, 1, 1, 1]
    kept = FlattenAction(Echo(MIXED, NUMBERS, mask), fields=("angle",))
    kept.reset(seed=0)
    assert kept.action_masks().astype(int).tolist() == [1, 0, 0, 1]


def test_missing_mask_permits_all_actions() -> None:
    env = FlattenAction(Echo(MIXED, NUMBERS))
    env.reset(seed=0)
    assert env.action_masks().tolist() == [True] * 15


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_masks_of_roles_permit_a_value_of_every_field(role: Role) -> None:
    env = flatten(single(role, max_cycles=6))
    assert isinstance(env.action_space, spaces.MultiDiscrete)
    observation, _ = env.reset(seed=2)
    borders = np.cumsum(env.action_space.nvec)[:-1]
    rng = np.random.default_rng(2)
    truncated = False
    while not truncated:
        choices = np.split(observation["action_mask"], borders)
        assert all(choice.any() for choice in choices)
        action = np.array([rng.choice(np.flatnonzero(choice)) for choice in choices])
        observation, _, _, truncated, _ = env.step(action)
        assert env.observation_space.contains(observation)


def test_masked_physical_actions_follow_the_car() -> None:
    env = FlattenAction(single("co_wizard"), fields=("physical",))
    env.reset(seed=0)
    stop = 5
    assert env.action_masks()[stop]
    env.step(np.array([stop]))
    assert not env.action_masks()[stop]


def test_observations_are_a_vector_of_finite_numbers() -> None:
    env = FlattenObservation(Echo(MIXED, NUMBERS))
    box = env.observation_space["observation"]
    assert isinstance(box, spaces.Box)
    assert box.dtype == np.float32
    assert box.low.tolist() == [0.0, -1e6, -1e6, -1e6, -1e6]
    assert box.high.tolist() == [4.0, 1e6, 1e6, 1e6, 1e6]
    flat = env.flatten({"lane": np.int64(3), "pose": np.array([[1.5, 2.0], [3e7, -4.0]]), "story": "Once"})
    assert flat["observation"].tolist() == [3.0, 1.5, 2.0, 1e6, -4.0]
    assert set(flat) == {"observation"}


def test_plain_spaces_are_flattened() -> None:
    env = flatten(Echo(spaces.Discrete(3, start=1), spaces.Box(0.0, 1.0, (2, 3), dtype=np.float64)))
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert observation["observation"].shape == (6,)
    assert observation["action_mask"].tolist() == [1, 1, 1]
    env.step(np.array([2]))
    assert env.unwrapped.taken == 3  # type: ignore[attr-defined]  # `unwrapped` is declared as `Env`


@pytest.mark.parametrize(
    ("space", "fields", "message"),
    [
        (MIXED, ("angel",), "fields: 'angel' is none of angle, plan, slots"),
        (MIXED, ("words",), "fields: 'words' is none of"),
        (MIXED, (), "none are left"),
        (spaces.Dict(throttle=spaces.Box(0.0, 1.0)), None, "field 'throttle'"),
    ],
)
def test_error_names_the_field_that_cannot_be_flattened(space: Any, fields: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FlattenAction(Echo(space, NUMBERS), fields)


def test_action_of_wrong_shape_raises_error() -> None:
    with pytest.raises(ValueError, match=r"shape \(2,\); it must be \(6,\)"):
        FlattenAction(Echo(MIXED, NUMBERS)).unflatten(np.array([0, 0]))


def test_flat_environment_is_recreated_from_spec() -> None:
    env = flatten(gym.make("dorothie_gym/CoWizard-v0", max_cycles=3, town="brookside"), fields=("physical",))
    assert env.spec is not None
    again = gym.make(env.spec)
    assert again.action_space == env.action_space
    assert again.observation_space == env.observation_space
