"""JSON that comes out byte for byte the same for the same content, and JSON of others that is read with care."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.layout import MAX_TEXT_FILE, PART

MAX_DEPTH: Final = 40
"""Levels of nesting that a session may hold."""


def canonical(value: Any, where: str, depth: int = MAX_DEPTH) -> Any:
    """Returns `value` in plain JSON types: mappings as dicts with sorted keys, tuples as lists, numpy as Python.

    Args:
        value: what is to be written.
        where: name of the field, for the message of an error.
        depth: levels of nesting that are still allowed.

    Raises:
        SessionError: something in it has no place in JSON (a number that is not finite, a key that is not a text), or
            it is nested too deeply.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return _canonical_text(value, where)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise SessionError(f"{where} is {value}; a session holds finite numbers only")
        return float(value)
    if depth == 0:
        raise SessionError(f"{where[:80]}... is nested more than {MAX_DEPTH} levels deep")
    if isinstance(value, Mapping):
        return _canonical_mapping(value, where, depth - 1)
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{index}]", depth - 1) for index, item in enumerate(value)]
    raise SessionError(f"{where} is a {type(value).__name__}; a session holds JSON types only")


def _canonical_text(value: str, where: str) -> str:
    if not value.isascii():
        try:
            value.encode("utf-8")
        except UnicodeEncodeError as error:
            message = f"{where} cannot be written in UTF-8 ({error.reason} at character {error.start})"
            raise SessionError(message) from None
    return str(value)  # a member of a StrEnum becomes its text


def _canonical_mapping(value: Mapping[Any, Any], where: str, depth: int) -> dict[str, Any]:
    for key in value:
        if not isinstance(key, str):
            raise SessionError(f"{where} has the key {key!r}; keys must be texts")
    return {_canonical_text(key, where): canonical(value[key], f"{where}.{key}", depth) for key in sorted(value)}


def to_line(value: Any) -> str:
    """Returns canonical JSON on one line, without its end."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def to_page(value: Any) -> str:
    """Returns canonical JSON on several lines, for people, with its end."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def from_line(text: str, where: str) -> dict[str, Any]:
    """Returns the JSON object that `text` holds.

    Raises:
        SessionError: it holds none, or a number that is not finite; the message begins with `where`.
    """
    try:
        value = json.loads(text, parse_constant=_refuse_constant, parse_float=_finite)
    except ValueError as error:
        raise SessionError(f"{where}: not JSON ({error})") from None
    except RecursionError:
        raise SessionError(f"{where}: the JSON is nested too deeply to be read") from None
    if not isinstance(value, dict):
        raise SessionError(f"{where}: a JSON object is expected, not {type(value).__name__}")
    return value


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:30]} is too large a number")
    return value


def read_bytes(path: Path, limit: int = MAX_TEXT_FILE) -> bytes:
    """Returns what a regular file, or a link to one, holds.

    Raises:
        SessionError: it is no regular file (a pipe would block for ever), or larger than `limit`.
        OSError: it cannot be read.
    """
    if not path.is_file():
        kind = "is not a regular file" if os.path.lexists(path) else "is missing"
        raise SessionError(f"{path}: {kind}")
    with path.open("rb") as file:
        content = file.read(limit + 1)
    if len(content) > limit:
        raise SessionError(f"{path}: is larger than {limit >> 20} MiB, which no session needs; it is not read")
    return content


def decode_text(content: bytes, where: str) -> str:
    """Returns the text of bytes in UTF-8; raises `SessionError` beginning with `where` for others."""
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SessionError(f"{where}: not UTF-8 at byte {error.start}") from None


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a file whole or not at all: readers never see a part of it, even when the process dies."""
    temporary = path.with_name(path.name + PART)
    temporary.unlink(missing_ok=True)  # whatever stands there, a link to somewhere else included
    data = content.encode("utf-8") if isinstance(content, str) else content
    with temporary.open("xb") as file:
        file.write(data)
    os.replace(temporary, path)
