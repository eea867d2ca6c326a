"""Player of a learned participant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.learned_role.decision import Attention, InputBatch, Inputs
from dorothie_gym.baselines.roles.learned_role.inference import shares_of
from dorothie_gym.baselines.roles.learned_role.policy import LearnedPolicy, drawn
from dorothie_gym.baselines.roles.participant.decision import (
    ParticipantPercept,
    choosing_inputs,
    perceive,
    speaking_inputs,
)
from dorothie_gym.baselines.roles.participant.examples import MOST_REMARKS
from dorothie_gym.baselines.roles.participant.features import answer_to
from dorothie_gym.baselines.roles.participant.memory import KEEP_TARGET, SessionMemory, TargetChoice
from dorothie_gym.baselines.roles.participant.network import ParticipantInference, ParticipantNetwork
from dorothie_gym.baselines.roles.participant.observed_truth import is_denied
from dorothie_gym.baselines.roles.participant.remarks import (
    STOP_FORM,
    filled,
    is_no,
    is_yes,
    sources,
    sources_of,
    stop_remark,
)
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.participant.unprompted_remarks import scene_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.session.spaces.actions import ParticipantAction, Speech

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

TEMPERATURE: Final = 0.5
"""Temperature at which remarks are drawn."""


@dataclass(frozen=True, kw_only=True)
class LearnedState:
    """State of the policy: memory and last utterances."""

    attention: Attention[SessionMemory]


class LearnedParticipant(LearnedPolicy[LearnedState, ParticipantNetwork]):
    """Participant whose network chooses the next errand, and the content and time of remarks to the car.

    The most likely target and guidance are chosen. Remarks are sampled: yes only if it is true, no only if it is not,
    and no crowd or weather that is not observed. Names, numbers and words of a remark are filled in (see `remarks`).
    """

    def __init__(
        self, network: ParticipantNetwork, vocabulary: Sequence[str], limits: SpaceLimits | None = None
    ) -> None:
        """Prepares the policy.

        Args:
            network: trained network.
            vocabulary: forms of remarks; the first one stands for silence.
            limits: sizes of the spaces.
        """
        super().__init__(Role.PARTICIPANT, network, vocabulary, limits, sources_of)
        self._inference = ParticipantInference(network)
        self._yes = np.array([is_yes(form) for form in self._vocabulary])
        self._no = np.array([is_no(form) for form in self._vocabulary])

    def initial_state(self, seed: int, town: Town) -> LearnedState:
        """Returns the state before the first observation."""
        return LearnedState(attention=Attention(memory=SessionMemory.begin(town, seed)))

    def act_all(
        self, observations: Sequence[ObservationMapping], states: Sequence[LearnedState]
    ) -> list[tuple[ParticipantAction, LearnedState]]:
        """Chooses a typed action for each session, with one forward pass for all; see `BatchPolicy.act_all`."""
        percepts = [perceive(seen, state.attention) for seen, state in zip(observations, states, strict=True)]
        choices = self._choose_all([choosing_inputs(percept) for percept in percepts], percepts)
        memories = [
            percept.memory.chosen(choice, percept.view, percept.rng)
            for percept, choice in zip(percepts, choices, strict=True)
        ]
        inputs = [speaking_inputs(percept, memory) for percept, memory in zip(percepts, memories, strict=True)]
        scores, hidden = self._inference.speak(InputBatch.of(inputs))
        found = []
        for number, (percept, memory, state) in enumerate(zip(percepts, memories, states, strict=True)):
            remarks = self._talk(scores[number], hidden[number : number + 1], percept, memory)
            speech, attention = finished(percept, memory, remarks)
            found.append((ParticipantAction(speech=speech), replace(state, attention=attention)))
        return found

    def choose(self, inputs: Inputs, percept: ParticipantPercept) -> TargetChoice:
        """Returns the most likely target, and whether to guide."""
        return self._choose_all([inputs], [percept])[0]

    def _choose_all(self, inputs: Sequence[Inputs], percepts: Sequence[ParticipantPercept]) -> list[TargetChoice]:
        guides = [percept.memory.records.guidance.guiding for percept in percepts]
        targets, guiding = self._inference.choose(InputBatch.of(inputs), guides)
        return [
            TargetChoice(target=own.rows[chosen - 1] if chosen else KEEP_TARGET, guiding=bool(guide > 0.0))
            for own, chosen, guide in zip(inputs, targets.argmax(axis=1).tolist(), guiding.tolist(), strict=True)
        ]

    def speak(self, inputs: Inputs, percept: ParticipantPercept, memory: SessionMemory) -> tuple[Remark, ...]:
        """Returns sampled remarks; none for silence."""
        scores, hidden = self._inference.speak(InputBatch.of([inputs]))
        return self._talk(scores[0], hidden, percept, memory)

    def _talk(
        self,
        scores: NDArray[np.float32],
        hidden: NDArray[np.float32],
        percept: ParticipantPercept,
        memory: SessionMemory,
    ) -> tuple[Remark, ...]:
        """Returns sampled remarks, from the logits of the first one (r,) and the hidden layer (1, h)."""
        shares = shares_of(scores, TEMPERATURE)
        if percept.rng.random() < shares[0]:
            return ()
        available = sources(memory, percept.view, percept.utterances)
        allowed = self._fillable(available)
        if STOP_FORM in self._vocabulary:
            allowed[self._vocabulary.index(STOP_FORM)] = stop_remark(memory) is not None
        if percept.heard and (true := answer_to(memory, percept.view, percept.utterances[0])) is not None:
            allowed &= ~(self._no if true else self._yes)
        allowed[0] = False
        remarks: list[Remark] = []
        while len(remarks) < MOST_REMARKS:
            chosen, said = self._draw(shares * allowed, percept, memory, available, joined=bool(remarks))
            if said is None:
                break
            remarks.append(said)
            allowed[0], allowed[chosen] = True, False
            shares = shares_of(self._inference.then(hidden, [chosen])[0], TEMPERATURE)
        return tuple(remarks)

    def _draw(
        self,
        shares: NDArray[np.float64],
        percept: ParticipantPercept,
        memory: SessionMemory,
        available: Mapping[str, object],
        *,
        joined: bool,
    ) -> tuple[int, Remark | None]:
        """Returns the number of a form and its remark, drawn among those that are not denied; None for silence."""
        while chosen := drawn(shares, percept.rng):
            form = self._vocabulary[chosen]
            said = stop_remark(memory) if form == STOP_FORM else filled(form, available, joined=joined)
            if said is None or not is_denied(said, percept.view):
                return chosen, said
            shares[chosen] = 0.0
        return 0, None


def finished(
    percept: ParticipantPercept, memory: SessionMemory, remarks: Sequence[Remark]
) -> tuple[Speech | None, Attention[SessionMemory]]:
    """Returns the speech of a decision, and the state after it.

    Args:
        percept: perception.
        memory: memory after the choice of the target.
        remarks: chosen remarks.
    """
    view = percept.view
    memory = memory.decided(remarks, view, percept.rng)
    records = memory.records
    context = None if records.speech.idle else scene_of(records, view)
    speech, voice = records.speech.speak(
        view.time,
        view.speaking,
        percept.rng,
        context,
        interval=records.clock.interval,
        other_speaking=view.other_speaking,
    )
    return speech, Attention(memory=memory.spoken(voice, view), utterances=percept.utterances)
