"""Player of a learned participant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.learned_role.drawing import drawn
from dorothie_gym.baselines.roles.participant.decision import (
    Attention,
    Inputs,
    Scene,
    choosing_inputs,
    perceive,
    speaking_inputs,
)
from dorothie_gym.baselines.roles.participant.examples import MOST_REMARKS
from dorothie_gym.baselines.roles.participant.features import answer_to
from dorothie_gym.baselines.roles.participant.memory import KEEP_TARGET, Choice, Memory
from dorothie_gym.baselines.roles.participant.network import ParticipantNetwork
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
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.participant.reactions import scene_of
from dorothie_gym.policies.policy import Policy, replace
from dorothie_gym.policies.speech import Remark
from dorothie_gym.session.spaces.actions import ActionDict, ParticipantAction, Speech
from dorothie_gym.session.spaces.limits import SpaceLimits
from dorothie_gym.session.spaces.observations import ObservationMapping

TEMPERATURE = 0.5
"""Temperature at which remarks are drawn."""


@dataclass(frozen=True, kw_only=True)
class LearnedState:
    """State of the policy: memory and last utterances."""

    attention: Attention


class LearnedParticipant(Policy[LearnedState]):
    """Participant whose network chooses the next errand, and what to say to the car and when.

    Target and guidance are the likeliest ones. Remarks are drawn: yes only where it is true, no only where it is not,
    and no crowd or weather that is not there. Names, numbers and words of a remark are filled in (see `remarks`).
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
        super().__init__(Role.PARTICIPANT, limits)
        self._network, self._vocabulary = network.eval(), tuple(vocabulary)
        self._yes = np.array([is_yes(form) for form in self._vocabulary])
        self._no = np.array([is_no(form) for form in self._vocabulary])
        self._needs = [frozenset() if not form else sources_of(form) for form in self._vocabulary]

    def initial_state(self, seed: int, town: Town) -> LearnedState:
        """Returns the state before the first observation."""
        return LearnedState(attention=Attention.begin(town, seed))

    def step(self, observation: ObservationMapping, state: LearnedState) -> tuple[ActionDict, LearnedState]:
        """Looks, listens, chooses the errand, and speaks or is silent."""
        scene = perceive(observation, state.attention)
        choice = self.choose(choosing_inputs(scene), scene)
        memory = scene.memory.chosen(choice, scene.view, scene.rng)
        remarks = self.speak(speaking_inputs(scene, memory), scene, memory)
        speech, attention = finished(scene, memory, remarks)
        return ParticipantAction(speech=speech).encode(self.limits), replace(state, attention=attention)

    def choose(self, inputs: Inputs, scene: Scene) -> Choice:
        """Returns the likeliest target, and whether to guide."""
        guides = torch.tensor([float(scene.memory.records.guidance.guiding)])
        with torch.inference_mode():
            state, words, errands = _tensors(inputs)
            count = torch.tensor([len(inputs.numbers)])
            target, guiding = self._network.choose(state, words, errands, count, guides)
        chosen = int(target[0].argmax())
        return Choice(target=inputs.numbers[chosen - 1] if chosen else KEEP_TARGET, guiding=bool(guiding[0] > 0.0))

    def speak(self, inputs: Inputs, scene: Scene, memory: Memory) -> tuple[Remark, ...]:
        """Returns what to say, which is drawn; nothing for silence."""
        with torch.inference_mode():
            state, words, _ = _tensors(inputs)
            scores, hidden = self._network.speak(state, words)
            shares = _shares(scores)
            if scene.rng.random() < shares[0]:
                return ()
            available = sources(memory, scene.view, scene.utterances)
            allowed = np.array([needs <= available.keys() for needs in self._needs])
            if STOP_FORM in self._vocabulary:
                allowed[self._vocabulary.index(STOP_FORM)] = stop_remark(memory) is not None
            if scene.heard and (true := answer_to(memory, scene.view, scene.utterances[0])) is not None:
                allowed &= ~(self._no if true else self._yes)
            allowed[0] = False
            remarks: list[Remark] = []
            while len(remarks) < MOST_REMARKS:
                chosen, said = self._draw(shares * allowed, scene, memory, available, joined=bool(remarks))
                if said is None:
                    break
                remarks.append(said)
                allowed[0], allowed[chosen] = True, False
                shares = _shares(self._network.then(hidden, torch.tensor([chosen])))
        return tuple(remarks)

    def _draw(
        self,
        shares: NDArray[np.float64],
        scene: Scene,
        memory: Memory,
        available: Mapping[str, object],
        *,
        joined: bool,
    ) -> tuple[int, Remark | None]:
        """Returns the number of a form and its remark, drawn among those that are not denied; None for silence."""
        while chosen := drawn(shares, scene.rng):
            form = self._vocabulary[chosen]
            said = stop_remark(memory) if form == STOP_FORM else filled(form, available, joined=joined)
            if said is None or not is_denied(said, scene.view):
                return chosen, said
            shares[chosen] = 0.0
        return 0, None


def finished(scene: Scene, memory: Memory, remarks: Sequence[Remark]) -> tuple[Speech | None, Attention]:
    """Returns the speech of a decision, and the state after it.

    Args:
        scene: what was perceived.
        memory: memory after the choice of the target.
        remarks: what was decided to say.
    """
    view = scene.view
    memory = memory.decided(remarks, view, scene.rng)
    records = memory.records
    context = None if records.speech.idle else scene_of(records, view)
    speech, voice = records.speech.speak(
        view.time,
        view.speaking,
        scene.rng,
        context,
        interval=records.clock.interval,
        other_speaking=view.other_speaking,
    )
    return speech, Attention(memory=memory.spoken(voice, view), utterances=scene.utterances)


def _tensors(inputs: Inputs) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Returns inputs as a batch of one, rounded as in training."""
    state, errands = (array.astype(np.float16).astype(np.float32) for array in (inputs.state, inputs.errands))
    return torch.from_numpy(state)[None], torch.from_numpy(inputs.words)[None], torch.from_numpy(errands)[None]


def _shares(scores: torch.Tensor) -> NDArray[np.float64]:
    """Returns the probabilities of remarks at `TEMPERATURE` (r,) from logits (1, r)."""
    shares: NDArray[np.float64] = torch.softmax(scores[0].double() / TEMPERATURE, dim=0).numpy()
    return shares
