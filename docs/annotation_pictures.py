"""Takes the pictures of docs/annotation-tool.md: an annotator and the adjudicator of a session in Chromium.

python docs/annotation_pictures.py         # needs the extra console, playwright and Chromium

The annotator accepts or corrects the suggestions by keyboard; a second annotator has the labels of the generator.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

from console_pictures import FLAGS, save  # type: ignore[import-not-found]  # beside this file
from playwright.sync_api import sync_playwright

DOCS: Final = Path(__file__).parent
PROGRAM: Final = (sys.executable, "-m", "dorothie_gym.cli")
TOWN, SEED, SECONDS = "midtown", "12", "150"
SHOWN: Final = 9
"""Number of the span that is open in the picture."""


def main() -> None:
    """Takes all pictures."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        sys.exit("no Chromium is installed; on Debian: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder:
        one = str(Path(folder) / "seed_12")
        _run("run", "--town", TOWN, "--seed", SEED, "--max-seconds", SECONDS, "--out", one)
        _run("annotations", "import", one, one, "--annotator", "ben")
        command = (*PROGRAM, "annotate", one, "--annotator", "anna", "--adjudicator", "carol", "--port", "0", "--json")
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                assert server.stdout is not None
                _take(json.loads(server.stdout.readline())["links"], chromium)
            finally:
                server.terminate()


def _run(*arguments: str) -> None:
    subprocess.run((*PROGRAM, *arguments), check=True, stdout=subprocess.DEVNULL)


def _take(links: dict[str, str], chromium: str) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        page = _open(browser, links["anna"], "annotator")
        spans = page.locator(".span").count()
        for _ in range(SHOWN):
            page.keyboard.press("Enter")
        page.keyboard.press("b")  # through the windscreen
        page.keyboard.press("3")
        page.keyboard.press("2")
        page.wait_for_selector(".screen:not([hidden])")
        page.wait_for_selector(".picture .note:empty", state="attached", timeout=120_000)
        page.wait_for_timeout(1500)
        save(page.screenshot(), DOCS / "annotation_tool.png")
        for _ in range(spans):
            page.keyboard.press("Enter")
        page.wait_for_timeout(1500)
        page = _open(browser, links["carol"], "adjudicator")
        page.wait_for_selector(".versions .version")
        page.wait_for_timeout(4000)
        save(page.screenshot(), DOCS / "annotation_adjudication.png")
        browser.close()


def _open(browser: Any, link: str, kind: str) -> Any:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(link)
    page.wait_for_selector(f"body[data-ready={kind}]", timeout=60_000)
    return page


if __name__ == "__main__":
    main()
