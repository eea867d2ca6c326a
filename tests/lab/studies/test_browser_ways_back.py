"""People whom something keeps from going on: reloads after the end, lost cookies and networks, tabs. Needs Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import IN_CHROMIUM, chromium
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.laboratory import Browsers, at, number, until
from tests.lab.studies.serving import ServedStudy
from tests.lab.studies.test_server import remains

pytestmark = IN_CHROMIUM

CONTACT = str(STUDY["contact"])
TEXTS = {
    **SOLO,
    "session": {"max_seconds": 5.0, "pictures": False},
    "questionnaires": {
        "before": [
            {"id": "age", "kind": "number", "text": "How old are you?", "min": 18, "max": 99},
            {"id": "note", "kind": "text", "long": True, "text": "Anything?", "max_length": 20, "required": False},
        ],
        "after": [{"id": "comment", "kind": "text", "text": "Comments?"}],
    },
}
LINK = "/?PROLIFIC_PID=platform-one"


@pytest.fixture(scope="module")
def launched() -> Iterator[Any]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def browsers(launched: Any, tmp_path: Path) -> Iterator[Browsers]:
    with ServedStudy(write_study(tmp_path, TEXTS), tmp_path / "data") as served:
        made = Browsers(launched, served)
        yield made
        for context in launched.contexts:
            context.close()
    assert made.errors == []


def agree(page: Any) -> None:
    at(page, "consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")


def test_the_link_as_it_is_printed_admits_each_browser(browsers: Browsers) -> None:
    link = "/?PROLIFIC_PID={{%PROLIFIC_PID%}}&STUDY_ID={{%STUDY_ID%}}"
    pages = [browsers.tab(link) for _ in range(3)]
    for page in pages:
        at(page, "consent")
    assert len({number(page) for page in pages}) == 3


def test_a_reload_after_a_withdrawal_shows_the_farewell(browsers: Browsers) -> None:
    page = browsers.tab(LINK)
    agree(page)
    page.click("text=Withdraw")
    page.click("text=Withdraw and delete")
    for _ in range(2):
        page.wait_for_selector("text=You have withdrawn")
        page.reload()
    page.wait_for_selector("text=You have withdrawn")
    assert not page.query_selector("text=Begin again")
    assert remains(browsers.served.data, "platform-one") == []


def test_a_person_who_declined_begins_again_with_the_same_id(browsers: Browsers) -> None:
    page = browsers.tab(LINK)
    at(page, "consent")
    page.click("text=I do not take part")
    page.wait_for_selector("text=You did not agree")
    page.reload()
    page.wait_for_selector("text=You did not agree")
    page.click("text=Begin again")
    agree(page)
    at(page, "before")
    assert remains(browsers.served.data, "platform-one") == ["recruitment.sqlite"]


def test_a_consent_page_that_was_open_for_too_long_begins_anew_with_the_same_id(
    browsers: Browsers, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = browsers.tab(LINK)
    at(page, "consent")
    first = number(page)
    page.wait_for_timeout(5500)
    monkeypatch.setattr("dorothie_gym.lab.studies.server.CLEANING_PERIOD", 0.1)
    monkeypatch.setattr("dorothie_gym.lab.studies.records.ABANDONED_SECONDS", 5.0)
    until(
        page,
        f"document.querySelector('#bar .number') && document.querySelector('#bar .number').textContent !== '{first}'",
    )
    monkeypatch.undo()
    page.reload()
    agree(page)
    at(page, "before")
    assert number(page) != first
    assert remains(browsers.served.data, "platform-one") == ["recruitment.sqlite"]


def test_a_person_with_another_browser_goes_on_by_a_link_of_the_experimenter(browsers: Browsers) -> None:
    old = browsers.tab(LINK)
    agree(old)
    at(old, "before")
    name = number(old)
    new = browsers.tab(LINK)
    new.wait_for_selector(f"text={CONTACT}")
    assert new.query_selector("text=Try again")
    assert browsers.served.study is not None
    control = browsers.tab(f"/experimenter#{browsers.served.study.experimenter.token}")
    control.click("text=Somebody cannot go on")
    control.fill("#person", "platform-one")
    control.click("text=Make a link")
    link = control.inner_text(".made code")
    new.goto("about:blank")
    new.goto(link)
    at(new, "before")
    assert number(new) == name and "#" not in new.url
    old.wait_for_selector(f"text={CONTACT}")
    new.reload()
    at(new, "before")
    control.click(f"[data-id={name}]")
    until(control, f"document.querySelector('.made').textContent.includes('{name}')")


def test_a_crowd_waits_and_comes_in(browsers: Browsers, monkeypatch: pytest.MonkeyPatch) -> None:
    assert browsers.served.study is not None
    monkeypatch.setattr("dorothie_gym.lab.studies.server.ENTRIES", (0.0, 0.0))
    page = browsers.tab(LINK)
    page.wait_for_selector("text=Many people are coming in")
    monkeypatch.undo()
    browsers.served.study.gate.budgets.clear()
    at(page, "consent")


def test_five_seconds_without_a_connection_lose_nothing_at_any_page(browsers: Browsers) -> None:
    page = browsers.tab(LINK)

    def offline(act: str, *then: str) -> None:
        page.context.set_offline(True)
        page.click(act)
        for each in then:
            page.click(each)
        page.wait_for_selector(".notices >> text=There is no connection")
        page.wait_for_timeout(5000)
        page.context.set_offline(False)

    at(page, "consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    offline("text=I take part")
    at(page, "before")
    page.fill("input[type=number]", "45")
    offline("text=Continue")
    at(page, "instructions")
    offline("text=Continue")
    at(page, "tutorial")
    page.wait_for_selector("text=Start the practice drive")
    offline("text=Skip it")
    at(page, "session")
    page.wait_for_selector("body[data-ready]")
    page.context.set_offline(True)
    page.wait_for_timeout(5000)
    page.context.set_offline(False)
    page.wait_for_selector(".over >> text=Continue", timeout=60_000)
    offline(".over >> text=Continue")
    at(page, "after")
    page.fill("input[type=text]", "Velvet")
    offline("text=Continue")
    at(page, "debriefing")
    offline("text=Continue")
    page.wait_for_selector("text=FINISHED")
    offline("text=Withdraw", "text=Withdraw and delete")
    page.wait_for_selector("text=You have withdrawn")
    assert remains(browsers.served.data, "Velvet") == []


def test_a_draft_is_in_both_tabs_and_is_sent_once(browsers: Browsers) -> None:
    one = browsers.tab(LINK)
    agree(one)
    at(one, "before")
    one.fill("input[type=number]", "45")
    two = browsers.tab("/", one.context)
    at(two, "before")
    assert two.input_value("input[type=number]") == "45"
    two.fill("textarea", "Velvet")
    until(one, "document.querySelector('textarea').value === 'Velvet'")
    one.dblclick("text=Continue")
    two.evaluate(  # in one step: the page may go on to the next stage, which has such a button as well
        "document.body.dataset.stage === 'before' &&"
        " [...document.querySelectorAll('button')].find(button => button.textContent.includes('Continue')).click()"
    )
    for page in (one, two):
        at(page, "instructions")
    assert one.evaluate("Object.keys(localStorage)") == []
    one.go_back()
    one.goto(f"{browsers.served.address}/")
    at(one, "instructions")


def test_a_long_text_is_not_cut_but_named(browsers: Browsers) -> None:
    page = browsers.tab(LINK)
    agree(page)
    at(page, "before")
    page.fill("input[type=number]", "45")
    text = "a" * 19 + "🚗🚗🚗🚗"
    page.fill("textarea", text)
    assert page.input_value("textarea") == text
    page.wait_for_selector("text=3 characters too many")
    page.click("text=Continue")
    page.wait_for_selector("text=Please shorten this text by 3 characters")
    page.reload()
    at(page, "before")
    assert page.input_value("textarea") == text
    page.fill("textarea", text[:-3])
    page.click("text=Continue")
    at(page, "instructions")
