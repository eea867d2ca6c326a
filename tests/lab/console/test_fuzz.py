"""Malformed messages at the sockets of the console: nothing but refusals, memory bounded, and it serves on."""

from __future__ import annotations

import contextlib
import json
import random
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from websockets.exceptions import ConnectionClosed

from dorothie_gym.lab.console.connection import CloseCode
from tests.fuzzing import COUNTS, GROWTH, WRONG, check_raw_requests, malformed, memory, needs_memory
from tests.lab.console.malformed_messages import SOUND, STRICT, refusals
from tests.lab.console.people import Table
from tests.lab.console.serving import Served

SEATS = "participant", "co_wizard", "ad_wizard", "experimenter", "spectator"


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    monkeypatch.setattr("dorothie_gym.lab.console.connection.BURST", 1e9)  # the limit of the rate has tests of its own
    table = Table("participant=human,co_wizard=human,ad_wizard=human", max_seconds=3600.0)
    with Served(table.room) as running:
        yield running


@needs_memory()
@pytest.mark.parametrize(("seed", "count"), COUNTS)
def test_malformed_messages_are_refused_one_by_one(
    served: Served, caplog: pytest.LogCaptureFixture, request: pytest.FixtureRequest, seed: int, count: int
) -> None:
    drawn = random.Random(seed + request.config.getoption("--malformed-seed"))
    batch, before = 40, 0.0
    for number in range(count // batch):
        seat = served.room.seats[SEATS[number % len(SEATS)]]
        with served.connect(seat.token) as socket:
            for _ in range(batch):
                text = malformed(drawn, SOUND, STRICT)
                if drawn.random() < 0.05:
                    socket.send(drawn.randbytes(drawn.randrange(300)))
                else:
                    socket.send(text.encode("utf-8", "surrogatepass").decode("utf-8", "replace"))
            refusals(socket, batch)
        if number == 5:
            before = memory()
    assert memory() - before < GROWTH
    assert not caplog.records, "no error of the program"
    with (
        served.connect(served.room.seats["co_wizard"].token) as socket,
        served.connect(served.room.seats["participant"].token),
        served.connect(served.room.seats["ad_wizard"].token),
    ):
        assert json.loads(socket.recv(timeout=10))["k"] == "hello"
        socket.send(json.dumps({"k": "drive", "n": 1, "action": "SpeedChange", "up": True}))
        while json.loads(socket.recv(timeout=10)).get("done") != 1:
            pass


@needs_memory()
def test_large_frames_broken_text_and_wrong_tokens_end_the_connection(
    served: Served, caplog: pytest.LogCaptureFixture
) -> None:
    drawn, before = random.Random(3), memory()
    token = served.room.seats["spectator"].token
    contents: list[tuple[str | bytes, bool, set[int]]] = [
        ("a" * 2**20, True, {1009}),
        (bytes(2**20), False, {1009}),
        (b'{"k":"ping","c":\xff\xfe}', True, {1007}),
        (b"\xed\xa0\x80", True, {1007}),
    ]
    for _ in range(10):
        for content, is_text, codes in contents:
            with served.connect(token) as socket:
                socket.send(content, text=is_text)
                assert closing_code(socket) in codes
    first = [{"k": "join", "token": each} for each in (*map(str, WRONG), token[:-1], f"{token}x", "\ud800", "é", "..")]
    first += [{"k": "join"}, {"k": "join", "token": 5}, {"k": "join", "token": token, "more": 1}, {"k": "ping", "c": 1}]
    for message in first:
        with served.connect() as socket:
            socket.send(json.dumps(message))
            assert closing_code(socket) in (CloseCode.REFUSED, CloseCode.UNKNOWN_SEAT), message
    for _ in range(40):
        with served.connect() as socket:
            with contextlib.suppress(ConnectionClosed):
                socket.send(drawn.randbytes(drawn.randrange(1, 500)), text=drawn.random() < 0.5)
            assert closing_code(socket) in (CloseCode.REFUSED, CloseCode.UNKNOWN_SEAT, 1007)
    check_raw_requests(served.port, drawn, 150)
    assert served.get("/seat")[0] == 200
    assert memory() - before < GROWTH
    errors = [record.getMessage() for record in caplog.records if record.levelname == "ERROR"]
    assert set(errors) <= {"Invalid UTF-8 sequence received from client."}, "uvicorn's words for such a refusal"


def closing_code(socket: Any) -> int:
    try:
        while True:
            socket.recv(timeout=10)
    except ConnectionClosed as closed:
        return int((closed.rcvd or closed.sent).code)  # type: ignore[union-attr]  # one of them closed it
