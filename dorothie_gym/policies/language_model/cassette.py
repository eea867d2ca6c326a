"""Cassette: calls recorded in a JSONL file by the hash of their request, which replay without network.

A line has the fields `key` (SHA-256 of the request), `request` (pictures replaced by their hashes), `answer` or `fault`
with `reason`, `tokens` (prompt, answer, cached), `retried` and `latency` [s]; also `refused` and `model` if there are
any. Headers, and thus the key of the endpoint, are never part of it.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from dorothie_gym.errors import InputFileError, PolicyLoadError
from dorothie_gym.policies.language_model.chat_endpoint import Tokens, canonical
from dorothie_gym.policies.language_model.faults import Fault
from dorothie_gym.support.input_files import MAX_SESSION_TEXT, parse_json, read_text

if sys.platform != "win32":
    import fcntl


@dataclass(frozen=True, kw_only=True)
class Reply:
    """Outcome of a call.

    Attributes:
        answer: text of the answer; None after a fault.
        fault: the fault; None for an answer.
        reason: fault; empty for an answer.
        tokens: number of tokens of both attempts.
        retried: whether a second attempt was made.
        latency: time of the call [s].
        refused: parameters that the endpoint has refused, in order of their names; the call was made without them.
        model: name of the model that has answered; empty if the endpoint does not say.
    """

    answer: str | None = None
    fault: Fault | None = None
    reason: str = ""
    tokens: Tokens = Tokens()
    retried: bool = False
    latency: float = 0.0
    refused: tuple[str, ...] = ()
    model: str = ""


def request_key(request: Mapping[str, object]) -> str:
    """Returns the hash by which a request is found again."""
    return hashlib.sha256(canonical(request).encode()).hexdigest()


class Cassette:
    """File of recorded calls; several processes may append to it.

    Args:
        path: the file; created with the first call if it is missing.

    Raises:
        PolicyLoadError: the file cannot be read, or a line is not a recorded call.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._replies = dict(_recorded(path, *_stamp(path)))

    def find(self, request: Mapping[str, object]) -> Reply | None:
        """Returns the recorded reply to a request; None if there is none."""
        return self._replies.get(request_key(request))

    def add(self, request: Mapping[str, object], reply: Reply) -> None:
        """Appends a call; raises `OSError` if the file cannot be written."""
        key = request_key(request)
        self._replies[key] = reply
        page: dict[str, object] = {"key": key, "request": _without_pictures(request)}
        if reply.fault is None:
            page["answer"] = reply.answer
        else:
            page |= {"fault": str(reply.fault), "reason": reply.reason}
        page |= {"tokens": list(reply.tokens), "retried": reply.retried, "latency": reply.latency}
        page |= {name: value for name, value in (("refused", list(reply.refused)), ("model", reply.model)) if value}
        line = json.dumps(page, separators=(",", ":")) + "\n"
        with self._path.open("a", encoding="utf-8") as file:
            if sys.platform != "win32":
                fcntl.flock(file, fcntl.LOCK_EX)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())


def _stamp(path: Path) -> tuple[int, int]:
    """Returns size and time of a file, with which its content is cached; zeros if it is missing."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return 0, 0
    except OSError as error:
        raise PolicyLoadError(f"{path}: cannot be read ({error.strerror}); give another cassette") from None
    return found.st_size, found.st_mtime_ns


@lru_cache(maxsize=4)
def _recorded(path: Path, size: int, changed: int) -> Mapping[str, Reply]:
    """Returns the replies of a file by key; an incomplete last line is ignored."""
    if not path.exists():
        return {}
    try:
        text = read_text(path, MAX_CASSETTE)
        lines = text.split("\n")
        found: dict[str, Reply] = {}
        for number, line in enumerate(lines[:-1], start=1):
            key, reply = _read_line(parse_json(line, f"{path}, line {number}"), f"{path}, line {number}")
            found.setdefault(key, reply)
    except (InputFileError, OSError) as error:
        raise PolicyLoadError(f"{error}; give a cassette that dorothie-gym has recorded") from None
    return found


MAX_CASSETTE: Final = 16 * MAX_SESSION_TEXT
"""Largest cassette that is read [bytes]."""


def _read_line(page: Any, where: str) -> tuple[str, Reply]:
    try:
        fault = Fault(page["fault"]) if "fault" in page else None
        answer = None if fault is not None else page["answer"]
        first, second, *cached = map(int, page["tokens"])  # two numbers in files of versions before 0.3
        reply = Reply(
            answer=answer,
            fault=fault,
            reason=str(page.get("reason", "")),
            tokens=Tokens(first, second, *cached),
            retried=bool(page["retried"]),
            latency=float(page["latency"]),
            refused=tuple(map(str, page.get("refused", ()))),
            model=str(page.get("model", "")),
        )
        if answer is not None and not isinstance(answer, str):
            raise TypeError
        return str(page["key"]), reply
    except (KeyError, TypeError, ValueError):
        raise InputFileError(where, "is no recorded call") from None


def _without_pictures(request: Mapping[str, object]) -> object:
    """Returns a request with the hash of each picture instead of the picture."""

    def shortened(value: object) -> object:
        if isinstance(value, str) and value.startswith("data:image/"):
            return "sha256:" + hashlib.sha256(value.encode()).hexdigest()
        if isinstance(value, Mapping):
            return {name: shortened(each) for name, each in value.items()}
        return [shortened(each) for each in value] if isinstance(value, list) else value

    return shortened(request)
