"""JSON that comes out byte for byte the same for the same content."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.sessions.errors import SessionError


def canonical(value: Any, where: str) -> Any:
    """Returns `value` in plain JSON types: mappings as dicts with sorted keys, tuples as lists, numpy as Python.

    Args:
        value: what is to be written.
        where: name of the field, for the message of an error.

    Raises:
        SessionError: something in it has no place in JSON (a number that is not finite, a key that is not a text).
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
    if isinstance(value, Mapping):
        return _canonical_mapping(value, where)
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{index}]") for index, item in enumerate(value)]
    raise SessionError(f"{where} is a {type(value).__name__}; a session holds JSON types only")


def _canonical_text(value: str, where: str) -> str:
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise SessionError(f"{where} cannot be written in UTF-8 ({error.reason} at character {error.start})") from None
    return str(value)  # a member of a StrEnum becomes its text


def _canonical_mapping(value: Mapping[Any, Any], where: str) -> dict[str, Any]:
    for key in value:
        if not isinstance(key, str):
            raise SessionError(f"{where} has the key {key!r}; keys must be texts")
    return {_canonical_text(key, where): canonical(value[key], f"{where}.{key}") for key in sorted(value)}


def to_line(value: Any) -> str:
    """Returns canonical JSON on one line, without its end."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def from_line(text: str, where: str) -> dict[str, Any]:
    """Returns the JSON object that `text` holds.

    Raises:
        SessionError: it holds none; the message begins with `where`.
    """
    try:
        value = json.loads(text, parse_constant=_refuse_constant)
    except ValueError as error:
        raise SessionError(f"{where}: not JSON ({error})") from None
    if not isinstance(value, dict):
        raise SessionError(f"{where}: a JSON object is expected, not {type(value).__name__}")
    return value


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def write_atomically(path: Path, text: str) -> None:
    """Writes a file whole or not at all: readers never see a part of it, even when the process dies."""
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(text, encoding="utf-8", newline="\n")
    os.replace(temporary, path)
