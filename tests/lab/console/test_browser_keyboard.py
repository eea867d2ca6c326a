"""Whole sessions at each seat by keyboard alone, in real browsers; three browsers at once. Needs Chromium."""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("playwright.sync_api", reason="needs playwright")
pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.lab.console.room import RoomState
from dorothie_gym.ontology import MentalAction, PhysicalAction, Role
from dorothie_gym.session.recording import EventType, Session, read_seat_log
from tests.chromium import IN_CHROMIUM, WAIT, another, chromium, press, tab_to
from tests.lab.console.people import Table
from tests.lab.console.serving import Served

pytestmark = IN_CHROMIUM

LONGEST = 900.0
"""Time limit of sessions until a test has done everything [s]; it then sets a shorter one."""

CO_WIZARD_SCALE, AD_WIZARD_SCALE = 4.0, 2.6
"""Scale of the maps when a session begins [px/m]."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as launched:
        yield launched


class Keyboard:
    """Browser at a seat that is never touched by a mouse; mistakes of the page fail the test.

    Attributes:
        page: the page.
        errors: mistakes of the page.
    """

    def __init__(self, browser: Any, served: Served, seat: str, width: int = 1280, height: int = 720) -> None:
        self.page = browser.new_context(viewport={"width": width, "height": height}).new_page()
        self.errors: list[str] = []
        self.page.set_default_timeout(WAIT)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda line: self.errors.append(line.text) if line.type == "error" else None)
        self.page.goto(f"http://127.0.0.1:{served.port}/seat#{served.room.seats[seat].token}")
        self.page.wait_for_selector(f"body[data-ready={seat}]")

    def press(self, *keys: str) -> None:
        press(self.page, *keys)

    def to(self, label: str) -> None:
        """Moves the focus to what has a label."""
        tab_to(self.page, label, most=160)

    def type(self, text: str) -> None:
        self.page.keyboard.type(text)

    def until(self, reached: Callable[[], object], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, "not in time"
            self.page.wait_for_timeout(50)

    def point(self, scale: float, x: float, y: float) -> None:
        """Moves the pointer of the focused map to a place [m], in steps of the arrows, and clicks.

        Args:
            scale: scale of the map [px/m].
            x, y: the place.
        """
        self.press("ArrowLeft", "ArrowRight")  # takes the pointer, which holds the map with the car in its middle
        car = self.page.evaluate("consoleLink.state.pose")
        right, down = round(scale * (x - car[0]) / 12), round(scale * (y - car[1]) / 12)
        self.press(*["ArrowRight" if right > 0 else "ArrowLeft"] * abs(right))
        self.press(*["ArrowDown" if down > 0 else "ArrowUp"] * abs(down))
        self.press("Enter")

    def finish(self, table: Table) -> None:
        """Lets the time of the session run out, and begins the next one."""
        run_out(table)
        self.page.wait_for_selector(".over >> text=Next session", timeout=90_000)
        assert table.room.state is RoomState.OVER
        assert self.page.evaluate("document.activeElement.textContent") in (
            "The session is over",
            "All errands are done",
        )
        self.to("Next session")
        self.press("Enter")
        self.until(lambda: table.room.state is RoomState.RUNNING)
        self.page.wait_for_selector(".over", state="detached")
        assert self.errors == []


def run_out(table: Table) -> None:
    """Ends the time of a session in three seconds."""
    engine = table.room.engine
    engine.max_cycles = engine.session.decisions + 30


def record_of(folder: Path, table: Table) -> Session:
    """Returns the first session of a folder, which must be complete and replay exactly; names of folders are random."""
    session = min(map(Session.load, folder.iterdir()), key=lambda each: each.header.seed or 0)
    assert session.complete
    assert resimulate(session, table.room.engine.town).digest == session.digest
    return session


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (844, 390)], ids=["1280x720", "phone"])
def test_a_participant_plays_a_whole_session_by_keyboard(browser: Any, tmp_path: Path, width: int, height: int) -> None:
    table = Table(
        "participant=human,co_wizard=scripted,ad_wizard=scripted", folder=tmp_path, pictures=True, max_seconds=LONGEST
    )
    with Served(table.room) as served:
        at = Keyboard(browser, served, "participant", width, height)
        page = at.page
        at.press("Enter")
        at.type("Left at the corner.")
        page.wait_for_selector(".talk > .chips .chip")
        at.to("correct the act of “Left at the corner.”")
        at.press("Enter")
        at.to("Confirm")
        at.press("Enter", "Enter")  # takes the move, then says it
        page.wait_for_selector(".line.own:not(.waiting) >> text=Left at the corner.")
        at.press("Escape", "4")
        page.wait_for_selector(".line.own:not(.waiting) >> text=Turn left.")
        at.to("correct the act of “Left at the corner.”")
        at.press("Enter")
        at.to("ReplyW")
        at.press("Enter")
        page.wait_for_selector(".line.own .chip.corrected >> text=ReplyW")
        for state in ("false", "true"):
            at.press("v")
            assert page.get_attribute(".windscreen .round", "aria-pressed") == state
        at.press("m", "e", "?")
        page.wait_for_selector("dialog >> text=Go to the errands")
        at.press("Escape")
        page.wait_for_selector("dialog", state="detached")
        for selector in ("#words", ".errands h2", ".map canvas", ".front .windscreen", "#bar h1"):
            box = page.locator(selector).first.bounding_box()
            assert box and box["x"] >= 0 and box["x"] + box["width"] <= width, selector
            assert box["y"] >= 0 and box["y"] + box["height"] <= height, selector
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        at.until(lambda: page.evaluate("document.querySelector('.windscreen .note').hidden"), 120.0)
        at.finish(table)
    session = record_of(tmp_path, table)
    assert session.summary is not None and session.summary["reason"] == "out of time"
    said = session.utterances(Role.PARTICIPANT)
    assert [each.text for each in said[:2]] == ["Left at the corner.", "Turn left."]
    assert said[0].moves[0].act.move.label == "Confirm"


def test_a_co_wizard_plays_a_whole_session_by_keyboard(browser: Any, tmp_path: Path) -> None:
    table = Table("co_wizard=human,participant=scripted,ad_wizard=scripted", folder=tmp_path, max_seconds=LONGEST)
    with Served(table.room) as served:
        at = Keyboard(browser, served, "co_wizard")
        page = at.page
        junctions = [junction.position for junction in table.room.engine.town.junctions]

        def pose() -> tuple[float, float]:
            return tuple(page.evaluate("consoleLink.state.pose.slice(0, 2)"))

        at.until(lambda: page.evaluate("consoleLink.state.exits?.length"))
        at.press("1", "f", "q", "e", "u", "ArrowUp", "ArrowDown", "l", "s", "g", "b", "Alt+1")
        at.press("Enter")
        at.type("Where would you like to go?")
        at.press("Enter", "Escape", "n")
        at.press("Enter")  # the first note: a goal
        at.to("Mark the place of")
        at.press("Enter")
        at.point(CO_WIZARD_SCALE, *pose())
        at.press("n")
        at.to("State of")
        at.press("ArrowDown")
        at.press("Escape", "p")
        at.to("Map with what the car knows")
        at.point(CO_WIZARD_SCALE, *min(junctions, key=lambda each: math.dist(each, pose())))
        at.until(lambda: page.evaluate("consoleLink.waiting.size") == 0)
        at.press("c", "Escape", "v", "v")
        at.finish(table)
    session = record_of(tmp_path, table)
    updates = {event.data["action"] for event in session.of_type(EventType.BELIEF_UPDATE)}
    assert updates == {action.label for action in MentalAction}, "all mental actions"
    decided = {
        PhysicalAction(decision.actions[Role.CO_WIZARD]["physical"])
        for decision in session.decisions or ()
        if "physical" in decision.actions.get(Role.CO_WIZARD, {})
    }
    assert decided == set(PhysicalAction), "all physical actions"
    said = " ".join(each.text for each in session.utterances(Role.CO_WIZARD))
    assert "Okay. Where would you like to go?" in said


def test_an_ad_wizard_plays_a_whole_session_by_keyboard(browser: Any, tmp_path: Path) -> None:
    table = Table("ad_wizard=human,participant=scripted,co_wizard=scripted", folder=tmp_path, max_seconds=LONGEST)
    with Served(table.room) as served:
        at = Keyboard(browser, served, "ad_wizard")
        page, session = at.page, table.room.engine.session

        def place(number: int) -> tuple[float, float]:
            """Returns a place on which props may stand: the one of this number, by its distance from the car."""
            car = session.world.car.position.tolist()
            far = [landmark.position for landmark in session.task.storyboard.landmarks]
            lanes = [lane for lane in table.room.engine.town.lanes if lane.length > 80.0 and not lane.in_junction]
            middles = [tuple(map(float, lane.position(0.6 * lane.length))) for lane in lanes]
            free = [at for at in middles if math.dist(at, car) > 30.0 and min(math.dist(at, p) for p in far) > 30.0]
            return sorted(free, key=lambda at: math.dist(at, car))[number]

        at.until(lambda: table.room.state is RoomState.RUNNING)
        at.press("m")
        at.type("Please hurry up.")
        at.press("Enter", "Escape", "w")
        at.to("Dense fog")
        at.press("Enter")
        at.to("precipitation")
        at.press("ArrowRight", "ArrowRight", "ArrowRight", "x")
        at.to("No position (GPS)")
        at.press("Enter", "r")
        at.to("street barrier")
        at.press("Enter")
        for number in range(8):  # a place may be refused: the map shows where the car was a moment ago
            at.point(AD_WIZARD_SCALE, *place(number))
            at.until(lambda: page.evaluate("consoleLink.waiting.size") == 0)
            page.wait_for_timeout(500)
            if page.locator(".placed li").count():
                break
        page.wait_for_selector(".placed li")
        at.press("Escape", "r")
        at.to("Move")
        at.press("Enter")
        at.point(AD_WIZARD_SCALE, *place(1))
        at.until(lambda: page.evaluate("consoleLink.waiting.size") == 0)
        at.press("r")
        at.to("Remove")
        at.press("Enter")
        page.wait_for_selector(".placed li", state="detached")
        at.press("r")
        at.to("Number")
        at.press("ArrowUp", "Escape", "r")
        at.to("Pedestrians")
        at.press("Enter")
        at.point(AD_WIZARD_SCALE, *place(0))
        at.press("Escape", "t")
        at.to("Add")
        at.press("Enter")
        at.until(lambda: page.evaluate("consoleLink.waiting.size") == 0)
        at.finish(table)
    done = [
        json.dumps(event.data) for event in record_of(tmp_path, table).of_type(EventType.EXCEPTION, EventType.MESSAGE)
    ]
    for word in ("fog_density", "precipitation", "gps", "streetbarrier", "edestrian", "hurry up", "rigger"):
        assert any(word in each for each in done), (word, done)


def test_three_browsers_play_one_session_at_once(browser: Any, tmp_path: Path) -> None:
    roles = "participant=human,co_wizard=human,ad_wizard=human"
    table = Table(roles, folder=tmp_path, pictures=True, max_seconds=LONGEST)
    with Served(table.room) as served, another(browser) as second, another(browser) as third:
        participant = Keyboard(browser, served, "participant")
        co_wizard = Keyboard(second, served, "co_wizard")
        assert table.room.state is RoomState.WAITING
        ad_wizard = Keyboard(third, served, "ad_wizard")
        participant.until(lambda: table.room.state is RoomState.RUNNING)
        participant.press("Enter")
        participant.type("Please go straight on.")
        participant.press("Enter")
        co_wizard.page.wait_for_selector(".line.participant >> text=go straight on")
        co_wizard.press("Alt+1", "ArrowUp")
        participant.page.wait_for_selector(".line.co_wizard >> text=Okay.")
        ad_wizard.press("m")
        ad_wizard.type("Look out for fog.")
        ad_wizard.press("Enter")
        participant.page.wait_for_selector(".line.ad_wizard >> text=Look out for fog.")
        assert "fog" not in co_wizard.page.inner_text(".talk")
        everyone = (participant, co_wizard, ad_wizard)
        run_out(table)
        for each in everyone:
            each.page.wait_for_selector(".over >> text=The time is up.", timeout=120_000)
        assert [each.errors for each in everyone] == [[], [], []]
    record_of(tmp_path, table)
    joined = [event.role for event in read_seat_log(next(tmp_path.iterdir())) or () if event.kind.value == "joined"]
    assert set(joined) == {Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD}


def documented(page: str) -> set[str]:
    """Returns the keys in the table of a page of the documentation, without those that need a microphone."""
    text = (Path(__file__).parents[3] / "docs" / page).read_text(encoding="utf-8").partition("\n## Keys\n")[2]
    keys: set[str] = set()
    for key, label in re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", text, flags=re.MULTILINE)[1:]:  # without the heading
        for each in key.split(", ") if "microphone" not in label else ():
            first, _, last = each.partition(" to ")
            before = first[:-1] if last else first
            keys |= {f"{before}{k}" for k in range(int(first[-1]), int(last[-1]) + 1)} if last else {first}
    return keys


@pytest.mark.parametrize("seat", ["participant", "co_wizard", "ad_wizard", "experimenter"])
def test_the_pages_of_the_seats_list_their_keys(browser: Any, seat: str) -> None:
    table = Table()
    with Served(table.room) as served:
        at = Keyboard(browser, served, seat)
        at.press("?")
        at.page.wait_for_selector("dialog.keys")
        shown = set(at.page.locator("dialog.keys dt").all_inner_texts())
        assert shown | {"Escape"} == documented(f"seat-{seat.replace('_', '-')}.md") | {"Escape"}
        assert at.errors == []
