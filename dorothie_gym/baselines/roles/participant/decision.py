"""One decision of the learned participant, up to the inputs of the network: the same in training and in play."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.baselines.roles.learned_role.decision import Attention, Inputs, Percept, just_heard, kept_utterances
from dorothie_gym.baselines.roles.participant.features import ERRAND_SIZE, MAX_ERRANDS, errand_vectors, state_vector
from dorothie_gym.baselines.roles.participant.memory import SessionMemory
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.participant.view import ParticipantView

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.observations import ObservationMapping


@dataclass(frozen=True, kw_only=True)
class ParticipantPercept(Percept[ParticipantView, SessionMemory]):
    """Perception at a decision.

    Attributes:
        rng: random generator of the decision.
    """

    rng: np.random.Generator

    @property
    def considers_errands(self) -> bool:
        """Returns whether the target is chosen now: there is none, or something was heard."""
        return self.heard or self.memory.records.task.target is None or bool(self._news)

    @property
    def _news(self) -> list[float]:
        return [at for _, at, _ in self.memory.events if at >= self.view.time]


def perceive(observation: ObservationMapping, attention: Attention[SessionMemory]) -> ParticipantPercept:
    """Reads an observation of the participant."""
    before = attention.memory
    view = ParticipantView.read(observation, before.records.town)
    memory, view = before.looking(view)
    rng = np.random.default_rng((memory.records.seed, memory.records.count))
    last = memory.records.speech.last
    heard = just_heard(observation, Role.CO_WIZARD, None if last is None else last.act.move, view.time)
    utterances = kept_utterances(heard, attention.utterances)
    if heard is not None:
        memory = memory.hearing(heard.heard, view, rng)
    return ParticipantPercept(view=view, memory=memory, utterances=utterances, heard=heard is not None, rng=rng)


def choosing_inputs(percept: ParticipantPercept) -> Inputs:
    """Returns the inputs of the first step, which chooses the target."""
    vectors: list[list[float]] = []
    numbers: tuple[int, ...] = ()
    if percept.considers_errands:
        vectors, numbers = errand_vectors(percept.memory, percept.view, percept.utterances)
    return _inputs(percept, percept.memory, vectors, numbers)


def speaking_inputs(percept: ParticipantPercept, memory: SessionMemory) -> Inputs:
    """Returns the inputs of the second step, which speaks, with the memory after the first one."""
    return _inputs(percept, memory, [], ())


def _inputs(
    percept: ParticipantPercept, memory: SessionMemory, vectors: list[list[float]], numbers: tuple[int, ...]
) -> Inputs:
    own = np.array(state_vector(memory, percept.view, percept.utterances), dtype=np.float32)
    state = np.concatenate([own, percept.talk])
    return Inputs.of(state, percept.words, vectors, numbers, (MAX_ERRANDS, ERRAND_SIZE))
