"""One decision of the learned participant, up to what the network is given: the same in training and in play."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.co_wizard.hearing import KEPT, Utterance, utterance_vector, word_rows
from dorothie_gym.baselines.roles.participant.features import ERRAND_SIZE, MAX_ERRANDS, errand_vectors, state_vector
from dorothie_gym.baselines.roles.participant.memory import Memory, voice_of
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.observation_parser import heard_utterance
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.policy import replace
from dorothie_gym.session.spaces.observations import ObservationMapping

Vector = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Attention:
    """State between decisions: the memory, and the last utterances of the car, the latest first."""

    memory: Memory
    utterances: tuple[Utterance, ...] = ()

    @classmethod
    def begin(cls, town: Town, seed: int) -> Attention:
        """Returns the state before the first decision."""
        return cls(memory=Memory.begin(town, seed, voice_of(seed)))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What is perceived at a decision.

    Attributes:
        view: observation.
        memory: memory, brought up to date with it.
        utterances: last utterances of the car, the latest first.
        heard: whether one has just ended.
        rng: random generator of the decision.
    """

    view: ParticipantView
    memory: Memory
    utterances: tuple[Utterance, ...]
    heard: bool
    rng: np.random.Generator

    @property
    def considers_errands(self) -> bool:
        """Returns whether the target is chosen now: there is none, or something was heard."""
        return self.heard or self.memory.records.task.target is None or bool(self._news)

    @property
    def _news(self) -> list[float]:
        return [at for _, at, _ in self.memory.events if at >= self.view.time]


def perceive(observation: ObservationMapping, attention: Attention) -> Scene:
    """Reads an observation of the participant."""
    before = attention.memory
    view = ParticipantView.read(observation, before.records.town)
    memory, view = before.looking(view)
    rng = np.random.default_rng((memory.records.seed, memory.records.count))
    last = memory.records.speech.last
    heard = heard_utterance(observation, Role.CO_WIZARD, None if last is None else last.act.move)
    utterances = attention.utterances
    if heard is not None:
        utterances = (Utterance(time=view.time, heard=heard), *utterances)[:KEPT]
        memory = memory.hearing(heard, view, rng)
    return Scene(view=view, memory=memory, utterances=utterances, heard=heard is not None, rng=rng)


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Inputs of one of the two steps of a decision.

    Attributes:
        state: state and utterances (n,).
        words: rows of the words of the latest utterance.
        errands: vectors of the errands (k, e), filled with 0.
        numbers: number of the subgoal of each errand.
    """

    state: Vector
    words: NDArray[np.int64]
    errands: Vector
    numbers: tuple[int, ...] = ()


def choosing_inputs(scene: Scene) -> Inputs:
    """Returns the inputs of the first step, which chooses the target."""
    vectors: list[list[float]] = []
    numbers: tuple[int, ...] = ()
    if scene.considers_errands:
        vectors, numbers = errand_vectors(scene.memory, scene.view, scene.utterances)
    inputs = speaking_inputs(scene, scene.memory)
    if vectors:
        inputs.errands[: len(vectors)] = vectors
    return replace(inputs, numbers=numbers)


def speaking_inputs(scene: Scene, memory: Memory) -> Inputs:
    """Returns the inputs of the second step, which speaks, with the memory after the first one."""
    state = state_vector(memory, scene.view, scene.utterances)
    for k in range(KEPT):
        state += utterance_vector(scene.utterances[k] if k < len(scene.utterances) else None, scene.view.time)
    text = scene.utterances[0].heard.words.text if scene.heard else ""
    return Inputs(
        state=np.asarray(state, dtype=np.float32),
        words=word_rows(text),
        errands=np.zeros((MAX_ERRANDS, ERRAND_SIZE), dtype=np.float32),
    )
