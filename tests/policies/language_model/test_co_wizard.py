"""The Co-Wizard by prompts: what they say is enough to do the job, and nothing that it must not know."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.evaluation.rollout import resimulate
from dorothie_gym.maps import DEVELOPMENT_TOWNS, SEEN_TOWNS
from dorothie_gym.ontology import Role
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.language_model import LanguageModelPolicy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.session_engine import SessionEngine
from tests.policies.language_model.prompt_reader import CoWizardReader
from tests.policies.language_model.sessions import NOWHERE, PromptModel, play
from tests.policies.language_model.simple_readers import listed

TOWNS = (*DEVELOPMENT_TOWNS, *SEEN_TOWNS)


def completed(sessions: int, first_seed: int, co_wizard: bool) -> tuple[int, int, float]:
    """Subgoals that were reached, live subgoals, and calls per simulated minute, of sessions in all towns in turns."""
    reached = live = calls = 0
    seconds = 0.0
    for k in range(sessions):
        model = PromptModel(CoWizardReader())
        models = {Role.CO_WIZARD: (NOWHERE, model)} if co_wizard else {}
        summary = play(models, town=TOWNS[k % len(TOWNS)], seed=first_seed + k)
        reached, live = reached + summary["subgoals"]["reached"], live + summary["subgoals"]["live"]
        calls, seconds = calls + len(model.asked), seconds + summary["seconds"]
    return reached, live, 60.0 * calls / seconds


@pytest.mark.long
def test_prompts_are_enough_to_complete_sessions() -> None:
    reached, live, rate = completed(4, 40, True)
    assert reached >= 0.75 * live
    assert rate < 25.0  # asked when something happens, not at each of 120 decisions


@pytest.mark.slow
def test_reader_of_prompts_completes_what_the_script_completes() -> None:
    scripted, of, _ = completed(32, 7000, False)
    reached, live, _ = completed(32, 7000, True)
    assert reached / live >= 0.9 * scripted / of


def test_prompt_has_nothing_that_the_co_wizard_must_not_know() -> None:
    engines: list[SessionEngine] = []
    model = PromptModel(CoWizardReader())
    play({Role.CO_WIZARD: (NOWHERE, model)}, seed=5, on_step=engines.append)
    storyboard = engines[0].scenario.storyboard
    hidden = [mark for mark in storyboard.landmarks if mark.hidden]
    assert hidden
    for prompt, _ in model.asked:
        heard = [line for line in prompt.text.split("\n") if " passenger: " in line or "The passenger said" in line]
        own = "\n".join(line for line in prompt.text.split("\n") if line not in heard)
        assert storyboard.story[:40] not in own
        assert not any(goal.description in own for goal in storyboard.subgoals)
        known = sum(not mark.hidden for mark in storyboard.landmarks)
        places = listed(own, "Places on your map:")
        assert len(places) == known
        names = {place.partition(", on ")[0] for place in places}
        assert {look.partition(":")[0] for look in listed(own, "Looks of what is in view:")} <= names
        assert prompt.system == model.asked[0][0].system


def test_hidden_landmarks_leave_the_first_prompt_as_it_is() -> None:
    """Two worlds that differ only in where the hidden landmarks lie look the same to the model."""
    engine = SessionEngine("brookside")
    engine.reset(seed=5)
    observation = {**engine.observations.of((Role.CO_WIZARD,))["co_wizard"], "action_mask": engine.mask(Role.CO_WIZARD)}
    texts = []
    for _ in range(2):
        model = PromptModel(CoWizardReader())
        policy = LanguageModelPolicy(Role.CO_WIZARD, NOWHERE, engine.limits, model)
        policy.step(observation, policy.initial_state(policy_seed(5, Role.CO_WIZARD), engine.town))
        texts.append(model.asked[0][0].text)
        for landmark in engine.scenario.storyboard.landmarks:
            if landmark.hidden:
                object.__setattr__(landmark, "station", landmark.station + 1.0)
    assert texts[0] == texts[1]


def test_equal_replies_give_equal_sessions_that_replay_from_their_actions(tmp_path: Path) -> None:
    config = EnvConfig(max_seconds=90.0)
    for name in ("one", "two"):
        play({Role.CO_WIZARD: (NOWHERE, PromptModel(CoWizardReader()))}, config=config, folder=tmp_path / name)
    one, two = (Session.load(tmp_path / name) for name in ("one", "two"))
    assert one.digest == two.digest
    engine = SessionEngine("brookside")
    assert resimulate(one, engine.town).digest == one.digest


def test_step_changes_neither_state_nor_observation() -> None:
    engine = SessionEngine("brookside")
    engine.reset(seed=3)
    policy = LanguageModelPolicy(Role.CO_WIZARD, NOWHERE, engine.limits, PromptModel(CoWizardReader()))
    state = policy.initial_state(1, engine.town)
    seen = {**engine.observations.of((Role.CO_WIZARD,))["co_wizard"], "action_mask": engine.mask(Role.CO_WIZARD)}
    before = {name: np.copy(value) for name, value in seen.items() if isinstance(value, np.ndarray)}
    first, second = policy.step(seen, state), policy.step(seen, state)
    assert repr(first) == repr(second)
    assert all(np.array_equal(value, seen[name]) for name, value in before.items())


def test_action_chosen_long_ago_is_dropped_where_it_is_no_longer_possible() -> None:
    def stubborn(prompt: str) -> dict[str, str]:
        offered = prompt.rpartition("You can drive: ")[2].split(", ")
        turns = [label for label in offered if label.startswith("JTurn")]
        return {"drive": turns[0] if turns else "none", "again": "1"}

    from dataclasses import replace

    from dorothie_gym.policies.language_model import SimulatedTime

    charged = replace(NOWHERE, time=SimulatedTime.CHARGED)
    late = PromptModel(stubborn, latency=12.0)
    summary = play({Role.CO_WIZARD: (charged, late)}, config=EnvConfig(max_seconds=180.0))
    usage = summary["usage"]["co_wizard"]
    assert usage["calls"] == len(late.asked) <= 180 / 12 + 1  # one call at a time, each of 12 s
    assert usage["expired"] > 0
    assert usage["latency"] == pytest.approx(12.0 * usage["calls"])
