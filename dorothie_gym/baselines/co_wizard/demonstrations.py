"""Lessons: recorded sessions that are followed beside the teacher, and sessions that the player plays beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from dorothie_gym.baselines.co_wizard.decision import (
    Attention,
    Scene,
    acting_inputs,
    blank_inputs,
    finished,
    listening_inputs,
    perceive,
    remember,
)
from dorothie_gym.baselines.co_wizard.examples import Example, correcting_example, make_example
from dorothie_gym.baselines.co_wizard.memory import Memory, initial_values
from dorothie_gym.baselines.co_wizard.policy import LearnedCoWizard
from dorothie_gym.baselines.co_wizard.remarks import sources
from dorothie_gym.baselines.co_wizard.teacher import CALM, Lesson, Teacher
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.maps import Town
from dorothie_gym.ontology import DialogueMove, Role
from dorothie_gym.policies import ScriptedAdWizard, ScriptedParticipant
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs, policy_seed, replace
from dorothie_gym.recording import Session
from dorothie_gym.recording.header import SessionHeader
from dorothie_gym.rollout.replay import begin_replay, recorded_actions
from dorothie_gym.spaces import CoWizardAction, ObservationMapping, Physical, SpaceLimits

CO_WIZARD: Final = Role.CO_WIZARD

SHORTEST_TURN, LONGEST_TURN = 10, 80
"""Range of the number of decisions for which teacher and player in turns drive."""

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
        self, observation: ObservationMapping, on_example: OnExample
    ) -> tuple[Scene, Memory, Lesson]:  # fmt: skip
        """Lets the teacher decide, and hands on the example; returns scene, memory after listening, and lesson.

        Args:
            observation: observation of the Co-Wizard, with its action mask.
            on_example: receives the example.
        """
        scene = perceive(observation, self.attention, self.last)
        latest = scene.latest
        places, streets = (latest.places, latest.streets) if latest is not None else ((), ())
        lesson = self._teacher.decide(observation, places, streets)
        listening = listening_inputs(scene, queued=lesson.queued)
        memory = remember(scene, lesson.update)
        acting, commands = acting_inputs(scene, memory, queued=lesson.queued)
        available = sources(memory, scene.view, scene.utterances) if lesson.remarks else {}
        example = make_example(scene, listening, acting, commands, lesson, available, self._rng)
        if example is not None:
            on_example(example)
        return scene, memory, lesson

    def did(self, scene: Scene, memory: Memory, physical: Physical | None, lesson: Lesson) -> None:
        """Notes the command that was given, and the remarks of the teacher, which are said."""
        self.attention = finished(scene, memory, physical, lesson.remarks)[1]
        if lesson.remarks:
            self.last = lesson.remarks[-1].act.move


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
        scene, memory, lesson = pupil.decide(_observed(engine), on_example)
        pupil.did(scene, memory, lesson.physical, lesson)
        engine.step(actions)


def practise(
    player: LearnedCoWizard | None, engine: SessionEngine, seed: int, on_example: OnExample, share: float
) -> None:  # fmt: skip
    """Plays a session in which teacher and player drive in turns, and the teacher talks; hands on the examples.

    Args:
        player: the player; None where the teacher alone drives.
        engine: engine of the town.
        seed: seed of the session.
        on_example: receives the examples.
        share: share of the time in which the player drives.
    """
    engine.reset(seed=seed)
    town, limits = engine.town, engine.limits
    others: dict[Role, AnyPolicy] = {
        Role.PARTICIPANT: ScriptedParticipant(limits, traits=TRAINED),
        Role.AD_WIZARD: ScriptedAdWizard(limits),
    }
    states = {role: policy.initial_state(policy_seed(seed, role), town) for role, policy in others.items()}
    own = policy_seed(seed, CO_WIZARD)
    teacher = Teacher(town, limits, own, CALM)
    pupil, rng = Pupil(town, limits, own, teacher), np.random.default_rng((own, 2))
    attention, left, leads = pupil.attention, 0, False
    blank = blank_inputs()
    while not engine.over:
        if left <= 0:
            left, leads = int(rng.integers(SHORTEST_TURN, LONGEST_TURN)), bool(rng.random() < share)
            attention = pupil.attention
        left -= 1
        inputs, actions = policy_inputs(engine, others), {}
        for role, policy in others.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        observation = _observed(engine)
        scene, memory, lesson = pupil.decide(observation, on_example)
        action = lesson.action
        if leads and player is not None:
            seen = perceive(observation, attention, pupil.last)
            after, physical, _ = player.decide(seen, rng, queued=lesson.queued, silent=True)
            correction = correcting_example(seen, listening_inputs(seen, queued=lesson.queued), blank, memory, lesson)
            if correction is not None:
                on_example(correction)
            mental, attention = finished(seen, after, physical, lesson.remarks)
            action = CoWizardAction(speech=lesson.action.speech, physical=physical, mental=mental)
        pupil.did(scene, memory, action.physical, lesson)
        teacher.settle(action.physical, spoke=True)
        engine.step({**actions, str(CO_WIZARD): action.encode(limits)})


def _observed(engine: SessionEngine) -> ObservationMapping:
    """Returns the observation of the Co-Wizard, with its action mask."""
    return {**engine.observations.of([CO_WIZARD])[str(CO_WIZARD)], "action_mask": engine.mask(CO_WIZARD)}
