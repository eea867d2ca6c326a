"""One request to an endpoint with OpenAI's chat interface, over httpx, with a deadline that holds for every fault."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from dorothie_gym.errors import InputFileError, PolicyLoadError, one_line
from dorothie_gym.policies.language_model.event_stream import is_event_stream, joined_completion
from dorothie_gym.policies.language_model.faults import CallError, Fault
from dorothie_gym.policies.language_model.request_parameters import refused_parameter
from dorothie_gym.support.input_files import parse_json
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

KEY_VARIABLE: Final = "OPENAI_API_KEY"
"""Environment variable with the secret for the header `Authorization`; unset for servers without one."""

_LARGEST_ANSWER: Final = 4_000_000
"""Largest body that is read [bytes]."""

MAX_NAME: Final = 100
"""Longest name of a model that is kept [characters]."""

_LONGEST_WAIT: Final = 3600.0
"""Longest `Retry-After` that is believed [s]."""


class Tokens(NamedTuple):
    """Numbers of tokens of one or more calls, as the endpoint counts them; 0 if it does not.

    Attributes:
        prompt: tokens of the prompts.
        completion: tokens of the answers, reasoning included.
        cached: tokens of the prompts that the endpoint has taken from its cache.
    """

    prompt: int = 0
    completion: int = 0
    cached: int = 0

    def plus(self, other: Tokens) -> Tokens:
        """Returns the sum of two numbers of tokens."""
        return Tokens(*(one + another for one, another in zip(self, other, strict=True)))


@dataclass(frozen=True, kw_only=True)
class Completion:
    """Answer of a model.

    Attributes:
        text: the answer.
        tokens: number of tokens of the call.
        model: name of the model that has answered; empty if the endpoint does not say.
    """

    text: str
    tokens: Tokens
    model: str = ""


class RefusedParameterError(CallError):
    """The endpoint does not take a parameter of the request, and names it.

    Attributes:
        name: the parameter.
    """

    def __init__(self, reason: str, name: str) -> None:
        super().__init__(Fault.REJECTED, reason)
        self.name = name


class IncompleteError(CallError):
    """Completion without a valid answer; its tokens are charged nevertheless.

    Attributes:
        tokens: as in `Completion`.
    """

    def __init__(self, fault: Fault, reason: str, tokens: Tokens) -> None:
        super().__init__(fault, reason)
        self.tokens = tokens


def httpx_module() -> ModuleType:
    """Returns the package httpx; raises `PolicyLoadError` if it is not installed."""
    try:
        return import_module("httpx")
    except ModuleNotFoundError:
        raise PolicyLoadError(
            f"language models need httpx, which is not installed; run: {pip_install('llm')}"
        ) from None


class ChatEndpoint:
    """Endpoint with the route `chat/completions`.

    Args:
        url: address before the route.

    Raises:
        PolicyLoadError: httpx is not installed.
    """

    def __init__(self, url: str) -> None:
        self._url = f"{url.rstrip('/')}/chat/completions"
        self._httpx: Any = httpx_module()

    def complete(self, request: Mapping[str, object], timeout: float) -> Completion:
        """Returns the answer to a request.

        The exchange runs in a thread of its own, which is abandoned at the deadline: timeouts of a connection hold
        between two bytes, so that a server could otherwise trickle for hours.

        Args:
            request: body of the request, in JSON types.
            timeout: time in which the answer must be complete [s].

        Raises:
            RefusedParameterError: the endpoint names a parameter of the request that it does not take.
            CallError: there is no answer; the reason never contains the key.
        """
        exchange = _Exchange(self._httpx, self._url, request, timeout)
        exchange.start()
        exchange.join(timeout)
        if exchange.is_alive():
            exchange.cancel()
            raise CallError(Fault.TIMEOUT, f"no answer within {timeout:.1f} s")
        status, answered, body = exchange.result()
        if name := refused_parameter(status, body, request.keys()):
            raise RefusedParameterError(_status_error(status, answered, body).reason, name)
        return _completion(status, answered, body)


class _Exchange(threading.Thread):
    """Thread of one request."""

    def __init__(self, httpx: Any, url: str, request: Mapping[str, object], timeout: float) -> None:
        super().__init__(name="language-model", daemon=True)
        self._httpx, self._url, self._request = httpx, url, request
        self._timeout = timeout
        self._cancelled = threading.Event()
        self._status, self._headers, self._body = 0, dict[str, str](), b""
        self._error: CallError | None = None

    def run(self) -> None:
        """Sends the request and keeps the answer or the error."""
        key = os.environ.get(KEY_VARIABLE, "")
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        httpx = self._httpx
        try:
            with (
                httpx.Client(timeout=self._timeout, verify=_certificates(self._url)) as client,
                client.stream("POST", self._url, json=self._request, headers=headers) as answer,
            ):
                self._status, self._headers = answer.status_code, dict(answer.headers)
                for block in answer.iter_bytes():
                    self._body += block
                    if self._cancelled.is_set():
                        return
                    if len(self._body) > _LARGEST_ANSWER:
                        raise CallError(Fault.NOT_A_COMPLETION, f"the answer has more than {_LARGEST_ANSWER} bytes")
        except CallError as error:
            self._error = error
        except httpx.TimeoutException:
            self._error = CallError(Fault.TIMEOUT, f"no answer within {self._timeout:.1f} s")
        except httpx.DecodingError as error:
            self._error = CallError(Fault.NOT_A_COMPLETION, f"the answer cannot be decoded: {_safe(error, key)}")
        except (httpx.HTTPError, httpx.InvalidURL, OSError, UnicodeError) as error:
            self._error = CallError(Fault.NO_CONNECTION, f"{type(error).__name__}: {_safe(error, key)}")

    def cancel(self) -> None:
        """Ends the exchange at its next byte."""
        self._cancelled.set()

    def result(self) -> tuple[int, dict[str, str], bytes]:
        """Returns status, headers and body; raises the error of the exchange."""
        if self._error is not None:
            raise self._error
        return self._status, self._headers, self._body


def _certificates(url: str) -> Any:
    """Returns the context that checks certificates; False for a server without TLS, which needs none."""
    return _ssl_context() if url.startswith("https:") else False


@lru_cache(maxsize=1)
def _ssl_context() -> Any:
    return httpx_module().create_ssl_context()  # reads the certificates of the authorities, which takes 30 ms


def _completion(status: int, headers: Mapping[str, str], body: bytes) -> Completion:
    """Returns the answer in a body; raises `CallError` if there is none."""
    if status != 200:
        raise _status_error(status, headers, body)
    try:
        page = _page(headers, body)
    except (InputFileError, UnicodeDecodeError):
        raise CallError(Fault.NOT_A_COMPLETION, f"the server sent no JSON: {_shown(body)}") from None
    tokens, choice = _tokens(page), _first_choice(page)
    message = choice.get("message")
    if not isinstance(message, Mapping):
        raise CallError(Fault.NOT_A_COMPLETION, f"the server sent no chat completion: {_shown(body)}")
    text, refusal, ended = message.get("content"), message.get("refusal"), choice.get("finish_reason")
    if refusal or ended == "content_filter":
        raise IncompleteError(Fault.REFUSED, f"the model declined to answer: {one_line(refusal or ended)}", tokens)
    if ended == "length":
        raise IncompleteError(Fault.CUT_OFF, "the answer was too long and was cut off", tokens)
    if not isinstance(text, str) or not text.strip():
        raise IncompleteError(Fault.REFUSED, "the answer is empty", tokens)
    model = page.get("model") if isinstance(page, Mapping) else None
    return Completion(text=text, tokens=tokens, model=one_line(model, MAX_NAME) if isinstance(model, str) else "")


def _page(headers: Mapping[str, str], body: bytes) -> JsonValue:
    """Returns the completion in a body; raises `InputFileError` or `UnicodeDecodeError` if there is none."""
    text = body.decode("utf-8")
    if is_event_stream(headers, body):
        return joined_completion(text)
    return parse_json(text, "the completion", unique=False)


def _first_choice(page: JsonValue) -> Mapping[str, JsonValue]:
    """Returns the first choice of a completion; empty if there is none."""
    choices = page.get("choices") if isinstance(page, Mapping) else None
    first = choices[0] if isinstance(choices, list) and choices else None
    return first if isinstance(first, Mapping) else {}


def _status_error(status: int, headers: Mapping[str, str], body: bytes) -> CallError:
    fault = Fault.RATE_LIMITED if status == 429 else Fault.SERVER_ERROR if status >= 500 else Fault.REJECTED
    try:
        wait = min(max(float(headers.get("retry-after", "0")), 0.0), _LONGEST_WAIT)
    except ValueError:
        wait = 0.0  # a date: the server's clock is not known
    return CallError(fault, f"status {status}: {_shown(body)}", wait)


def _tokens(page: object) -> Tokens:
    """Returns the numbers of tokens in a completion; endpoints differ in where they count cached ones."""
    usage = page.get("usage") if isinstance(page, Mapping) else None
    if not isinstance(usage, Mapping):
        return Tokens()
    details = usage.get("prompt_tokens_details")
    cached = details.get("cached_tokens") if isinstance(details, Mapping) else usage.get("prompt_cache_hit_tokens")
    return Tokens(*(_count(value) for value in (usage.get("prompt_tokens"), usage.get("completion_tokens"), cached)))


def _count(value: object) -> int:
    return value if type(value) is int and 0 <= value < 2**31 else 0


def _shown(body: bytes) -> str:
    return _safe(body[:1000].decode("utf-8", "replace"), os.environ.get(KEY_VARIABLE, "")) or "nothing"


def _safe(text: object, key: str) -> str:
    """Returns a text on one line, without the key: servers repeat it in messages."""
    words = str(text)
    return one_line(words.replace(key, "[key]") if key else words, 200)


def canonical(request: Mapping[str, object]) -> str:
    """Returns a request as JSON that is the same for equal requests."""
    return json.dumps(request, sort_keys=True, separators=(",", ":"))
