"""Player of the learned Co-Wizard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import torch
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.co_wizard.answers import is_sayable
from dorothie_gym.baselines.roles.co_wizard.decision import (
    CoWizardPercept,
    acting_inputs,
    finished,
    listening_inputs,
    perceive,
    remember,
)
from dorothie_gym.baselines.roles.co_wizard.memory import GoalEvent, Update, WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.network import SIZES, CoWizardNetwork
from dorothie_gym.baselines.roles.co_wizard.remarks import sources
from dorothie_gym.baselines.roles.learned_role.decision import Attention, Inputs
from dorothie_gym.baselines.roles.learned_role.policy import LearnedPolicy, drawn, shares_of
from dorothie_gym.baselines.roles.learned_role.remark_forms import Sources, filled, sources_of, topic_of
from dorothie_gym.dialogue.realization_context import WordingContext
from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.policies.observation_parser import nearest_landmark, street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, SpeechState
from dorothie_gym.session.spaces.actions import CoWizardAction

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

TEMPERATURE: Final = 0.7
"""Temperature at which remarks are drawn."""

KEPT_BONUS: Final = 2.0
"""Added to the logit of each current value of the memory if no utterance has just been heard.

A change that was missed is made up for at the next decision; one for no reason stays. In the second round of a
training, 2 reduced the latter from 635 to 214, while 166 instead of 87 of 472 changes came later.
"""

MAX_DRAWS: Final = 8
"""Number of remarks that are drawn until one is sayable; then there is silence."""


@dataclass(frozen=True, kw_only=True)
class LearnedState:
    """State of the policy.

    Attributes:
        seed: seed of the draws.
        attention: memory and last utterances.
        voice: its remarks, queued and said.
        count: number of decisions.
    """

    seed: int
    attention: Attention[WorkingMemory]
    voice: SpeechState
    count: int = 0


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Decision of the player.

    Attributes:
        percept: perception.
        memory: memory after listening.
        action: the action.
        remarks: chosen remarks.
        queued: whether its remarks waited before.
        silent: whether no new remark was possible.
        state: state after the decision.
    """

    percept: CoWizardPercept
    memory: WorkingMemory
    action: CoWizardAction
    remarks: tuple[Remark, ...]
    queued: bool
    silent: bool
    state: LearnedState


class LearnedCoWizard(LearnedPolicy[LearnedState, CoWizardNetwork]):
    """Co-Wizard whose memory, goal, commands and remarks are decided by a network.

    Memory and commands are the most likely ones; remarks are drawn. Names, numbers and words of a remark are filled in
    (see `remarks`); belief updates say how the memory has changed.
    """

    reads_mask = True

    def __init__(self, network: CoWizardNetwork, vocabulary: Sequence[str], limits: SpaceLimits | None = None) -> None:
        """Prepares the policy.

        Args:
            network: trained network.
            vocabulary: forms of remarks; the first one stands for silence.
            limits: sizes of the spaces.
        """
        super().__init__(Role.CO_WIZARD, network, vocabulary, limits, sources_of)

    def initial_state(self, seed: int, town: Town) -> LearnedState:
        """Returns the state before the first observation."""
        style = draw_style(Role.CO_WIZARD, np.random.default_rng((seed, 0)))
        return LearnedState(
            seed=seed,
            attention=Attention(memory=WorkingMemory(town=town)),
            voice=SpeechState(role=Role.CO_WIZARD, style=style),
        )

    def act(self, observation: ObservationMapping, state: LearnedState) -> tuple[CoWizardAction, LearnedState]:
        """Updates the memory, and chooses a command and remarks."""
        turn = self.play(observation, state)
        return turn.action, turn.state

    def play(self, observation: ObservationMapping, state: LearnedState, *, silent: bool = False) -> Turn:
        """Takes a decision; returns all that it consists of.

        Args:
            observation: observation of the Co-Wizard, with its action mask.
            state: state before.
            silent: whether the Co-Wizard must stay silent.
        """
        rng = np.random.default_rng((state.seed, state.count))
        voice = state.voice
        percept = perceive(observation, state.attention, None if voice.last is None else voice.last.act.move)
        view, queued = percept.view, not voice.idle
        if percept.latest is not None:
            late = percept.memory.clock.interval / 2.0
            voice = voice.heard_other(view.time, percept.latest.heard.acts, rng, late).cleared()
        silent = silent or not voice.idle
        with torch.inference_mode():
            memory = remember(percept, self._listen(percept, listening_inputs(percept, queued=queued)))
            inputs, commands = acting_inputs(percept, memory, queued=queued)
            command, remarks = self._act(percept, memory, inputs, rng, silent=silent)
        physical = commands[command]
        voice = voice.plan(*remarks)
        speech, voice = voice.speak(
            view.time,
            view.speaking,
            rng,
            _wording_context(view, memory),
            interval=memory.clock.interval,
            other_speaking=view.other_speaking,
        )
        mental, attention = finished(percept, memory, physical, remarks)
        action = CoWizardAction(speech=speech, physical=physical, mental=mental)
        return Turn(
            percept=percept,
            memory=memory,
            action=action,
            remarks=remarks,
            queued=queued,
            silent=silent,
            state=replace(state, attention=attention, voice=voice, count=state.count + 1),
        )

    def _listen(self, percept: CoWizardPercept, inputs: Inputs) -> Update:
        """Returns the most likely update of the memory."""
        state, words, places, count = inputs.tensors()
        before = torch.tensor([percept.memory.values])
        heard = self._network.listen(state, words, places, count, before)
        goal = int(heard.goal[0].argmax())
        starts, logits = np.cumsum((0, *SIZES[:-1])), torch.cat(heard.values, dim=1)[0].numpy()
        if not percept.heard:
            logits[starts + percept.memory.values] += KEPT_BONUS
        if goal >= len(GoalEvent):
            goal = len(GoalEvent) + inputs.rows[goal - len(GoalEvent)]
        return Update(
            values=tuple(int(part.argmax()) for part in np.split(logits, starts[1:])),
            fresh=tuple(flag > 0.0 for flag in heard.fresh[0].tolist()),
            goal=goal,
            status=int(heard.status[0].argmax()),
        )

    def _act(
        self, percept: CoWizardPercept, memory: WorkingMemory, inputs: Inputs, rng: np.random.Generator, *, silent: bool
    ) -> tuple[int, tuple[Remark, ...]]:
        """Returns the index of the most likely command, and the remarks that are drawn."""
        scores, first, hidden = self._network.act(*inputs.tensors())
        command = int(scores[0].argmax())
        if silent:
            return command, ()
        shares = shares_of(first, TEMPERATURE)
        if rng.random() < shares[0]:
            return command, ()
        available = sources(memory, percept.view, percept.utterances)
        possible = self._fillable(available)
        possible[0] = False
        shares *= possible
        chosen, remark = self._draw(shares, percept, memory, available, rng)
        if remark is None:
            return command, ()
        possible[0] = True
        shares = shares_of(self._network.then(hidden, torch.tensor([chosen])), TEMPERATURE) * possible
        _, more = self._draw(shares, percept, memory, available, rng, joined=True)
        return command, (remark,) if more is None else (remark, more)

    def _draw(
        self,
        shares: NDArray[np.float64],
        percept: CoWizardPercept,
        memory: WorkingMemory,
        available: Sources,
        rng: np.random.Generator,
        *,
        joined: bool = False,
    ) -> tuple[int, Remark | None]:
        """Returns the number of a form and its remark, drawn among those that are sayable; None for silence."""
        latest, answer = percept.utterances[0] if percept.utterances else None, available.get("answer")
        answer = answer if isinstance(answer, Remark) else None
        for _ in range(MAX_DRAWS):
            chosen = drawn(shares, rng)
            remark = filled(self._vocabulary[chosen], available, joined=joined) if chosen else None
            if remark is None or is_sayable(remark, topic_of(remark), memory, percept.view, latest, answer):
                return chosen, remark
            shares[chosen] = 0.0
        return 0, None


def _wording_context(view: CoWizardView, memory: WorkingMemory) -> WordingContext:
    """Returns the possible referents of the words."""
    near = nearest_landmark(view.raw, view.landmarks, *view.position)
    street = street_of(view.raw, memory.town, view.lane)
    return WordingContext(
        street=None if street is StreetName.UNKNOWN else street,
        landmark=None if near is None or near.name is LandmarkName.UNKNOWN else near.name,
        exception=bool(memory.value("detour")),
    )
