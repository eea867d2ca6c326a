"""Files of a session folder: their names and limits, JSON with equal bytes for equal content, checked reading."""

from __future__ import annotations

import enum
import json
import math
import re
import sys
from collections.abc import Callable, Collection, Mapping
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeGuard, TypeVar

import numpy as np

from dorothie_gym.errors import SessionError, short_repr
from dorothie_gym.support.input_files import (
    MAX_DEPTH,
    MAX_SESSION_TEXT,
    check_value_count,
    parse_json,
    raising,
    read_file,
)

if TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

# --- Names and limits -------------------------------------------------------------------------------------------------

HEADER_FILE: Final = "session.json"
"""Header, outcome, counts and version; written when the session begins, and again when it ends."""

EVENTS_FILE: Final = "events.jsonl"
"""One event per line, appended during the session."""

ACTIONS_FILE: Final = "actions.jsonl"
"""One decision of the roles per line; decisions without an action are left out."""

SEATS_FILE: Final = "seats.jsonl"
"""One event at the seats of people per line; absent from sessions without people."""

FRAMES_FILE: Final = "frames.parquet"
"""One row per frame, written when the session ends."""

JOURNAL_FILE: Final = "frames.journal"
"""Binary log of the frames, appended during the session; converted into `FRAMES_FILE` when it ends."""

PICTURES_FOLDER: Final = "pictures"
"""Optional pictures, `<frame>.png`."""

AUDIO_FOLDER: Final = "utterance"
"""Optional audio of dialogue moves, as their field `audio` names it; the folder of SDN's layout."""

ANNOTATIONS_FOLDER: Final = "annotations"
"""Optional logs of annotators (`dorothie_gym.lab.annotation`), which are not part of the session."""

SESSION_FILES: Final = (HEADER_FILE, EVENTS_FILE, ACTIONS_FILE, SEATS_FILE, FRAMES_FILE, JOURNAL_FILE)

MAX_EVENTS: Final = 200_000
"""Maximum number of events of a session; 15 minutes of three roles acting at 2 Hz give some 5,000."""

MAX_MOVES: Final = 10_000
"""Maximum number of dialogue moves of a session; 15 minutes have about 300."""

MAX_EXCEPTIONS: Final = 500
"""Maximum number of exceptions of a session; most sessions have up to 4."""

MAX_FRAMES: Final = 1_000_000
"""Maximum number of frames of a session: 9 hours at 30 Hz."""

MAX_FRAME: Final = 2**31
"""Bound of frame numbers."""

MAX_FRAMES_FILE: Final = 2**28
"""Largest uncompressed frames file, and largest journal, that is read [bytes]; a session of 15 minutes takes 16 MB."""

_NAME: Final = re.compile(r"[^\w.+-]+")


class SessionState(enum.StrEnum):
    """State of a session folder."""

    ABSENT = "absent"
    """No session, or one whose process died before the header was written."""
    PARTIAL = "partial"
    """Interrupted session, which loads up to the last complete event and frame."""
    FINISHED = "finished"
    """Complete session."""


def safe_name(text: str) -> str:
    """Returns `text` as the name of a file or folder: no separators, no leading dot, at most 100 characters."""
    return _NAME.sub("_", text).lstrip(".")[:100] or "session"


# --- JSON -------------------------------------------------------------------------------------------------------------

MAX_WHOLE: Final = 2**53
"""Bound of whole numbers, which floats hold exactly; seeds may be larger."""


def canonical(value: object, where: str, depth: int = MAX_DEPTH) -> JsonValue:
    """Returns `value` in plain JSON types: mappings as dicts with sorted keys, tuples as lists, numpy as Python.

    Args:
        value: the value.
        where: name of the field, for the message of an error.
        depth: allowed levels of nesting.

    Raises:
        SessionError: it holds a value without a JSON equivalent (a number that is not finite, a key that is not a
            text), or it is nested too deeply.
    """
    if is_canonical(value):
        return value
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
        return canonical_object(value, where, depth - 1)
    if isinstance(value, list | tuple):
        return [canonical(item, f"{where}[{index}]", depth - 1) for index, item in enumerate(value)]
    raise SessionError(f"{where} is a {type(value).__name__}; a session holds JSON types only")


def is_canonical(value: object) -> TypeGuard[str | float | None]:
    """Returns whether a value is plain JSON as it is: quickly, and not of all that are."""
    if type(value) is str:
        return value.isascii()
    if type(value) is float:
        return math.isfinite(value)
    return value is None or type(value) is int or type(value) is bool


def _canonical_text(value: str, where: str) -> str:
    if not value.isascii():
        try:
            value.encode("utf-8")
        except UnicodeEncodeError as error:
            message = f"{where} cannot be written in UTF-8 ({error.reason} at character {error.start})"
            raise SessionError(message) from None
    return str(value)  # a member of a StrEnum becomes its text


def canonical_object(value: Mapping[str, object], where: str, depth: int = MAX_DEPTH - 1) -> dict[str, JsonValue]:
    """Returns a mapping in plain JSON types; see `canonical`."""
    for key in value:
        if not isinstance(key, str):
            raise SessionError(f"{where} has the key {key!r}; keys must be texts")
    return {
        _canonical_text(key, where): item if is_canonical(item) else canonical(item, f"{where}.{key}", depth)
        for key, item in sorted(value.items(), key=itemgetter(0))
    }


def to_line(value: object) -> str:
    """Returns canonical JSON on one line, without a line break at the end."""
    return _LINE.encode(value)


_LINE: Final = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def to_page(value: object) -> str:
    """Returns canonical JSON on several lines, with a line break at the end."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def same_json(first: object, second: object) -> bool:
    """Returns whether two values have equal JSON, regardless of the order of keys; 15 and 15.0 differ."""
    return to_line(canonical(first, "value")) == to_line(canonical(second, "value"))


def from_line(text: str, where: str) -> dict[str, JsonValue]:
    """Returns the JSON object of a text.

    Raises:
        SessionError: it is not a JSON object, contains a field twice, or is beyond the limits of `parse_json`; the
            message begins with `where`.
    """
    with raising(SessionError):
        value = parse_json(text, where)
    if not isinstance(value, dict):
        raise SessionError(f"{where}: a JSON object is expected, not {type(value).__name__}")
    return value


def read_bytes(path: Path, limit: int = MAX_SESSION_TEXT) -> bytes:
    """Returns the content of a regular file, or of a link to one.

    Raises:
        SessionError: it is missing, no regular file (a pipe would block forever), or larger than `limit`.
        OSError: it cannot be read.
    """
    with raising(SessionError):
        try:
            return read_file(path, limit)
        except FileNotFoundError:
            raise SessionError(f"{path}: is missing") from None


def read_object(path: Path) -> Fields:
    """Returns the fields of the JSON object in a file; raises as `read_bytes` and `from_line`."""
    return Fields(from_line(decode_text(read_bytes(path), str(path)), str(path)), str(path))


def decode_text(content: bytes, where: str) -> str:
    """Returns the text of bytes in UTF-8; raises `SessionError`, prefixed with `where`, for other bytes."""
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SessionError(f"{where}: not UTF-8 at byte {error.start}") from None


# --- Checked fields --------------------------------------------------------------------------------------------------

_T = TypeVar("_T")

_LARGEST = sys.float_info.max
"""Largest float; a whole number of JSON may be larger."""


class Fields:
    """Fields of a JSON object.

    Each method returns a field in its type, and raises `SessionError` if it is missing or of another type.

    Args:
        values: the object.
        where: file and line, which every message begins with.
    """

    def __init__(self, values: Mapping[str, object], where: str) -> None:
        self._values = values
        self.where = where

    def integer(self, name: str, minimum: int | None = None) -> int:
        """Returns a whole number of at least `minimum`, of a magnitude below `MAX_WHOLE`."""
        value = self.anything(name)
        if type(value) is not int or (minimum is not None and value < minimum) or not abs(value) < MAX_WHOLE:
            least = "" if minimum is None else f" of at least {minimum}"
            raise self.error(name, f"a whole number{least}, of a magnitude below 2^53")
        return value

    def seed(self, name: str) -> int:
        """Returns a whole number of at least 0 and of any size."""
        value = self.anything(name)
        if type(value) is not int or value < 0:
            raise self.error(name, "a whole number of at least 0")
        return value

    def number(self, name: str) -> float:
        """Returns a finite number."""
        value = self.anything(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
            raise self.error(name, "a finite number")
        return float(value)

    def text(self, name: str) -> str:
        """Returns a text."""
        value = self.anything(name)
        if not isinstance(value, str):
            raise self.error(name, "a text")
        return value

    def flag(self, name: str) -> bool:
        """Returns a bool."""
        value = self.anything(name)
        if not isinstance(value, bool):
            raise self.error(name, "true or false")
        return value

    def mapping(self, name: str) -> Mapping[str, object]:
        """Returns an object."""
        value = self.anything(name)
        if not isinstance(value, Mapping):
            raise self.error(name, "an object")
        return value

    def texts(self, name: str) -> tuple[str, ...]:
        """Returns a list of texts."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
            raise self.error(name, "a list of texts")
        return tuple(value)

    def integers(self, name: str) -> tuple[int, ...]:
        """Returns a list of whole numbers."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(
            type(item) is int and abs(item) < MAX_WHOLE for item in value
        ):
            raise self.error(name, "a list of whole numbers of a magnitude below 2^53")
        return tuple(value)

    def objects(self, name: str) -> tuple[Fields, ...]:
        """Returns a list of objects."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(isinstance(item, Mapping) for item in value):
            raise self.error(name, "a list of objects")
        return tuple(Fields(item, f"{self.where}, {name}[{index}]") for index, item in enumerate(value))

    def optional(self, name: str, read: Callable[[str], _T]) -> _T | None:
        """Returns None if the field is null, else the result of `read`, one of the methods above."""
        return None if self.anything(name) is None else read(name)

    def error(self, name: str, expected: str) -> SessionError:
        """Returns the error for a field with an unexpected value."""
        return SessionError(f"{self.where}: field {name!r} is {short_repr(self._values[name])}; it must be {expected}")

    def if_given(self, name: str, read: Callable[[str], _T]) -> _T | None:
        """Returns None if the field is missing or null, else the result of `read`."""
        return read(name) if self._values.get(name) is not None else None

    def others(self, known: Collection[str]) -> dict[str, object]:
        """Returns the fields with other names."""
        return {name: value for name, value in self._values.items() if name not in known}

    def anything(self, name: str) -> Any:
        """Returns the unchecked value of a field."""
        if name not in self._values:
            raise SessionError(f"{self.where}: field {name!r} is missing")
        return self._values[name]


# --- Lines -----------------------------------------------------------------------------------------------------------


def read_lines(path: Path, limit: int) -> tuple[list[str], bool]:
    """Returns the complete lines of a file, and whether it is missing or its last line is torn.

    Raises:
        SessionError: more than `limit` lines, a line that is not UTF-8, or no regular file.
    """
    if not path.exists():
        return [], True
    content = read_bytes(path)
    if content.count(b"\n") > limit:
        raise SessionError(f"{path}: holds more than {limit} lines, which no session does; it is not read")
    with raising(SessionError):
        check_value_count(content, path)
    *lines, rest = content.split(b"\n")
    return [decode_text(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)], bool(rest)
