"""Speech at the seats: recordings become text, lines of others are spoken, and nobody else gets either."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.console.config import ConsoleConfig
from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.lab.console.spoken_turns import MAX_BYTES
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.speech import find_synthesizer, say
from dorothie_gym.support.audio import read_audio
from tests.lab.console.people import SEED, TOWN
from tests.lab.console.serving import Served

TURN = "Turn left at the KFC, please."


def spoken(text: str) -> bytes:
    """A recording as a browser sends it."""
    return np.rint(say(find_synthesizer(), text) * 32767).astype("<i2").tobytes()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    config = ConsoleConfig(pictures=False, speech=True)
    engine = SessionEngine(TOWN, config=config.environment())
    room = Room(engine, parse_roles("participant=human,co_wizard=human"), config, seed=SEED, folder=tmp_path / "out")
    with Served(room) as running:
        yield running


def ask(served: Served, path: str, token: str | None, body: bytes | None = None) -> tuple[int, bytes]:
    headers = {} if token is None else {"Authorization": f"Bearer {token}"}
    request = urllib.request.Request(f"http://127.0.0.1:{served.port}{path}", data=body, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read()


def until(socket: Any, wanted: str) -> dict[str, Any]:
    """Returns the next message that has a field."""
    while True:
        message: dict[str, Any] = json.loads(socket.recv(timeout=30))
        if wanted in message:
            return message


@pytest.mark.long
def test_recording_is_recognised_said_kept_and_spoken_to_the_other(served: Served, tmp_path: Path) -> None:
    participant, driver = (served.room.seats[name] for name in ("participant", "co_wizard"))
    with served.connect(participant.token) as first, served.connect(driver.token) as second:
        assert until(first, "speech")["speech"] is True
        while served.room.record is None:
            until(first, "time")
        status, content = ask(served, "/speech/heard", participant.token, spoken(TURN))
        heard = json.loads(content)
        assert status == 200 and "left" in heard["text"] and "KFC" in heard["text"]
        assert 0.0 <= heard["confidence"] <= 1.0 and heard["audio"] == "participant_1.flac"
        first.send(json.dumps({"k": "say", "n": 1, "text": heard["text"], "audio": heard["audio"]}))
        line = until(second, "talk")["talk"][0]
        assert line["who"] == "participant" and "KFC" in line["text"]
        status, wav = ask(served, "/speech/said/0", driver.token)
        assert status == 200 and wav[:4] == b"RIFF" and len(wav) > 16000
        assert ask(served, "/speech/said/0", participant.token)[0] == 404, "own words are not spoken"
        assert ask(served, "/speech/said/1", driver.token)[0] == 404
    folder = next((tmp_path / "out").iterdir())
    assert len(read_audio(folder / "utterance" / "participant_1.flac")) == len(spoken(TURN)) // 2
    rows = [json.loads(row) for row in (folder / "seats.jsonl").read_text(encoding="utf-8").splitlines()]
    said = [row for row in rows if "source" in json.dumps(row)]
    assert said and all('"participant_1.flac"' in json.dumps(row) for row in said)


def test_strangers_and_seats_that_only_watch_have_no_speech(served: Served) -> None:
    seats = served.room.seats
    for token in (None, "wrong", seats["spectator"].token, seats["experimenter"].token):
        assert ask(served, "/speech/heard", token, spoken("Left."))[0] == 403
        assert ask(served, "/speech/said/0", token)[0] == 403


def test_recordings_of_wrong_size_are_refused_and_short_ones_say_nothing(served: Served) -> None:
    token = served.room.seats["participant"].token
    assert ask(served, "/speech/heard", token, bytes(MAX_BYTES + 2))[0] == 413
    assert ask(served, "/speech/heard", token, bytes(3201))[0] == 400
    for silent in (b"", bytes(1000), bytes(32000)):
        status, content = ask(served, "/speech/heard", token, silent)
        assert status == 200 and json.loads(content) == {"text": "", "confidence": None, "audio": None}


def test_recording_of_another_seat_cannot_be_claimed(served: Served) -> None:
    seats = served.room.seats
    with served.connect(seats["participant"].token) as first, served.connect(seats["co_wizard"].token):
        first.send(json.dumps({"k": "say", "n": 1, "text": "Left.", "audio": "co_wizard_1.flac"}))
        assert "no recording of that name" in until(first, "reason")["reason"]


def test_console_without_speech_has_no_such_pages() -> None:
    config = ConsoleConfig(pictures=False)
    engine = SessionEngine(TOWN, config=config.environment())
    room = Room(engine, parse_roles("participant=human"), config, seed=SEED)
    with Served(room) as running, running.connect(room.seats["participant"].token) as socket:
        assert until(socket, "speech")["speech"] is False
        assert ask(running, "/speech/heard", room.seats["participant"].token, b"")[0] == 404
