"""Settings of a language model as a policy."""

from __future__ import annotations

import enum
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from dorothie_gym.errors import short_repr
from dorothie_gym.policies.language_model.request_parameters import USUAL_TOKENS, check_parameters
from dorothie_gym.support.copying import shared

URL_VARIABLE: Final = "OPENAI_BASE_URL"
"""Environment variable with the address of the endpoint if none is given, as in OpenAI's client."""


QUIET_TIME: Final = 10.0
"""Usual longest time between two turns of a role that is played by text [s]."""


class SimulatedTime(enum.StrEnum):
    """Behaviour of the session while the model answers."""

    WAITS = "waits"
    """Simulated time stops: an answer takes effect in the decision that requested it."""
    CHARGED = "charged"
    """The session continues: an answer takes effect after as much simulated time as the call took."""


@shared
@dataclass(frozen=True, kw_only=True)
class LanguageModelConfig:
    """Settings of a language model as a policy.

    The key is not a setting: the environment variable `OPENAI_API_KEY` is read at each call, and never recorded.

    Attributes:
        model: name of the model, as the endpoint knows it.
        url: address before `/chat/completions`, such as "http://localhost:8000/v1". May be empty if `offline` is set.
        timeout: longest time of a call, retry included [s].
        max_tokens: maximum number of tokens of an answer.
        temperature: temperature of sampling; 0 for the most likely answer.
        quiet_time: longest time between two calls [s]; the model may request a shorter one.
        time: behaviour of the session while the model answers.
        pictures: whether prompts contain the picture of the camera, where the role observes one.
        cassette: file in which calls are recorded and from which recorded calls are answered; None if there is none.
        offline: whether only recorded calls are answered; a call that is not in the cassette is an error.
        prices: price of a million tokens of prompts and of answers [US dollars]; None if unknown.
        parameters: further parameters of the requests, or other values of the usual ones; None leaves one out. See
            `request_parameters.parse_parameters`.

    Raises:
        ValueError: a field is out of range; names the field.
    """

    model: str
    url: str = ""
    timeout: float = 30.0
    max_tokens: int = USUAL_TOKENS
    temperature: float = 0.0
    quiet_time: float = QUIET_TIME
    time: SimulatedTime = SimulatedTime.WAITS
    pictures: bool = False
    cassette: Path | None = None
    offline: bool = False
    prices: tuple[float, float] | None = None
    parameters: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.model or not self.model.isprintable():
            raise ValueError(f"model is {self.model!r}; give the name of a model of the endpoint")
        if self.offline and self.cassette is None:
            raise ValueError("offline is set without a cassette; give the file with the recorded calls")
        if not self.offline:
            _check_url(self.url)
        _check_range("timeout", self.timeout, 0.1, 3600.0)
        _check_range("temperature", self.temperature, 0.0, 2.0)
        check_quiet_time(self.quiet_time)
        if not 16 <= self.max_tokens <= 100_000:
            raise ValueError(f"max_tokens is {self.max_tokens}; it must be in 16..100000")
        if self.prices is not None and not all(0.0 <= price < math.inf for price in self.prices):
            raise ValueError(f"prices are {self.prices}; they must be at least 0")
        check_parameters(self.parameters)
        object.__setattr__(self, "time", SimulatedTime(self.time))

    @classmethod
    def usual(cls, model: str) -> LanguageModelConfig:
        """Returns the default settings of a model at the endpoint that the environment names (`OPENAI_BASE_URL`).

        Raises:
            ValueError: the variable is not set, or the model has no name.
        """
        url = os.environ.get(URL_VARIABLE, "")
        if not url:
            raise ValueError(f"llm:{model} has no endpoint; give --llm-url, or set the variable {URL_VARIABLE}")
        return cls(model=model, url=url)

    def record(self) -> dict[str, object]:
        """Returns the settings that determine answers and actions, in JSON types: neither address nor cassette."""
        return {
            "max_tokens": self.max_tokens,
            "temperature": self.temperature,
            "quiet_time": self.quiet_time,
            "time": str(self.time),
            "timeout": self.timeout,
            "pictures": self.pictures,
            **({} if self.prices is None else {"prices": list(self.prices)}),
            **({"parameters": dict(self.parameters)} if self.parameters else {}),
        }


def check_quiet_time(seconds: float) -> None:
    """Raises `ValueError` for a longest time between two turns that is out of its range [s]."""
    _check_range("quiet_time", seconds, 1.0, 3600.0)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not isinstance(value, int | float) or not low <= value <= high:
        raise ValueError(f"{name} is {short_repr(value)}; it must be in {low:g}..{high:g}")


def _check_url(url: str) -> None:
    """Raises `ValueError` for an address that is none, or that contains a secret."""
    if not url:
        raise ValueError("url is empty; give the address of the endpoint, such as http://localhost:8000/v1")
    try:
        parts = urlsplit(url)
        host = parts.hostname
    except ValueError as error:
        raise ValueError(f"url is no address ({error}); it must be like http://localhost:8000/v1") from None
    if parts.username is not None or parts.password is not None or parts.query or parts.fragment:
        raise ValueError("url contains a user, a password or a query; give the key by the variable OPENAI_API_KEY")
    if parts.scheme not in ("http", "https") or not host:
        raise ValueError(f"url is {url!r}; it must begin with http:// or https://")
