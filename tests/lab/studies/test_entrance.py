"""Entrance of a study: links that were never filled in, invitations, lost cookies and answers, and crowds."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from dorothie_gym.errors import InputFileError
from dorothie_gym.lab.studies.entrance import is_placeholder
from dorothie_gym.lab.studies.folder import open_study
from dorothie_gym.lab.studies.records import StudyRecords
from dorothie_gym.lab.studies.study_file import read_study
from tests.cli.test_study import command
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.serving import Client, ServedStudy, at_once
from tests.lab.studies.test_experimenter import entered
from tests.lab.studies.test_server import remains

CONTACT = str(STUDY["contact"])
TAB = "a-random-text-of-one-tab"


def invited(data: Path) -> str:
    """Returns the token of a new invitation."""
    with contextlib.closing(StudyRecords(data)) as records:
        return records.invite(1)[0]


@pytest.mark.parametrize(
    "value",
    ["{{%PROLIFIC_PID%}}", "${e://Field/PROLIFIC_PID}", "[PROLIFIC_PID]", "<id>", "%PID%", "prolific_pid", "null", " "],
)
def test_a_link_that_was_not_filled_in_admits_any_number_of_people(tmp_path: Path, value: str) -> None:
    assert is_placeholder("PROLIFIC_PID", value)
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, SOLO), data) as served:
        one, two = Client(served.port), Client(served.port)
        for person in (one, two):
            person.do("join", {"parameters": {"PROLIFIC_PID": value, "STUDY_ID": "5f0e"}})
        assert one.view["id"] != two.view["id"]
        one.do("join", {"parameters": {"PROLIFIC_PID": value}})
        assert one.view["id"] != two.view["id"]
        assert remains(data, value) == [] or not value.strip() or value == "null"


@given(st.one_of(st.from_regex(r"[0-9a-f]{24}", fullmatch=True), st.emails(), st.uuids().map(str)))
def test_ids_of_platforms_are_no_placeholders(value: str) -> None:
    if not any(sign in value for sign in "{}%$"):  # which a mail address may have, and nobody's has
        assert not is_placeholder("PROLIFIC_PID", value)


def test_a_study_that_pays_by_the_platform_asks_for_its_link(tmp_path: Path) -> None:
    content = {**SOLO, "recruitment": {"required": True}}
    with ServedStudy(write_study(tmp_path, content), tmp_path / "data") as served:
        person = Client(served.port)
        for parameters in ({}, {"PROLIFIC_PID": "{{%PROLIFIC_PID%}}"}, {"STUDY_ID": "x"}):
            assert person.post("join", {"parameters": parameters}) == 409
            assert "link that your recruiting platform" in person.answer["error"] and CONTACT in person.answer["error"]
        person.do("join", {"parameters": {"PROLIFIC_PID": "5f0e"}})
    with pytest.raises(InputFileError, match="recruitment.required: there is no parameter"):
        read_study(write_study(tmp_path, {**SOLO, "recruitment": {"required": True, "parameters": []}}))


def test_a_link_may_have_long_parameters_of_others(tmp_path: Path) -> None:
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served:
        person = Client(served.port)
        more = {f"utm_{k}": "x" * 1500 for k in range(60)}
        person.do("join", {"parameters": {"PROLIFIC_PID": "a" * 800, **more}})


def test_a_person_in_another_browser_is_told_whom_to_ask_and_goes_on_by_a_link(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, SOLO), data) as served:
        old, new, later, stranger = (Client(served.port) for _ in range(4))
        old.enter({"PROLIFIC_PID": "platform-one"})
        old.follow(lambda: old.view.get("token"))  # the stage stays the same from now on
        assert new.post("join", {"parameters": {"PROLIFIC_PID": "platform-one"}}) == 409
        assert CONTACT in new.answer["error"]
        code, text = command("readmit", data, "platform-one", "--address", "https://study.example.org/")
        assert code == 0 and text.startswith("https://study.example.org/#")
        first = text.partition("#")[2]
        assert remains(data, first) == [], "only its hash is stored"
        assert old.post("news") == 200, "nothing has changed for the old browser"
        experimenter = entered(served)
        assert {"id": old.view["id"], "stage": old.stage, "present": True} in experimenter.view["people"]
        experimenter.do("experimenter/readmit", {"participant": old.view["id"]})
        token = experimenter.view["token"]
        assert new.post("join", {"invitation": first}) == 409 and CONTACT in new.answer["error"], "void"
        new.do("join", {"invitation": token, "visit": TAB})
        assert (new.view["id"], new.stage) == (old.view["id"], old.stage)
        assert old.post("news") == 401 and CONTACT in old.answer["error"], "the old secret is void"
        assert later.post("join", {"invitation": token}) == 409, "used"
        lost = Client(served.port)
        lost.do("join", {"invitation": token, "visit": TAB})
        assert lost.view["id"] == new.view["id"], "the answer was lost on its way to this tab"
        new.cookie = lost.cookie
        new.do("join", {"invitation": token, "visit": TAB})
        assert new.cookie == lost.cookie and new.post("news") == 200
        assert stranger.post("experimenter/readmit", {"participant": old.view["id"]}) == 401
        assert experimenter.post("experimenter/readmit", {"participant": "nobody"}) == 409
    code, text = command("readmit", data, "nobody")
    assert code == 2 and "has no participant 'nobody'" in text


def test_a_person_comes_back_to_the_completion_code(tmp_path: Path) -> None:
    data = tmp_path / "data"
    study = {**STUDY, "waiting_room": {"seconds": 1.0}}
    with ServedStudy(write_study(tmp_path, study), data) as served:
        old, new = Client(served.port), Client(served.port)
        old.enter({"PROLIFIC_PID": "platform-one"})
        old.follow(lambda: old.view.get("in_vain"))
        old.do("wait", {"on": False})
        old.do("proceed", {"stage": "debriefing"})
        token = command("readmit", data, old.view["id"])[1].partition("#")[2]
        new.do("join", {"invitation": token})
        assert new.view["code"] == old.view["code"] == "WAITED"
        old.do("join", {"parameters": {"PROLIFIC_PID": "platform-three"}})
        assert old.view["id"] != new.view["id"]


def test_an_answer_that_is_lost_on_its_way_costs_nobody_the_place(tmp_path: Path) -> None:
    data = tmp_path / "data"
    content = {**SOLO, "recruitment": {"admission": "invited"}}
    with ServedStudy(write_study(tmp_path, content), data) as served:
        token = invited(data)
        body = {"invitation": token, "visit": TAB, "parameters": {"PROLIFIC_PID": "platform-one"}}
        tries = [Client(served.port) for _ in range(3)]
        for each in tries:
            each.do("join", body)
        assert len({each.view["id"] for each in tries}) == 1
        last = tries[-1]
        assert tries[0].post("news") == 401 and last.post("news") == 200
        last.do("consent", {"agreed": [True, True]})
        assert tries[0].post("join", body) == 409, "after the consent, the cookie alone counts"


def test_an_invitation_is_valid_again_for_people_who_have_agreed_to_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.records.ABANDONED_SECONDS", 0.2)
    monkeypatch.setattr("dorothie_gym.lab.studies.server.CLEANING_PERIOD", 1e9)  # the first server deletes nobody
    data = tmp_path / "data"
    content = {**SOLO, "recruitment": {"admission": "invited"}}
    with ServedStudy(write_study(tmp_path, content), data) as served:
        person, token = Client(served.port), invited(data)
        body = {"invitation": token, "visit": TAB}
        person.do("join", body)
        assert Client(served.port).post("join", {"invitation": token}) == 409
        person.do("consent", {"agreed": None})
        assert person.view["again"]
        person.cookie = ""
        person.do("join", body)
        first = person.view["id"]
        time.sleep(0.3)
        assert served.study is not None
    with open_study(data) as records:  # a consent page that was left open overnight
        assert records.undecided() == [first]
    monkeypatch.setattr("dorothie_gym.lab.studies.server.CLEANING_PERIOD", 0.1)
    with ServedStudy(tmp_path / "study.yaml", data) as served:
        person.port = served.port
        end = time.monotonic() + 10.0
        while person.post("news") != 401:
            assert time.monotonic() < end
            time.sleep(0.1)
        person.do("join", body)
        assert person.view["id"] != first and person.stage == "consent"
        person.do("consent", {"agreed": [True, True]})
        person.do("withdraw", {"sure": True})
        assert Client(served.port).post("join", {"invitation": token}) == 409, "that it was used stays"


@pytest.mark.long
def test_a_hundred_people_come_in_from_one_address(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with ServedStudy(write_study(tmp_path, SOLO), data) as served:
        people = [Client(served.port) for _ in range(100)]
        at_once(
            *(
                lambda k=k, person=person: person.do("join", {"parameters": {"PROLIFIC_PID": f"person-{k}"}})  # type: ignore[misc]
                for k, person in enumerate(people)
            )
        )
        assert len({person.view["id"] for person in people}) == 100
        at_once(*(lambda person=person: person.do("news") for person in people))  # type: ignore[misc]


def test_a_page_that_was_refused_as_one_of_too_many_is_told_when_to_come_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.ENTRIES", (1.0, 0.0))
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served:
        Client(served.port).do("join")
        status, headers, _ = Client(served.port).send(
            "POST", "/study/join", b"{}", {"Content-Type": "application/json"}
        )
        assert status == 429 and int(headers["Retry-After"]) >= 1
