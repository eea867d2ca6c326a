"""Makes docs/console_film.webp: a session in which two people, in two windows of Chromium, drive and talk.

python docs/console_film.py            # needs the extras console and video, playwright and Chromium

The people are played by this script, by keyboard only: one asks for turns, the other one answers and drives. The
session is recorded as every session of the console is, and filmed by `dorothie-gym film`. It is in real time, so that
no two films are equal to the pixel.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import imageio.v2 as imageio
from console_pictures import DOCS, FLAGS, find_chromium, until
from PIL import Image
from playwright.sync_api import sync_playwright

PROGRAM: Final = (sys.executable, "-m", "dorothie_gym.cli")
SECONDS: Final = 46
"""Duration of the session [s]."""

FRAMES_PER_SECOND: Final = 4
SIZE: Final = (576, 324)
"""Size of the film [px]."""

QUALITY: Final = 40
"""Quality of the film as WebP, which keeps it below 1 MB."""


def main() -> None:
    """Plays the session, and films it."""
    with tempfile.TemporaryDirectory() as folder:
        _play(Path(folder, "sessions"))
        (session,) = Path(folder, "sessions").iterdir()
        video = Path(folder, "film.mp4")
        film = [*PROGRAM, "film", str(session), "--out", str(video), "--fps", str(FRAMES_PER_SECOND)]
        subprocess.run(film, check=True)
        frames = [Image.fromarray(frame).resize(SIZE, Image.Resampling.LANCZOS) for frame in imageio.get_reader(video)]
    frames[0].save(
        DOCS / "console_film.webp",
        save_all=True,
        append_images=frames[1:],
        duration=1000 // FRAMES_PER_SECOND,
        loop=0,
        quality=QUALITY,
        method=4,
    )


def _play(out: Path) -> None:
    console = [
        *PROGRAM, "console", "--roles", "participant=human,co_wizard=human,ad_wizard=silent", "--town", "brookside",
        "--storyboard", "lunch_break", "--seed", "4", "--max-seconds", str(SECONDS), "--out", str(out), "--port", "0",
        "--json",
    ]  # fmt: skip
    with subprocess.Popen(console, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            links: dict[str, str] = json.loads(server.stdout.readline())["links"]
            with sync_playwright() as playwright:
                windows = [
                    playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS)) for _ in range(2)
                ]
                passenger, driver = (
                    _sit(window, links[seat], seat)
                    for window, seat in zip(windows, ("participant", "co_wizard"), strict=True)
                )
                _converse(passenger, driver)
                passenger.wait_for_selector(".over", timeout=90_000)
                for window in windows:
                    window.close()
        finally:
            server.terminate()


def _sit(window: Any, link: str, seat: str) -> Any:
    page = window.new_page(viewport={"width": 1280, "height": 720})
    page.goto(link)
    page.wait_for_selector(f"body[data-ready={seat}]", timeout=60_000)
    return page


def _converse(passenger: Any, driver: Any) -> None:
    """Lets the passenger ask for two turns and a stop, and the driver answer and drive."""
    _say(passenger, "Hello, car. I am hungry.")
    _say(driver, "Hello. Where would you like to go?")
    for number, request in enumerate(("Please take the next turn {way}.", "And now {way}, please.")):
        way = _next_way(driver, number)
        _say(passenger, request.format(way=way["name"]))
        _heard(driver, "participant", way["name"])
        driver.keyboard.press(str(way["key"]))
        _say(driver, f"Going {way['name']}{' into ' + way['street'] if way['street'] else ''}.")
        passed = f"(consoleLink.state.exits?.[0]?.[3] ?? -1) !== {way['junction']}"
        until(driver, f"{passed} || consoleLink.state.time > {SECONDS - 12}")
    passenger.keyboard.press("7")  # Stop here, please.
    _heard(driver, "participant", "Stop here")
    driver.keyboard.press("s")
    _say(driver, "All right, we stop.")


def _next_way(driver: Any, number: int) -> dict[str, Any]:
    """Returns a turn of the next junction: its name, street, key, and the junction."""
    until(driver, "consoleLink.state.exits?.length > 1")
    exits = driver.evaluate("consoleLink.state.exits")
    key = next((k for k, row in enumerate(exits) if abs(row[0]) > 30 and (row[0] > 0) == (number % 2 == 0)), 0)
    angle, _, street, junction = exits[key]
    name = "left" if angle > 30 else "right" if angle < -30 else "straight on"
    return {
        "name": name,
        "street": driver.evaluate(f"consoleLink.hello.streets[{street}]"),
        "key": key + 1,
        "junction": junction,
    }


def _say(page: Any, text: str) -> None:
    page.keyboard.press("Enter")
    page.keyboard.type(text, delay=25)
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    page.wait_for_selector(f".line.own:not(.waiting) >> text={text}", timeout=60_000)


def _heard(page: Any, who: str, text: str) -> None:
    page.locator(f".line.{who}", has_text=text).last.wait_for(timeout=60_000)


if __name__ == "__main__":
    main()
