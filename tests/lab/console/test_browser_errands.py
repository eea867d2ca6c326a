"""Errands and their pins in real browsers, and two people who do errands by what the screen shows. Needs Chromium."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.console.room import RoomState
from tests.chromium import IN_CHROMIUM, WAIT, chromium
from tests.lab.console.people import Table
from tests.lab.console.people_in_browsers import Chauffeur, Passenger
from tests.lab.console.serving import Served

pytestmark = IN_CHROMIUM

LIMIT = 600.0
"""Simulated time for all errands of a story [s]."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


def open_seats(browser: Any, served: Served, *seats: str) -> tuple[list[Any], list[str]]:
    """Returns the pages of seats, and the mistakes that they make."""
    pages, errors = [], []
    for seat in seats:
        page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
        page.goto(f"http://127.0.0.1:{served.port}/seat#{served.room.seats[seat].token}")
        page.wait_for_selector(f"body[data-ready={seat}]")
        pages.append(page)
    return pages, errors


def linked(page: Any) -> list[str]:
    """Places of the rows and pins that are shown as belonging together."""
    rows = page.locator(".tasks .linked .where, .notes .linked .where").all_inner_texts()
    pins = page.locator(".pins .pin.linked").evaluate_all("all => all.map(each => each.title)")
    return sorted([row.split("\n")[-1] for row in rows] + [pin.split(": ")[1] for pin in pins])


def test_errands_and_pins_show_one_another_by_hover_click_and_focus(browser: Any) -> None:
    table = Table("participant=human,co_wizard=human,ad_wizard=silent", storyboard="winter_coats", seed=2)
    with Served(table.room) as served:
        (page, co_wizard), errors = open_seats(browser, served, "participant", "co_wizard")
        page.wait_for_selector(".tasks > li")
        places = [text.split("\n")[-1] for text in page.locator(".tasks .where").all_inner_texts()]
        assert len(set(places)) == len(places) == 2
        assert all(place.startswith("House, ") for place in places)
        assert "within 2 m" in page.locator(".rule").inner_text()
        assert "press Enter" in page.locator(".first-hint").inner_text()
        for number, place in enumerate(places, start=1):
            page.hover(f".tasks > li:nth-child({number})")
            assert linked(page) == [place, place]
            page.locator(f".tasks > li:nth-child({number}) .where").focus()
            assert linked(page) == [place, place]
            pin = page.get_by_role("button", name=f"Errand {number}: {place}", exact=True)
            page.mouse.move(5, 5)
            pin.hover()
            assert linked(page) == [place, place]
            pin.click()
            assert page.evaluate("document.activeElement.innerText.split('\\n').pop()") == place
            page.keyboard.press("Enter")  # the map goes to the pin
            box = page.locator(".map > canvas").bounding_box()
            at = pin.bounding_box()
            assert abs(at["x"] + at["width"] / 2 - box["x"] - box["width"] / 2) < 3
        assert co_wizard.locator(".pins .pin").count() == 0, "the Co-Wizard has not been told anything"
        assert co_wizard.locator(".notes .told").count() == 0
        page.fill("#words", f"Please go to the house on {places[1].split(', ')[1]}.")
        page.press("#words", "Enter")
        co_wizard.wait_for_selector(".notes .told")
        co_wizard.hover(".notes .told .where")
        assert linked(co_wizard) == [places[1], places[1]]
        co_wizard.mouse.move(5, 5)
        pin = co_wizard.get_by_role("button", name=f"Place 1: {places[1]}", exact=True)
        pin.focus()
        assert linked(co_wizard) == [places[1], places[1]]
        pin.press("Enter")
        assert places[1] in co_wizard.evaluate("document.activeElement.innerText")
        assert not errors


@pytest.mark.timeout(2 * LIMIT + 60.0)  # it is played in real time
@pytest.mark.parametrize(("story", "seed"), [("winter_coats", 2), ("first_concert", 1), ("chess_by_post", 1)])
def test_two_people_do_all_errands_by_what_the_screen_shows(browser: Any, story: str, seed: int) -> None:
    table = Table("participant=human,co_wizard=human,ad_wizard=silent", max_seconds=LIMIT, storyboard=story, seed=seed)
    with Served(table.room) as served:
        (passenger, chauffeur), errors = open_seats(browser, served, "participant", "co_wizard")
        people = Passenger(passenger), Chauffeur(chauffeur)
        for _ in range(4):
            chauffeur.click("button[aria-label='Zoom out']")
        end = time.monotonic() + 2 * LIMIT
        while served.room.state is not RoomState.OVER:
            assert time.monotonic() < end, "the machine is too slow"
            for person in people:
                person.look()
            chauffeur.wait_for_timeout(50)
        passenger.wait_for_selector("text=All errands are done")
        assert not errors
