from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, ActionValue, DialogueAct, DialogueMove, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.navigation import NavigationAction, NavigationPolicy, layout
from dorothie_gym.policies.navigation.actions import EstimatedActionMask, physical_of
from dorothie_gym.policies.navigation.driver_view import driver_of
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.policies.navigation.observation_vector import NavigationEncoder
from dorothie_gym.policies.observation_parser import read_landmarks
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import AdWizardAction, CoWizardAction, ParticipantAction, Speech, noop
from tests.envs.navigation_drivers import obey

FIELD = layout()


def cast(env: DuoWizardEnv, driver: Any) -> dict[Role, Any]:
    others = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    return {**others, Role.CO_WIZARD: NavigationPolicy(driver, env.limits)}


@pytest.mark.parametrize(("seed", "observe_acts"), [(1, True), (4, True), (5, False)])
def test_obedient_driver_completes_tasks_by_dialogue(seed: int, observe_acts: bool) -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(observe_acts=observe_acts))
    summary = play_session(env, cast(env, obey), seed=seed)
    assert summary["success"], summary


@pytest.mark.parametrize(("town", "guidance"), [("brookside", "turns"), ("brookside", "goals"), ("midtown", "goals")])
def test_observation_equals_that_of_training(town: str, guidance: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The vector depends only on the Co-Wizard's observation, in both environments."""
    learning = NavigationEnv(town, guidance=guidance, exceptions=4.0)
    observation, info = learning.reset(seed=4)
    playing = DuoWizardEnv(learning.town, config=learning.config.session_config)
    observations, _ = playing.reset(seed=4)
    viewpoint = NavigationEncoder(learning.town, JunctionExits(learning.town), learning.config.max_seconds)
    session, exits = learning.session, JunctionExits(learning.town)
    others: dict[str, Any] = {}
    believe, interfere = session.update_beliefs, session.play_ad_wizard
    monkeypatch.setattr(session, "update_beliefs", lambda mental: (others.update(mental=mental), believe(mental))[1])
    monkeypatch.setattr(session, "play_ad_wizard", lambda action: (others.update(trick=action), interfere(action))[1])
    for _ in range(160):
        seen = viewpoint.observe(observations["co_wizard"], learning.batch.heard(0), learning.batch.blocked(0))
        np.testing.assert_array_equal(seen, observation)
        chosen = obey(observation, info["action_mask"])
        physical = physical_of(NavigationAction(chosen), driver_of(observations["co_wizard"], exits))
        observation, _, terminated, truncated, info = learning.step(chosen)
        actions = {
            Role.PARTICIPANT: ParticipantAction(),
            Role.CO_WIZARD: CoWizardAction(mental=others.pop("mental", None), physical=physical),
            Role.AD_WIZARD: others.pop("trick", AdWizardAction()),
        }
        observations, *_ = playing.step({str(role): action.encode(playing.limits) for role, action in actions.items()})
        assert not (terminated or truncated)


class Ride:
    """Session in which the test speaks as the participant and keeps the driver's observations."""

    def __init__(self, seed: int = 0) -> None:
        self.env = DuoWizardEnv("brookside", config=EnvConfig(words_per_second=20.0, word_error_rate=0.0))
        self.observations, _ = self.env.reset(seed=seed)
        self.player = NavigationPolicy(self._drive, self.env.limits)
        self.state = self.player.initial_state(0, self.env.town)
        self.seen: Any = None

    def _drive(self, observation: Any, mask: Any) -> int:
        self.seen = observation
        return NavigationAction.NOTHING

    def go(self, decisions: int, act: DialogueAct | None = None, words: str = "") -> None:
        for _ in range(decisions):
            speech = None if act is None else Speech(act=act, text=words)
            driven, self.state = self.player.step(self.observations["co_wizard"], self.state)
            self.observations, *_ = self.env.step(
                {
                    "participant": ParticipantAction(speech=speech).encode(self.env.limits),
                    "co_wizard": driven,
                    "ad_wizard": noop(Role.AD_WIZARD, self.env.limits),
                }
            )
            act = None

    def field(self, name: str) -> Any:
        return self.seen[FIELD[name]]


def instruct(*values: Any) -> DialogueAct:
    return DialogueAct.of(DialogueMove.INSTRUCT, *values)


def test_driver_is_not_queried_before_first_instruction() -> None:
    ride = Ride()
    ride.go(4)
    assert ride.seen is None


def test_named_place_becomes_goal_with_route() -> None:
    ride = Ride()
    mark = read_landmarks(ride.observations["co_wizard"], ride.env.town)[0]
    ride.go(4, instruct(mark.name), f"go to the {mark.name.label}")
    assert ride.field("said")[0] == 1.0 and ride.field("said_landmark").argmax() == mark.name.value
    assert ride.field("goal")[0] == 1.0 and ride.field("goal_distance")[0] > 0.0
    assert ride.env.session.beliefs.goals == (mark.name,)


def test_instructed_turn_has_sector_of_its_exit() -> None:
    ride = Ride()
    ride.go(3, instruct(ActionValue.J_TURN), "turn left")
    turns = [k for k in range(8) if ride.field("said_sector")[k]]
    assert ride.field("said_action").argmax() == ActionValue.J_TURN.value and len(turns) == 1
    exits = ride.field("exits").reshape(8, 3)
    assert exits[turns[0], 0] == 1.0
    assert ride.field("said_distance")[0] <= ride.field("junction")[1] + 1e-6


def test_stop_instruction_has_stopping_distance() -> None:
    ride = Ride()
    ride.go(12, instruct(ActionValue.LANE_FOLLOW), "keep going straight")
    ride.go(3, instruct(ActionValue.STOP), "stop")
    assert ride.field("said_action").argmax() == ActionValue.STOP.value
    assert 0.0 < ride.field("said_distance")[0] * 100.0 < 30.0


def test_speed_and_lights_are_set_on_request() -> None:
    ride = Ride()
    ride.go(5, instruct(ActionValue.LIGHT_CHANGE), "turn on your lights")
    assert ride.observations["co_wizard"]["lights"]
    ride.go(6, instruct(ActionValue.SPEED_CHANGE), "slow down to 20")
    assert float(ride.observations["co_wizard"]["cruise_speed"][0]) < 30.0


def test_estimated_mask_agrees_with_environment() -> None:
    env = NavigationEnv("brookside", guidance="goals", traffic="medium")
    same = total = 0
    for seed in range(10, 18):
        observation, info = env.reset(seed=seed)
        likely = EstimatedActionMask(env.town)
        for _ in range(80):
            seen = env.session.observations((Role.CO_WIZARD,))[Role.CO_WIZARD]
            mask = likely.mask(driver_of(seen, JunctionExits(env.town)))
            same, total = same + int((mask == info["action_mask"]).sum()), total + len(mask)
            observation, _, over, cut, info = env.step(obey(observation, info["action_mask"]))
            if over or cut:
                break
    assert same / total > 0.98
