"""Withdrawals at a running server whose disk fails, and by command."""

from __future__ import annotations

import errno
import os
import time
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from tests.cli.test_study import command
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.faults import prepare
from tests.lab.studies.faults import remains as remains_of
from tests.lab.studies.serving import Client, ServedStudy, at_once, seat
from tests.lab.studies.test_server import remains


@pytest.mark.long
def test_a_backup_beside_the_records_goes_with_them(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, STUDY), data) as served:
        one, two = Client(served.port), Client(served.port)
        one.enter({"PROLIFIC_PID": "platform-one"})
        two.enter()
        seat(one, two)
        with one.sit() as here, two.sit():
            one.say(here, "Marmalade, please.")
            at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
        (data / "sessions/S00001-01.zip").write_bytes(b"Marmalade")
        one.do("withdraw", {"sure": True})
        assert "deleted" in one.view["gone"] and "at once" not in one.view["gone"]
        assert not list((data / "sessions").iterdir())
        assert not any(remains(data, text) for text in ("armalade", one.view.get("id", "platform-one")))
        two.finish()


def test_a_server_whose_disk_fails_tells_the_person_and_tries_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    data, unlink, broken = tmp_path / "data", os.unlink, [True]

    def failing(path: str, *more: object, **options: int) -> None:
        if broken[0] and str(path).endswith("/events.jsonl"):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        unlink(path, *more, **options)

    monkeypatch.setattr(os, "unlink", failing)
    monkeypatch.setattr("dorothie_gym.lab.studies.server.CLEANING_PERIOD", 0.5)
    file = write_study(tmp_path, {**SOLO, "tutorial": None})
    with ServedStudy(file, data) as served:
        one = Client(served.port)
        one.do("join", {"parameters": {"PROLIFIC_PID": "platform-one"}})
        one.do("consent", {"agreed": [True, True]})
        one.do("answers", {"stage": "before", "answers": {"age": 30}})
        one.do("proceed", {"stage": "instructions"})
        name = one.view["id"]
        with one.sit() as here:
            one.say(here, "Marmalade, please.")
            one.do("withdraw", {"sure": True})
        assert "could not be deleted at once" in one.view["gone"] and STUDY["contact"] in one.view["gone"]
        assert remains(data, "platform-one") == [] and remains(data / "sessions", "armalade") != []
        assert "still to be deleted" in caplog.text
    with ServedStudy(file, data):  # starts all the same
        assert list((data / "sessions").iterdir())
        broken[0] = False
        end = time.monotonic() + 10.0
        while list((data / "sessions").iterdir()):
            assert time.monotonic() < end
            time.sleep(0.05)
    assert remains(data, name) == [] and remains(data, "armalade") == []


def test_the_command_finishes_what_was_interrupted_and_names_what_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, rmdir = tmp_path / "data", os.rmdir
    name = prepare(data)
    write_study(data, SOLO)
    (data / "notes.txt").write_text(f"{name} was nice")

    def failing(path: str, **options: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))

    monkeypatch.setattr(os, "rmdir", failing)
    code, text = command("delete", data, "platform-one")
    assert code == 1 and "S00001-01/utterance: cannot be removed (Input/output error)" in text and "notes.txt" in text
    code, text = command("delete", data, "platform-one")
    assert code == 1 and "cannot be removed" in text
    monkeypatch.setattr(os, "rmdir", rmdir)
    (data / "notes.txt").unlink()
    assert command("delete", data, "platform-one") == (0, "An interrupted deletion is finished.")
    assert remains_of(data, name) == []
    code, text = command("delete", data, "platform-one")
    assert code == 2 and "has no participant 'platform-one'" in text
