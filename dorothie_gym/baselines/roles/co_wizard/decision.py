"""One decision of the learned Co-Wizard, up to the inputs of the network: the same in training and in play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from dorothie_gym.baselines.roles.co_wizard.answers import QUESTIONS
from dorothie_gym.baselines.roles.co_wizard.features import (
    COMMAND_SIZE,
    MAX_COMMANDS,
    MAX_PLACES,
    PLACE_SIZE,
    STATE_SIZE,
    car_vector,
    command_vectors,
    place_vectors,
    state_vector,
)
from dorothie_gym.baselines.roles.co_wizard.memory import Update, WorkingMemory
from dorothie_gym.baselines.roles.learned_role.decision import Attention, Inputs, Percept, just_heard, kept_utterances
from dorothie_gym.baselines.roles.learned_role.hearing import KEPT, UTTERANCE_SIZE, word_rows
from dorothie_gym.baselines.roles.learned_role.remark_forms import topic_of
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.co_wizard_prompt import drive_options
from dorothie_gym.policies.policy import replace

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.policies.language_model.navigator import RouteStep
    from dorothie_gym.policies.speech import Remark
    from dorothie_gym.session.spaces.actions import Mental, Physical
    from dorothie_gym.session.spaces.observations import ObservationMapping


@dataclass(frozen=True, kw_only=True)
class CoWizardPercept(Percept[CoWizardView, WorkingMemory]):
    """Perception at a decision."""

    @cached_property
    def car(self) -> list[float]:
        """State of the car as numbers."""
        return car_vector(self.memory, self.view)


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
    vectors = place_vectors(percept.memory, percept.view, percept.utterances) if percept.heard else []
    rows = tuple(mark.row for mark in percept.view.landmarks if mark.row < MAX_PLACES) if percept.heard else ()
    return _inputs(
        percept, percept.memory, vectors, rows, (MAX_PLACES, PLACE_SIZE), queued, _step(percept, percept.memory)
    )


def acting_inputs(
    percept: CoWizardPercept, memory: WorkingMemory, *, queued: bool
) -> tuple[Inputs, list[Physical | None]]:
    """Returns the inputs of the second step, which chooses a command and remarks, and the possible commands."""
    step = _step(percept, memory)
    commands = list(drive_options(percept.view, memory.town).values())[:MAX_COMMANDS]
    vectors = command_vectors(commands, memory, percept.view, step)
    return _inputs(
        percept, memory, vectors, tuple(range(len(commands))), (MAX_COMMANDS, COMMAND_SIZE), queued, step
    ), commands


def blank_inputs() -> Inputs:
    """Returns inputs of the second step without content, with the command "none" as the only one."""
    state = [0.0] * (STATE_SIZE + KEPT * UTTERANCE_SIZE)
    return Inputs.of(state, word_rows(""), (), (0,), (MAX_COMMANDS, COMMAND_SIZE))


def _step(percept: CoWizardPercept, memory: WorkingMemory) -> RouteStep | None:
    return memory.navigator.step(memory.town, percept.view, memory.clock.interval, 0.0)


def _inputs(
    percept: CoWizardPercept,
    memory: WorkingMemory,
    vectors: list[list[float]],
    rows: tuple[int, ...],
    shape: tuple[int, int],
    queued: bool,
    step: RouteStep | None,
) -> Inputs:
    state = [*percept.car, *state_vector(memory, percept.view, step, percept.utterances, queued=queued), *percept.talk]
    return Inputs.of(state, percept.words, vectors, rows, shape)


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
