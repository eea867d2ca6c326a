"""Seats inside a study: names of their pages, refused connections, and phones. Needs Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import IN_CHROMIUM, chromium
from tests.lab.studies.content import SOLO
from tests.lab.studies.laboratory import Laboratory, at, served_laboratory, until

pytestmark = IN_CHROMIUM

DRIVER = {
    **SOLO,
    "conditions": [{"name": "driver", "participant": "scripted", "co_wizard": "human"}],
    "texts": {"instructions": {"co_wizard": "Drive the car."}, "debriefing": "Thank you."},
    "session": {"max_seconds": 60.0, "pictures": True},
    "absence": {"seconds": 60.0},
}
"""One person drives alone."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


@pytest.fixture
def laboratory(browser: Any, tmp_path: Path) -> Iterator[Laboratory]:
    with served_laboratory(browser, tmp_path, DRIVER) as made:
        yield made


def to_practice(page: Any) -> None:
    at(page, "consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    at(page, "before")
    page.fill("input[type=number]", "31")
    page.click("text=Continue")
    at(page, "instructions")
    page.click("text=Continue")
    at(page, "tutorial")


def outside(page: Any, selector: str) -> list[str]:
    """Returns texts of elements that are beside the window."""
    found: list[str] = page.evaluate(
        "selector => [...document.querySelectorAll(selector)].filter(each => {"
        " const box = each.getBoundingClientRect(); return box.left < 0 || box.right > innerWidth;"
        " }).map(each => each.textContent)",
        selector,
    )
    return found


def overlap(page: Any, one: str, other: str) -> bool:
    """Returns whether two elements cover each other."""
    a, b = (page.locator(selector).bounding_box() for selector in (one, other))
    return bool(
        a["x"] < b["x"] + b["width"]
        and b["x"] < a["x"] + a["width"]
        and a["y"] < b["y"] + b["height"]
        and b["y"] < a["y"] + a["height"]
    )


def test_the_bar_of_a_seat_fits_a_narrow_phone_and_the_practice_drive_has_its_own_end(laboratory: Laboratory) -> None:
    page = laboratory.open("/", 390, 844)
    to_practice(page)
    page.click("text=Start the practice drive")
    page.wait_for_selector("body[data-ready=co_wizard]")
    assert page.title() == "A small study"
    page.wait_for_selector("#bar >> text=Withdraw")
    assert outside(page, "#bar > *") == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.wait_for_selector(".over >> text=The practice drive is over")


def test_a_refused_connection_leads_back_to_the_session(laboratory: Laboratory) -> None:
    page = laboratory.open("/", 844, 390)
    to_practice(page)
    page.click("text=Skip it")
    page.wait_for_selector("body[data-ready=co_wizard]")
    assert page.title() == "Now: A small study", "the waiting room says that the title changes"
    for one, other in ((".status", ".modes"), (".status", ".zoom"), (".map > .windscreen", ".zoom")):
        assert not overlap(page, one, other), (one, other)
    page.evaluate("document.body.dataset.old = 'yes'; window.consoleLink.closed(4400)")
    until(page, "!document.body.dataset.old && document.body.dataset.ready === 'co_wizard'")
    assert not page.query_selector(".over")
