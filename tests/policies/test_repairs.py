from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, Wording
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import ActionValue, DialogueMove, GoalStatus, LandmarkName, Role
from dorothie_gym.policies import ScriptedParticipant
from dorothie_gym.policies.participant.config import ParticipantStyle
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.repairs import correction, has_missed
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.speech import remark
from tests.policies.said import heard, with_words

M = DialogueMove
CALM = ParticipantStyle(guides=0.0, names_street=0.0, hurries=1.0, patience=60.0, chat=1e4, puzzled=1.0)


class Human:
    """Participant in brookside after its first instruction."""

    def __init__(self, seed: int = 4) -> None:
        self.env = DuoWizardEnv(town="brookside")
        observations, _ = self.env.reset(seed=seed)
        self.observation = dict(observations["participant"])
        policy = ScriptedParticipant(self.env.limits, style=CALM)
        self.state = policy.initial_state(seed, self.env.town)
        _, self.state = policy.step(self.observation, self.state)
        assert self.state.task.goal is not None and self.state.task.announced
        self.state.speech = replace(self.state.speech.cleared(), last_end=-100.0)  # it has stopped speaking long ago
        self.rng = np.random.default_rng(0)

    @property
    def view(self) -> ParticipantView:
        return ParticipantView.read(self.observation, self.env.town)

    def another_place(self) -> LandmarkName:
        assert self.state.task.goal is not None
        return next(name for name in (LandmarkName.KFC, LandmarkName.IKEA) if name is not self.state.task.goal.name)

    def hears(self, move: DialogueMove, *values, wording: Wording | None = None) -> None:
        said = heard(self.observation, Role.CO_WIZARD, move, *values, wording=wording)
        listen(self.state, self.view_of(said), self.rng)

    def view_of(self, said) -> ParticipantView:
        return replace(self.view, raw=with_words(self.observation, Role.CO_WIZARD, said.words.text, *said.acts))

    def moves(self) -> list[DialogueMove]:
        return [item.act.move for item in self.state.speech.queue]


def test_car_that_gives_up_the_present_errand_is_corrected():
    human = Human()
    human.hears(M.CONFIRM, human.state.task.goal.name, GoalStatus.ABANDONED)
    clarified = [item.act for item in human.state.speech.queue if item.act.move is M.CLARIFY]
    assert clarified and human.state.task.goal.name in clarified[0].slots


@pytest.mark.parametrize("move", [M.ACKNOWLEDGE, M.CONFIRM])
def test_wrong_place_is_corrected(move):
    human = Human()
    human.hears(move, human.another_place())
    clarified = [item.act for item in human.state.speech.queue if item.act.move is M.CLARIFY]
    assert clarified and human.state.task.goal.name in clarified[0].slots


def test_right_place_is_not_corrected():
    human = Human()
    human.hears(M.ACKNOWLEDGE, human.state.task.goal.name)
    assert M.CLARIFY not in human.moves()


def test_repeated_abandoned_place_is_not_corrected():
    human = Human()
    other = human.another_place()
    dropped = remark(M.INSTRUCT, human.state.task.goal.name, wording=Wording(dropped=other))
    human.state.speech = replace(human.state.speech, said=(dropped,))
    said = heard(human.observation, Role.CO_WIZARD, M.CONFIRM, other)
    assert correction(human.state, human.view, said.acts[0], said.words) is None


def test_wrong_side_is_corrected():
    human = Human()
    left = remark(M.INSTRUCT, ActionValue.J_TURN, wording=Wording(direction=Direction.LEFT))
    human.state.speech = replace(human.state.speech, said=(left,), last_end=human.view.time)
    wrong = heard(human.observation, Role.CO_WIZARD, M.CONFIRM, ActionValue.J_TURN, wording=Wording(direction="right"))
    right = heard(human.observation, Role.CO_WIZARD, M.CONFIRM, ActionValue.J_TURN, wording=Wording(direction="left"))
    again = correction(human.state, human.view, wrong.acts[0], wrong.words)
    assert again is not None and again.act.move is M.CLARIFY and again.wording.direction is Direction.LEFT
    assert correction(human.state, human.view, right.acts[0], right.words) is None


@pytest.mark.parametrize(("ended", "caught"), [(0.0, False), (30.0, True)])
def test_only_overlapping_speech_is_missed(ended, caught):
    human = Human()
    human.observation["time"] = np.array([40.0])
    human.state.speech = replace(human.state.speech, last_end=40.0 - ended)
    question = heard(human.observation, Role.CO_WIZARD, M.CHECK, human.state.task.goal.name)
    assert has_missed(human.state, human.view, question, human.rng) is not caught


def test_missed_question_is_answered_after_clarification():
    human = Human()
    human.observation["time"] = np.array([40.0])
    human.state.speech = replace(human.state.speech, last_end=40.0)
    human.hears(M.CHECK, human.state.task.goal.name)
    assert human.moves() == [M.CONFUSE]
    human.state.speech = replace(human.state.speech.cleared(), last_end=0.0)
    human.hears(M.CLARIFY, human.state.task.goal.name)
    assert M.CONFIRM in human.moves()
