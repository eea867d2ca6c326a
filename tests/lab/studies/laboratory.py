"""Browsers of the people of a study, and their way from page to page by mouse."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tests.chromium import WAIT
from tests.lab.studies.content import STUDY, write_study
from tests.lab.studies.serving import ServedStudy

RICH = {
    **STUDY,
    "session": {"max_seconds": 15.0, "pictures": True},
    "questionnaires": {
        "before": [
            {"id": "age", "kind": "number", "text": "How old are you?", "min": 18, "max": 99},
            {"id": "licence", "kind": "choice", "text": "Do you have a licence?", "options": ["Yes", "No"]},
        ],
        "after": [
            {"id": "trust", "kind": "likert", "text": "I trusted the other one."},
            {"id": "used", "kind": "choice", "several": True, "text": "What did you use?", "options": ["Map", "Talk"]},
            {"id": "comment", "kind": "text", "long": True, "text": "Comments?", "required": False},
        ],
    },
}


class Laboratory:
    """Browsers of participants; mistakes of the page fail the test."""

    def __init__(self, browser: Any, served: ServedStudy) -> None:
        self.browser, self.served = browser, served
        self.errors: list[str] = []
        self.pages: list[Any] = []

    def open(self, link: str = "/", width: int = 1280, height: int = 720, **options: Any) -> Any:
        page = self.browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "console", lambda line: self.errors.append(f"{line.text} {line.location}") if line.type == "error" else None
        )
        page.goto(f"{self.served.address}{link}")
        page.wait_for_selector("body[data-stage]")
        self.pages.append(page)
        return page

    def read(self, line: Any) -> None:
        if line.type == "error":
            self.errors.append(f"{line.text} {line.location}")


@contextlib.contextmanager
def served_laboratory(browser: Any, folder: Path, study: Mapping[str, Any]) -> Iterator[Laboratory]:
    """Serves a study from a folder, with browsers for its people; at the end none may have reported an error."""
    with ServedStudy(write_study(folder, study), folder / "data") as served:
        made = Laboratory(browser, served)
        yield made
        for page in made.pages:
            page.context.close()
    assert made.errors == []


def at(page: Any, stage: str) -> None:
    page.wait_for_selector(f"body[data-stage={stage}]")


def to_waiting_room(page: Any) -> None:
    """Goes to the waiting room by mouse, past the practice drive."""
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    at(page, "before")
    page.fill("input[type=number]", "31")
    page.check("text=Yes")
    page.click("text=Continue")
    at(page, "instructions")
    page.click("text=Continue")
    at(page, "tutorial")
    page.click("text=Skip it")


def to_code(page: Any) -> None:
    """Goes from the end of the session to the code by mouse."""
    page.wait_for_selector(".over >> text=Continue", timeout=60_000)
    page.click(".over >> text=Continue")
    at(page, "after")
    page.check(".points label:nth-child(6) input")
    page.check("text=Talk")
    page.click("button:has-text('Continue')")
    at(page, "debriefing")
    page.click("text=Continue")
    page.wait_for_selector("text=FINISHED")


class Browsers:
    """Browsers of people, each with cookies of its own; mistakes of the pages' scripts fail the test."""

    def __init__(self, launched: Any, served: ServedStudy) -> None:
        self.launched, self.served = launched, served
        self.errors: list[str] = []

    def tab(self, link: str = "/", context: Any = None) -> Any:
        page = (context or self.launched.new_context()).new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(f"{self.served.address}{link}")
        return page


def until(page: Any, reached: str) -> None:
    """Waits for an expression of the page; its policy forbids Playwright's own way."""
    from playwright.sync_api import Error

    end = time.monotonic() + 40.0
    while True:
        with contextlib.suppress(Error):  # the page is being loaded
            if page.evaluate(reached):
                return
        assert time.monotonic() < end, reached
        page.wait_for_timeout(100)


def number(page: Any) -> str:
    """The number of the person in the study, as the bar shows it."""
    return str(page.inner_text("#bar .number"))
