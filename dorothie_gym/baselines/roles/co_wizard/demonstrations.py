"""Lessons: recorded sessions that are followed beside the teacher, and sessions that the player plays beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from dorothie_gym.baselines.roles.co_wizard.decision import (
    Attention,
    Scene,
    acting_inputs,
    blank_inputs,
    finished,
    listening_inputs,
    perceive,
    remember,
)
from dorothie_gym.baselines.roles.co_wizard.examples import Example, correcting_example, make_example
from dorothie_gym.baselines.roles.co_wizard.memory import Memory, initial_values
from dorothie_gym.baselines.roles.co_wizard.policy import LearnedCoWizard, Turn
from dorothie_gym.baselines.roles.co_wizard.remarks import sources
from dorothie_gym.baselines.roles.co_wizard.teacher import CALM, Lesson, Teacher
from dorothie_gym.evaluation.rollout.replay import begin_replay, recorded_actions
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.participant.policy import ScriptedParticipant
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs, policy_seed, replace
from dorothie_gym.policies.speech import Remark
from dorothie_gym.session.recording.header import SessionHeader
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import CoWizardAction, Physical
from dorothie_gym.session.spaces.limits import SpaceLimits
from dorothie_gym.session.spaces.observations import ObservationMapping

CO_WIZARD: Final = Role.CO_WIZARD

SHORTEST_TURN, LONGEST_TURN = 10, 80
"""Range of the number of decisions for which teacher and player in turns drive."""

PATIENCE: Final = 8
"""Number of decisions in a row with another command than the teacher's after which the teacher takes over.

A player that is stuck would otherwise fill its turn with examples of one moment.
"""

TRAINED: Final = parse_traits("talkativeness=0..0.8,certainty=0.2..1")
"""Traits of the participants in training; those who are talkative or uncertain beyond are held out."""

OnExample = Callable[[Example], None]


def is_held_out(header: SessionHeader) -> bool:
    """Returns whether the participant of a recorded session has traits outside `TRAINED`."""
    personas = header.extra.get("personas")
    traits = personas.get(str(Role.PARTICIPANT)) if isinstance(personas, Mapping) else None
    if not isinstance(traits, Mapping):
        return False
    return float(traits["talkativeness"]) > 0.8 or float(traits["certainty"]) < 0.2


class Pupil:
    """Attention that is led by the teacher: it remembers what the teacher remembers."""

    def __init__(self, town: Town, limits: SpaceLimits, seed: int, teacher: Teacher) -> None:
        """Prepares the pupil of a teacher; the seed draws which examples are kept."""
        memory = replace(Memory(town=town), values=initial_values(teacher.usual_speed))
        self.attention, self._teacher = Attention(memory=memory), teacher
        self._rng = np.random.default_rng((seed, 1))
        self.last: DialogueMove | None = None

    def decide(
        self, observation: ObservationMapping, on_example: OnExample, turn: Turn | None = None
    ) -> tuple[Scene, Memory, Lesson]:
        """Lets the teacher decide, and hands on the example; returns scene, memory after listening, and lesson.

        Args:
            observation: observation of the Co-Wizard, with its action mask.
            on_example: receives the example.
            turn: decision of the player where it talks.
        """
        scene = perceive(observation, self.attention, self.last)
        latest = scene.latest
        places, streets = (latest.places, latest.streets) if latest is not None else ((), ())
        lesson = self._teacher.decide(observation, places, streets)
        queued = lesson.queued if turn is None else turn.queued
        listening = listening_inputs(scene, queued=queued)
        memory = remember(scene, lesson.update)
        acting, commands = acting_inputs(scene, memory, queued=queued)
        available = sources(memory, scene.view, scene.utterances) if lesson.remarks else {}
        talks = turn is None or not turn.silent
        example = make_example(scene, listening, acting, commands, lesson, available, self._rng, talks=talks)
        if example is not None:
            on_example(example)
        return scene, memory, lesson

    def did(self, scene: Scene, memory: Memory, physical: Physical | None, remarks: Sequence[Remark]) -> None:
        """Notes the command that was given, and what was decided to say."""
        self.attention = finished(scene, memory, physical, remarks)[1]
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
        scene, memory, lesson = pupil.decide(observed(engine), on_example)
        pupil.did(scene, memory, lesson.physical, lesson.remarks)
        engine.step(actions)


def practise(
    player: LearnedCoWizard, engine: SessionEngine, seed: int, on_example: OnExample, *, share: float, talking: float
) -> None:
    """Plays a session in which teacher and player take turns; hands on the teacher's decisions as examples.

    Args:
        player: the player.
        engine: engine of the town.
        seed: seed of the session.
        on_example: receives the examples.
        share: share of the time in which the player drives.
        talking: share of that time in which it also talks.
    """
    engine.reset(seed=seed)
    town, limits = engine.town, engine.limits
    others: dict[Role, AnyPolicy] = {
        Role.PARTICIPANT: ScriptedParticipant(limits, traits=TRAINED),
        Role.AD_WIZARD: ScriptedAdWizard(limits),
    }
    states = {role: policy.initial_state(policy_seed(seed, role), town) for role, policy in others.items()}
    own = policy_seed(seed, CO_WIZARD)
    practice = _Practice(player, Teacher(town, limits, own, CALM), town, limits, own)
    rng, left, leads, talks = np.random.default_rng((own, 2)), 0, False, False
    while not engine.over:
        if left <= 0 or practice.disagreements >= PATIENCE:
            stuck = practice.disagreements >= PATIENCE
            left = int(rng.integers(SHORTEST_TURN, LONGEST_TURN))
            leads, talks = bool(rng.random() < share) and not stuck, bool(rng.random() < talking)
            practice.take_over()
        left -= 1
        inputs, actions = policy_inputs(engine, others), {}
        for role, policy in others.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        action = practice.decide(observed(engine), on_example, leads=leads, talks=leads and talks)
        engine.step({**actions, str(CO_WIZARD): action.encode(limits)})


class _Practice:
    """Player and teacher in one session."""

    def __init__(self, player: LearnedCoWizard, teacher: Teacher, town: Town, limits: SpaceLimits, seed: int) -> None:
        self._player, self._teacher = player, teacher
        self._pupil = Pupil(town, limits, seed, teacher)
        self._state = player.initial_state(seed, town)
        self.disagreements = 0

    def take_over(self) -> None:
        """Gives the player the memory that the teacher has led to, and what was said."""
        voice = replace(self._teacher.speech, queue=())
        self._state = replace(self._state, attention=self._pupil.attention, voice=voice)
        self.disagreements = 0

    def decide(
        self, observation: ObservationMapping, on_example: OnExample, *, leads: bool, talks: bool
    ) -> CoWizardAction:
        """Takes a decision: the player's where it leads, with the teacher's words unless it talks."""
        turn = self._player.play(observation, self._state, silent=not talks) if leads else None
        scene, memory, lesson = self._pupil.decide(observation, on_example, turn if talks else None)
        if turn is None:
            self._pupil.did(scene, memory, lesson.physical, lesson.remarks)
            return lesson.action
        self._correct(turn, memory, lesson, on_example)
        self.disagreements = self.disagreements + 1 if turn.action.physical != lesson.physical else 0
        remarks, speech = (turn.remarks, turn.action.speech) if talks else (lesson.remarks, lesson.action.speech)
        if talks:
            self._teacher.talked(turn.state.voice, remarks, lesson, scene.view)
            self._state = turn.state
        else:
            attention = finished(turn.scene, turn.memory, turn.action.physical, remarks)[1]
            self._state = replace(turn.state, attention=attention, voice=self._teacher.speech)
        self._teacher.drove(turn.action.physical)
        self._pupil.did(scene, memory, turn.action.physical, remarks)
        return replace(turn.action, speech=speech)

    def _correct(self, turn: Turn, memory: Memory, lesson: Lesson, on_example: OnExample) -> None:
        """Hands on an example of how the player's memory gets back to the teacher's, if something was just heard.

        Without anything new, the network would learn to change a memory for no reason.
        """
        if not turn.scene.heard:
            return
        listening = listening_inputs(turn.scene, queued=turn.queued)
        correction = correcting_example(turn.scene, listening, blank_inputs(), memory, lesson)
        if correction is not None:
            on_example(correction)


def observed(engine: SessionEngine) -> ObservationMapping:
    """Returns the observation of the Co-Wizard, with its action mask."""
    return {**engine.observations.of([CO_WIZARD])[str(CO_WIZARD)], "action_mask": engine.mask(CO_WIZARD)}
