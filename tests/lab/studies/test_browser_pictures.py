"""A study in real browsers: two people from consent to code, by keyboard, after reloads, on a phone. Needs Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.session.recording import Session
from tests.chromium import IN_CHROMIUM, chromium, press, tab_to
from tests.lab.studies.content import STUDY
from tests.lab.studies.laboratory import RICH, Laboratory, at, served_laboratory, to_code, to_waiting_room

pytestmark = IN_CHROMIUM


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


@pytest.fixture
def laboratory(browser: Any, tmp_path: Path) -> Iterator[Laboratory]:
    with served_laboratory(browser, tmp_path, RICH) as made:
        yield made


def test_two_people_play_a_study_one_of_them_by_keyboard_on_a_phone(laboratory: Laboratory) -> None:
    one = laboratory.open("/?PROLIFIC_PID=platform-one", 844, 390)
    assert one.url == f"{laboratory.served.address}/", "the id does not stay in the address"
    for statement in STUDY["consent"]["statements"]:
        tab_to(one, statement)
        press(one, "Space")
    press(one, "Enter")
    at(one, "before")
    tab_to(one, "How old are you?")
    one.keyboard.type("27")
    press(one, "Tab", "ArrowDown", "Enter")
    at(one, "instructions")
    tab_to(one, "Continue")
    press(one, "Enter")
    at(one, "tutorial")
    one.wait_for_selector("text=Start the practice drive")
    tab_to(one, "Start the practice drive")
    press(one, "Enter")
    one.wait_for_selector("body[data-ready]")
    one.wait_for_selector(".over >> text=Continue")
    tab_to(one, "Continue")
    press(one, "Enter")
    at(one, "lobby")
    two = laboratory.open("/?PROLIFIC_PID=platform-two")
    to_waiting_room(two)
    for page in (one, two):
        page.wait_for_selector("body[data-stage=session][data-ready]", timeout=60_000)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    first = one if one.get_attribute("body", "data-ready") == "participant" else two
    other = two if first is one else one
    press(first, "Enter")
    first.keyboard.type("Please turn left.")
    press(first, "Enter")
    other.wait_for_selector("text=turn left")
    one.wait_for_selector(".over >> text=Continue", timeout=60_000)
    tab_to(one, "Continue")
    press(one, "Enter")
    to_code(two)
    at(one, "after")
    tab_to(one, "strongly disagree")
    press(one, "ArrowRight", "ArrowRight")
    tab_to(one, "Map")
    press(one, "Space")
    tab_to(one, "Comments?")
    one.keyboard.type("Velvet")
    tab_to(one, "Continue")
    press(one, "Enter")
    at(one, "debriefing")
    tab_to(one, "Continue")
    press(one, "Enter")
    one.wait_for_selector("text=FINISHED")
    assert one.get_attribute("text=Go back to the recruiting page", "href") == "https://recruiting.example.org/done"
    (folder,) = (laboratory.served.data / "sessions").iterdir()
    assert Session.load(folder).complete


def test_a_reload_goes_on_at_every_stage(laboratory: Laboratory) -> None:
    page = laboratory.open()
    other = laboratory.open()
    to_waiting_room(other)

    def reload(stage: str) -> None:
        at(page, stage)
        page.reload()
        at(page, stage)

    reload("consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    at(page, "before")
    page.fill("input[type=number]", "45")
    reload("before")
    assert page.input_value("input[type=number]") == "45"
    page.check("text=No")
    page.click("text=Continue")
    reload("instructions")
    page.click("text=Continue")
    reload("tutorial")
    page.click("text=Start the practice drive")
    page.wait_for_selector("body[data-ready]")
    reload("tutorial")
    page.click("text=Start the practice drive")
    page.click("text=End practice")
    at(page, "session")
    page.wait_for_selector("body[data-ready]")
    reload("session")
    page.wait_for_selector("body[data-ready]")
    page.wait_for_selector(".over >> text=Continue", timeout=60_000)
    reload("session")
    page.click("text=Continue")
    reload("after")
    page.check(".points label:nth-child(2) input")
    page.check("text=Map")
    page.click("button:has-text('Continue')")
    reload("debriefing")
    page.click("text=Continue")
    reload("done")
    page.wait_for_selector("text=FINISHED")


def test_a_person_withdraws_in_a_session_and_the_partner_goes_on(laboratory: Laboratory) -> None:
    one, two = laboratory.open("/?PROLIFIC_PID=platform-one"), laboratory.open()
    to_waiting_room(one)
    to_waiting_room(two)
    for page in (one, two):
        page.wait_for_selector("body[data-stage=session][data-ready]", timeout=60_000)
    one.fill("#words", "Marmalade, please.")
    one.press("#words", "Enter")
    two.wait_for_selector("text=armalade")
    one.click("text=Withdraw")
    one.click("text=Go on with the study")
    one.click("text=Withdraw")
    one.click("text=Withdraw and delete")
    one.wait_for_selector("text=has been deleted")
    data = [path.read_bytes() for path in laboratory.served.data.rglob("*") if path.is_file()]
    assert not any(b"armalade" in content or b"platform-one" in content for content in data)
    two.wait_for_selector("text=The session is over")
    two.wait_for_selector("text=Continue")  # on the page that follows by itself
    assert not two.query_selector("text=armalade")
    two.click("text=Continue")
    at(two, "after")
    one.reload()
    one.wait_for_selector("text=has been deleted")  # and no new person


def test_axe_finds_no_violation_at_any_stage(laboratory: Laboratory) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python").Axe()
    other = laboratory.open()
    page = laboratory.open("/", 844, 390, bypass_csp=True)  # the policy of the page forbids the scripts of axe

    def check(stage: str) -> None:
        at(page, stage)
        page.wait_for_timeout(200)
        found = axe.run(page).response["violations"]
        assert not found, [(stage, each["id"], [node["html"] for node in each["nodes"]][:3]) for each in found]

    check("consent")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    at(page, "before")
    page.click("text=Continue")
    check("before")  # with messages
    page.fill("input[type=number]", "31")
    page.check("text=Yes")
    page.click("text=Continue")
    check("instructions")
    page.click("text=Continue")
    check("tutorial")
    page.click("text=Start the practice drive")
    page.wait_for_selector("body[data-ready]")
    check("tutorial")
    page.click("text=End practice")
    check("lobby")
    page.click("text=Withdraw")
    check("lobby")
    page.click("text=Go on with the study")
    to_waiting_room(other)
    page.wait_for_selector("body[data-stage=session][data-ready]", timeout=60_000)
    check("session")
    page.wait_for_selector(".over >> text=Continue", timeout=60_000)
    check("session")
    page.click(".over >> text=Continue")
    check("after")
    page.check(".points label:nth-child(6) input")
    page.check("text=Talk")
    page.click("button:has-text('Continue')")
    check("debriefing")
    page.click("text=Continue")
    check("done")
    page.click("text=Withdraw")
    page.click("text=Withdraw and delete")
    check("gone")
