"""A language model that answers prompts: request, attempts within a deadline, cassette."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypedDict

from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema
from dorothie_gym.policies.language_model.cassette import Cassette, Reply
from dorothie_gym.policies.language_model.chat_endpoint import ChatEndpoint, IncompleteError, httpx_module
from dorothie_gym.policies.language_model.faults import ABOUT_THE_ANSWER, WORTH_REPEATING, CallError
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.policies.language_model.config import LanguageModelConfig

_LEAST_TIME: Final = 0.05
"""Time below which no further attempt is made [s]."""


class ChatRequest(TypedDict):
    """Body of a request to a chat endpoint, as its interface names the fields."""

    model: str
    messages: list[dict[str, object]]
    response_format: dict[str, Any]
    temperature: float
    max_tokens: int
    seed: int


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

    def request(self, config: LanguageModelConfig) -> ChatRequest:
        """Returns the body of the request."""
        content: object = self.text
        if self.picture:
            content = [
                {"type": "text", "text": self.text},
                {"type": "image_url", "image_url": {"url": self.picture}},
            ]
        return {
            "model": config.model,
            "messages": [{"role": "system", "content": self.system}, {"role": "user", "content": content}],
            "response_format": self.schema.response_format(),
            "temperature": config.temperature,
            "max_tokens": config.max_tokens,
            "seed": self.seed,
        }


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

    def _call(self, request: ChatRequest, schema: AnswerSchema) -> Reply:
        """Makes a call of at most two attempts, the second after a requested delay or with the model's error."""
        endpoint, begun = ChatEndpoint(self._config.url), self._clock()
        tokens, retried = (0, 0), False
        while True:
            left = self._config.timeout - (self._clock() - begun)
            text = ""
            try:
                completion = endpoint.complete(request, left)
                tokens, text = _added(tokens, completion.tokens), completion.text
                schema.read(text)
                return Reply(answer=text, tokens=tokens, retried=retried, latency=self._since(begun))
            except CallError as error:
                fault = error
            if isinstance(fault, IncompleteError):
                tokens = _added(tokens, fault.tokens)
            left = self._config.timeout - (self._clock() - begun)
            if retried or fault.fault not in WORTH_REPEATING or left - fault.wait < _LEAST_TIME:
                return Reply(
                    fault=fault.fault, reason=fault.reason, tokens=tokens, retried=retried, latency=self._since(begun)
                )
            retried = True
            if fault.wait:
                time.sleep(fault.wait)
            if fault.fault in ABOUT_THE_ANSWER:
                request = _with_error(request, text, fault)

    def _since(self, begun: float) -> float:
        return round(self._clock() - begun, 3)


def _added(first: tuple[int, int], second: tuple[int, int]) -> tuple[int, int]:
    return first[0] + second[0], first[1] + second[1]


def _with_error(request: ChatRequest, text: str, error: CallError) -> ChatRequest:
    """Returns the request of the second attempt: the conversation is continued by the answer and its error."""
    messages = list(request["messages"])
    if text:
        messages.append({"role": "assistant", "content": text[:2000]})
    messages.append(
        {"role": "user", "content": f"This was refused: {error.reason}. Answer with one JSON object of the schema."}
    )
    return {**request, "messages": messages}
