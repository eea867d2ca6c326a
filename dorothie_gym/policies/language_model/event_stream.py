"""Completions that arrive as a stream of server-sent events, as one completion.

Some endpoints stream whatever is requested. A stream is a series of lines `data: {...}`, each with a part of the
answer; the last one is `data: [DONE]`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from dorothie_gym.support.input_files import parse_json

_PREFIX: Final = "data:"
_END: Final = "[DONE]"
_LINE_END: Final = re.compile(r"\r\n|\r|\n")  # other separators, as U+2028, may stand in the texts of an event


def is_event_stream(headers: Mapping[str, str], body: bytes) -> bool:
    """Returns whether a content is a stream of events."""
    kind = next((value for name, value in headers.items() if name.lower() == "content-type"), "")
    return kind.lower().startswith("text/event-stream") or body.lstrip()[:5] == _PREFIX.encode()


def joined_completion(text: str) -> dict[str, Any]:
    """Returns the completion whose parts a stream has: content, refusal, reason of the end, usage, model.

    Raises:
        InputFileError: an event is not JSON.
    """
    page: dict[str, Any] = {}
    contents: dict[str, list[str]] = {"content": [], "refusal": []}
    ended, parts = None, 0
    for event in _events(text):
        page |= {name: event[name] for name in ("usage", "model") if event.get(name)}
        choices = event.get("choices")
        first = choices[0] if isinstance(choices, list) and choices else None
        if not isinstance(first, Mapping):
            continue
        ended, parts = first.get("finish_reason") or ended, parts + 1
        delta = first.get("delta")
        for name, found in contents.items():
            words = delta.get(name) if isinstance(delta, Mapping) else None
            if isinstance(words, str):
                found.append(words)
    if parts:
        message = {name: "".join(found) or None for name, found in contents.items()}
        page["choices"] = [{"message": message, "finish_reason": ended}]
    return page


def _events(text: str) -> Iterator[Mapping[str, Any]]:
    for line in map(str.strip, _LINE_END.split(text)):
        data = line.removeprefix(_PREFIX).strip() if line.startswith(_PREFIX) else ""
        if data == _END:
            return
        event = parse_json(data, "an event of the stream", unique=False) if data else None
        if isinstance(event, Mapping):
            yield event
