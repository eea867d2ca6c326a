"""Connections that ask for nothing, or for too much: they give way, or are ended, and people are seated."""

from __future__ import annotations

import contextlib
import json
import os
import re
import socket
import time
from collections.abc import Iterator

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
from websockets.exceptions import ConnectionClosed

from dorothie_gym.lab.console.connection import CloseCode
from tests.lab.console.people import Table
from tests.lab.console.serving import Served
from tests.lab.console.test_fuzz import closing_code


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    monkeypatch.setattr("dorothie_gym.lab.web.MOST_STRANGERS", 40)
    monkeypatch.setattr("dorothie_gym.lab.console.server.MOST_JOINING", 20)
    monkeypatch.setattr("dorothie_gym.lab.admission.STRANGER_SECONDS", 2.0)
    with Served(Table("co_wizard=human").room) as running:
        yield running


def is_closed(connection: socket.socket) -> bool:
    """Returns whether the server has ended a connection."""
    connection.settimeout(0.01)
    try:
        return not connection.recv(1)
    except TimeoutError:
        return False
    except OSError:
        return True


def seat_somebody(served: Served) -> None:
    assert served.get("/console/main.js")[0] == 200
    with served.connect(served.room.seats["spectator"].token) as socket:
        assert json.loads(socket.recv(timeout=10))["k"] == "hello"


@pytest.mark.parametrize("sent", [b"", b"GET /seat HTTP/1.1\r\nHost: x\r\n"])
def test_connections_that_do_not_ask_give_way_and_have_limited_time(served: Served, sent: bytes) -> None:
    with contextlib.ExitStack() as stack:
        flood = [stack.enter_context(socket.create_connection(("127.0.0.1", served.port))) for _ in range(100)]
        for each in flood:
            with contextlib.suppress(OSError):
                each.sendall(sent)
        with served.connect(served.room.seats["co_wizard"].token, max_queue=None) as seat:
            seat_somebody(served)
            assert sum(map(is_closed, flood)) >= 60
            end = time.monotonic() + 20.0
            while not all(map(is_closed, flood)):
                assert time.monotonic() < end
            assert seat.recv(timeout=10), "a person at a seat stays"


def test_websockets_that_do_not_join_give_way_and_may_try_again(served: Served) -> None:
    with contextlib.ExitStack() as stack:
        waiting = [stack.enter_context(served.connect()) for _ in range(21)]
        seat_somebody(served)
        with pytest.raises(ConnectionClosed) as closed:
            waiting[0].recv(timeout=10)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == CloseCode.TOO_SLOW


def test_a_slow_browser_that_has_not_joined_in_time_may_try_again(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.console.server.JOIN_SECONDS", 0.2)
    with served.connect() as waiting, pytest.raises(ConnectionClosed) as closed:
        waiting.recv(timeout=10)
    assert closed.value.rcvd is not None and closed.value.rcvd.code == CloseCode.TOO_SLOW


@pytest.mark.parametrize("part", [100, 2**20])
def test_a_websocket_that_sends_much_before_it_joins_learns_why_it_is_ended(served: Served, part: int) -> None:
    with served.connect() as seat:
        with contextlib.suppress(ConnectionClosed, OSError):
            for _ in range(max(1, 2**16 // part)):
                seat.ping(os.urandom(100)) if part == 100 else seat.send("a" * part)
        assert closing_code(seat) == 1009


def test_a_message_before_the_answer_to_the_handshake_is_read(served: Served) -> None:
    with socket.create_connection(("127.0.0.1", served.port), timeout=20) as raw:
        raw.sendall(
            b"GET /ws HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
            b"\x81\x81\0\0\0\0{"
        )
        content = b""
        while len(content.partition(b"\r\n\r\n")[2]) < 4:
            content += raw.recv(65536)
    assert content.partition(b"\r\n\r\n")[2] == b"\x88\x02" + CloseCode.REFUSED.to_bytes(2, "big")


def test_pipelined_requests_are_answered_in_order(served: Served) -> None:
    with socket.create_connection(("127.0.0.1", served.port), timeout=20) as raw:
        paths = [b"/seat", b"/nothing", b"/console/main.js"] * 10
        for path in paths:
            raw.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        raw.sendall(b"GET /seat HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
        content = b"".join(iter(lambda: raw.recv(65536), b""))
    statuses = re.findall(rb"HTTP/1\.1 (\d{3}) ", content)
    assert statuses == [b"200", b"404", b"200"] * 10 + [b"200"]
