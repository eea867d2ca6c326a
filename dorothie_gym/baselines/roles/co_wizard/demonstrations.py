"""Demonstrations of the scripted Co-Wizard, in recorded sessions and in practice sessions of the learned one."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.baselines.roles.co_wizard.decision import (
    CoWizardPercept,
    acting_inputs,
    blank_inputs,
    finished,
    listening_inputs,
    perceive,
    remember,
)
from dorothie_gym.baselines.roles.co_wizard.examples import Example, LessonInputs, correcting_example, make_example
from dorothie_gym.baselines.roles.co_wizard.memory import WorkingMemory, initial_values
from dorothie_gym.baselines.roles.co_wizard.policy import LearnedCoWizard, LearnedDecision, LearnedState
from dorothie_gym.baselines.roles.co_wizard.remarks import sources
from dorothie_gym.baselines.roles.co_wizard.teacher import CALM, Lesson, Teacher
from dorothie_gym.baselines.roles.learned_role.dagger import RoundSettings
from dorothie_gym.baselines.roles.learned_role.dagger_sessions import (
    TRAINED,
    PracticeSession,
    observed,
    play_in_turns,
    play_together,
)
from dorothie_gym.baselines.roles.learned_role.decision import Attention
from dorothie_gym.evaluation.rollout.replay import begin_replay, recorded_actions
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.participant.policy import ScriptedParticipant
from dorothie_gym.policies.policy import AnyPolicy, replace
from dorothie_gym.session.spaces.observations import ObservationMapping

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.co_wizard.network import CoWizardNetwork
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.actions import CoWizardAction, Physical
    from dorothie_gym.session.spaces.fields import SpaceLimits

CO_WIZARD: Final = Role.CO_WIZARD

SHORTEST_TURN, LONGEST_TURN = 10, 80
"""Range of the number of decisions between changes of the driver, teacher or player."""

PATIENCE: Final = 8
"""Number of decisions in a row with another command than the teacher's after which the teacher takes over.

A player that is stuck would otherwise fill its turn with examples of one moment.
"""

OnExample = Callable[[Example], None]


@dataclass(frozen=True, kw_only=True)
class CoWizardTraining(RoundSettings):
    """Settings of a training.

    Attributes:
        rounds: number of rounds of practice.
        sessions: sessions of practice in a round.
        max_seconds: time limit of a session of practice [s]; shorter ones would lack the last errands.
        last_epochs: passes of the last fit.
        talking: share of the time in which the player drives in which it also talks.
    """

    rounds: int = 8
    sessions: int = 45
    max_seconds: float = 600.0
    last_epochs: int = 16
    talking: float = 0.5


class Pupil:
    """Attention that follows the teacher: its memory is that of the teacher."""

    def __init__(self, town: Town, limits: SpaceLimits, seed: int, teacher: Teacher) -> None:
        """Prepares the pupil of a teacher; the seed draws which examples are kept."""
        memory = replace(WorkingMemory(town=town), values=initial_values(teacher.usual_speed))
        self.attention: Attention[WorkingMemory] = Attention(memory=memory)
        self._teacher = teacher
        self._rng = np.random.default_rng((seed, 1))
        self.last: DialogueMove | None = None

    def decide(
        self, observation: ObservationMapping, on_example: OnExample, turn: LearnedDecision | None = None
    ) -> tuple[CoWizardPercept, WorkingMemory, Lesson]:
        """Lets the teacher decide, and hands on the example; returns percept, memory after listening, and lesson.

        Args:
            observation: observation of the Co-Wizard, with its action mask.
            on_example: receives the example.
            turn: decision of the player where it talks.
        """
        percept = perceive(observation, self.attention, self.last)
        latest = percept.latest
        places, streets = (latest.places, latest.streets) if latest is not None else ((), ())
        lesson = self._teacher.decide(observation, places, streets)
        queued = lesson.queued if turn is None else turn.queued
        memory = remember(percept, lesson.update)

        def inputs() -> LessonInputs:
            acting, commands = acting_inputs(percept, memory, queued=queued)
            available = sources(memory, percept.view, percept.utterances) if lesson.remarks else {}
            return LessonInputs(listening_inputs(percept, queued=queued), acting, commands, available)

        talks = turn is None or not turn.silent
        example = make_example(percept, inputs, lesson, self._rng, talks=talks)
        if example is not None:
            on_example(example)
        return percept, memory, lesson

    def did(
        self, percept: CoWizardPercept, memory: WorkingMemory, physical: Physical | None, remarks: Sequence[Remark]
    ) -> None:
        """Notes the command that was given and the chosen remarks."""
        self.attention = finished(percept, memory, physical, remarks)[1]
        if remarks:
            self.last = remarks[-1].act.move


def follow(session: Session, town: Town, on_example: OnExample) -> None:
    """Simulates a recorded session of scripted roles again, and hands on the examples of its Co-Wizard.

    Args:
        session: recorded session.
        town: its town.
        on_example: receives the examples.
    """
    engine = begin_replay(session, town)
    seed = policy_seed(session.header.seed or 0, CO_WIZARD)
    pupil = Pupil(town, engine.limits, seed, Teacher(town, engine.limits, seed))
    for actions in recorded_actions(engine, session):
        percept, memory, lesson = pupil.decide(observed(engine, CO_WIZARD), on_example)
        pupil.did(percept, memory, lesson.physical, lesson.remarks)
        engine.step(actions)


def practise(
    network: CoWizardNetwork,
    vocabulary: Sequence[str],
    sessions: Sequence[PracticeSession[Example]],
    settings: CoWizardTraining,
) -> None:
    """Plays sessions in which teacher and player take turns; hands on the teacher's decisions as examples.

    The player decides for all sessions together.

    Args:
        network: network of the player.
        vocabulary: its forms of remarks.
        sessions: the sessions.
        settings: settings of the training.
    """
    player = LearnedCoWizard(network, vocabulary)

    def answer(questions: Sequence[Question]) -> list[LearnedDecision]:
        return player.play_all(
            [question.observation for question in questions],
            [question.state for question in questions],
            silent=[question.silent for question in questions],
        )

    play_together([_session(player, session, settings) for session in sessions], answer)


class Question(NamedTuple):
    """Question for the player's decision: observation, state, and whether it must stay silent."""

    observation: ObservationMapping
    state: LearnedState
    silent: bool


def _session(
    player: LearnedCoWizard, session: PracticeSession[Example], settings: CoWizardTraining
) -> Generator[Question, LearnedDecision, None]:
    """Plays a session of practice."""
    engine, seed = session.engine, session.seed
    engine.reset(seed=seed)
    limits = engine.limits
    others: dict[Role, AnyPolicy] = {
        Role.PARTICIPANT: ScriptedParticipant(limits, traits=TRAINED),
        Role.AD_WIZARD: ScriptedAdWizard(limits),
    }
    practice = CoWizardPractice(player, engine, policy_seed(seed, CO_WIZARD), session.on_example, settings)
    yield from play_in_turns(CO_WIZARD, practice, others, engine, seed)


class CoWizardPractice:
    """Player and teacher in one session, see `Turns`."""

    def __init__(
        self,
        player: LearnedCoWizard,
        engine: SessionEngine,
        seed: int,
        on_example: OnExample,
        settings: CoWizardTraining,
    ) -> None:
        """Prepares the session of an engine; the seed is that of the role."""
        town, limits = engine.town, engine.limits
        self._player, self._teacher = player, Teacher(town, limits, seed, CALM)
        self._pupil = Pupil(town, limits, seed, self._teacher)
        self._state = player.initial_state(seed, town)
        self._on_example, self._settings = on_example, settings
        self._leads, self._talks, self._disagreements = False, False, 0

    @property
    def is_stuck(self) -> bool:
        """Whether the player has long commanded otherwise than the teacher."""
        return self._disagreements >= PATIENCE

    def begin_turn(self, rng: np.random.Generator) -> int:
        """Draws whose turn it is; gives the player the memory that follows from the teacher, and the latest remarks."""
        left = int(rng.integers(SHORTEST_TURN, LONGEST_TURN))
        self._leads = bool(rng.random() < self._settings.share) and not self.is_stuck
        self._talks = bool(rng.random() < self._settings.talking) and self._leads
        voice = replace(self._teacher.speech, queue=())
        self._state = replace(self._state, attention=self._pupil.attention, voice=voice)
        self._disagreements = 0
        return left

    def asks(self, observation: ObservationMapping) -> Question | None:
        """Returns the question for the player's decision where it leads."""
        return Question(observation, self._state, not self._talks) if self._leads else None

    def decide(self, observation: ObservationMapping, answer: LearnedDecision | None) -> CoWizardAction:
        """Takes a decision: the player's where it leads, with the teacher's words unless it talks."""
        turn, talks = answer, self._talks
        percept, memory, lesson = self._pupil.decide(observation, self._on_example, turn if talks else None)
        if turn is None:
            self._pupil.did(percept, memory, lesson.physical, lesson.remarks)
            return lesson.action
        self._correct(turn, memory, lesson)
        self._disagreements = self._disagreements + 1 if turn.action.physical != lesson.physical else 0
        remarks, speech = (turn.remarks, turn.action.speech) if talks else (lesson.remarks, lesson.action.speech)
        if talks:
            self._teacher.talked(turn.state.voice, remarks, lesson, percept.view)
            self._state = turn.state
        else:
            attention = finished(turn.percept, turn.memory, turn.action.physical, remarks)[1]
            self._state = replace(turn.state, attention=attention, voice=self._teacher.speech)
        self._teacher.drove(turn.action.physical)
        self._pupil.did(percept, memory, turn.action.physical, remarks)
        return replace(turn.action, speech=speech)

    def _correct(self, turn: LearnedDecision, memory: WorkingMemory, lesson: Lesson) -> None:
        """Passes on an example of how the player's memory returns to the teacher's, if something was just heard.

        Without a new utterance, the network would learn to change its memory without a cause.
        """
        if not turn.percept.heard:
            return
        listening = listening_inputs(turn.percept, queued=turn.queued)
        correction = correcting_example(turn.percept, listening, blank_inputs(), memory, lesson)
        if correction is not None:
            self._on_example(correction)
