"""Malformed messages for servers, requests on the raw socket, and the memory of this process."""

from __future__ import annotations

import json
import os
import random
import socket
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

COUNTS = [(1, 400), pytest.param(2, 10_000, marks=pytest.mark.slow)]
"""Seeds and numbers of malformed messages; `--malformed-seed` is added to the seed."""

GROWTH = 60.0
"""Most memory that a server may gain by malformed messages [MB]."""

WRONG: Sequence[Any] = (None, {}, [{}], [[[[]]]], 10**40, -(10**40), -1e308, "\ud800", "x" * 9000, True, "", "\x00")
"""Values of which each is wrong for fields of several types."""

TRICKS = (
    "/static/../server.py", "/static/%2e%2e/server.py", "/static/..%2fserver.py", "/static/%2e%2e%2fcli/app.py",
    "/static/%252e%252e/server.py", "/static//etc/passwd", "/static/%00", "/static/main.js%00", "/static/%ff%fe",
    "/towns/..%2f..%2fserver.json", "/towns/%00.json", "/towns/%2e%2e.json", "/../../../../etc/passwd", "//etc/passwd",
    "/seat/..", "/%", "/%zz", "/\\..\\..\\x", "/speech/heard", "/study.sqlite", "/.git/config", "/ws", "/ws/../x",
)  # fmt: skip
"""Paths that lead to no page."""


def memory() -> float:
    """Returns the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def needs_memory() -> pytest.MarkDecorator:
    """Skips a test where the memory of a process cannot be measured."""
    return pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="memory is measured in /proc")


def malformed(drawn: random.Random, sound: Sequence[Mapping[str, Any]], strict: Mapping[str, Any]) -> str:
    """Returns a text that no server may accept.

    Args:
        drawn: source of randomness.
        sound: messages that would be accepted.
        strict: fields that are in some of them, and a wrong value of each.
    """
    message = dict(drawn.choice(sound))
    text = json.dumps(message)
    kind = drawn.randrange(9)
    if kind == 0:
        return drawn.choice("}]:,x\x00") + "".join(map(chr, drawn.choices(range(1, 0x2FF), k=drawn.randrange(200))))
    if kind == 1:
        return drawn.choice("[{") * drawn.randrange(1, 8000)
    if kind == 2:
        return drawn.choice(["1", '"x"', "null", "[]", "{}", "1e999", "-", "NaN", "9" * 5000, '"\\ud800"'])
    if kind == 3:
        return json.dumps({**message, "".join(drawn.choices("abcdefgh_", k=5)) + "_": drawn.choice(WRONG)})
    if kind == 4:
        return text[: drawn.randrange(len(text))] if drawn.random() < 0.5 else f"{text}{drawn.choice('}]x,0')}"
    if kind == 5:
        at = drawn.choice([k for k, letter in enumerate(text) if letter in ",:{}"])
        return text[: at + 1] + drawn.choice(["\x00", "\x1f", "NaN", "'", "//"]) + text[at + 1 :]
    if kind == 6:
        return json.dumps({**message, "x" * drawn.randrange(9000, 14_000): 1})
    field = drawn.choice([name for name in message if name in strict])
    if kind == 7:
        del message[field]
        return json.dumps(message)
    return json.dumps({**message, field: drawn.choice(strict[field])})


def raw_answer(port: int, request: bytes) -> bytes:
    """Returns the beginning of what a server answers to bytes on its socket; nothing if it hangs up."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as raw:
        try:
            raw.sendall(request)
            raw.shutdown(socket.SHUT_WR)
            return raw.recv(4000)
        except TimeoutError:
            raise
        except OSError:  # it has hung up
            return b""


def raw_requests(drawn: random.Random, count: int) -> Iterator[bytes]:
    """Yields requests that are malformed as HTTP, or ask for files by tricks."""
    for _ in range(count):
        path = drawn.choice(TRICKS).encode()
        yield drawn.choice(
            [
                b"GET %b HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n" % path,
                b"POST %b HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\n" % path,
                b"GET %b\x00 HTTP/1.1\r\nHost: x\r\n\r\n" % path,
                b"GET %b HTTP/9.9\r\n\r\n" % path,
                b"GET /seat HTTP/1.1\r\nHost: \xff\xfe\r\nX: " + b"a" * 200_000 + b"\r\n\r\n",
                drawn.randbytes(drawn.randrange(1, 400)),
            ]
        )


def check_raw_requests(port: int, drawn: random.Random, count: int) -> None:
    """Sends malformed requests on the raw socket; each must be refused without the content of a file."""
    for request in raw_requests(drawn, count):
        answer = raw_answer(port, request)
        assert not answer or answer.split(b" ", 2)[1][:1] in (b"3", b"4"), (request[:200], answer[:200])
        assert b"import " not in answer and b"root:" not in answer, request[:200]
