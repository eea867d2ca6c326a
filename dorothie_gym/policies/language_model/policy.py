"""Policy that asks a language model: event-driven calls, and the effects of their answers."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.errors import EndpointError
from dorothie_gym.policies.language_model.chat_endpoint import KEY_VARIABLE
from dorothie_gym.policies.language_model.config import LanguageModelConfig, SimulatedTime
from dorothie_gym.policies.language_model.faults import REJECTIONS
from dorothie_gym.policies.language_model.language_model import LanguageModel, Prompt
from dorothie_gym.policies.language_model.picture import picture_address
from dorothie_gym.policies.language_model.turns import RoleTurns, TurnState
from dorothie_gym.policies.language_model.usage import ModelUsage
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.policy import Policy, replace

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.policies.language_model.cassette import Reply
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.fields import SpaceLimits
    from dorothie_gym.session.spaces.observations import ObservationMapping

_LOG = logging.getLogger(__name__)

REJECTED_CALLS: Final = 3
"""Number of rejected calls at the beginning of a session that end it: none of the later ones would be answered."""

_LARGEST_SEED: Final = 2**31
"""Bound of the seeds of sampling: endpoints take signed numbers of 32 bits."""


@dataclass(frozen=True, kw_only=True)
class LanguageModelState:
    """State of the policy.

    Attributes:
        seed: seed of the role in the session.
        turns: state of the turns.
        usage: usage of the model so far, without the expired actions.
    """

    seed: int
    turns: TurnState
    usage: ModelUsage


class LanguageModelPolicy(Policy[LanguageModelState]):
    """Plays a role by calling a language model after events.

    A call without an answer, for any reason, becomes a silent action with a name (`Fault`): the role continues as
    before, and the model is called again at the next event. With equal replies, as from a cassette, equal sessions
    follow.
    """

    reads_mask = True
    reads_refusals = True

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
        self._turns = RoleTurns(role, self.limits, config.quiet_time)
        self._model = LanguageModel(config) if model is None else model

    def initial_state(self, seed: int, town: Town) -> LanguageModelState:
        """Returns the state before the first call."""
        return LanguageModelState(seed=seed, turns=self._turns.begin(town), usage=ModelUsage(model=self._config.model))

    def usage_of(self, state: LanguageModelState) -> Mapping[str, object]:
        """Returns the usage of the model in a session."""
        return dict(replace(state.usage, expired=state.turns.expired).to_json())

    def step(self, observation: ObservationMapping, state: LanguageModelState) -> tuple[ActionDict, LanguageModelState]:
        """Processes the observation, calls the model after an event, and acts on its last answer.

        Raises:
            EndpointError: the endpoint has rejected the first calls of the session.
        """
        state = replace(state, turns=self._turns.attend(observation, state.turns))
        if self._turns.is_due(observation, state.turns):
            state = self._ask(observation, state)
        action, turns = self._turns.act(observation, state.turns)
        return action, replace(state, turns=turns)

    def _ask(self, observation: ObservationMapping, state: LanguageModelState) -> LanguageModelState:
        """Makes a call; its answer takes effect at once, or after the time that the call took."""
        text, schema = self._turns.page(observation, state.turns)
        prompt = Prompt(
            system=self._turns.system,
            text=text,
            schema=schema,
            picture=picture_address(observation) if self._config.pictures else "",
            seed=(state.seed + state.usage.calls) % _LARGEST_SEED,
        )
        reply = self._model.ask(prompt)
        usage = state.usage.with_call(reply, self._config.prices)
        if reply.answer is None:
            _check_beginning(usage, reply)
            now = scalar(observation, "time")
            _LOG.info("%s at %.1f s: silent action (%s): %s", self.role, now, reply.fault, reply.reason)
        answer = None if reply.answer is None else schema.read(reply.answer)
        charged = reply.latency if self._config.time is SimulatedTime.CHARGED else 0.0
        return replace(state, turns=self._turns.answered(observation, state.turns, answer, charged), usage=usage)


def _check_beginning(usage: ModelUsage, reply: Reply) -> None:
    """Raises `EndpointError` if the endpoint has rejected the first calls of a session."""
    if usage.calls == REJECTED_CALLS and sum(usage.silences.get(str(fault), 0) for fault in REJECTIONS) == usage.calls:
        raise EndpointError(
            f"llm:{usage.model}: the first {usage.calls} calls of a session were rejected ({reply.fault}: "
            f"{reply.reason}); check --llm-url, the name of the model, the key in {KEY_VARIABLE}, and --llm-parameters"
        )
