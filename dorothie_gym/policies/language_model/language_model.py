"""A language model that answers prompts: request, attempts within a deadline, cassette."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema
from dorothie_gym.policies.language_model.cassette import Cassette, Reply
from dorothie_gym.policies.language_model.chat_endpoint import (
    ChatEndpoint,
    IncompleteError,
    RefusedParameterError,
    Tokens,
    httpx_module,
)
from dorothie_gym.policies.language_model.faults import ABOUT_THE_ANSWER, WORTH_REPEATING, CallError
from dorothie_gym.policies.language_model.request_parameters import SHARED, with_parameters, without_parameter
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.policies.language_model.config import LanguageModelConfig

_LEAST_TIME: Final = 0.05
"""Time below which no further attempt is made [s]."""


@dataclass(frozen=True, kw_only=True)
class Prompt:
    """Prompt for one answer.

    Attributes:
        system: role of the model and meanings of the answer's fields; the same in all calls of a role.
        text: current observation of the role.
        schema: schema of the answer.
        picture: picture of the camera as the address of a PNG (`data:image/png;base64,...`); empty if there is none.
        seed: seed of sampling, which also distinguishes equal prompts.
    """

    system: str
    text: str
    schema: AnswerSchema
    picture: str = ""
    seed: int = 0

    def request(self, config: LanguageModelConfig) -> dict[str, Any]:
        """Returns the body of the request, as the interface names its fields."""
        content: object = self.text
        if self.picture:
            content = [
                {"type": "text", "text": self.text},
                {"type": "image_url", "image_url": {"url": self.picture}},
            ]
        shared = config.parameters.get("response_format") == SHARED
        usual = {
            "model": config.model,
            "messages": [{"role": "system", "content": self.system}, {"role": "user", "content": content}],
            "response_format": self.schema.response_format(shared=shared),
            "temperature": config.temperature,
            "max_tokens": config.max_tokens,
            "seed": self.seed,
        }
        return with_parameters(usual, config.parameters)


@shared
class LanguageModel:
    """Model behind an endpoint, a cassette, or both.

    Args:
        config: settings.
        clock: returns a time [s], for the deadline and the latency.

    Raises:
        PolicyLoadError: httpx is not installed, or the cassette cannot be read.
    """

    def __init__(self, config: LanguageModelConfig, clock: Callable[[], float] = time.monotonic) -> None:
        self._config, self._clock = config, clock
        self._cassette = None if config.cassette is None else Cassette(config.cassette)
        self._refused: list[str] = []  # parameters that the endpoint does not take, in the order of its refusals
        if not config.offline:
            httpx_module()

    def ask(self, prompt: Prompt) -> Reply:
        """Returns the reply to a prompt: an answer of its schema, or a fault, within the time of a call.

        Raises:
            PolicyLoadError: the model is offline and the call is not in the cassette.
            OSError: the cassette cannot be written.
        """
        request = prompt.request(self._config)
        if self._cassette is not None:
            recorded = self._cassette.find(request)
            if recorded is not None:
                return recorded
        if self._config.offline:
            raise PolicyLoadError(
                f"{self._config.cassette}: the call is not recorded; replay the sessions that were recorded, with the "
                "same settings and version"
            )
        reply = self._call(request, prompt.schema)
        if self._cassette is not None:
            self._cassette.add(request, reply)
        return reply

    def _call(self, request: Mapping[str, Any], schema: AnswerSchema) -> Reply:
        """Makes a call of at most two attempts, the second after a requested delay or with the model's error.

        A request whose parameter the endpoint refuses is no attempt: it is sent once more without the parameter, and so
        are later ones.
        """
        endpoint, begun = ChatEndpoint(self._config.url), self._clock()
        tokens, retried = Tokens(), False
        for name in self._refused:
            request = without_parameter(request, name, self._refused, schema)
        while True:
            text, model = "", ""
            try:
                completion = endpoint.complete(request, self._left(begun))
                tokens, text, model = tokens.plus(completion.tokens), completion.text, completion.model
                schema.read(text)
                return self._reply(begun, tokens, answer=text, retried=retried, model=model)
            except CallError as error:
                fault = error
            if isinstance(fault, RefusedParameterError) and fault.name not in self._refused:
                self._refused.append(fault.name)
                request = without_parameter(request, fault.name, self._refused, schema)
                if self._left(begun) >= _LEAST_TIME:
                    continue
            if isinstance(fault, IncompleteError):
                tokens = tokens.plus(fault.tokens)
            if retried or fault.fault not in WORTH_REPEATING or self._left(begun) - fault.wait < _LEAST_TIME:
                return self._reply(begun, tokens, fault=fault.fault, reason=fault.reason, retried=retried, model=model)
            retried = True
            if fault.wait:
                time.sleep(fault.wait)
            if fault.fault in ABOUT_THE_ANSWER:
                request = _with_error(request, text, fault)

    def _reply(self, begun: float, tokens: Tokens, **outcome: Any) -> Reply:
        latency = round(self._clock() - begun, 3)
        return Reply(tokens=tokens, latency=latency, refused=tuple(sorted(self._refused)), **outcome)

    def _left(self, begun: float) -> float:
        """Returns the time that is left for a call [s]."""
        return self._config.timeout - (self._clock() - begun)


def _with_error(request: Mapping[str, Any], text: str, error: CallError) -> dict[str, Any]:
    """Returns the request of the second attempt: the conversation is continued by the answer and its error."""
    messages = list(request["messages"])
    if text:
        messages.append({"role": "assistant", "content": text[:2000]})
    messages.append(
        {"role": "user", "content": f"This was refused: {error.reason}. Answer with one JSON object of the schema."}
    )
    return {**request, "messages": messages}
