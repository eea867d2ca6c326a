"""What happens to people at every page of a study: nobody is locked out, nothing is lost, everybody can be paid.

Needs Chromium.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import IN_CHROMIUM, chromium
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.laboratory import Browsers, at, number, until
from tests.lab.studies.serving import Client, ServedStudy
from tests.lab.studies.test_server import exported
from tests.lab.studies.walking import LINK, PAGES, PAIR, arrive, go_on, walk, way_back

pytestmark = IN_CHROMIUM


@pytest.fixture(scope="module")
def launched() -> Iterator[Any]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def browsers(launched: Any, tmp_path: Path) -> Iterator[Browsers]:
    with ServedStudy(write_study(tmp_path, PAIR), tmp_path / "data") as served:
        made = Browsers(launched, served)
        yield made
        for context in launched.contexts:
            context.close()
    assert made.errors == []


def check_whole(browsers: Browsers, out: Path) -> None:
    """Looks at the data: two people, each with the id that is paid, and all that they answered, once."""
    data = browsers.served.data
    people = exported(data, out, "participants")
    assert [row["outcome"] for row in people] == ["completed", "completed"]
    answers = Counter((row["participant"], row["item"]) for row in exported(data, out, "answers"))
    assert len(answers) == 6 and set(answers.values()) == {1}
    assert [row["reason"] for row in exported(data, out, "sessions")] == ["out of time"]
    assert browsers.served.study is not None
    for person in ("platform-one", "platform-two"):
        way_back(data, browsers.served.address, person)  # fails for an id that nobody has


# --- what happens at each page ----------------------------------------------------------------------------------------


class Reload:
    """The page is loaded again."""

    def __call__(self, page: Any, place: str) -> Any:
        page.reload()
        return page


class Back:
    """The person goes back, and forward again."""

    def __call__(self, page: Any, place: str) -> Any:
        page.go_back()
        page.wait_for_timeout(300)
        page.go_forward()
        return page


class BackOnly:
    """The person goes back, does not find the study, and opens its link again."""

    def __call__(self, page: Any, place: str) -> Any:
        page.go_back()
        page.goto(f"http://127.0.0.1:{self.port}{LINK}")
        return page

    port = 0


class Offline:
    """There is no network for five seconds."""

    def __call__(self, page: Any, place: str) -> Any:
        page.context.set_offline(True)
        page.wait_for_timeout(5000)
        page.context.set_offline(False)
        return page


class NextDay:
    """The browser is closed, with all that it keeps for a tab only, and the link is opened again."""

    link = LINK

    def __init__(self, browsers: Browsers) -> None:
        self.browsers = browsers

    def __call__(self, page: Any, place: str) -> Any:
        kept = page.context.storage_state()
        page.context.close()
        return self.browsers.tab(self.link, self.browsers.launched.new_context(storage_state=kept))


class NextDayByAddress(NextDay):
    """As before; but the person has kept the address only, which has no id."""

    link = "/"


class LostCookie:
    """The browser loses its cookies, and is opened anew; the page names a contact, who gives a link."""

    def __init__(self, browsers: Browsers) -> None:
        self.browsers = browsers

    def __call__(self, page: Any, place: str) -> Any:
        context = page.context
        context.clear_cookies()
        if place == "consent":
            page.reload()
            return page  # nothing was agreed to: the tab gets its place back
        page.close()
        page = self.browsers.tab(LINK, context)
        page.wait_for_selector(f"text={STUDY['contact']}")
        assert page.query_selector("text=Try again")
        served = self.browsers.served
        page.goto("about:blank")
        page.goto(way_back(served.data, served.address))
        return page


class OtherBrowser:
    """The person goes on in another browser, by a link of the contact; the old one is told so."""

    def __init__(self, browsers: Browsers) -> None:
        self.browsers = browsers

    def __call__(self, page: Any, place: str) -> Any:
        new = self.browsers.tab(LINK)
        new.wait_for_selector(f"text={STUDY['contact']}")
        served = self.browsers.served
        new.goto("about:blank")
        new.goto(way_back(served.data, served.address))
        arrive(new, place)
        page.context.close()
        return new


class LostCookieOfTheTab(LostCookie):
    """The tab loses its cookie; one that came by a link of the contact gets its place back by itself."""

    def __call__(self, page: Any, place: str) -> Any:
        if place == "before":
            return super().__call__(page, place)
        page.context.clear_cookies()
        page.reload()
        return page


KINDS = Reload, Back, BackOnly, Offline, NextDay, NextDayByAddress, LostCookie, LostCookieOfTheTab, OtherBrowser


@pytest.mark.parametrize("kind", KINDS)
def test_people_go_on_at_every_page(browsers: Browsers, tmp_path: Path, kind: Any) -> None:
    BackOnly.port = browsers.served.port
    disturb = kind(browsers) if issubclass(kind, (NextDay, LostCookie, OtherBrowser)) else kind()
    walk(browsers, disturb)
    check_whole(browsers, tmp_path / "out")


def test_double_clicks_count_once_at_every_page(browsers: Browsers, tmp_path: Path) -> None:
    walk(browsers, lambda page, place: page, lambda page, what: page.dblclick(what))
    check_whole(browsers, tmp_path / "out")


def test_two_tabs_go_on_together_at_every_page(browsers: Browsers, tmp_path: Path) -> None:
    tabs: list[Any] = []

    def other(page: Any, place: str) -> Any:
        if not tabs:
            tabs.extend([page, browsers.tab("/", page.context)])
        if place in ("session", "over"):
            return page
        new = tabs[1 - tabs.index(page)]
        arrive(new, place)
        return new

    def with_seat(page: Any, place: str) -> Any:
        """One of the tabs has the seat, and the other one says so."""
        if place != "session":
            return page
        words = "text=This seat was opened in another window"
        end = time.monotonic() + 60.0
        while sum(tab.query_selector(words) is not None for tab in tabs) != 1:
            assert time.monotonic() < end
            page.wait_for_timeout(100)
        return next(tab for tab in tabs if tab.query_selector(words) is None)

    page = walk(browsers, other, choose=with_seat)
    for tab in tabs:
        arrive(tab, "done")
    assert page in tabs
    check_whole(browsers, tmp_path / "out")


# --- people who leave -------------------------------------------------------------------------------------------------


def test_people_who_leave_at_any_page_hold_nobody_up_and_come_back_to_a_code(launched: Any, tmp_path: Path) -> None:
    study = {**PAIR, "absence": {"seconds": 2.0, "then": "end"}, "waiting_room": {"seconds": 12.0}}
    away: dict[str, tuple[str, Any]] = {}
    with ServedStudy(write_study(tmp_path, study), tmp_path / "data") as served:
        browsers = Browsers(launched, served)

        def leave(page: Any, place: str) -> None:
            away[place] = (name, page.context.storage_state())
            page.context.close()

        for k, last in enumerate(PAGES[:5]):  # before anybody else is there
            page, name = browsers.tab(f"/?PROLIFIC_PID=leaver-{k}"), ""
            for place in PAGES[: k + 1]:
                arrive(page, place)
                name = number(page)
                if place != last:
                    go_on(page, place, lambda page, what: page.click(what))
            leave(page, last)
        page = walk(browsers, lambda page, place: page, until="debriefing")
        name = number(page)
        leave(page, "debriefing")
        page, partner = browsers.tab("/?PROLIFIC_PID=leaver-5"), Client(served.port)
        for place in PAGES[:5]:
            arrive(page, place)
            name = number(page)
            go_on(page, place, lambda page, what: page.click(what))
        partner.enter({"PROLIFIC_PID": "platform-three"})
        with partner.sit():
            arrive(page, "session")
            leave(page, "session")
            partner.follow(lambda: partner.view.get("over"))
        partner.do("proceed", {"stage": "session"})
        assert partner.stage == "after_session", "the partner goes on"

        back: dict[str, Any] = {}
        for place, (name, kept) in away.items():
            page = back[place] = browsers.tab("/", launched.new_context(storage_state=kept))
            at(page, place)
            assert number(page) == name if place != "session" else True
        for page in back.values():
            _go_to_the_end(page)
        codes = [row["outcome"] for row in exported(served.data, tmp_path / "out", "participants")]
        assert Counter(codes)["no partner"] + Counter(codes)["completed"] + Counter(codes)["left"] >= 6, codes
        for context in launched.contexts:
            context.close()
    assert browsers.errors == []


def _go_to_the_end(page: Any) -> None:
    """Goes on alone: who finds no partner ends the waiting, and gets a code, too."""
    end = time.monotonic() + 240.0
    while (stage := page.get_attribute("body", "data-stage")) != "done":
        assert time.monotonic() < end, stage
        if stage in ("lobby", "session"):  # two of them may play
            button = page.query_selector("button >> text=Finish now" if stage == "lobby" else ".over >> text=Continue")
            if button is None and stage == "session":
                button = page.query_selector("article >> text=Continue")
            if button is None:
                page.wait_for_timeout(200)
                continue
            button.click()
        else:
            arrive(page, stage)
            go_on(page, stage, lambda page, what: page.click(what))
        until(page, f"document.body.dataset.stage && document.body.dataset.stage !== '{stage}'")
    page.wait_for_selector("text=Your completion code")


# --- many people ------------------------------------------------------------------------------------------------------


def test_a_hundred_people_from_one_address_come_in_some_of_them_in_browsers(launched: Any, tmp_path: Path) -> None:
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served:
        browsers, clients = Browsers(launched, served), [Client(served.port) for _ in range(96)]
        threads = [
            threading.Thread(target=client.do, args=("join", {"parameters": {"PROLIFIC_PID": f"person-{k}"}}))
            for k, client in enumerate(clients)
        ]
        for thread in threads:
            thread.start()
        pages = [browsers.tab(f"/?PROLIFIC_PID=browser-{k}") for k in range(4)]
        for page in pages:
            at(page, "consent")
        for thread in threads:
            thread.join(60.0)
        names = {number(page) for page in pages} | {client.view["id"] for client in clients}
        assert len(names) == 100
        for k in range(4):
            way_back(served.data, served.address, f"browser-{k}")
        for context in launched.contexts:
            context.close()
    assert browsers.errors == []
