"""One decision of the learned Co-Wizard, up to what the network is given: the same in training and in play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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
from dorothie_gym.baselines.roles.co_wizard.hearing import KEPT, UTTERANCE_SIZE, Utterance, utterance_vector, word_rows
from dorothie_gym.baselines.roles.co_wizard.memory import Memory, Update
from dorothie_gym.baselines.roles.co_wizard.remarks import topic_of
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.language_model.co_wizard_prompt import drive_options
from dorothie_gym.policies.language_model.navigator import RouteStep
from dorothie_gym.policies.observation_parser import heard_utterance
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark
from dorothie_gym.session.spaces.actions import Mental, Physical
from dorothie_gym.session.spaces.observations import ObservationMapping

Vector = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Attention:
    """State of a player between decisions: its memory, and the last utterances of the participant, latest first."""

    memory: Memory
    utterances: tuple[Utterance, ...] = ()

    @classmethod
    def begin(cls, town: Town) -> Attention:
        """Returns the state before the first decision."""
        return cls(memory=Memory(town=town))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What is perceived at a decision.

    Attributes:
        view: observation.
        memory: memory, brought up to date with it.
        utterances: last utterances of the participant, the latest first.
        heard: whether one has just ended.
    """

    view: CoWizardView
    memory: Memory
    utterances: tuple[Utterance, ...]
    heard: bool

    @property
    def latest(self) -> Utterance | None:
        """The utterance that has just ended."""
        return self.utterances[0] if self.heard else None

    @cached_property
    def car(self) -> list[float]:
        """State of the car as numbers."""
        return car_vector(self.memory, self.view)

    @cached_property
    def talk(self) -> list[float]:
        """Last utterances as numbers."""
        kept = [*self.utterances, *[None] * KEPT][:KEPT]
        return [number for utterance in kept for number in utterance_vector(utterance, self.view.time)]

    @cached_property
    def words(self) -> NDArray[np.int64]:
        """Rows of the words of the utterance that has just ended."""
        return word_rows("" if self.latest is None else self.latest.heard.words.text)


def perceive(observation: ObservationMapping, attention: Attention, last: DialogueMove | None) -> Scene:
    """Reads an observation.

    Args:
        observation: observation of the Co-Wizard, with its action mask.
        attention: state before.
        last: last own move, as context of what is heard.
    """
    view = CoWizardView.read(observation, attention.memory.town)
    heard = heard_utterance(observation, Role.PARTICIPANT, last)
    utterances = attention.utterances
    if heard is not None:
        utterances = (Utterance(time=view.time, heard=heard), *utterances)[:KEPT]
    memory = attention.memory.seen(view, heard=heard is not None)
    return Scene(view=view, memory=memory, utterances=utterances, heard=heard is not None)


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Inputs of one of the two steps of a decision.

    Attributes:
        state: state and utterances (n,).
        words: rows of the words of the latest utterance.
        options: vectors of what is chosen among, places or commands (k, m), filled with 0.
        rows: number of each option: row of the landmark, or index of the command.
    """

    state: Vector
    words: NDArray[np.int64]
    options: Vector
    rows: tuple[int, ...]


def listening_inputs(scene: Scene, *, queued: bool) -> Inputs:
    """Returns the inputs of the first step, which updates the memory."""
    vectors = place_vectors(scene.memory, scene.view, scene.utterances) if scene.heard else []
    rows = tuple(mark.row for mark in scene.view.landmarks if mark.row < MAX_PLACES) if scene.heard else ()
    return _inputs(scene, scene.memory, vectors, rows, MAX_PLACES, queued, _step(scene, scene.memory))


def acting_inputs(scene: Scene, memory: Memory, *, queued: bool) -> tuple[Inputs, list[Physical | None]]:
    """Returns the inputs of the second step, which chooses a command and remarks, and the possible commands."""
    step = _step(scene, memory)
    commands = list(drive_options(scene.view, memory.town).values())[:MAX_COMMANDS]
    vectors = command_vectors(commands, memory, scene.view, step)
    return _inputs(scene, memory, vectors, tuple(range(len(commands))), MAX_COMMANDS, queued, step), commands


def blank_inputs() -> Inputs:
    """Returns inputs of the second step without content, with the command "none" as the only one."""
    return Inputs(
        state=np.zeros(STATE_SIZE + KEPT * UTTERANCE_SIZE, dtype=np.float32),
        words=word_rows(""),
        options=np.zeros((MAX_COMMANDS, COMMAND_SIZE), dtype=np.float32),
        rows=(0,),
    )


def _step(scene: Scene, memory: Memory) -> RouteStep | None:
    return memory.navigator.step(memory.town, scene.view, memory.clock.interval, 0.0)


def _inputs(
    scene: Scene,
    memory: Memory,
    vectors: list[list[float]],
    rows: tuple[int, ...],
    most: int,
    queued: bool,
    step: RouteStep | None,
) -> Inputs:
    state = [*scene.car, *state_vector(memory, scene.view, step, scene.utterances, queued=queued), *scene.talk]
    options = np.zeros((most, PLACE_SIZE if most == MAX_PLACES else COMMAND_SIZE), dtype=np.float32)
    if vectors:
        options[: len(vectors)] = vectors
    return Inputs(state=np.asarray(state, dtype=np.float32), words=scene.words, options=options, rows=rows)


def remember(scene: Scene, update: Update) -> Memory:
    """Returns the memory after an update."""
    latest = scene.latest
    places, streets = (latest.places, latest.streets) if latest is not None else ((), ())
    distance = None if latest is None else latest.heard.words.distance
    return scene.memory.updated(update, scene.view, places, streets, distance)


def noted(memory: Memory, remark: Remark, view: CoWizardView) -> Memory:
    """Returns the memory after an own remark."""
    asks = remark.act.move in QUESTIONS
    way = bool({ActionValue.QUERIED, ActionValue.J_TURN, ActionValue.LANE_FOLLOW} & set(remark.act.values(Slot.ACTION)))
    return memory.spoken(remark, topic_of(remark), view, asks=asks, asks_way=asks and way)


def finished(
    scene: Scene, memory: Memory, physical: Physical | None, remarks: Sequence[Remark]
) -> tuple[Mental | None, Attention]:
    """Returns the belief update to send, and the state after a decision.

    Args:
        scene: what was perceived.
        memory: memory after listening.
        physical: command that is given.
        remarks: what was decided to say.
    """
    for remark in remarks:
        memory = noted(memory, remark, scene.view)
    mental = memory.updates[0] if memory.updates else None
    memory = replace(memory, updates=memory.updates[1:])
    memory = memory.acted(None if physical is None else physical.action, scene.view)
    return mental, Attention(memory=memory, utterances=scene.utterances)
