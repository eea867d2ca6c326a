"""The server over real sockets: joining, refusals, headers, and pictures."""

from __future__ import annotations

import contextlib
import gzip
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from websockets.exceptions import ConnectionClosed, InvalidStatus

from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.lab.console.connection import CloseCode
from dorothie_gym.lab.console.messages import MAX_BYTES
from dorothie_gym.lab.console.resuming import Resumed
from dorothie_gym.lab.console.room import RoomState
from dorothie_gym.session.recording import Session
from tests.lab.console.people import Table
from tests.lab.console.serving import Served


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    table = Table("co_wizard=human", folder=tmp_path_factory.mktemp("sessions"))
    with Served(table.room) as running:
        yield running


def closing_code(socket: Any) -> int:
    try:
        for _ in range(500):
            socket.recv(timeout=5)
    except ConnectionClosed as closed:
        assert closed.rcvd is not None
        return int(closed.rcvd.code)
    raise AssertionError("the connection stayed open")


def test_a_seat_is_joined_and_driven_in_real_time(served: Served) -> None:
    seat = served.room.seats["co_wizard"]
    with served.connect(seat.token) as socket:
        assert json.loads(socket.recv(timeout=5))["k"] == "hello"
        first = json.loads(socket.recv(timeout=5))
        socket.send(json.dumps({"k": "drive", "n": 1, "action": "SpeedChange", "up": True}))
        state = dict(first)
        while state.get("done") != 1:
            state |= json.loads(socket.recv(timeout=5))
        assert state["cruise"] == first["cruise"] + 5
    served.room.seats["co_wizard"].away_since = None


def test_wrong_tokens_and_other_first_messages_are_refused(served: Served) -> None:
    with served.connect("nonsense") as socket:
        assert closing_code(socket) == CloseCode.UNKNOWN_SEAT
    for content in ('{"k":"ping","c":1}', "{", b"\x00\x01"):
        with served.connect() as socket:
            socket.send(content)
            assert closing_code(socket) in (CloseCode.UNKNOWN_SEAT, CloseCode.REFUSED)


def test_pages_of_other_hosts_cannot_connect(served: Served) -> None:
    with pytest.raises(InvalidStatus), served.connect(origin="https://example.org"):
        pass
    with served.connect(origin=f"http://127.0.0.1:{served.port}"):
        pass


def test_floods_and_large_messages_end_the_connection(served: Served) -> None:
    token = served.room.seats["spectator"].token
    with served.connect(token) as socket:
        with contextlib.suppress(ConnectionClosed):  # while it is still sending
            for _ in range(400):
                socket.send('{"k":"ping","c":1}')
        assert closing_code(socket) == CloseCode.TOO_FAST
    with served.connect(token) as socket:
        socket.send("a" * 2**20)
        assert closing_code(socket) == 1009
    with served.connect(token) as socket:
        socket.send("a" * (MAX_BYTES + 10))
        while (message := json.loads(socket.recv(timeout=5)))["k"] != "refused":
            assert message["k"] in ("hello", "frame")
        assert f"at most {MAX_BYTES}" in message["reason"]


def test_every_answer_forbids_foreign_content(served: Served) -> None:
    for path in ("/seat", "/console/main.js", "/nothing"):
        _, headers, _ = served.get(path)
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"]
        assert headers["Referrer-Policy"] == "no-referrer"


def test_only_the_files_of_the_page_are_served(served: Served) -> None:
    assert served.get("/static/../server.py")[0] == 404
    assert served.get("/static/%2e%2e/server.py")[0] == 404
    assert served.get("/static//etc/passwd")[0] == 404
    assert served.get("/towns/..%2f..%2fserver.json")[0] == 404
    assert served.get("/towns/midtown.json")[0] == 404, "no session is there"


def test_the_map_of_the_town_is_served(served: Served) -> None:
    status, headers, content = served.get("/towns/brookside.json")
    page = json.loads(gzip.decompress(content))
    assert status == 200 and headers["Content-Encoding"] == "gzip"
    town = served.room.engine.town
    assert len(page["junctions"]) == len(town.junctions)
    assert {label[0] for label in page["labels"]} <= {street.id for street in town.streets}
    assert len(page["shapes"]) > 500


def test_the_record_is_complete_when_the_server_stops(tmp_path: Path) -> None:
    table = Table("co_wizard=human", folder=tmp_path)
    with Served(table.room) as running, running.connect(table.room.seats["co_wizard"].token) as socket:
        for _ in range(6):
            socket.recv(timeout=5)
    (folder,) = tmp_path.iterdir()
    session = Session.load(folder)
    assert session.complete and session.summary is not None and session.summary["reason"] == "technical"
    assert resimulate(session, table.room.engine.town).digest == session.digest


def test_an_error_of_the_program_ends_its_room_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    table = Table("co_wizard=human", folder=tmp_path)
    token = table.room.seats["co_wizard"].token
    with Served(table.room) as running:
        with running.connect(token) as socket:
            for _ in range(5):
                socket.recv(timeout=5)
            monkeypatch.setattr(table.room.engine, "step", None)  # a fault that no message of a browser causes
            assert closing_code(socket) == CloseCode.FAILED
        with running.connect(token) as socket:
            assert closing_code(socket) == CloseCode.FAILED
        assert running.get("/seat")[0] == 200
    assert "a session of the console failed" in caplog.text
    (folder,) = tmp_path.iterdir()
    assert not Session.load(folder).complete, "it can go on"


def test_a_disk_that_is_full_ends_the_session_for_its_people_and_it_can_go_on(tmp_path: Path) -> None:
    from tests.full_disk import full_disk  # skips the test where the system has no such limits

    table = Table("co_wizard=human", folder=tmp_path)
    with Served(table.room) as running, running.connect(table.room.seats["co_wizard"].token) as socket:
        for _ in range(5):
            socket.recv(timeout=5)
        with full_disk():
            assert closing_code(socket) == CloseCode.FAILED
        assert table.room.failed and table.room.state is RoomState.OVER
    (folder,) = tmp_path.iterdir()
    assert len(Resumed.load(folder).session.trajectory) > 0
