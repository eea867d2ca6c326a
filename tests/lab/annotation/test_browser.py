"""Annotation in a real browser: by keyboard, by mouse, with sound and pictures, and adjudication. Needs Chromium."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.archive import Corpus
from dorothie_gym.lab.annotation.corpus_agreement import corpus_agreement
from dorothie_gym.lab.annotation.log import ADJUDICATED
from dorothie_gym.ontology import DialogueMove, LandmarkName, UnitEnd
from dorothie_gym.session.recording import Session
from tests.chromium import IN_CHROMIUM
from tests.lab.annotation.builders import recorded
from tests.lab.annotation.people import Room, forgive, press, saved
from tests.lab.annotation.serving import Served

pytestmark = IN_CHROMIUM


def test_a_session_is_annotated_by_keyboard_alone(room: Room) -> None:
    page = room.open("anna")
    press(page, "2", "1")  # it opens something; a command
    room.until(lambda: room.line("anna", 0)[0].move is DialogueMove.INSTRUCT)
    press(page, "e")  # a direct key
    room.until(lambda: room.line("anna", 0)[0].move is DialogueMove.EXPLAIN)
    press(page, "2", "3", "Backspace", "2")  # back to "what is opened?"; a statement
    room.until(lambda: room.line("anna", 0)[0].move is DialogueMove.EXPLAIN)
    press(page, "s", "ArrowLeft", "ArrowLeft", "Enter")
    room.until(lambda: len(room.line("anna", 0)) == 2)
    before = room.line("anna", 0)[0].words
    press(page, "]")
    room.until(lambda: room.line("anna", 0)[0].words == before + 1)
    press(page, "[")
    room.until(lambda: room.line("anna", 0)[0].words == before)
    press(page, "g")
    page.keyboard.type("kfc")
    press(page, "Enter", "Escape")
    room.until(lambda: LandmarkName.KFC in room.line("anna", 0)[0].slots)
    press(page, "x", "1", "e", "f", "Escape", "t", "1", "c", "Escape")
    room.until(lambda: [row.end for row in room.marks("anna").transactions.values()][:1] == [UnitEnd.COMPLETED])
    assert room.marks("anna").exchanges[0].exception == "environmental"
    press(page, "ArrowDown", "y", "p")
    room.until(lambda: room.line("anna", 0)[1].exchange == 0 and room.line("anna", 0)[1].move is DialogueMove.REPLY_Y)
    press(page, "ArrowUp", "m")
    room.until(lambda: len(room.line("anna", 0)) == 1)
    press(page, "Control+z")
    room.until(lambda: len(room.line("anna", 0)) == 2)
    press(page, "Control+y")
    room.until(lambda: len(room.line("anna", 0)) == 1)
    press(page, "?")
    page.wait_for_selector("dialog >> text=Merge with the next span")
    press(page, "Escape", " ")
    page.wait_for_selector("text=Pause")
    press(page, " ", "Enter")
    room.until(lambda: page.locator(".script li:nth-child(2) [aria-current]").count() == 1)


def test_a_reload_restores_marks_undo_and_redo(room: Room) -> None:
    page = room.open("anna")
    press(page, "i", "c", "Control+z")
    page.wait_for_selector(".span.decided >> text=Instruct")
    room.until(lambda: page.evaluate("document.body.dataset.saved === 'true'"))
    page.reload()
    page.wait_for_selector(".span.decided >> text=Instruct")
    press(page, "ArrowUp", "ArrowUp")
    press(page, "Control+y")
    page.wait_for_selector(".span.decided >> text=Check")
    room.until(lambda: room.line("anna", 0)[0].move is DialogueMove.CHECK)


def test_marks_are_made_by_mouse(room: Room) -> None:
    page = room.open("anna")
    page.click(".script li:nth-child(2) .span")
    page.click(".answers button:has-text('it reacts')")
    page.click(".answers button:has-text('only about the talk')")
    page.click(".answers button:has-text('it did not')")
    room.until(lambda: room.line("anna", 1)[0].move is DialogueMove.CONFUSE)
    page.click(".tools-row button:has-text('Values')")
    page.click(".popover .slot button:has-text('House')")
    page.keyboard.press("Escape")
    room.until(lambda: LandmarkName.HOUSE in room.line("anna", 1)[0].slots)
    box = page.locator("canvas.timeline").bounding_box()
    page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + 8)
    assert page.locator(".reel .time").inner_text().split(" / ")[0] != "0:00"
    assert page.evaluate(
        "document.documentElement.scrollWidth <= innerWidth && document.documentElement.scrollHeight <= innerHeight"
    )


def test_film_shows_map_and_windscreen_and_plays_the_audio(room: Room, session: Session) -> None:
    page = room.open("anna")
    room.until(lambda: page.evaluate("document.querySelector('.picture .note').textContent === ''"), 60.0)
    assert (
        page.evaluate(
            "new Set(document.querySelector('.mapcanvas').getContext('2d').getImageData(0, 0, 300, 100).data).size"
        )
        > 20
    )
    press(page, "b")
    room.until(lambda: page.evaluate("!document.querySelector('.screen').hidden"))
    pixels = "document.querySelector('.screen').getContext('2d').getImageData(0, 0, 480, 270).data"
    room.until(lambda: page.evaluate(f"new Set({pixels}).size") > 60, 120.0)
    if session.audio:
        with page.expect_response(lambda answer: "/audio/" in answer.url and answer.status == 200):
            press(page, "r")
        room.until(lambda: page.evaluate("document.querySelector('.reel').textContent.includes('Play')"))


def test_sessions_of_unknown_towns_and_damaged_logs_are_explained(browser: Any, tmp_path: Path) -> None:
    one, _ = recorded(tmp_path / "corpus" / "one")
    two, _ = recorded(tmp_path / "corpus" / "two")
    (tmp_path / "corpus" / "two" / "annotations").mkdir()
    (tmp_path / "corpus" / "two" / "annotations" / "anna.jsonl").write_text("{\n")
    with Served(tmp_path / "corpus") as served:
        made = Room(browser, served, one)
        page = made.open("anna")
        page.wait_for_selector("text=The map of the town is not known.")
        press(page, "i")
        made.until(lambda: made.line("anna", 0)[0].move is DialogueMove.INSTRUCT)
        page.select_option("#bar select", "1")
        page.wait_for_selector("text=anna.jsonl, line 1")
        page.select_option("#bar select", "0")
        page.wait_for_selector(".span.decided >> text=Instruct")
        page.context.close()
    assert all("400" in line for line in made.errors), "the browser reports the refusal"
    assert two.name == "two"


def test_annotators_work_side_by_side_and_the_adjudicator_decides(room: Room) -> None:
    anna, ben = room.open("anna"), room.open("ben")
    count = len(room.text.lines)
    for page, other in ((anna, "i"), (ben, "e")):
        for k in range(count):
            press(page, other if k == 1 else "a" if k % 2 else "c", "ArrowDown")
        room.until(lambda page=page: page.evaluate("document.body.dataset.saved === 'true'"))  # type: ignore[misc]
    room.until(
        lambda: not list(room.marks("anna").undecided(room.text)) and not list(room.marks("ben").undecided(room.text))
    )
    found = corpus_agreement(Corpus.load(room.served.corpus).entries, with_alpha=False)
    pair = found.pairs["anna", "ben"][1].labels
    # All but one of `count` spans agree; by chance: Check (ceil(n/2) of n)^2, Align (the rest without one)^2.
    checks, aligns = (count + 1) // 2, count // 2 - 1
    chance = (checks**2 + aligns**2) / count**2
    assert pair.moves_of_equal_spans == pytest.approx(((count - 1) / count - chance) / (1 - chance))
    assert pair.spans == 1.0
    carol = room.open("carol")
    carol.wait_for_selector(".adjudication >> text=anna, ben: spans 1.00")
    carol.wait_for_selector(".script li:nth-child(2) .flag >> text=moves")
    assert carol.locator(".span.open").count() == 1
    press(carol, "Alt+2")
    room.until(lambda: room.line(ADJUDICATED, 1)[0].move is DialogueMove.EXPLAIN)
    carol.click("text=History")
    carol.wait_for_selector(".history >> text=carol: take over from ben")
    carol.keyboard.press("Escape")
    assert not list(room.marks(ADJUDICATED).undecided(room.text))


def test_a_second_window_notices_edits_of_the_first(room: Room) -> None:
    first, second = room.open("anna"), room.open("anna")
    press(first, "i")
    room.until(lambda: room.line("anna", 0)[0].move is DialogueMove.INSTRUCT)
    press(second, "ArrowDown", "c")
    second.wait_for_selector("#dropped >> text=changed elsewhere")
    second.wait_for_selector(".span.decided >> text=Instruct")
    room.errors = [line for line in room.errors if "409" not in line]  # the browser reports the refusal


def test_axe_finds_no_violation_without_a_seat(room: Room) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python").Axe()
    page = room.browser.new_context(bypass_csp=True).new_page()
    room.pages.append(page)
    for secret in ("", "#wrong"):
        page.goto(f"http://127.0.0.1:{room.served.port}/annotate{secret}")
        page.wait_for_selector("h1")
        found = axe.run(page).response["violations"]
        assert not found, [(each["id"], [node["html"] for node in each["nodes"]][:3]) for each in found]
        page.goto("about:blank")


@pytest.mark.parametrize("name", ["anna", "carol"])
def test_axe_finds_no_violation(room: Room, name: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python").Axe()
    first = room.open("anna", bypass_csp=True)
    press(first, "i", "x", "1", "e", "Escape")
    room.until(lambda: room.marks("anna").exchanges)
    page = first if name == "anna" else room.open(name, bypass_csp=True)
    page.wait_for_timeout(500)
    if name == "anna":  # an edit that another window has overtaken is named
        other = room.open("anna")
        press(other, "e")
        saved(room, other)
        press(page, "c")
        page.wait_for_selector("#dropped li")
        forgive(room, "409")
    for keys in ((), ("g",), ("Escape", "x"), ("Escape", "s"), ("Escape", "?")):
        press(page, *keys)
        found = axe.run(page).response["violations"]
        assert not found, (keys, [(each["id"], [node["html"] for node in each["nodes"]][:3]) for each in found])
