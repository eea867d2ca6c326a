"""Note of the way that was asked for, on the page of the Co-Wizard. Needs Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import IN_CHROMIUM, chromium
from tests.lab.console.people import Table
from tests.lab.console.serving import Served
from tests.lab.console.test_browser_errands import open_seats

pytestmark = IN_CHROMIUM

WAY = "Turn left, then take the next left, then stop."


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


def test_steps_appear_in_order_at_the_seat_of_the_co_wizard(browser: Any) -> None:
    table = Table("participant=human,co_wizard=human")
    with Served(table.room) as served:
        (participant, co_wizard), errors = open_seats(browser, served, "participant", "co_wizard")
        assert co_wizard.locator(".asked").is_hidden()
        participant.fill("#words", WAY)
        participant.press("#words", "Enter")
        co_wizard.wait_for_selector(".asked li >> nth=2")
        steps = co_wizard.locator(".asked li")
        assert steps.all_inner_texts() == ["left", "the next left", "stop"]
        assert steps.nth(0).get_attribute("aria-current") == "step" and co_wizard.locator(".asked").is_visible()
        assert participant.locator(".asked").count() == 0
        assert co_wizard.evaluate("document.scrollingElement.scrollWidth <= innerWidth"), "nothing is pushed aside"
        assert not errors
