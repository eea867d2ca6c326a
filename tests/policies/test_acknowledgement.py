import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, understand
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import ActionValue, DialogueMove, Role
from dorothie_gym.policies import ScriptedCoWizard, ScriptedParticipant
from dorothie_gym.policies.co_wizard.acknowledgement import acknowledge, plan_remark
from dorothie_gym.policies.co_wizard.config import CoWizardConfig, CoWizardStyle
from dorothie_gym.policies.co_wizard.intentions import Intentions
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.speech import SpeechState


def start(**style: float) -> tuple[CoWizardState, CoWizardView]:
    traits = {"echoes": 0.0, "checks": 0.0, "announces": 0.0, "silent": 0.0} | style
    env = DuoWizardEnv(town="brookside")
    observations, _ = env.reset(seed=0)
    state = CoWizardState(
        seed=0,
        town=env.town,
        style=CoWizardStyle(**traits),
        config=CoWizardConfig(),
        speech=SpeechState(role=Role.CO_WIZARD),
        intentions=Intentions(speed=40, usual=40),
    )
    return state, CoWizardView.read(observations["co_wizard"], env.town)


def heard_moves(
    words: str, action: ActionValue, seed: int, *, answers: bool = False, **style: float
) -> list[DialogueMove]:
    state, view = start(**style)
    acknowledge(state, view, action, understand(words), np.random.default_rng(seed), answers=answers)
    return [item.act.move for item in state.speech.queue]


def test_silent_style_obeys_answers_without_a_word_but_acknowledges_orders():
    for seed in range(20):
        assert heard_moves("turn left", ActionValue.J_TURN, seed, answers=True, silent=1.0) == []
        assert heard_moves("turn left", ActionValue.J_TURN, seed, silent=1.0)


def test_echo_names_direction():
    state, view = start(echoes=1.0)
    acknowledge(
        state, view, ActionValue.J_TURN, understand("left at the next one"), np.random.default_rng(5), answers=False
    )
    named = [item for item in state.speech.queue if item.act.slots]
    assert named and named[0].wording.direction is Direction.LEFT


def test_stop_is_never_checked():
    moves = [heard_moves("stop", ActionValue.STOP, seed, checks=1.0) for seed in range(60)]
    assert all(DialogueMove.CHECK not in found for found in moves)
    turns = [heard_moves("turn left", ActionValue.J_TURN, seed, checks=1.0) for seed in range(60)]
    assert any(DialogueMove.CHECK in found for found in turns)


@pytest.mark.parametrize(("rambles", "expected"), [(0.0, 0), (1.0, 1)])
def test_only_rambling_style_mentions_plan(rambles, expected):
    assert len(plan_remark(*start(rambles=rambles), np.random.default_rng(1))) == expected


def test_plan_is_not_mentioned_twice_in_a_row():
    state, view = start(rambles=1.0)
    state.say(*plan_remark(state, view, np.random.default_rng(1)))
    _, state.speech = state.speech.speak(0.0, 0.0, np.random.default_rng(1))
    assert plan_remark(state, view, np.random.default_rng(1)) == ()


def test_speaker_style_depends_on_seed_only():
    env = DuoWizardEnv(town="brookside")
    env.reset(seed=0)
    for policy, role in ((ScriptedParticipant(), Role.PARTICIPANT), (ScriptedCoWizard(), Role.CO_WIZARD)):
        styles = [policy.initial_state(policy_seed(seed, role), env.town).speech.style for seed in range(8)]
        assert len({style.idiolect for style in styles}) == 8
        assert styles[3] == policy.initial_state(policy_seed(3, role), env.town).speech.style
