"""Optional parameters of a request: what is sent to an endpoint, profiles of endpoints, and what an endpoint refuses.

Endpoints with OpenAI's chat interface agree on `model` and `messages` only. Each takes other parameters beside them. A
request with one that an endpoint does not take is answered by status 400 or 422, and by words that name it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.errors import InputFileError, did_you_mean, short_repr
from dorothie_gym.support.input_files import parse_json

if TYPE_CHECKING:
    from dorothie_gym.policies.language_model.answer_schema import AnswerSchema
    from dorothie_gym.support.files import JsonValue

LIMITS: Final = ("max_tokens", "max_completion_tokens")
"""Names of the limit of tokens of an answer; a request has one of them."""

USUAL_TOKENS: Final = 300
"""Usual limit of an answer without reasoning [tokens]."""

_REASONING_TOKENS: Final = 4000
"""Usual limit of an answer of a model that reasons before it answers; its reasoning counts [tokens]."""

SHARED: Final = "shared"
"""Value of `response_format` for the schema that is the same in all calls of a role."""

_FIXED: Final = ("model", "messages")
"""Fields of a request that are no parameters."""

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")

_BAD_REQUEST: Final = (400, 422)
"""Status of an endpoint that does not take a request as it is."""

_STREAM: Final = "stream"

_MENTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "response_format": ("response_format", "json_schema", "structured outputs?", "guided decoding"),
}
"""Words by which the message of an endpoint may mention a parameter, other than its name."""


@dataclass(frozen=True, kw_only=True)
class ParameterProfile:
    """Parameters that a kind of endpoint takes.

    Attributes:
        values: values of parameters; None leaves a parameter out.
        limit: name of the limit of tokens.
        tokens: usual limit of tokens.
    """

    values: Mapping[str, object] = field(default_factory=dict)
    limit: str = LIMITS[0]
    tokens: int = USUAL_TOKENS


PROFILES: Final[Mapping[str, ParameterProfile]] = {
    "usual": ParameterProfile(),
    "completion-tokens": ParameterProfile(limit=LIMITS[1]),
    "reasoning": ParameterProfile(
        values={"temperature": None, "seed": None, "reasoning_effort": "low"}, limit=LIMITS[1], tokens=_REASONING_TOKENS
    ),
    "shared-schema": ParameterProfile(values={"response_format": SHARED}),
    "plain": ParameterProfile(values={"temperature": None, "seed": None, "response_format": None}),
}
"""Profiles by their names: `usual` sends `max_tokens`, `temperature`, `seed` and `response_format`.

`shared-schema` sends one schema for all calls of a role, so that the endpoint can cache the beginning of its prompts.
"""


def parse_parameters(text: str, tokens: int | None = None) -> tuple[dict[str, object], int]:
    """Returns parameters of requests from a text, and the limit of tokens.

    The text is a JSON object (null leaves a parameter out), or a list with commas: the name of a profile,
    `NAME=VALUE` (a JSON value, else a word), or `no-NAME` for a parameter that is not sent.

    Args:
        text: the text.
        tokens: limit of tokens; None for that of the profile.

    Raises:
        ValueError: an item is none of these.
    """
    if text.lstrip().startswith("{"):
        try:
            page = parse_json(text, "the parameters")
        except InputFileError as error:
            raise ValueError(f"parameters are no JSON object ({error.reason})") from None
        found: dict[str, object] = dict(page) if isinstance(page, Mapping) else {}
        return found, USUAL_TOKENS if tokens is None else tokens
    found, limit, usual = {}, LIMITS[0], USUAL_TOKENS
    for item in filter(None, map(str.strip, text.split(","))):
        name, given, value = item.partition("=")
        if given:
            found[name.strip()] = _value(value.strip())
        elif name in PROFILES:
            found |= PROFILES[name].values
            limit, usual = PROFILES[name].limit, PROFILES[name].tokens
        elif name.startswith("no-"):
            found[name.removeprefix("no-")] = None
        else:
            raise ValueError(
                f"parameters have {short_repr(item)}; {did_you_mean(item, PROFILES)}give NAME=VALUE, no-NAME, "
                f"a profile ({', '.join(PROFILES)}), or one JSON object for values with commas"
            )
    count = usual if tokens is None else tokens
    if limit != LIMITS[0]:
        found |= {LIMITS[0]: None, limit: count}
    return found, count


def _value(text: str) -> JsonValue:
    try:
        return parse_json(text, "the value")
    except InputFileError:
        return text


def check_parameters(parameters: Mapping[str, object]) -> None:
    """Raises `ValueError` for a parameter that no request can have."""
    for name in parameters:
        if name in _FIXED or not _NAME.fullmatch(name):
            raise ValueError(
                f"parameters have {short_repr(name)}; a parameter has letters, digits and _, and is not one of "
                f"{', '.join(_FIXED)}"
            )
    try:
        json.dumps(dict(parameters), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ValueError(f"parameters are not JSON: {error}") from None


def with_parameters(request: Mapping[str, Any], parameters: Mapping[str, object]) -> dict[str, Any]:
    """Returns a request with other parameters; None leaves one out."""
    given = {name: value for name, value in parameters.items() if (name, value) != ("response_format", SHARED)}
    changed = {**request, **given}
    return {name: value for name, value in changed.items() if name in _FIXED or value is not None}


# --- Negotiation ------------------------------------------------------------------------------------------------------


def refused_parameter(status: int, body: bytes, sent: Collection[str]) -> str:
    """Returns the parameter that an endpoint refuses, in its own words; empty if it names none.

    Args:
        status: status of the answer.
        body: content of the answer.
        sent: names of the fields of the request. A parameter `stream` that was not sent counts as refused when the
            endpoint asks for it.
    """
    if status not in _BAD_REQUEST:
        return ""
    words = body[:10_000].decode("utf-8", "replace")
    named = _named_field(words)
    optional = [name for name in sent if name not in _FIXED]
    if named in optional:
        return named
    places = {name: _first_mention(words, name) for name in optional}
    found = {place: name for name, place in places.items() if place >= 0}
    if found:
        return found[min(found)]
    return _STREAM if _STREAM not in sent and _first_mention(words, _STREAM) >= 0 else ""


def _first_mention(words: str, name: str) -> int:
    """Returns the position at which a text mentions a parameter; -1 if it does not."""
    pattern = "|".join(_MENTIONS.get(name, (re.escape(name),)))
    found = re.search(rf"\b(?:{pattern})\b", words, re.IGNORECASE)
    return -1 if found is None else found.start()


def _named_field(words: str) -> str:
    """Returns the field that an error names as such: OpenAI's `error.param`, or FastAPI's `detail[0].loc`."""
    try:
        page = parse_json(words, "the error", unique=False)
    except InputFileError:
        return ""
    error = page.get("error") if isinstance(page, Mapping) else None
    if isinstance(error, Mapping) and isinstance(error.get("param"), str):
        return str(error["param"]).partition(".")[0]
    details = page.get("detail") if isinstance(page, Mapping) else None
    first = details[0] if isinstance(details, list) and details else None
    place = first.get("loc") if isinstance(first, Mapping) else None
    names = [name for name in place if isinstance(name, str) and name != "body"] if isinstance(place, list) else []
    return names[0] if names else ""


def without_parameter(
    request: Mapping[str, Any], name: str, refused: Collection[str], schema: AnswerSchema
) -> dict[str, Any]:
    """Returns a request without a refused parameter.

    The limit of tokens is sent under its other name, unless that is refused, too. Without `response_format`, the schema
    becomes part of the messages. An endpoint that only streams is asked to stream.

    Args:
        request: the request.
        name: the refused parameter.
        refused: all parameters that the endpoint has refused.
        schema: schema of the answer.
    """
    if name == _STREAM and _STREAM not in request:
        return {**request, _STREAM: True, "stream_options": {"include_usage": True}}
    changed = {field: value for field, value in request.items() if field != name}
    if name in LIMITS:
        other = LIMITS[1 - LIMITS.index(name)]
        if other not in refused and other not in request:
            changed[other] = request[name]
    if name == "response_format":
        wanted = json.dumps(schema.json_schema(), separators=(",", ":"))
        words = f"Answer with one JSON object of this schema, without other text: {wanted}"
        changed["messages"] = [*request["messages"], {"role": "user", "content": words}]
    return changed
