from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import DialogueAct, DialogueMove, ExceptionKind, PhysicalAction, PropKind, Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import INFRACTIONS, EventType
from dorothie_gym.session.spaces import (
    NO_MOVE,
    AdWizardAction,
    CoWizardAction,
    ParticipantAction,
    Physical,
    Speech,
    SubgoalColumn,
    noop,
)
from dorothie_gym.sim.config import WorldConfig
from tests.sim.forcing import blind

ALONE = EnvConfig(words_per_second=2.5, world=WorldConfig(vehicles=0, pedestrians=0))


@pytest.fixture
def env() -> DuoWizardEnv:
    env = DuoWizardEnv("brookside", config=ALONE)
    env.reset(seed=5)
    return env


def step(env: DuoWizardEnv, action: Any = None) -> tuple[Any, ...]:
    actions = {agent: noop(Role(agent), env.limits) for agent in env.agents}
    if action is not None:
        actions[str(action.role)] = action.encode(env.limits)
    return env.step(actions)


def test_utterance_is_delivered_after_its_last_word(env: DuoWizardEnv) -> None:
    words = "please turn left at the next junction now"  # eight words: 3.2 s
    speech = Speech(act=DialogueAct(move=DialogueMove.INSTRUCT), text=words)
    observations, *_ = step(env, ParticipantAction(speech=speech))
    heard = []
    for k in range(1, 12):
        if observations["co_wizard"]["participant_text"]:
            heard.append((k, observations["co_wizard"]["participant_text"]))
            assert observations["co_wizard"]["participant_moves"][0] == DialogueMove.INSTRUCT
            assert observations["ad_wizard"]["participant_text"] == words
        else:
            assert (observations["co_wizard"]["participant_moves"] == NO_MOVE).all()
        observations, *_ = step(env)
    assert heard == [(7, words)]


def test_physical_action_that_changes_nothing_is_refused_and_not_counted(env: DuoWizardEnv) -> None:
    start = CoWizardAction(physical=Physical(action=PhysicalAction.START))
    *_, infos = step(env, start)
    assert infos["co_wizard"]["refused"] == {"speech": False, "mental": False, "physical": True}
    assert infos["co_wizard"]["refusal_reason"] == "Start: the car is not stopped"
    assert env.summary()["physical_actions"] == 0
    *_, infos = step(env, CoWizardAction(physical=Physical(action=PhysicalAction.STOP)))
    assert not any(infos["co_wizard"]["refused"].values())
    assert env.summary()["physical_actions"] == 1


def test_message_reaches_the_participant_only(env: DuoWizardEnv) -> None:
    observations, *_ = step(env, AdWizardAction(exception=ExceptionKind.MESSAGE, message="The road is closed"))
    assert observations["participant"]["message"] == "The road is closed"
    assert "message" not in observations["co_wizard"]
    observations, *_ = step(env)
    assert observations["participant"]["message"] == ""


def test_co_wizard_sees_landmarks_that_are_not_hidden_only() -> None:
    env = DuoWizardEnv("brookside", config=ALONE)
    hidden = 0
    for seed in range(12):
        observations, _ = env.reset(seed=seed)
        landmarks = env.scenario.storyboard.landmarks
        known = observations["co_wizard"]["landmarks"]
        assert {int(name) for name in known[:, 0] if name} == {m.name.value for m in landmarks if not m.hidden}
        assert {int(name) for name in observations["participant"]["landmarks"][:, 0] if name} == {
            m.name.value for m in landmarks
        }
        hidden += sum(m.hidden for m in landmarks)
        for m in landmarks:
            if m.hidden:
                assert not np.isclose(known[:, 1:3], m.position).all(axis=1).any()
    assert hidden > 0


def test_participant_does_not_see_subgoals_before_they_are_triggered() -> None:
    env = DuoWizardEnv("brookside", config=ALONE)
    waiting = 0
    for seed in range(20):
        observations, _ = env.reset(seed=seed)
        for row, subgoal in zip(
            observations["participant"]["subgoals"], env.scenario.storyboard.subgoals, strict=False
        ):
            if subgoal.trigger:
                waiting += 1
                assert not row.any()
                assert subgoal.description not in observations["participant"]["tasks"]
            else:
                assert row[SubgoalColumn.LIVE] == 1
    assert waiting > 0


def test_observations_are_in_their_spaces(env: DuoWizardEnv) -> None:
    infos: Any = None
    observations, infos = env.reset(seed=6)
    for agent in env.possible_agents:
        env.action_space(agent).seed(6)
    for _ in range(60):
        for agent, observation in observations.items():
            assert env.observation_space(agent).contains(observation)
        actions = {agent: env.action_space(agent).sample(mask=infos[agent]["action_mask"]) for agent in env.agents}
        observations, *_, infos = env.step(actions)


def test_infractions_are_logged_and_counted(env: DuoWizardEnv) -> None:
    *_, infos = step(env)
    assert set(infos["participant"]["infractions"].values()) == {0}
    world = env.session.world
    lane = world.town.lanes[world.planner.lane]
    prop = world.actors.add_prop(PropKind.STREET_BARRIER, lane.id, min(world.planner.station + 8.0, lane.length - 1.0))
    blind(world)
    events = []
    for _ in range(20):
        *_, infos = step(env)
        events += [event for event in env.last_events if event.type in INFRACTIONS]
    (event,) = events
    assert event.type is EventType.COLLISION
    assert event.data["key"] == prop.key
    assert infos["ad_wizard"]["infractions"] == env.summary()["infractions"]
    assert env.summary()["infractions"]["collision"] == 1
    assert env.summary()["collisions"] == 1
