"""A study over HTTP and websockets: from the link to the completion code, withdrawal, restarts, and refusals."""

from __future__ import annotations

import contextlib
import csv
import json
import time
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.lab.studies.export import export_study
from dorothie_gym.maps import load_town
from dorothie_gym.session.recording import SeatEventKind, Session, read_seat_log
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.serving import Client, ServedStudy, at_once, seat


def remains(folder: Path, text: str) -> list[str]:
    """Names the files of a folder that hold a text; looks again where a server removes one meanwhile."""
    while True:
        with contextlib.suppress(FileNotFoundError):
            return [path.name for path in folder.rglob("*") if path.is_file() and text.encode() in path.read_bytes()]


def exported(data: Path, out: Path, table: str) -> list[dict[str, str]]:
    """Returns the rows of a table of the export."""
    export_study(data, out)
    with (out / f"{table}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_two_people_go_from_the_link_to_the_code(tmp_path: Path) -> None:
    with ServedStudy(write_study(tmp_path, STUDY), tmp_path / "data") as served:
        one, two = Client(served.port), Client(served.port)
        one.enter({"PROLIFIC_PID": "platform-one", "STUDY_ID": "s", "other": "left out"})
        two.enter({"PROLIFIC_PID": "platform-two"})
        seat(one, two)
        with one.sit() as here, two.sit():
            one.say(here, "Marmalade, please.")
            one.follow(lambda: one.view.get("over"))
        at_once(two.finish, lambda: one.finish("quite nice"))
        assert one.view["code"] == two.view["code"] == "FINISHED"
        assert one.view["url"] == "https://recruiting.example.org/done"
        for secret in (two.view["id"], "platform", "exact", "noisy", "condition", "brookside", "scripted"):
            assert secret.encode() not in one.received, f"the page is told {secret!r}"
    (folder,) = (tmp_path / "data" / "sessions").iterdir()
    session = Session.load(folder)
    assert session.complete
    study = session.header.extra["study"]
    assert set(study["participants"].values()) == {one.view["id"], two.view["id"]}  # type: ignore[index]
    again = resimulate(session, load_town("brookside"))
    assert again.digest == session.digest
    assert remains(tmp_path / "data", "platform-one") == ["recruitment.sqlite"]
    assert remains(tmp_path / "data", "left out") == []


@pytest.mark.long
def test_withdrawal_leaves_nothing_of_a_person(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, STUDY), data) as served:
        one, two = Client(served.port), Client(served.port)
        one.enter({"PROLIFIC_PID": "platform-one"})
        two.enter({"PROLIFIC_PID": "platform-two"})
        seat(one, two)
        with one.sit() as here, two.sit() as there:
            one.say(here, "Marmalade, please.")
            two.say(there, "Certainly so.")
            at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
        at_once(lambda: two.finish("Shiny"), lambda: one.finish("Velvet"))
        name, other = one.view["id"], two.view["id"]
        assert remains(data, "armalade") and remains(data, "Velvet") and remains(data, name)
        one.do("withdraw", {"sure": True})
        assert one.view["gone"]
        for trace in ("armalade", "Certainly", "Velvet", name, "platform-one"):
            assert remains(data, trace) == [], trace
        assert not list((data / "sessions").iterdir())
        assert one.post("news") == 401
        two.tag = ""
        two.do("news")
        assert two.view["code"] == "FINISHED" and two.view["id"] == other
        assert remains(data, "Shiny") == ["study.sqlite"]
        assert remains(data, "platform-two") == ["recruitment.sqlite"]


def test_withdrawal_in_a_session_ends_it_for_both(tmp_path: Path) -> None:
    data = tmp_path / "data"
    longer = {**STUDY, "session": {"max_seconds": 300.0, "pictures": False}}
    with ServedStudy(write_study(tmp_path, longer), data) as served:
        one, two = Client(served.port), Client(served.port)
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit() as here, two.sit():
            one.say(here, "Marmalade, please.")
            name = one.view["id"]
            one.do("withdraw", {"sure": True})
            assert remains(data, "armalade") == [] and remains(data, name) == []
            two.finish()
        assert two.view["code"] == "FINISHED"
        three, four = Client(served.port), Client(served.port)
        three.enter()
        four.enter()
        seat(three, four)
    rows = exported(data, tmp_path / "out", "sessions")
    assert [row["reason"] for row in rows] == ["withdrawn", ""]
    assert len({row["slot"] for row in rows}) == 1, "the slot is free again"
    outcomes = {row["participant"]: row["outcome"] for row in exported(data, tmp_path / "out", "participants")}
    assert len(outcomes) == 3 and outcomes[two.view["id"]] == "interrupted"


@pytest.mark.long
def test_people_go_on_where_they_were_after_a_restart(tmp_path: Path) -> None:
    file, data = write_study(tmp_path, STUDY), tmp_path / "data"
    with ServedStudy(file, data) as served:
        early, one, two = Client(served.port), Client(served.port), Client(served.port)
        early.do("join")
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit() as here, two.sit():
            one.say(here, "Marmalade, please.")
    (partial,) = (data / "sessions").iterdir()
    assert not Session.load(partial).complete
    with ServedStudy(file, data) as served:
        for each in (early, one, two):
            each.port, each.tag = served.port, ""
            each.view = {}
        early.do("consent", {"agreed": [True, True]})
        assert early.stage == "before"
        seat(one, two)
        with one.sit(), two.sit():
            at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
        at_once(one.finish, two.finish)
    (folder,) = (data / "sessions").iterdir()
    session = Session.load(folder)
    assert session.complete and session.summary is not None and session.summary["reason"] == "out of time"
    assert remains(folder, "armalade"), "what was said before the restart is in the record"
    assert resimulate(session, load_town("brookside")).digest == session.digest


def test_a_person_who_leaves_ends_the_session_and_is_noted(tmp_path: Path) -> None:
    data = tmp_path / "data"
    longer = {**STUDY, "session": {"max_seconds": 300.0, "pictures": False}}
    with ServedStudy(write_study(tmp_path, longer), data) as served:
        one, two = Client(served.port), Client(served.port)
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit():
            with two.sit() as there:
                two.say(there, "Certainly so.")
            one.finish()
        two.finish()  # comes back after the end
    (row,) = exported(data, tmp_path / "out", "sessions")
    assert row["reason"] == "left"
    outcomes = {row["participant"]: row["outcome"] for row in exported(data, tmp_path / "out", "participants")}
    assert outcomes == {one.view["id"]: "interrupted", two.view["id"]: "left"}


@pytest.mark.long
def test_people_who_wait_in_vain_finish_with_another_code(tmp_path: Path) -> None:
    study = {**STUDY, "waiting_room": {"seconds": 1.0}}
    with ServedStudy(write_study(tmp_path, study), tmp_path / "data") as served:
        one = Client(served.port)
        one.enter()
        assert one.post("wait", {"on": False}) == 409
        one.follow(lambda: one.view.get("in_vain"))
        one.do("wait", {"on": True})
        assert not one.view["in_vain"]
        one.follow(lambda: one.view.get("in_vain"))
        one.do("wait", {"on": False})
        one.do("proceed", {"stage": "debriefing"})
        assert one.view["code"] == "WAITED"


@pytest.mark.long
def test_all_conditions_are_played_in_turn(tmp_path: Path) -> None:
    study = {
        **SOLO,
        "conditions": [{"name": "calm", "ad_wizard": "silent"}, {"name": "alone"}],
        "assignment": {"method": "balanced_latin_square", "seed": 3},
        "session": {"max_seconds": 5.0, "pictures": False},
    }
    study["questionnaires"] = {"after_session": [{"id": "mood", "kind": "likert", "text": "I felt well."}]}
    with ServedStudy(write_study(tmp_path, study), tmp_path / "data") as served:
        one = Client(served.port)
        one.do("join")
        one.do("consent", {"agreed": [True, True]})
        one.do("proceed", {"stage": "instructions"})
        one.do("proceed", {"stage": "tutorial"})
        for rating in (2, 6):
            with one.sit():
                one.follow(lambda: one.view.get("over"))
            one.do("proceed", {"stage": "session"})
            one.do("answers", {"stage": "after_session", "answers": {"mood": rating}})
        assert one.stage == "debriefing"
    played = {row["session"]: row["condition"] for row in exported(tmp_path / "data", tmp_path / "out", "sessions")}
    assert sorted(played.values()) == ["alone", "calm"]
    answers = exported(tmp_path / "data", tmp_path / "out", "answers")
    assert [(row["session"], row["number"]) for row in answers] == list(zip(played, ["2.0", "6.0"], strict=True))
    assert [row["condition"] for row in answers] == list(played.values())
    assert exported(tmp_path / "data", tmp_path / "out", "participants")[0]["outcome"] == "completed"


@pytest.mark.long
@pytest.mark.parametrize("practises", [False, True])
def test_a_person_who_reads_the_instructions_or_practises_gets_the_role_of_a_partner_who_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, practises: bool
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.waiting_room.GONE_SECONDS", 3.0)
    with ServedStudy(write_study(tmp_path, STUDY), tmp_path / "data") as served:
        one, two, three, four = (Client(served.port) for _ in range(4))
        one.enter()
        for each in (two, three, four):
            each.do("join")
            each.do("consent", {"agreed": [True, True]})
            each.do("answers", {"stage": "before", "answers": {"age": 30}})
            one.do("news")
        assert two.view["part"] == three.view["part"] != four.view["part"], "a partner, a substitute, and the next one"
        before = four.view["part"]
        if practises:
            four.do("proceed", {"stage": "instructions"})
            while not four.view["token"]:
                for each in (one, two, three, four):
                    each.tag = ""
                    each.do("news")
        end = time.monotonic() + 30.0
        while four.view.get("part", before) == before:  # the second and the third have closed their pages
            assert time.monotonic() < end
            for each in (one, four):
                each.tag = ""
                each.do("news")
            time.sleep(0.2)
        assert four.stage == "instructions" and four.view["text"] == STUDY["texts"]["instructions"][four.view["part"]]
        assert four.post("proceed", {"stage": "instructions", "role": before}) == 409, "it was not read yet"
        role = four.view["part"]
        four.do("proceed", {"stage": "instructions", "role": role})
        with four.sit() as there:
            assert json.loads(there.recv(timeout=10))["seat"] == role, "the practice drive is one of the new role"
        four.do("proceed", {"stage": "tutorial"})
        seat(one, four)


@pytest.mark.long
def test_a_script_takes_over_for_a_person_who_leaves(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, {**STUDY, "absence": {"seconds": 0.5, "then": "script"}}), data) as served:
        one, two = Client(served.port), Client(served.port)
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit():
            with two.sit() as there:
                two.say(there, "Certainly so.")
            one.finish()
    (folder,) = (data / "sessions").iterdir()
    events = read_seat_log(folder)
    assert events is not None
    role = next(event.role for event in events if event.kind is SeatEventKind.TAKEN_OVER)
    assert role is not None and Session.load(folder).header.extra["study"]["participants"][role] == two.view["id"]  # type: ignore[index]
    assert exported(data, tmp_path / "out", "sessions")[0]["reason"] == "out of time"


@pytest.mark.long
def test_people_go_back_to_the_waiting_room_if_their_partner_does_not_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.open_rooms.LEAST_PATIENCE", 1.0)
    with ServedStudy(write_study(tmp_path, STUDY), tmp_path / "data") as served:
        one, two = Client(served.port), Client(served.port)
        one.enter()
        two.enter()
        seat(one, two)
        with one.sit():
            one.follow(lambda: one.stage == "lobby")
        two.tag = ""
        two.do("news")
        seat(one, two)
        with one.sit(), two.sit():
            at_once(*(lambda each=each: each.follow(lambda: each.view.get("over")) for each in (one, two)))
    (row,) = exported(tmp_path / "data", tmp_path / "out", "sessions")
    assert row["reason"] == "out of time"


def test_another_person_at_the_same_computer_begins_anew(tmp_path: Path) -> None:
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served:
        one = Client(served.port)
        one.do("join", {"parameters": {"PROLIFIC_PID": "first"}})
        first, cookie = one.view["id"], one.cookie
        for parameters in ({"PROLIFIC_PID": "first"}, {}):
            one.do("join", {"parameters": parameters})
            assert one.view["id"] == first and one.cookie == cookie
        one.do("join", {"parameters": {"PROLIFIC_PID": "platform-two"}})
        assert one.view["id"] != first and one.cookie != cookie
        stranger = Client(served.port)
        assert stranger.post("join", {"parameters": {"PROLIFIC_PID": "platform-two"}}) == 409, "in another browser"
        one.do("consent", {"agreed": None})
        assert one.view["gone"] and remains(tmp_path / "data", "platform-two") == []
        stranger.do("join", {"parameters": {"PROLIFIC_PID": "platform-two"}})
