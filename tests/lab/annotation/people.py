"""Browsers of annotators, and what they show."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any

from dorothie_gym.lab.annotation.log import log_path, read_annotation
from dorothie_gym.lab.annotation.marks import Annotation, SpanMark
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.session.recording import Session
from tests.chromium import WAIT
from tests.lab.annotation.serving import Served


class Room:
    """Browsers of annotators; mistakes of the page fail the test."""

    def __init__(self, browser: Any, served: Served, session: Session) -> None:
        self.browser, self.served = browser, served
        self.folder = served.corpus / "one"
        self.text = SourceText.of(session)
        self.errors: list[str] = []
        self.pages: list[Any] = []

    def open(self, name: str, width: int = 1280, height: int = 720, **options: Any) -> Any:
        page = self.browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: self.errors.append(f"{name}: {error}"))
        page.on("console", lambda line: self.errors.append(f"{name}: {line.text}") if line.type == "error" else None)
        page.goto(self.served.link(name))
        page.wait_for_selector("body[data-ready=annotator], body[data-ready=adjudicator]")
        self.pages.append(page)
        return page

    def marks(self, name: str) -> Annotation:
        return read_annotation(self.text, self.folder, name)

    def line(self, name: str, k: int) -> tuple[SpanMark, ...]:
        return self.marks(name).utterances[self.text.lines[k].id]

    def until(self, reached: Callable[[], object], seconds: float = 30.0) -> None:
        end = time.monotonic() + seconds
        while True:
            try:
                if reached():
                    return
            except ValueError:  # nothing has been written yet
                pass
            assert time.monotonic() < end, "not in time"
            self.pages[0].wait_for_timeout(50)


def press(page: Any, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)
        page.wait_for_timeout(30)


def shown(page: Any) -> list[list[str]]:
    """The moves on the screen, by utterance."""
    found: list[list[str]] = page.evaluate(
        "[...document.querySelectorAll('.script li')].map(li => [...li.querySelectorAll('.span b')]"
        ".map(b => b.textContent))"
    )
    return found


def served_moves(room: Room, name: str) -> list[list[str]]:
    """The moves on the server, as the screen shows them."""
    if not log_path(room.folder, name).exists():
        return [["undecided"] for _ in room.text.lines]
    marks = room.marks(name).utterances
    return [
        [re.sub("([a-z])([A-Z])", r"\1 \2", span.move.label) if span.move else "undecided" for span in marks[line.id]]
        for line in room.text.lines
    ]


def saved(room: Room, page: Any) -> None:
    room.until(lambda: page.evaluate("document.body.dataset.saved === 'true'"), 60.0)


class Hold:
    """Requests of a page that are held back until they go on.

    Args:
        page: the page.
        action: last part of their addresses.
    """

    def __init__(self, page: Any, action: str = "mark") -> None:
        self.held: list[Any] = []
        self._open = False
        page.route(f"**/{action}", self._take)

    def _take(self, route: Any) -> None:
        if self._open:
            route.continue_()
        else:
            self.held.append(route)

    def go_on(self) -> None:
        """Lets the requests go on, and those that follow."""
        self._open = True
        for route in self.held:
            route.continue_()


def forgive(room: Room, *words: str) -> None:
    """Drops what the browser itself says about refused and failed requests."""
    room.errors = [line for line in room.errors if not any(word in line for word in words)]
