"""Takes the pictures of docs/console.md: the seats of a session of the console in Chromium.

python docs/console_pictures.py            # needs the extra console, playwright and Chromium

The scripts play until the moment of the pictures; then a browser sits down at each seat. Sessions with people are in
real time, so that no two pictures are equal to the pixel.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Final

from PIL import Image
from playwright.sync_api import sync_playwright

DOCS: Final = Path(__file__).parent
COMMAND: Final = (
    sys.executable, "-m", "dorothie_gym.cli", "console", "--town", "midtown", "--seed", "12", "--port", "0", "--json",
)  # fmt: skip
SECONDS: Final = 38.0
"""Time that the scripts play before the pictures [s]."""

SEATS: Final = ("experimenter", "co_wizard", "participant", "ad_wizard")
FLAGS: Final = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")
COLOURS: Final = 256
"""Number of colours of the pictures, which keeps their files small."""


def main() -> None:
    """Takes all pictures."""
    chromium = find_chromium()
    with subprocess.Popen(COMMAND, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            links: dict[str, str] = json.loads(server.stdout.readline())["links"]
            _take(links, chromium)
        finally:
            server.terminate()


def find_chromium() -> str:
    """Returns the path of Chromium; exits if none is installed."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        sys.exit("no Chromium is installed; on Debian: apt-get install chromium")
    return chromium


def _take(links: dict[str, str], chromium: str) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        pages: dict[str, Any] = {}
        for seat in SEATS:
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(links[seat])
            page.wait_for_selector(f"body[data-ready={seat}]", timeout=60_000)
            pages[seat] = page
            if seat == "experimenter":
                page.click("button:has-text('Start')")
                time.sleep(SECONDS)
        _work(pages)
        for seat, page in pages.items():
            page.evaluate("document.querySelector('.net').remove()")  # the time to the server, which is this machine's
            save(page.screenshot(), DOCS / f"console_{seat}.png")
        browser.close()


def _work(pages: dict[str, Any]) -> None:
    """Lets the people do something that is worth a picture."""
    co_wizard, participant, ad_wizard = pages["co_wizard"], pages["participant"], pages["ad_wizard"]
    ad_wizard.click("text=Heavy rain")
    ad_wizard.click("button[data-tool=streetbarrier]")
    co_wizard.keyboard.press("p")
    box = co_wizard.locator(".map > canvas").bounding_box()
    for share in (0.5, 0.62):
        co_wizard.mouse.click(box["x"] + share * box["width"], box["y"] + 0.5 * box["height"])
    participant.fill("#words", "Okay. Turn right at the next corner, then stop at the KFC.")
    participant.wait_for_selector(".talk > .chips .chip")
    for page in (co_wizard, participant):
        until(page, "document.querySelector('.windscreen .note').hidden")
    time.sleep(3.0)


def until(page: Any, reached: str) -> None:
    """Waits until an expression of a page is true; the policy of the page forbids Playwright's own way."""
    end = time.monotonic() + 60.0
    while not page.evaluate(reached):
        if time.monotonic() > end:
            sys.exit(f"not within 60 s: {reached}")
        time.sleep(0.1)


def save(content: bytes, path: Path) -> None:
    """Writes a picture with few colours."""
    path.write_bytes(content)
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main()
