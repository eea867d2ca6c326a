"""Takes the pictures of docs/studies.md: questionnaire and page of the experimenter, in Chromium.

python docs/study_pictures.py            # needs the extra console, playwright and Chromium
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

from console_pictures import DOCS, FLAGS, find_chromium, save
from playwright.sync_api import sync_playwright

PROGRAM: Final = (sys.executable, "-m", "dorothie_gym.cli", "study")


def main() -> None:
    """Takes the pictures."""
    chromium = find_chromium()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "errands.yaml")
        subprocess.run([*PROGRAM, "init", str(file)], check=True, stdout=subprocess.DEVNULL)
        run = [*PROGRAM, "run", str(file), "--out", str(Path(folder, "data")), "--port", "0", "--json"]
        with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as server:
            try:
                assert server.stdout is not None
                links = json.loads(server.stdout.readline())
                with sync_playwright() as playwright:
                    browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
                    _take(browser, links["link"], links["experimenter"])
                    browser.close()
            finally:
                server.terminate()


def _take(browser: Any, link: str, experimenter: str) -> None:
    people = [browser.new_context(viewport={"width": 1280, "height": 720}).new_page() for _ in range(4)]
    for number, page in enumerate(people):
        _to_questionnaire(page, link)
        if number == 0:
            save(page.screenshot(), DOCS / "study_questionnaire.png")
        if number < 3:
            _to_waiting_room(page)
    for page in people[:2]:
        page.wait_for_selector("body[data-stage=session][data-ready]", timeout=60_000)
    control = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
    control.goto(experimenter)
    control.wait_for_selector(".room >> text=running", timeout=60_000)
    save(control.screenshot(), DOCS / "study_experimenter.png")


def _to_questionnaire(page: Any, link: str) -> None:
    page.goto(link)
    page.wait_for_selector("body[data-stage=consent]")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    page.wait_for_selector("body[data-stage=before]")
    page.fill("input[type=number]", "34")
    page.check("text=Fluently")


def _to_waiting_room(page: Any) -> None:
    page.check('text="No"')
    page.click("text=Continue")
    page.wait_for_selector("body[data-stage=instructions]")
    page.click("text=Continue")
    page.click("text=Skip it")


if __name__ == "__main__":
    main()
