"""Observations, masks and refusals contain no hidden information."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import ExceptionKind, Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.spaces import AdWizardAction, SubgoalColumn, noop
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.tasks import with_reason
from dorothie_gym.testing.leaks import with_hidden_landmarks_moved, with_other_tasks
from dorothie_gym.testing.playing import play_again
from tests.envs.sessions_played import play_at_random, play_by_script


@pytest.fixture(scope="module")
def env() -> DuoWizardEnv:
    return DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2)))


def check_hidden_places_are_not_visible(env: DuoWizardEnv, play: Any, seed: int, decisions: int) -> None:
    """Plays a session, and plays its actions again with hidden landmarks at other sites."""
    while not any(landmark.hidden for landmark in draw_scenario(env.town, None, seed).storyboard.landmarks):
        seed += 1000
    played = list(play(env, seed=seed, decisions=decisions))
    moved = with_hidden_landmarks_moved(env.scenario, env.town, np.random.default_rng(seed))
    again = list(play_again(env, moved, [actions for _, _, actions in played if actions]))
    assert min(len(played), len(again)) > 1
    for k, ((observations, infos, _), (others, other_infos)) in enumerate(zip(played, again, strict=False)):
        role = str(Role.CO_WIZARD)
        for field, value in observations[role].items():
            np.testing.assert_array_equal(others[role][field], value, err_msg=f"{field}, decision {k}")
        for field in ("action_mask", "refused", "refusal_reason"):
            np.testing.assert_equal(other_infos[role][field], infos[role][field])
        # the participant observes the difference, so the test would detect a leak
        assert not np.array_equal(others["participant"]["landmarks"], observations["participant"]["landmarks"])


@pytest.mark.parametrize("seed", [0, 2, 5])
@pytest.mark.parametrize(("play", "decisions"), [(play_at_random, 40), (play_by_script, 120)])
def test_hidden_places_are_not_visible(env: DuoWizardEnv, play: Any, decisions: int, seed: int) -> None:
    check_hidden_places_are_not_visible(env, play, seed, decisions)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 125))
@pytest.mark.parametrize(("play", "decisions"), [(play_at_random, 120), (play_by_script, 600)])
def test_hidden_places_are_never_visible(env: DuoWizardEnv, play: Any, decisions: int, seed: int) -> None:
    check_hidden_places_are_not_visible(env, play, seed, decisions)


@pytest.mark.parametrize("config", [{"word_error_rate": 0.25}, {"word_error_rate": 0.25, "observe_acts": False}])
def test_hidden_places_are_not_visible_with_word_errors(config: dict[str, Any]) -> None:
    noisy = DuoWizardEnv("brookside", config=EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2), **config))
    check_hidden_places_are_not_visible(noisy, play_by_script, seed=2, decisions=120)


def check_tasks_are_not_visible(env: DuoWizardEnv, play: Any, seed: int, decisions: int) -> None:
    """Plays a session, and plays its actions again with other tasks and another story, up to the first arrival.

    Task exceptions of the Ad-Wizard are left out, because their refusals depend on the task.
    """
    played = list(play(env, seed=seed, decisions=decisions))
    idle = noop(Role.AD_WIZARD, env.limits)
    actions = [{**actions, "ad_wizard": idle} for _, _, actions in played if actions]
    runs = []
    for scenario in (env.scenario, with_other_tasks(env.scenario)):
        run = []
        for observations, infos in play_again(env, scenario, actions):
            run.append((observations, infos))
            if any(event.type == "Subgoal" for event in env.last_events):
                break
        runs.append(run)
    role = str(Role.CO_WIZARD)
    assert min(len(run) for run in runs) > 10
    for k, ((observations, infos), (others, other_infos)) in enumerate(zip(*runs, strict=False)):
        for field, value in observations[role].items():
            np.testing.assert_array_equal(others[role][field], value, err_msg=f"{field}, decision {k}")
        for field in ("action_mask", "refused", "refusal_reason"):
            np.testing.assert_equal(other_infos[role][field], infos[role][field])
        assert others["participant"]["story"] != observations["participant"]["story"]


@pytest.mark.parametrize("rate", [0.0, 0.25])
@pytest.mark.parametrize("play", [play_at_random, play_by_script])
def test_tasks_are_not_visible_to_the_co_wizard(play: Any, rate: float) -> None:
    env = DuoWizardEnv(
        "brookside", config=EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2), word_error_rate=rate)
    )
    check_tasks_are_not_visible(env, play, seed=3, decisions=60)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 215))
@pytest.mark.parametrize("rate", [0.0, 0.2])
@pytest.mark.parametrize("play", [play_at_random, play_by_script])
def test_tasks_are_never_visible_to_the_co_wizard(play: Any, rate: float, seed: int) -> None:
    env = DuoWizardEnv(
        "brookside", config=EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2), word_error_rate=rate)
    )
    check_tasks_are_not_visible(env, play, seed=seed, decisions=400)


def play_in_silence(env: DuoWizardEnv, seed: int, decisions: int = 4) -> list[dict[str, Any]]:
    observations, _ = env.reset(seed=seed)
    seen = [observations]
    for _ in range(decisions):
        observations, *_ = env.step({agent: noop(Role(agent), env.limits) for agent in env.agents})
        seen.append(observations)
    return seen


@pytest.mark.parametrize("seed", range(8))
def test_co_wizard_does_not_observe_story(env: DuoWizardEnv, seed: int) -> None:
    for observations in play_in_silence(env, seed):
        texts = {name: value for name, value in observations["co_wizard"].items() if isinstance(value, str)}
        assert texts == {"participant_text": ""}
        assert not {"story", "tasks", "subgoals", "message", "hidden"} & set(observations["co_wizard"])


@pytest.mark.parametrize("seed", range(8))
def test_co_wizard_map_lacks_hidden_landmarks(env: DuoWizardEnv, seed: int) -> None:
    for observations in play_in_silence(env, seed):
        known = [landmark for landmark in env.scenario.storyboard.landmarks if not landmark.hidden]
        table = observations["co_wizard"]["landmarks"]
        assert [(row[1], row[2]) for row in table if row[0]] == [landmark.position for landmark in known]


def test_participant_does_not_observe_untriggered_subgoals(env: DuoWizardEnv) -> None:
    checked = 0
    for seed in range(12):
        observations = play_in_silence(env, seed, decisions=1)[-1]
        task, participant = env.session.task, observations["participant"]
        for i, subgoal in enumerate(env.scenario.storyboard.subgoals):
            if i in task.live:
                assert participant["subgoals"][i, SubgoalColumn.LIVE]
                continue
            checked += 1
            assert not participant["subgoals"][i].any()
            assert subgoal.description not in participant["tasks"]
            assert observations["ad_wizard"]["subgoals"][i].any()
    assert checked


def test_participant_does_not_observe_permissions(env: DuoWizardEnv) -> None:
    for seed in range(8):
        table = play_in_silence(env, seed, decisions=1)[-1]["participant"]["subgoals"]
        assert not table[:, SubgoalColumn.CAN_TRIGGER :].any()


@pytest.mark.parametrize("name", ["birthday_tea", "film_night", "local_news"])
def test_only_the_ad_wizard_observes_what_may_happen_to_the_tasks(name: str) -> None:
    env = DuoWizardEnv("brookside", storyboard=name, config=EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2)))
    observations = play_in_silence(env, seed=1, decisions=1)[-1]
    secrets = [
        str(secret)
        for i, subgoal in enumerate(env.scenario.storyboard.subgoals)
        for secret in (
            *(message for _, message in subgoal.messages.given()),
            *((subgoal.change,) if subgoal.change else ()),
            *((subgoal.description, subgoal.reason) if i not in env.session.task.live else ()),
        )
    ]
    assert len(secrets) >= 2
    for role in ("participant", "co_wizard"):
        observed = "\n".join(value for value in observations[role].values() if isinstance(value, str))
        assert not [secret for secret in secrets if secret in observed]
    known = "\n".join(value for value in observations["ad_wizard"].values() if isinstance(value, str))
    assert all(secret in known for secret in secrets)


def test_participant_reads_a_message_when_it_is_sent() -> None:
    told = DuoWizardEnv(
        "brookside", storyboard="birthday_tea", config=EnvConfig(world=WorldConfig(vehicles=0, pedestrians=0))
    )
    told.reset(seed=1)
    message = told.scenario.storyboard.subgoals[2].messages.trigger
    idle = {agent: noop(Role(agent), told.limits) for agent in told.agents}
    sent = AdWizardAction(exception=ExceptionKind.TASK_TRIGGER, item=2, message=str(message)).encode(told.limits)
    observations, *_ = told.step({**idle, "ad_wizard": sent})
    assert observations["participant"]["message"] == str(message)
    subgoal = told.scenario.storyboard.subgoals[2]
    assert with_reason(subgoal.description, subgoal.reason) in observations["participant"]["tasks"].split("\n")
