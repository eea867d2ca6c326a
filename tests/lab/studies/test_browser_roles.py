"""Roles in the browser: who reads the instructions when a partner leaves gets the other role, and is told so."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from tests.chromium import CHROMIUM, chromium
from tests.lab.studies.content import STUDY, write_study
from tests.lab.studies.laboratory import Browsers, at
from tests.lab.studies.serving import Client, ServedStudy, seat

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (Debian: apt-get install chromium)"),
]

TEXTS = STUDY["texts"]["instructions"]


def to_instructions(port: int) -> Client:
    client = Client(port)
    client.do("join")
    client.do("consent", {"agreed": [True, True]})
    client.do("answers", {"stage": "before", "answers": {"age": 30}})
    return client


def read_until_instructions(page: Any) -> None:
    at(page, "consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    at(page, "before")
    page.fill("input[type=number]", "45")
    page.click("text=Continue")
    at(page, "instructions")


@contextlib.contextmanager
def open_page(client: Client) -> Iterator[None]:
    """Lets the page of a person ask for news while the block lasts, as one that is open does."""
    going = True

    def ask() -> None:
        while going:
            client.tag = ""
            client.do("news")
            time.sleep(0.3)

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        yield
    finally:
        going = False
        thread.join()


@pytest.mark.parametrize("practises", [False, True])
def test_new_instructions_are_shown_when_the_role_changes_and_belong_to_the_seat(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, practises: bool
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.waiting_room.GONE_SECONDS", 6.0)
    study = {**STUDY, "session": {"max_seconds": 60.0, "pictures": False}, "tutorial": {"seconds": 120.0}}
    with ServedStudy(write_study(tmp_path, study), tmp_path / "data") as served, chromium() as launched:
        browsers, first = Browsers(launched, served), Client(served.port)
        first.enter()
        with open_page(first):
            partner, substitute = to_instructions(served.port), to_instructions(served.port)
            assert partner.view["part"] == substitute.view["part"], "both are to play with the one who waits"
            role = partner.view["part"]
            other = next(each for each in TEXTS if each != role)
            with open_page(partner), open_page(substitute):
                page = browsers.tab()
                read_until_instructions(page)
                page.wait_for_selector(f"text={TEXTS[other]}")
                if practises:
                    page.click("text=Continue")
                    page.click("text=Start the practice drive")
                    page.wait_for_selector(f"body[data-ready={other}]")
            page.wait_for_selector("h2:text('New instructions')")  # the others have closed their pages
            page.wait_for_selector("text=Your role has changed")
            page.wait_for_selector(f"text={TEXTS[role]}")
            assert not page.query_selector(f"text={TEXTS[other]}")
            page.reload()
            page.wait_for_selector("text=Your role has changed")
            page.wait_for_selector(f"text={TEXTS[role]}")
            page.click("text=Continue")
            at(page, "tutorial")
            page.wait_for_selector("text=Start the practice drive")
            page.click("text=Skip it")
        seat(first)
        page.wait_for_selector(f"body[data-stage=session][data-ready={role}]")
        page.context.close()
    assert browsers.errors == []
