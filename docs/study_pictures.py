"""Takes the picture of docs/studies.md: a questionnaire of the example study in Chromium.

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
    """Takes the picture."""
    chromium = find_chromium()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "errands.yaml")
        subprocess.run([*PROGRAM, "init", str(file)], check=True, stdout=subprocess.DEVNULL)
        run = [*PROGRAM, "run", str(file), "--out", str(Path(folder, "data")), "--port", "0", "--json"]
        with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as server:
            try:
                assert server.stdout is not None
                link = json.loads(server.stdout.readline())["link"]
                with sync_playwright() as playwright:
                    browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
                    _take(browser.new_page(viewport={"width": 1280, "height": 720}), link)
                    browser.close()
            finally:
                server.terminate()


def _take(page: Any, link: str) -> None:
    page.goto(link)
    page.wait_for_selector("body[data-stage=consent]")
    for box in page.query_selector_all(".statement input"):
        box.check()
    page.click("text=I take part")
    page.wait_for_selector("body[data-stage=before]")
    page.fill("input[type=number]", "34")
    page.check("text=Fluently")
    save(page.screenshot(), DOCS / "study_questionnaire.png")


if __name__ == "__main__":
    main()
