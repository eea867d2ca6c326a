"""Three browsers in one study: a person who speaks, another one, and the experimenter. Needs Chromium."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("pocketsphinx", reason="needs the extra speech")

from dorothie_gym.session.recording import Session
from dorothie_gym.speech import find_synthesizer, say
from tests.chromium import IN_CHROMIUM, another, chromium, microphone, press, tab_to, talk_for
from tests.lab.studies.content import STUDY, write_study
from tests.lab.studies.laboratory import RICH, Laboratory, at, to_waiting_room
from tests.lab.studies.serving import ServedStudy

pytestmark = IN_CHROMIUM

SPOKEN = {
    **RICH,
    "session": {"max_seconds": 300.0, "pictures": True, "speech": True},
    "consent": {**STUDY["consent"], "voice": "I agree that my voice is recorded."},
}


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Chromium whose microphone asks to turn left over and over."""
    samples = say(find_synthesizer(), "Turn left at the KFC, please.")
    with chromium(*microphone(samples, tmp_path_factory.mktemp("microphone"))) as launched:
        yield launched


def test_the_experimenter_watches_two_people_writes_to_them_and_ends_their_session(
    browser: Any, tmp_path: Path
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python").Axe()
    data = tmp_path / "data"
    with (
        ServedStudy(write_study(tmp_path, SPOKEN), data) as served,
        another(browser) as second,
        another(browser) as third,
    ):
        assert served.study is not None
        people = [Laboratory(each, served) for each in (browser, second)]
        one = people[0].open(permissions=["microphone"])
        two = people[1].open()
        link = f"{served.address}/experimenter#{served.study.experimenter.token}"
        control = third.new_context(bypass_csp=True).new_page()  # the policy of the page forbids the scripts of axe
        errors: list[str] = []
        control.on("pageerror", lambda error: errors.append(str(error)))
        control.goto(link)
        control.wait_for_selector("text=Nobody is waiting.")
        assert control.url == f"{served.address}/experimenter", "the token does not stay in the address"
        to_waiting_room(one)
        control.wait_for_selector("li >> text=/^P.*, for 0:/")
        found = axe.run(control).response["violations"]
        assert not found, [(each["id"], [node["html"] for node in each["nodes"]][:3]) for each in found]
        to_waiting_room(two)
        for page in (one, two):
            page.wait_for_selector("body[data-stage=session][data-ready]", timeout=60_000)
        until(control, "document.querySelector('.room')?.innerText.includes('running')")
        speaker = one
        talk_for(speaker, 4.0)
        until(speaker, "document.querySelector('#words').value.includes('KFC')")
        speaker.press("#words", "Enter")
        two.wait_for_selector("text=KFC")
        tab_to(control, "Watch and control S00001-01")
        press(control, "Enter")
        control.wait_for_selector("body[data-ready=experimenter]")
        control.wait_for_selector(".line >> text=KFC")
        press(control, "p")
        one.wait_for_selector("text=Paused by the experimenter")
        press(control, "p")
        tab_to(control, "Message to all seats")
        control.keyboard.type("Thank you, that is enough.")
        press(control, "Enter")
        for page in (one, two):
            page.wait_for_selector("text=that is enough")
        control.on("dialog", lambda dialog: dialog.accept())
        press(control, "Escape")
        tab_to(control, "End")
        press(control, "Enter")
        for page in (one, two):
            page.wait_for_selector(".over >> text=The experimenter ended the session.")
        control.wait_for_selector(".over >> text=All rooms")
        control.click(".over >> text=All rooms")
        control.wait_for_selector("h2:has-text('Waiting room')")
        other = browser.new_context().new_page()
        other.goto(link)
        other.wait_for_selector("text=it has been used")
        one.click(".over >> text=Continue")
        at(one, "after")
        assert errors == [] and [each.errors for each in people] == [[], []]
    (folder,) = (data / "sessions").iterdir()
    session = Session.load(folder)
    assert session.complete and any("KFC" in each.text for each in session.utterances())
    assert list(session.audio), "what was said is kept with the session"


def until(page: Any, reached: str) -> None:
    """Waits for an expression of the page; the page's policy forbids Playwright's own way."""
    end = time.monotonic() + 40.0
    while not page.evaluate(reached):
        assert time.monotonic() < end, reached
        time.sleep(0.1)
