"""Policy that asks a language model: event-driven calls, and the effects of their answers."""

from __future__ import annotations

import base64
import io
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dorothie_gym.errors import EndpointError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.language_model.ad_wizard import AdWizardInterface
from dorothie_gym.policies.language_model.chat_endpoint import KEY_VARIABLE
from dorothie_gym.policies.language_model.co_wizard import CoWizardInterface
from dorothie_gym.policies.language_model.config import LanguageModelConfig, SimulatedTime
from dorothie_gym.policies.language_model.faults import REJECTIONS
from dorothie_gym.policies.language_model.language_model import LanguageModel, Prompt
from dorothie_gym.policies.language_model.participant import ParticipantInterface
from dorothie_gym.policies.language_model.role_interface import Memory, RoleInterface
from dorothie_gym.policies.language_model.usage import ModelUsage
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.policy import Policy, replace

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.language_model.cassette import Reply
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

_LOG = logging.getLogger(__name__)

_INTERFACES: Final[Mapping[Role, type[RoleInterface[Any]]]] = {
    Role.PARTICIPANT: ParticipantInterface,
    Role.CO_WIZARD: CoWizardInterface,
    Role.AD_WIZARD: AdWizardInterface,
}

REJECTED_CALLS: Final = 3
"""Number of rejected calls at the beginning of a session that end it: none of the later ones would be answered."""

_LARGEST_SEED: Final = 2**31
"""Bound of the seeds of sampling: endpoints take signed numbers of 32 bits."""


@dataclass(frozen=True, kw_only=True)
class PendingAnswer:
    """Answer that takes effect at a time [s]."""

    ready_at: float
    answer: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class LanguageModelState:
    """State of the policy.

    Attributes:
        seed: seed of the role in the session.
        memory: memory of the role.
        usage: usage of the model so far.
        events: events since the last call, in words.
        asked_at: time of the last call [s]; None before the first.
        delay: simulated time that the last answer took [s].
        busy_until: time until which the model is occupied with a call [s].
        pending: answer that has not taken effect yet.
    """

    seed: int
    memory: Memory
    usage: ModelUsage
    events: tuple[str, ...] = ()
    asked_at: float | None = None
    delay: float = 0.0
    busy_until: float = 0.0
    pending: PendingAnswer | None = None


class LanguageModelPolicy(Policy[LanguageModelState]):
    """Plays a role by calling a language model after events.

    A call without an answer, for any reason, becomes a silent action with a name (`Fault`): the role continues as
    before, and the model is called again at the next event. With equal replies, as from a cassette, equal sessions
    follow.
    """

    reads_mask = True

    def __init__(
        self,
        role: Role,
        config: LanguageModelConfig,
        limits: SpaceLimits | None = None,
        model: LanguageModel | None = None,
    ) -> None:
        """Prepares the policy.

        Args:
            role: role of the policy.
            config: settings.
            limits: sizes of the spaces.
            model: the model; None for the endpoint of the settings.

        Raises:
            PolicyLoadError: httpx is not installed, or the cassette cannot be read.
        """
        super().__init__(role, limits)
        self._config = config
        self._interface = _INTERFACES[role](self.limits)
        self._model = LanguageModel(config) if model is None else model

    def initial_state(self, seed: int, town: Town) -> LanguageModelState:
        """Returns the state before the first call."""
        return LanguageModelState(
            seed=seed, memory=self._interface.begin(town), usage=ModelUsage(model=self._config.model)
        )

    def usage_of(self, state: LanguageModelState) -> Mapping[str, object]:
        """Returns the usage of the model in a session."""
        return dict(state.usage.to_json())

    def step(self, observation: ObservationMapping, state: LanguageModelState) -> tuple[ActionDict, LanguageModelState]:
        """Processes the observation, calls the model after an event, and acts on its last answer.

        Raises:
            EndpointError: the endpoint has rejected the first calls of the session.
        """
        now = scalar(observation, "time")
        memory, events = self._interface.attend(observation, state.memory, state.delay)
        state = replace(state, memory=memory, events=(*state.events, *events))
        if state.pending is not None and now >= state.pending.ready_at:
            state = self._accept(observation, replace(state, pending=None), state.pending.answer)
        if state.pending is None and now >= state.busy_until and self._is_time(state, now):
            state = self._ask(observation, state, now)
        action, memory, expired = self._interface.act(observation, state.memory)
        return action, _with_expired(replace(state, memory=memory), expired)

    def _is_time(self, state: LanguageModelState, now: float) -> bool:
        if state.events or state.asked_at is None:
            return True
        return now >= min(state.asked_at + self._interface.patience * self._config.quiet_time, state.memory.again_at)

    def _ask(self, observation: ObservationMapping, state: LanguageModelState, now: float) -> LanguageModelState:
        """Makes a call; its answer takes effect at once, or after the time that the call took."""
        beginning = "The session begins." if state.asked_at is None else "Nothing new."
        text, schema = self._interface.prompt(observation, state.memory, state.events or (beginning,))
        prompt = Prompt(
            system=self._interface.system,
            text=text,
            schema=schema,
            picture=_picture(observation) if self._config.pictures else "",
            seed=(state.seed + state.usage.calls) % _LARGEST_SEED,
        )
        reply = self._model.ask(prompt)
        charged = reply.latency if self._config.time is SimulatedTime.CHARGED else 0.0
        memory = replace(state.memory, again_at=np.inf)
        state = replace(
            state,
            memory=memory,
            usage=state.usage.with_call(reply, self._config.prices),
            events=(),
            asked_at=now,
            delay=charged,
            busy_until=now + charged,
        )
        if reply.answer is None:
            _check_beginning(state.usage, reply)
            _LOG.info("%s at %.1f s: silent action (%s): %s", self.role, now, reply.fault, reply.reason)
            return state
        answer = schema.read(reply.answer)
        if charged:
            return replace(state, pending=PendingAnswer(ready_at=now + charged, answer=answer))
        return self._accept(observation, state, answer)

    def _accept(
        self, observation: ObservationMapping, state: LanguageModelState, answer: Mapping[str, str]
    ) -> LanguageModelState:
        memory, expired = self._interface.accept(observation, state.memory, answer)
        return _with_expired(replace(state, memory=memory), expired)


def _check_beginning(usage: ModelUsage, reply: Reply) -> None:
    """Raises `EndpointError` if the endpoint has rejected the first calls of a session."""
    if usage.calls == REJECTED_CALLS and sum(usage.silences.get(str(fault), 0) for fault in REJECTIONS) == usage.calls:
        raise EndpointError(
            f"llm:{usage.model}: the first {usage.calls} calls of a session were rejected ({reply.fault}: "
            f"{reply.reason}); check --llm-url, the name of the model, the key in {KEY_VARIABLE}, and --llm-parameters"
        )


def _with_expired(state: LanguageModelState, expired: int) -> LanguageModelState:
    if not expired:
        return state
    return replace(state, usage=replace(state.usage, expired=state.usage.expired + expired))


def _picture(observation: ObservationMapping) -> str:
    """Returns the picture of the camera as an address with its PNG; empty for a role without a camera."""
    pixels = observation.get("camera")
    if pixels is None:
        return ""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(buffer, format="PNG")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
