"""Seats in real browsers: by keyboard, by mouse, after a reload, and in a second window. Needs Chromium."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.console.room import RoomState
from tests.chromium import IN_CHROMIUM, WAIT, chromium
from tests.lab.console.people import Table
from tests.lab.console.serving import Served

pytestmark = IN_CHROMIUM


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


class Desk:
    """Browsers at the seats of a served room; mistakes of the page fail the test."""

    def __init__(self, browser: Any, served: Served) -> None:
        self.browser, self.served = browser, served
        self.errors: list[str] = []
        self.pages: list[Any] = []

    def open(self, seat: str, width: int = 1280, height: int = 720, **options: Any) -> Any:
        page = self.browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: self.errors.append(f"{seat}: {error}"))
        page.on("console", lambda line: self.errors.append(f"{seat}: {line.text}") if line.type == "error" else None)
        page.goto(f"http://127.0.0.1:{self.served.port}/seat#{self.served.room.seats[seat].token}")
        page.wait_for_selector(f"body[data-ready={seat}]")
        self.pages.append(page)
        return page

    def until(self, reached: Callable[[], object], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, "not in time"
            self.pages[0].wait_for_timeout(50)


@pytest.fixture
def desk(browser: Any) -> Iterator[Desk]:
    table = Table("participant=human,co_wizard=human", pictures=True, max_seconds=600.0)
    with Served(table.room) as served:
        made = Desk(browser, served)
        yield made
        for page in made.pages:
            page.context.close()
    assert not made.errors


def test_a_car_is_driven_and_talked_to_by_keyboard_alone(desk: Desk) -> None:
    participant, co_wizard = desk.open("participant", 844, 390), desk.open("co_wizard")
    session = desk.served.room.engine.session
    desk.until(lambda: desk.served.room.state is RoomState.RUNNING)
    participant.keyboard.press("Enter")
    participant.keyboard.type("Please turn left.")
    participant.keyboard.press("Enter")
    co_wizard.wait_for_selector("text=Please turn left.")
    co_wizard.keyboard.press("Alt+1")
    participant.wait_for_selector(".line.co_wizard >> text=Okay.")
    co_wizard.keyboard.press("ArrowUp")
    desk.until(lambda: session.world.ego.cruise > 44.0)
    co_wizard.keyboard.press("p")
    co_wizard.locator(".map > canvas").focus()
    for key in ("ArrowRight", "ArrowDown", "Enter"):  # moves the pointer on the map and clicks
        co_wizard.keyboard.press(key)
    co_wizard.keyboard.press("Escape")
    co_wizard.keyboard.press("s")
    desk.until(lambda: session.world.car.speed < 0.2)
    co_wizard.wait_for_selector(".status >> text=Stopped")
    co_wizard.keyboard.press("?")
    co_wizard.wait_for_selector("dialog >> text=Follow lane")
    co_wizard.keyboard.press("Escape")
    assert participant.evaluate("document.documentElement.scrollWidth <= innerWidth")
    desk.until(lambda: participant.evaluate("document.querySelector('.windscreen .note').hidden"), 120.0)


def test_an_act_is_corrected_with_two_clicks(desk: Desk) -> None:
    participant, co_wizard = desk.open("participant"), desk.open("co_wizard")
    participant.fill("#words", "Left at the corner.")
    participant.wait_for_selector(".talk > .chips .chip")
    participant.click(".talk > .chips .chip")
    participant.click(".popover .moves button:has-text('Confirm')")
    participant.press("#words", "Enter")
    co_wizard.wait_for_selector("text=Left at the corner.")
    spoken = desk.served.room.engine.session.dialogue.said[-1]
    assert [act.move.label for act in spoken.acts] == ["Confirm"]
    participant.click(".line.own .chip")
    participant.click(".popover .moves button:has-text('ReplyW')")
    participant.wait_for_selector(".line.own .chip.corrected >> text=ReplyW")


def test_the_ad_wizard_changes_the_world_by_clicks(desk: Desk) -> None:
    desk.open("participant")
    desk.open("co_wizard")
    ad_wizard, experimenter = desk.open("ad_wizard"), desk.open("experimenter")
    session = desk.served.room.engine.session
    desk.until(lambda: desk.served.room.state is RoomState.RUNNING)
    ad_wizard.click("text=Dense fog")
    ad_wizard.click("text=No position (GPS)")
    desk.until(lambda: len(session.exceptions) >= 3)
    ad_wizard.click("button[data-tool=pedestrians]")
    box = ad_wizard.locator(".map > canvas").bounding_box()
    ad_wizard.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    desk.until(lambda: len(session.exceptions) >= 4)
    ad_wizard.click("button[data-tool=tree]")
    ad_wizard.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    ad_wizard.wait_for_selector(".notices .error", state="attached")
    experimenter.wait_for_selector(".events >> text=fog_density becomes")
    experimenter.click("button:has-text('Pause')")
    desk.until(lambda: desk.served.room.state is RoomState.PAUSED)
    ad_wizard.wait_for_selector("text=Paused by the experimenter")


@pytest.mark.parametrize("seat", ["participant", "co_wizard", "ad_wizard", "experimenter"])
def test_axe_finds_no_violation(desk: Desk, seat: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python").Axe()
    for other in {"participant", "co_wizard"} - {seat}:
        desk.open(other)
    page = desk.open(seat, bypass_csp=True)  # the policy of the page forbids the scripts of axe
    desk.until(lambda: desk.served.room.state is RoomState.RUNNING)
    page.wait_for_timeout(500)
    found = axe.run(page).response["violations"]
    assert not found, [(each["id"], [node["html"] for node in each["nodes"]][:3]) for each in found]


def test_a_reload_restores_the_talk_and_a_second_window_takes_over(desk: Desk) -> None:
    participant, co_wizard = desk.open("participant"), desk.open("co_wizard")
    participant.fill("#words", "Hello, car.")
    participant.press("#words", "Enter")
    co_wizard.wait_for_selector("text=Hello, car.")
    begun = time.monotonic()
    co_wizard.reload()
    co_wizard.wait_for_selector("text=Hello, car.")
    assert time.monotonic() - begun < 10.0
    other = desk.open("co_wizard")
    co_wizard.wait_for_selector("text=This seat was opened in another window")
    other.wait_for_selector("text=Hello, car.")
    co_wizard.click("text=Use it here")
    other.wait_for_selector("text=This seat was opened in another window")


def test_refused_commands_are_waited_for_no_longer(desk: Desk) -> None:
    page = desk.open("co_wizard")
    desk.open("participant")
    desk.until(lambda: desk.served.room.state is RoomState.RUNNING)
    page.evaluate("consoleLink.command('mark', { landmark: 'house', x: 90000, y: 90000 })")
    page.wait_for_selector("text=too far from any road")
    assert page.evaluate("consoleLink.waiting.size") == 0
