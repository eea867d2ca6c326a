"""Demonstrations of the scripted participant, in recorded sessions and in practice sessions of the learned one."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.baselines.roles.learned_role.dagger_sessions import (
    PracticeSession,
    observed,
    play_in_turns,
    play_together,
)
from dorothie_gym.baselines.roles.learned_role.decision import Attention
from dorothie_gym.baselines.roles.participant.decision import (
    ParticipantPercept,
    choosing_inputs,
    perceive,
    speaking_inputs,
)
from dorothie_gym.baselines.roles.participant.examples import Example, forms_of_remarks, make_example
from dorothie_gym.baselines.roles.participant.memory import AVERAGE, SessionMemory
from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant, finished
from dorothie_gym.baselines.roles.participant.remarks import sources
from dorothie_gym.baselines.roles.participant.teacher import Lesson, Teacher
from dorothie_gym.evaluation.rollout.replay import begin_replay, recorded_actions
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, replace
from dorothie_gym.session.spaces.actions import ActionDict, ParticipantAction

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.dagger import RoundSettings
    from dorothie_gym.baselines.roles.participant.network import ParticipantNetwork
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.spaces.observations import ObservationMapping

PARTICIPANT: Final = Role.PARTICIPANT

SHORTEST_TURN, LONGEST_TURN = 20, 160
"""Range of the number of decisions between changes of the guide, teacher or player."""

OnExample = Callable[[Example], None]


class Pupil:
    """Attention that runs beside the teacher; its examples are the teacher's choices with the pupil's memory."""

    def __init__(self, town: Town, seed: int, teacher: Teacher) -> None:
        """Prepares the pupil of a teacher; the seed draws which examples are kept."""
        self.attention, self._teacher = Attention(memory=SessionMemory.begin(town, seed)), teacher
        self._rng = np.random.default_rng((seed, 1))

    def decide(
        self, observation: ObservationMapping, on_example: OnExample
    ) -> tuple[ParticipantPercept, SessionMemory, Lesson]:
        """Lets the teacher decide, and hands on the example; returns percept, memory with its choice, and lesson."""
        percept = perceive(observation, self.attention)
        lesson = self._teacher.decide(observation)
        choice, choosing = lesson.choice(percept.memory), choosing_inputs(percept)
        memory = percept.memory.chosen(choice, percept.view, percept.rng)
        speaking = speaking_inputs(percept, memory)
        forms: list[str | None] = []
        if lesson.remarks:
            available = sources(memory, percept.view, percept.utterances)
            forms = forms_of_remarks(lesson.remarks, memory, percept, available)
        example = make_example(percept, choosing, speaking, choice, forms, self._rng)
        if example is not None:
            on_example(example)
        return percept, memory, lesson

    def follow(self, percept: ParticipantPercept, memory: SessionMemory, lesson: Lesson) -> None:
        """Notes the teacher's utterance in its own words."""
        memory = memory.decided(lesson.remarks, percept.view, percept.rng)
        state = self._teacher.state
        records = replace(memory.records)
        guidance = records.guidance.with_stop_text(state.guidance.stop_text, points_out=state.guidance.points_out)
        records.guidance = replace(guidance, stop_said=state.guidance.stop_said)
        memory = replace(memory, records=records)
        self.attention = Attention(memory=memory.spoken(state.speech, percept.view), utterances=percept.utterances)

    def lead(self, percept: ParticipantPercept, player: LearnedParticipant) -> ActionDict:
        """Lets the player decide, and copies its decision into the teacher's state; returns its action."""
        memory = percept.memory.chosen(player.choose(choosing_inputs(percept), percept), percept.view, percept.rng)
        remarks = player.speak(speaking_inputs(percept, memory), percept, memory)
        speech, self.attention = finished(percept, memory, remarks)
        self._teacher.settle(self.attention.memory, spoke=bool(remarks))
        return ParticipantAction(speech=speech).encode(player.limits)


def follow(session: Session, town: Town, on_example: OnExample) -> None:
    """Simulates a recorded session of scripted roles again, and hands on the examples of its participant.

    Args:
        session: recorded session.
        town: its town.
        on_example: receives the examples.
    """
    engine = begin_replay(session, town)
    seed = policy_seed(session.header.seed or 0, PARTICIPANT)
    pupil = Pupil(town, seed, Teacher(town, engine.limits, seed))
    for actions in recorded_actions(engine, session):
        percept, memory, lesson = pupil.decide(observed(engine, PARTICIPANT), on_example)
        pupil.follow(percept, memory, lesson)
        engine.step(actions)


def practise(
    network: ParticipantNetwork,
    vocabulary: Sequence[str],
    sessions: Sequence[PracticeSession[Example]],
    settings: RoundSettings,
) -> None:
    """Plays sessions in which teacher and player guide the car alternately; passes the examples on.

    Args:
        network: network of the player.
        vocabulary: its forms of remarks.
        sessions: the sessions.
        settings: settings of the training.
    """
    play_together([_session(network, vocabulary, session, settings.share) for session in sessions], list)


def _session(
    network: ParticipantNetwork, vocabulary: Sequence[str], session: PracticeSession[Example], share: float
) -> Generator[None, None, None]:
    """Plays a session of practice, in which nothing is asked."""
    engine, seed = session.engine, session.seed
    engine.reset(seed=seed)
    limits = engine.limits
    others: dict[Role, AnyPolicy] = {Role.CO_WIZARD: ScriptedCoWizard(limits), Role.AD_WIZARD: ScriptedAdWizard(limits)}
    own = policy_seed(seed, PARTICIPANT)
    pupil = Pupil(engine.town, own, Teacher(engine.town, limits, own, AVERAGE))
    practice = ParticipantPractice(LearnedParticipant(network, vocabulary, limits), pupil, session.on_example, share)
    yield from play_in_turns(PARTICIPANT, practice, others, engine, seed)


class ParticipantPractice:
    """Player and teacher in one session, see `Turns`."""

    is_stuck: Final = False

    def __init__(self, player: LearnedParticipant, pupil: Pupil, on_example: OnExample, share: float) -> None:
        """Prepares the session; the share is that of the time in which the player guides."""
        self._player, self._pupil, self._on_example, self._share = player, pupil, on_example, share
        self._leads = False

    def begin_turn(self, rng: np.random.Generator) -> int:
        """Draws whose turn it is."""
        left = int(rng.integers(SHORTEST_TURN, LONGEST_TURN))
        self._leads = bool(rng.random() < self._share)
        return left

    def asks(self, observation: ObservationMapping) -> None:
        """Asks nothing: choosing and speaking follow each other within a decision."""

    def decide(self, observation: ObservationMapping, answer: None) -> ActionDict:
        """Takes a decision: the player's where it leads, else the teacher's."""
        percept, memory, lesson = self._pupil.decide(observation, self._on_example)
        if self._leads:
            return self._pupil.lead(percept, self._player)
        self._pupil.follow(percept, memory, lesson)
        return lesson.action
