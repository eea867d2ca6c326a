"""Speech in real browsers, with a microphone that plays a file. Needs Chromium."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.console.config import ConsoleConfig
from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.speech import find_synthesizer, say
from tests.chromium import IN_CHROMIUM, WAIT, chromium, microphone, talk_for
from tests.lab.console.people import SEED, TOWN
from tests.lab.console.serving import Served

pytestmark = IN_CHROMIUM

TURN = "Turn left at the KFC, please."


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Chromium whose microphone says `TURN` over and over, with pauses."""
    with chromium(*microphone(say(find_synthesizer(), TURN), tmp_path_factory.mktemp("microphone"))) as launched:
        yield launched


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    config = ConsoleConfig(pictures=False, speech=True)
    engine = SessionEngine(TOWN, config=config.environment())
    room = Room(engine, parse_roles("participant=human,co_wizard=human"), config, seed=SEED, folder=tmp_path / "out")
    with Served(room) as running:
        yield running


def opened(browser: Any, served: Served, seat: str, errors: list[str]) -> Any:
    page = browser.new_context(permissions=["microphone"]).new_page()
    page.set_default_timeout(WAIT)
    page.on("pageerror", lambda error: errors.append(f"{seat}: {error}"))
    page.on("console", lambda line: errors.append(f"{seat}: {line.text}") if line.type == "error" else None)
    page.goto(f"http://127.0.0.1:{served.port}/seat#{served.room.seats[seat].token}")
    page.wait_for_selector(f"body[data-ready={seat}]")
    return page


def until(page: Any, reached: str) -> None:
    """Waits for an expression of the page; the page's policy forbids Playwright's own way."""
    end = time.monotonic() + WAIT / 1000.0
    while not page.evaluate(reached):
        assert time.monotonic() < end, reached
        time.sleep(0.1)


def test_held_button_records_and_words_appear_with_their_acts(browser: Any, served: Served, tmp_path: Path) -> None:
    errors: list[str] = []
    page, other = (opened(browser, served, seat, errors) for seat in ("participant", "co_wizard"))
    other.locator("#aloud").check()
    talk_for(page, 4.0)
    until(page, "document.querySelector('#words').value.includes('KFC')")
    page.wait_for_selector(".talk > .chips .chip")
    assert "Instruct" in page.locator(".talk > .chips").inner_text()
    assert other.locator(".line.participant").count() == 0, "nothing is said before it is sent"
    page.locator("#words").press("Enter")
    other.wait_for_selector(".line.participant")
    assert "KFC" in other.locator(".line.participant").first.inner_text()
    until(other, "performance.getEntriesByType('resource').some(each => each.name.includes('/speech/said/'))")
    page.locator("#at-once").check()
    talk_for(page, 4.0)
    until(page, "document.querySelectorAll('.line.own').length > 1")
    assert page.locator("#words").input_value() == ""
    deadline = time.monotonic() + 30.0
    folder = next((tmp_path / "out").iterdir())
    while time.monotonic() < deadline and (folder / "seats.jsonl").read_text("utf-8").count('"audio"') < 2:
        time.sleep(0.2)
    assert {path.name for path in (folder / "utterance").iterdir()} == {"participant_1.flac", "participant_2.flac"}
    assert not errors


def test_key_begins_and_ends_a_turn(browser: Any, served: Served) -> None:
    errors: list[str] = []
    page, _ = (opened(browser, served, seat, errors) for seat in ("participant", "co_wizard"))
    page.locator("main").press("t")
    page.wait_for_selector(".speech .hold[aria-pressed=true]")
    time.sleep(4.0)
    page.locator("main").press("t")
    until(page, "document.querySelector('#words').value.toLowerCase().includes('left')")
    assert page.locator(".speech .hold").get_attribute("aria-pressed") == "false"
    assert not errors


def test_missing_microphone_is_reported_and_typing_goes_on(browser: Any, served: Served) -> None:
    errors: list[str] = []
    page = opened(browser, served, "participant", errors)
    page.evaluate("() => { navigator.mediaDevices.getUserMedia = () => Promise.reject(new Error('no device')); }")
    talk_for(page, 0.3)
    until(page, "document.body.innerText.includes('The microphone cannot be used: no device')")
    assert page.locator(".speech .hold").get_attribute("aria-pressed") == "false"
    assert page.locator("#words").is_enabled() and not errors
