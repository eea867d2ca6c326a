"""Way of a person through every page of a study in a browser, with a partner who needs none."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.cli.test_study import command
from tests.lab.studies.content import STUDY
from tests.lab.studies.laboratory import Browsers, at, number
from tests.lab.studies.serving import Client

PAIR = {
    **STUDY,
    "conditions": STUDY["conditions"][:1],
    "session": {"max_seconds": 10.0, "pictures": False},
    "tutorial": {"seconds": 120.0},
    "waiting_room": {"seconds": 600.0},
    "absence": {"seconds": 60.0, "then": "end"},
    "questionnaires": {
        "before": [{"id": "age", "kind": "number", "text": "How old are you?", "min": 18, "max": 99}],
        "after_session": [{"id": "drive", "kind": "text", "text": "How was the drive?"}],
        "after": [{"id": "comment", "kind": "text", "text": "Comments?"}],
    },
}
"""Study with every kind of page."""

LINK = "/?PROLIFIC_PID=platform-one"

PAGES = (
    "consent", "before", "instructions", "tutorial", "lobby", "session", "over", "after_session", "after", "debriefing",
    "done",
)  # fmt: skip
"""Pages of the study in their order; "over" is the end of a session, of the stage "session"."""

Click = Callable[[Any, str], None]


class Partner(threading.Thread):
    """Partner who waits, plays, and finishes."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.client = Client(port)
        self.failure: BaseException | None = None

    def run(self) -> None:
        try:
            client = self.client
            client.do("join", {"parameters": {"PROLIFIC_PID": "platform-two"}})
            client.do("consent", {"agreed": [True, True]})
            client.do("answers", {"stage": "before", "answers": {"age": 30}})
            client.do("proceed", {"stage": "instructions"})
            client.do("proceed", {"stage": "tutorial"})
            with client.sit():
                client.follow(lambda: client.view.get("over"), 150.0)
            client.do("proceed", {"stage": "session"})
            client.do("answers", {"stage": "after_session", "answers": {"drive": "Good."}})
            client.do("answers", {"stage": "after", "answers": {"comment": "None."}})
            client.do("proceed", {"stage": "debriefing"})
        except BaseException as error:
            self.failure = error
            raise

    def finish(self) -> None:
        """Waits until the partner has the code."""
        self.join(120.0)
        assert self.failure is None and self.client.view["code"] == "FINISHED", (self.failure, self.client.view)


def arrive(page: Any, place: str) -> None:
    """Waits until a page is shown."""
    at(page, "session" if place == "over" else place)
    if place == "tutorial":
        page.wait_for_selector("text=Start the practice drive")
    elif place == "session":
        page.wait_for_selector("body[data-ready]")
    elif place == "over":
        page.wait_for_selector("text=The session is over", timeout=90_000)
    elif place == "lobby":
        page.wait_for_selector("text=Waiting …")
    elif place == "done":
        page.wait_for_selector("text=FINISHED")


def go_on(page: Any, place: str, click: Click) -> None:
    """Does what leads to the next page; the waiting room and the session end by themselves."""
    if place == "consent":
        for box in page.query_selector_all(".statement input"):
            box.check()
        click(page, "text=I take part")
    elif place == "before":
        page.fill("input[type=number]", "45")
        click(page, "text=Continue")
    elif place == "tutorial":
        click(page, "text=Skip it")
    elif place in ("after_session", "after"):
        page.fill("input[type=text]", "Velvet")
        click(page, "text=Continue")
    elif place in ("instructions", "over", "debriefing"):
        click(page, "text=Continue")


def walk(
    browsers: Browsers,
    disturb: Callable[[Any, str], Any],
    click: Click = lambda page, what: page.click(what),
    until: str = "done",
    link: str = LINK,
    choose: Callable[[Any, str], Any] = lambda page, place: page,
) -> Any:
    """Walks through the pages; something happens at each of them.

    Args:
        browsers: browsers of people.
        disturb: what happens at a page; returns the page with which the person goes on.
        click: how the person clicks.
        until: last page.
        link: link of the person.
        choose: returns the window in which the person looks for a page.

    Returns:
        The last page.
    """
    page, name = browsers.tab(link), ""
    partner = Partner(browsers.served.port)
    for place in PAGES:
        page = choose(page, place)
        arrive(page, place)
        page = disturb(page, place)
        arrive(page, place)
        if place not in ("session", "over"):  # their bar is that of the seat
            assert number(page) == (name or number(page)), place
            name = number(page)
        if place == until:
            break
        if place == "lobby":
            partner.start()
        go_on(page, place, click)
    if until == "done":
        partner.finish()
    return page


def way_back(data: Path, address: str, person: str = "platform-one") -> str:
    """Returns the link with which the experimenter lets a person go on."""
    code, text = command("readmit", data, person, "--address", address)
    assert code == 0, text
    return text
