"""`dorothie-gym study`: example, check, run and restart, invitations, export, deletion."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.session.recording import Session
from tests.lab.studies.content import SOLO, STUDY, write_study

pytest.importorskip("websockets", reason="needs the extra console")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.lab.studies.serving import Client, at_once, seat


def command(*words: object) -> tuple[int, str]:
    """Runs a command; returns its exit code and output on one line."""
    result = CliRunner().invoke(app, ["study", *map(str, words)])
    return result.exit_code, " ".join((result.stdout + result.stderr).split())


@contextmanager
def running(file: Path, data: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Runs a study in a process of its own; yields it and its port."""
    words = [sys.executable, "-m", "dorothie_gym.cli", "study", "run", str(file), "--out", str(data)]
    with subprocess.Popen(
        [*words, "--port", "0", "--json"], stdout=subprocess.PIPE, text=True, env=os.environ
    ) as server:
        try:
            assert server.stdout is not None
            links = json.loads(server.stdout.readline())
            link = links["link"]
            assert links["experimenter"].startswith(f"{link}experimenter#"), "what is behind the # is not sent"
            yield server, int(link.rstrip("/").rpartition(":")[2])
        finally:
            server.kill()


def table(data: Path, out: Path, name: str) -> list[dict[str, str]]:
    assert command("export", data, "--out", out)[0] == 0
    with (out / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_example_is_written_once_and_checked(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    assert command("init", file)[0] == 0
    assert command("init", file) == (2, f"Error: {file}: exists; give the name of a new file")
    code, text = command("check", file)
    assert code == 0 and "People play: participant, co_wizard." in text
    assert "1 exact in brookside (lunch_break)" in text
    code, text = command("check", file, "--json")
    assert json.loads(text)["block_size"] == 2 and json.loads(text)["notes"] == []


def test_endings_without_a_code_are_noted(tmp_path: Path) -> None:
    pair = write_study(tmp_path, {**STUDY, "recruitment": {"completion": {"code": "FINISHED"}}})
    code, text = command("check", pair)
    assert code == 0 and "Note: recruitment.no_partner has no code" in text and "completion" not in text
    alone = write_study(tmp_path, {**SOLO, "recruitment": {}})
    code, text = command("check", alone)
    assert code == 0 and "Note: recruitment.completion has no code" in text and "no_partner" not in text


def test_mistakes_are_named(tmp_path: Path) -> None:
    file = write_study(tmp_path, {**SOLO, "contact": 5})
    for name in ("check", "run"):
        code, text = command(name, file, *(["--out", tmp_path / "data"] if name == "run" else []))
        assert code == 2 and text == f"Error: {file}, line 2, contact: expected `str`, got `int`"
    for words in (("export", tmp_path, "--out", tmp_path / "o"), ("delete", tmp_path, "P"), ("invite", tmp_path)):
        code, text = command(*words)
        assert code == 2 and str(tmp_path) in text
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "other").touch()
    code, text = command("run", write_study(tmp_path, SOLO), "--out", tmp_path / "full")
    assert code == 2 and "holds something else than a study" in text


@pytest.mark.slow
def test_people_go_on_after_the_server_was_killed(tmp_path: Path) -> None:
    file, data = write_study(tmp_path, STUDY), tmp_path / "data"
    with running(file, data) as (server, port):
        one, two, late = Client(port), Client(port), Client(port)
        late.do("join", {"parameters": {"PROLIFIC_PID": "late"}})
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit() as here, two.sit():
            one.say(here, "Marmalade, please.")
            assert command("delete", data, one.view["id"])[0] == 2, "the server is running"
            server.send_signal(signal.SIGKILL)
            server.wait(10)
    with running(file, data) as (server, port):
        for each in (one, two, late):
            each.port, each.tag, each.view = port, "", {}
        late.do("news")
        assert late.stage == "consent"
        seat(one, two)
        with one.sit(), two.sit():
            at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
        at_once(lambda: one.finish("=Velvet()"), two.finish)
        server.send_signal(signal.SIGINT)
        server.wait(20)
    (row,) = table(data, tmp_path / "out", "sessions")
    assert row["reason"] == "out of time" and {row["participant"], row["co_wizard"]} == {one.view["id"], two.view["id"]}
    session = data / row["folder"]
    assert Session.load(session).complete
    result = CliRunner().invoke(app, ["replay", str(session), "--check"])
    assert result.exit_code == 0, result.output
    said = [line["text"] for line in table(data, tmp_path / "out", "utterances")]
    assert any("armalade" in text for text in said)
    comments = {
        line["participant"]: line["value"]
        for line in table(data, tmp_path / "out", "answers")
        if line["item"] == "comment"
    }
    assert comments[one.view["id"]] == "'=Velvet()", "no formula for spreadsheets"
    assert b"late" not in b"".join(path.read_bytes() for path in (tmp_path / "out").iterdir())
    code, text = command("delete", data, "late")
    assert code == 0 and text.startswith("Everything of P")
    code, text = command("delete", data, one.view["id"])
    assert code == 0 and row["session"] in text and not session.exists()
    assert table(data, tmp_path / "out", "sessions")[0]["reason"] == "withdrawn"
    assert command("delete", data, one.view["id"])[0] == 2


def test_an_invitation_admits_one_person_once(tmp_path: Path) -> None:
    file, data = write_study(tmp_path, {**SOLO, "recruitment": {"admission": "invited"}}), tmp_path / "data"
    with running(file, data) as (_, port):
        code, text = command("invite", data, "--count", 2, "--address", "https://study.example.org/", "--json")
        assert code == 0
        links = json.loads(text)["links"]
        assert all(link.startswith("https://study.example.org/#") for link in links)
        token = links[0].rpartition("#")[2]
        assert token.encode() not in (data / "study.sqlite").read_bytes()
        one, two = Client(port), Client(port)
        assert two.post("join") == two.post("join", {"invitation": "wrong"}) == 409
        one.do("join", {"invitation": token})
        assert two.post("join", {"invitation": token}) == 409
        one.do("join", {"invitation": token})  # the same browser loads its link again
        assert one.stage == "consent"
        first = one.view["id"]
        one.do("join", {"invitation": links[1].rpartition("#")[2]})
        assert one.view["id"] != first, "another person at a shared computer"


@pytest.mark.long
def test_data_are_not_mixed_with_those_of_a_changed_study(tmp_path: Path) -> None:
    file, data = write_study(tmp_path, SOLO), tmp_path / "data"
    with running(file, data):
        code, text = command("run", file, "--out", data)
        assert code == 2 and "its server is running" in text
    before = file.read_text(encoding="utf-8")
    write_study(tmp_path, {**SOLO, "title": "Another title"})
    with running(file, data):
        pass
    assert (data / "study.1.yaml").read_text(encoding="utf-8") == before
    write_study(tmp_path, {**SOLO, "conditions": [{"name": "other"}]})
    code, text = command("run", file, "--out", data)
    assert code == 2 and "was begun with other conditions" in text
