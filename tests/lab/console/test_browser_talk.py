"""List of the talk in a real browser: its last line stays visible when the space for it changes. Needs Chromium."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import CHROMIUM, WAIT, chromium
from tests.lab.console.people import Table
from tests.lab.console.serving import Served

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (Debian: apt-get install chromium)"),
]

HIDDEN = """() => {
  const list = document.querySelector('.lines'), last = list.lastElementChild.getBoundingClientRect();
  const at = list.getBoundingClientRect();
  return Math.max(last.bottom - at.bottom, at.bottom - innerHeight, 0);
}"""
"""Part of the last line that cannot be seen [px]."""

LONG = "Turn left at the lights, then stop at the house on the right, please, and wait, and then go on straight ahead."
"""Text whose acts need several rows of chips."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


@pytest.fixture
def served() -> Iterator[Served]:
    with Served(Table("participant=human,co_wizard=human", max_seconds=600.0).room) as running:
        yield running


def sit(browser: Any, served: Served, width: int, height: int) -> Any:
    page = browser.new_context(viewport={"width": width, "height": height}).new_page()
    page.set_default_timeout(WAIT)
    page.goto(f"http://127.0.0.1:{served.port}/seat#{served.room.seats['participant'].token}")
    page.wait_for_selector("body[data-ready=participant]")
    for number in range(1, 13):  # lines that wait are lines of the list
        page.fill("#words", f"This is line {number}, and it is about something.")
        page.press("#words", "Enter")
    assert page.evaluate("(e => e.scrollHeight > e.clientHeight + 100)(document.querySelector('.lines'))")
    return page


def until(page: Any, reached: Callable[[], bool]) -> None:
    """Waits; the policy of the page forbids functions of the browser that wait."""
    end = time.monotonic() + 30.0
    while not reached():
        assert time.monotonic() < end, "not in time"
        page.wait_for_timeout(50)


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1024, 700)])
def test_the_last_line_stays_visible_while_acts_are_shown(
    browser: Any, served: Served, width: int, height: int
) -> None:
    page = sit(browser, served, width, height)
    before = page.evaluate("document.querySelector('.lines').clientHeight")
    assert page.evaluate(HIDDEN) < 1.0
    page.fill("#words", LONG)
    page.wait_for_selector(".talk > .chips .chip")
    page.wait_for_timeout(100)
    assert page.evaluate("document.querySelector('.lines').clientHeight") < before - 20, "chips take space"
    assert page.evaluate(HIDDEN) < 1.0
    page.fill("#words", "")
    page.wait_for_selector(".talk > .chips .chip", state="detached")
    page.set_viewport_size({"width": width, "height": height - 150})
    page.wait_for_timeout(100)
    assert page.evaluate(HIDDEN) < 1.0
    page.context.close()


def test_a_person_who_has_scrolled_up_goes_on_reading_there(browser: Any, served: Served) -> None:
    page = sit(browser, served, 1280, 800)
    top = "document.querySelector('.lines').scrollTop"
    page.hover(".lines")
    page.mouse.wheel(0, -200)
    until(page, lambda: page.evaluate(HIDDEN) > 100.0)
    page.wait_for_timeout(200)
    before = page.evaluate(top)
    page.fill("#words", LONG)
    page.wait_for_selector(".talk > .chips .chip")
    page.wait_for_timeout(100)
    assert page.evaluate(top) == before
    page.hover(".lines")
    page.mouse.wheel(0, 5000)
    until(page, lambda: page.evaluate(HIDDEN) < 1.0)
    page.set_viewport_size({"width": 1280, "height": 650})
    page.wait_for_timeout(100)
    assert page.evaluate(HIDDEN) < 1.0
    page.context.close()
