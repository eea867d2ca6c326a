"""The experimenter of a study: a link that works once, people who wait, rooms, pause, messages and the end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

import websockets.sync.client as sockets

from dorothie_gym.session.recording import SeatEventKind, Session, read_seat_log
from tests.lab.studies.content import STUDY, write_study
from tests.lab.studies.serving import Client, ServedStudy, at_once, seat
from tests.lab.studies.test_server import exported

LONG = {**STUDY, "session": {"max_seconds": 300.0, "pictures": False}}


def entered(served: ServedStudy) -> Client:
    """Returns a browser that has opened the experimenter's link."""
    assert served.study is not None
    made = Client(served.port)
    made.do("experimenter/enter", {"token": served.study.experimenter.token})
    return made


def room(experimenter: Client) -> dict[str, Any]:
    experimenter.do("experimenter/overview")
    (found,) = (each for each in experimenter.view["rooms"] if each["session"])
    return dict(found)


def test_the_link_admits_one_browser_and_nobody_else(tmp_path: Path) -> None:
    with ServedStudy(write_study(tmp_path, LONG), tmp_path / "data") as served:
        assert served.study is not None
        token, stranger = served.study.experimenter.token, Client(served.port)
        for wrong in ("", "x", token[:-1], f"{token}x", "\ud800"):
            assert stranger.post("experimenter/enter", {"token": wrong}) in (400, 409)
        assert stranger.post("experimenter/overview") == 401
        assert stranger.post("experimenter/enter", {"token": token, "more": 1}) == 400
        first = entered(served)
        first.do("experimenter/enter", {"token": token})  # the same browser loads its link again
        assert stranger.post("experimenter/enter", {"token": token}) == 409
        assert "has been used" in stranger.answer["error"]
        participant = Client(served.port)
        participant.do("join")
        assert participant.post("experimenter/overview") == 401
        assert first.cookie.startswith(f"dorothie_experimenter_{first.port}=") and token not in first.cookie
        first.cookie = f"{first.cookie}x"
        assert first.post("experimenter/overview") == 401
        status, headers, _ = first.send("GET", "/experimenter")
        assert status == 200 and "script-src 'self'" in headers["Content-Security-Policy"]


def test_waiting_people_and_rooms_are_listed_and_a_session_is_paused_and_ended(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, LONG), data) as served:
        experimenter, one, two = entered(served), Client(served.port), Client(served.port)
        assert experimenter.view["waiting"] == [] == experimenter.view["rooms"]
        one.enter()
        one.do("news")
        experimenter.do("experimenter/overview")
        (waits,) = experimenter.view["waiting"]
        assert waits["id"] == one.view["id"] and waits["role"] in ("participant", "co_wizard")
        assert experimenter.view["stages"] == {"lobby": 1}
        two.enter()
        seat(one, two)
        with one.sit() as here, two.sit():
            found = room(experimenter)
            assert {each["id"] for each in found["people"]} == {one.view["id"], two.view["id"]}
            assert found["condition"] in ("exact", "noisy")
            with sockets.connect(f"ws://127.0.0.1:{served.port}/ws", max_size=2**22) as control:
                control.send(json.dumps({"k": "join", "token": found["token"]}))
                assert json.loads(control.recv(timeout=10))["seat"] == "experimenter"
                control.send(json.dumps({"k": "control", "act": "pause"}))
                until(here, lambda message: message.get("state") == "paused")
                assert room(experimenter)["state"] == "paused"
                control.send(json.dumps({"k": "control", "act": "resume"}))
                control.send(json.dumps({"k": "announce", "text": "Please go on."}))
                until(here, lambda message: "Please go on." in [line["text"] for line in message.get("talk", ())])
                control.send(json.dumps({"k": "control", "act": "end"}))
                at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
            assert room(experimenter)["token"] is None, "there is nothing to control any more"
        at_once(one.finish, two.finish)
        assert one.view["code"] == "FINISHED"
    (row,) = exported(data, tmp_path / "out", "sessions")
    assert row["reason"] == "ended"
    outcomes = {row["outcome"] for row in exported(data, tmp_path / "out", "participants")}
    assert outcomes == {"interrupted"}
    folder = data / row["folder"]
    kinds = [event.kind for event in read_seat_log(folder) or ()]
    assert {SeatEventKind.PAUSED, SeatEventKind.RESUMED, SeatEventKind.ANNOUNCED} <= set(kinds)
    assert Session.load(folder).complete


def until(socket: Any, reached: Any) -> None:
    """Reads messages of a seat until one is as wanted."""
    while not reached(json.loads(socket.recv(timeout=20))):
        pass
