"""Lessons: recorded sessions that are followed beside the teacher, and sessions that the player plays beside it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from dorothie_gym.baselines.roles.participant.decision import (
    Attention,
    Scene,
    choosing_inputs,
    perceive,
    speaking_inputs,
)
from dorothie_gym.baselines.roles.participant.examples import Example, forms_of_remarks, make_example
from dorothie_gym.baselines.roles.participant.memory import AVERAGE, Memory
from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant, finished
from dorothie_gym.baselines.roles.participant.remarks import sources
from dorothie_gym.baselines.roles.participant.teacher import Lesson, Teacher
from dorothie_gym.evaluation.rollout.replay import begin_replay, recorded_actions
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.co_wizard.policy import ScriptedCoWizard
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs, policy_seed, replace
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import ActionDict, ParticipantAction
from dorothie_gym.session.spaces.observations import ObservationMapping

PARTICIPANT: Final = Role.PARTICIPANT

SHORTEST_TURN, LONGEST_TURN = 20, 160
"""Range of the number of decisions for which teacher and player in turns guide the car."""

OnExample = Callable[[Example], None]


class Pupil:
    """Attention beside the teacher; the example of a decision is what the teacher does with the pupil's memory."""

    def __init__(self, town: Town, seed: int, teacher: Teacher) -> None:
        """Prepares the pupil of a teacher; the seed draws which examples are kept."""
        self.attention, self._teacher = Attention.begin(town, seed), teacher
        self._rng = np.random.default_rng((seed, 1))

    def decide(self, observation: ObservationMapping, on_example: OnExample) -> tuple[Scene, Memory, Lesson]:
        """Lets the teacher decide, and hands on the example; returns scene, memory with its choice, and lesson."""
        scene = perceive(observation, self.attention)
        lesson = self._teacher.decide(observation)
        choice, choosing = lesson.choice(scene.memory), choosing_inputs(scene)
        memory = scene.memory.chosen(choice, scene.view, scene.rng)
        speaking = speaking_inputs(scene, memory)
        forms: list[str | None] = []
        if lesson.remarks:
            available = sources(memory, scene.view, scene.utterances)
            forms = forms_of_remarks(lesson.remarks, memory, scene, available)
        example = make_example(scene, choosing, speaking, choice, forms, self._rng)
        if example is not None:
            on_example(example)
        return scene, memory, lesson

    def follow(self, scene: Scene, memory: Memory, lesson: Lesson) -> None:
        """Notes what the teacher says, in its words."""
        memory = memory.decided(lesson.remarks, scene.view, scene.rng)
        state = self._teacher.state
        records = replace(memory.records)
        guidance = records.guidance.with_stop_text(state.guidance.stop_text, points_out=state.guidance.points_out)
        records.guidance = replace(guidance, stop_said=state.guidance.stop_said)
        memory = replace(memory, records=records)
        self.attention = Attention(memory=memory.spoken(state.speech, scene.view), utterances=scene.utterances)

    def lead(self, scene: Scene, player: LearnedParticipant) -> ActionDict:
        """Lets the player decide, and puts what it does into the teacher's state; returns its action."""
        memory = scene.memory.chosen(player.choose(choosing_inputs(scene), scene), scene.view, scene.rng)
        remarks = player.speak(speaking_inputs(scene, memory), scene, memory)
        speech, self.attention = finished(scene, memory, remarks)
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
        scene, memory, lesson = pupil.decide(_observed(engine), on_example)
        pupil.follow(scene, memory, lesson)
        engine.step(actions)


def practise(player: LearnedParticipant, engine: SessionEngine, seed: int, on_example: OnExample, share: float) -> None:
    """Plays a session in which teacher and player guide the car in turns; hands on the examples.

    Args:
        player: the player.
        engine: engine of the town.
        seed: seed of the session.
        on_example: receives the examples.
        share: share of the time in which the player guides.
    """
    engine.reset(seed=seed)
    town, limits = engine.town, engine.limits
    others: dict[Role, AnyPolicy] = {Role.CO_WIZARD: ScriptedCoWizard(limits), Role.AD_WIZARD: ScriptedAdWizard(limits)}
    states = {role: policy.initial_state(policy_seed(seed, role), town) for role, policy in others.items()}
    own = policy_seed(seed, PARTICIPANT)
    pupil, rng = Pupil(town, own, Teacher(town, limits, own, AVERAGE)), np.random.default_rng((own, 2))
    left, leads = 0, False
    while not engine.over:
        if left <= 0:
            left, leads = int(rng.integers(SHORTEST_TURN, LONGEST_TURN)), bool(rng.random() < share)
        left -= 1
        inputs, actions = policy_inputs(engine, others), {}
        for role, policy in others.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        scene, memory, lesson = pupil.decide(_observed(engine), on_example)
        if leads:
            actions[str(PARTICIPANT)] = pupil.lead(scene, player)
        else:
            pupil.follow(scene, memory, lesson)
            actions[str(PARTICIPANT)] = lesson.action
        engine.step(actions)


def _observed(engine: SessionEngine) -> ObservationMapping:
    """Returns the observation of the participant."""
    return engine.observations.of([PARTICIPANT])[str(PARTICIPANT)]
