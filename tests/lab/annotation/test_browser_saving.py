"""What a person sees while edits are saved: two windows, no network, reloads, and servers that are started anew."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.annotation.log import ADJUDICATED, log_path
from dorothie_gym.ontology import DialogueMove
from dorothie_gym.session.recording import Session
from tests.chromium import IN_CHROMIUM
from tests.lab.annotation.builders import recorded
from tests.lab.annotation.people import Hold, Room, forgive, press, saved, served_moves, shown
from tests.lab.annotation.serving import Served

pytestmark = IN_CHROMIUM


def test_edits_that_wait_do_not_overwrite_another_window(room: Room) -> None:
    first, second = room.open("anna"), room.open("anna")
    held = Hold(second)
    press(second, "c", "g")
    second.keyboard.type("kfc")
    press(second, "Enter", "Escape", "ArrowDown", "e", "ArrowDown", "Control+z")
    room.until(lambda: len(held.held) == 1)  # Check; values, Explain and the undo wait behind it
    press(first, "i", "s", "ArrowLeft", "Enter")
    saved(room, first)
    before = log_path(room.folder, "anna").read_bytes()
    press(second, "x")  # a choice that is open was made on marks that are no longer there
    second.wait_for_selector(".popover")
    held.go_on()
    second.wait_for_selector("#dropped >> text=changed elsewhere")
    saved(room, second)
    named = second.locator("#dropped li").all_inner_texts()
    assert [name.split(":")[0] for name in named] == ["move Check", "values", "move Explain", "undo"]
    assert log_path(room.folder, "anna").read_bytes() == before and len(room.line("anna", 0)) == 2
    assert shown(second) == served_moves(room, "anna") == shown(first) and second.locator(".popover").count() == 0
    press(second, "Control+z")  # it undoes the last edit of the marks that are shown
    room.until(lambda: len(room.line("anna", 0)) == 1)
    saved(room, second)
    assert shown(second) == served_moves(room, "anna") and shown(second)[0] == ["Instruct"]
    second.click("#dropped >> text=Close")
    assert second.locator("#dropped p").count() == 0
    press(second, "ArrowUp", "ArrowUp", "k", "k")
    held = Hold(second)
    press(second, "f")
    press(first, "e")  # the first window has not seen the undo
    first.wait_for_selector("#dropped >> text=changed elsewhere")
    held.go_on()
    saved(room, first)
    saved(room, second)
    assert shown(second) == served_moves(room, "anna")
    forgive(room, "409")


def test_takeovers_and_redos_that_wait_are_dropped_too(room: Room) -> None:
    for name, key in (("anna", "i"), ("ben", "e")):
        page = room.open(name)
        press(page, key)
        saved(room, page)
    first, second = room.open("carol"), room.open("carol")
    second.wait_for_selector(".version >> nth=1")
    press(second, "c", "Control+z")
    saved(room, second)
    first.reload()
    first.wait_for_selector("body[data-ready=adjudicator]")
    held = Hold(second, "redo")
    press(second, "Control+y", "Alt+2", "Alt+1")
    room.until(lambda: len(held.held) == 1)
    press(first, "f")
    saved(room, first)
    held.go_on()
    second.wait_for_selector("#dropped >> text=take over from anna")
    names = [name.split(":")[0] for name in second.locator("#dropped li").all_inner_texts()]
    assert names == ["redo", "take over from ben", "take over from anna"]
    saved(room, second)
    assert room.line(ADJUDICATED, 0)[0].move is DialogueMove.CONFIRM
    assert shown(second) == served_moves(room, ADJUDICATED)
    forgive(room, "409")


def test_edits_made_offline_are_saved_later(room: Room) -> None:
    page = room.open("anna")
    press(page, "i")
    saved(room, page)
    page.context.set_offline(True)
    press(page, "e", "ArrowDown", "c", "s", "ArrowLeft", "Enter", "ArrowDown", "y")
    page.wait_for_selector("#bar .state >> text=the server does not answer. 4 edits wait")
    page.wait_for_timeout(5000)
    wanted = shown(page)
    assert wanted[0] == ["Explain"] and len(wanted[1]) == 2
    assert room.line("anna", 0)[0].move is DialogueMove.INSTRUCT
    page.context.set_offline(False)
    saved(room, page)
    assert shown(page) == served_moves(room, "anna") == wanted and page.locator("#dropped li").count() == 0
    page.reload()
    page.wait_for_selector("body[data-ready=annotator]")
    assert shown(page) == wanted
    forgive(room, "ERR_INTERNET_DISCONNECTED")


def test_an_edit_whose_answer_is_lost_counts_once(room: Room) -> None:
    page = room.open("anna")
    lost = []

    def lose(route: Any) -> None:
        lost.append(route.fetch().status)
        route.abort()

    for key, action in (("i", "mark"), ("Control+z", "undo"), ("Control+y", "redo")):
        page.route(f"**/{action}", lose, times=1)
        press(page, key)
        room.until(lambda: len(lost) and page.evaluate("document.body.dataset.saved === 'true'"))
        assert shown(page) == served_moves(room, "anna")
    assert lost == [200, 200, 200]
    actions = [json.loads(line)["action"] for line in log_path(room.folder, "anna").read_text().splitlines()[1:]]
    assert actions == ["mark", "undo", "redo"] and page.locator("#dropped li").count() == 0
    forgive(room, "ERR_FAILED")


def test_a_reload_while_edits_wait_asks_and_then_shows_the_state_of_the_server(room: Room) -> None:
    page = room.open("anna")
    press(page, "i")
    saved(room, page)
    asked: list[str] = []
    stay = [True]

    def answer(dialog: Any) -> None:
        asked.append(dialog.type)
        if stay:
            dialog.dismiss()
        else:
            dialog.accept()

    page.on("dialog", answer)
    held = Hold(page)
    press(page, "e", "ArrowDown", "c")
    room.until(lambda: held.held)
    page.evaluate("setTimeout(() => location.reload(), 0)")
    room.until(lambda: asked)
    assert asked == ["beforeunload"] and shown(page)[0] == ["Explain"]
    stay.clear()
    page.reload()
    page.wait_for_selector("body[data-ready=annotator]")
    assert len(asked) == 2 and shown(page) == served_moves(room, "anna") and shown(page)[0] == ["Instruct"]
    held.go_on()
    press(page, "e")
    saved(room, page)
    page.reload()
    page.wait_for_selector("body[data-ready=annotator]")
    assert len(asked) == 2, "nothing waits, so nothing is asked"
    assert shown(page) == served_moves(room, "anna")


def test_another_session_opens_when_the_edits_are_saved(browser: Any, tmp_path: Path) -> None:
    one, _ = recorded(tmp_path / "corpus" / "one")
    recorded(tmp_path / "corpus" / "two")
    with Served(tmp_path / "corpus") as served:
        made = Room(browser, served, one)
        page = made.open("anna")
        held = Hold(page)
        press(page, "i", "ArrowDown", "e")
        made.until(lambda: held.held)
        page.select_option("#bar select", "1")
        page.wait_for_timeout(300)
        assert page.locator(".script li").count() and page.evaluate("document.body.dataset.session") == "0"
        held.go_on()
        page.wait_for_selector("body[data-session='1'][data-ready=annotator]")
        assert served_moves(made, "anna")[:2] == [["Instruct"], ["Explain"]]
        page.context.close()
    assert not [line for line in made.errors if "404" not in line]


def test_edits_outlive_the_server_with_the_same_link_and_with_a_new_one(
    browser: Any, session: Session, tmp_path: Path
) -> None:
    session.save(tmp_path / "corpus" / "one")
    served = Served(tmp_path / "corpus")
    with served:
        made = Room(browser, served, session)
        page = made.open("anna")
        press(page, "i")
        saved(made, page)
    press(page, "e", "ArrowDown", "c")
    page.wait_for_selector("#bar .state >> text=2 edits wait")
    with Served(tmp_path / "corpus", seats=served.seats, port=served.port):
        saved(made, page)
        assert served_moves(made, "anna")[:2] == [["Explain"], ["Check"]] == shown(page)[:2]
    press(page, "f", "ArrowDown", "y")
    with Served(tmp_path / "corpus", port=served.port) as renewed:
        page.wait_for_selector("#bar .state >> text=this link leads to no seat")
        assert page.evaluate("document.body.dataset.saved") == "false"
        page.goto(renewed.link("anna"))  # the same page with another secret: it is not loaded again
        saved(made, page)
        assert served_moves(made, "anna") == shown(page) and shown(page)[1:3] == [["Confirm"], ["Reply Y"]]
    page.context.close()
    forgive(made, "ERR_CONNECTION_REFUSED", "401", "ERR_EMPTY_RESPONSE", "ERR_CONNECTION_RESET")
    assert not made.errors
