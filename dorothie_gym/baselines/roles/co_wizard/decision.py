"""One decision of the learned Co-Wizard, up to the inputs of the network: the same in training and in play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.roles.co_wizard.answers import QUESTIONS
from dorothie_gym.baselines.roles.co_wizard.features import (
    COMMAND_SIZE,
    MAX_COMMANDS,
    MAX_PLACES,
    PLACE_SIZE,
    STATE,
    car_values,
    place_vectors,
    state_values,
    write_commands,
)
from dorothie_gym.baselines.roles.co_wizard.memory import Update, WorkingMemory
from dorothie_gym.baselines.roles.learned_role.decision import Attention, Inputs, Percept, just_heard, kept_utterances
from dorothie_gym.baselines.roles.learned_role.remark_forms import topic_of
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, UTTERANCE_SIZE, word_rows
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.co_wizard_prompt import drive_options
from dorothie_gym.policies.language_model.navigator import RouteStep
from dorothie_gym.policies.policy import replace

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.spaces.actions import Mental, Physical
    from dorothie_gym.session.spaces.observations import ObservationMapping


@dataclass(frozen=True, kw_only=True)
class CoWizardPercept(Percept[CoWizardView, WorkingMemory]):
    """Perception at a decision."""

    @cached_property
    def car(self) -> list[float]:
        """Fields of the car."""
        return car_values(self.memory, self.view)

    @cached_property
    def _own(self) -> dict[bool, Situation]:
        return {}

    def situation(self, memory: WorkingMemory, *, queued: bool) -> Situation:
        """Returns the next step and the inputs of the network with a memory: that before listening, or after it."""
        if memory is not self.memory:
            return self._situation(memory, queued)
        if queued not in self._own:
            self._own[queued] = self._situation(memory, queued)
        return self._own[queued]

    def _situation(self, memory: WorkingMemory, queued: bool) -> Situation:
        step = memory.navigator.step(memory.town, self.view, memory.clock.interval, 0.0)
        values = [*self.car, *state_values(memory, self.view, step, self.utterances, queued=queued)]
        state = np.zeros(STATE.size + self.talk.size, dtype=np.float32)
        STATE.write(values, self.view.time, state[: STATE.size])
        state[STATE.size :] = self.talk
        return Situation(step, state)


class Situation(NamedTuple):
    """Next step on the route, and state and utterances as inputs (n,)."""

    step: RouteStep | None
    state: NDArray[np.float32]


def perceive(
    observation: ObservationMapping, attention: Attention[WorkingMemory], last: DialogueMove | None
) -> CoWizardPercept:
    """Reads an observation.

    Args:
        observation: observation of the Co-Wizard, with its action mask.
        attention: state before.
        last: last own move, as context of the utterance heard.
    """
    view = CoWizardView.read(observation, attention.memory.town)
    heard = just_heard(observation, Role.PARTICIPANT, last, view.time)
    utterances = kept_utterances(heard, attention.utterances)
    memory = attention.memory.seen(view, heard=heard is not None)
    return CoWizardPercept(view=view, memory=memory, utterances=utterances, heard=heard is not None)


def listening_inputs(percept: CoWizardPercept, *, queued: bool) -> Inputs:
    """Returns the inputs of the first step, which updates the memory."""
    state = percept.situation(percept.memory, queued=queued).state
    if not percept.heard:
        return Inputs(state=state, words=percept.words, options=_NO_PLACES)
    vectors = place_vectors(percept.memory, percept.view, percept.utterances)
    rows = tuple(mark.row for mark in percept.view.landmarks if mark.row < MAX_PLACES)
    return Inputs.of(state, percept.words, vectors, rows, (MAX_PLACES, PLACE_SIZE))


_NO_PLACES: Final = np.zeros((MAX_PLACES, PLACE_SIZE), dtype=np.float32)
_NO_PLACES.flags.writeable = False


def acting_inputs(
    percept: CoWizardPercept, memory: WorkingMemory, *, queued: bool
) -> tuple[Inputs, list[Physical | None]]:
    """Returns the inputs of the second step, which chooses a command and remarks, and the possible commands."""
    step, state = percept.situation(memory, queued=queued)
    commands = list(drive_options(percept.view, memory.town).values())[:MAX_COMMANDS]
    options = np.zeros((MAX_COMMANDS, COMMAND_SIZE), dtype=np.float32)
    write_commands(commands, memory, percept.view, step, options)
    return Inputs(state=state, words=percept.words, options=options, rows=tuple(range(len(commands)))), commands


def blank_inputs() -> Inputs:
    """Returns inputs of the second step without content, with the command "none" as the only one."""
    state = np.zeros(STATE.size + KEPT * UTTERANCE_SIZE, dtype=np.float32)
    return Inputs.of(state, word_rows(""), (), (0,), (MAX_COMMANDS, COMMAND_SIZE))


def remember(percept: CoWizardPercept, update: Update) -> WorkingMemory:
    """Returns the memory after an update."""
    latest = percept.latest
    places, streets = (latest.places, latest.streets) if latest is not None else ((), ())
    distance = None if latest is None else latest.heard.words.distance
    return percept.memory.updated(update, percept.view, places, streets, distance)


def noted(memory: WorkingMemory, remark: Remark, view: CoWizardView) -> WorkingMemory:
    """Returns the memory after an own remark."""
    asks = remark.act.move in QUESTIONS
    way = bool({ActionValue.QUERIED, ActionValue.J_TURN, ActionValue.LANE_FOLLOW} & set(remark.act.values(Slot.ACTION)))
    return memory.spoken(remark, topic_of(remark), view, asks=asks, asks_way=asks and way)


def finished(
    percept: CoWizardPercept, memory: WorkingMemory, physical: Physical | None, remarks: Sequence[Remark]
) -> tuple[Mental | None, Attention[WorkingMemory]]:
    """Returns the belief update to send, and the state after a decision.

    Args:
        percept: perception.
        memory: memory after listening.
        physical: command that is given.
        remarks: chosen remarks.
    """
    for remark in remarks:
        memory = noted(memory, remark, percept.view)
    mental = memory.updates[0] if memory.updates else None
    memory = replace(memory, updates=memory.updates[1:])
    memory = memory.acted(None if physical is None else physical.action, percept.view)
    return mental, Attention(memory=memory, utterances=percept.utterances)
