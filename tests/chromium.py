"""Chromium for tests that drive a real browser."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.support.audio import Samples, encode_wav, resample

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

IN_CHROMIUM = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (Debian: apt-get install chromium)"),
]
"""Marks of modules whose tests drive it."""

WAIT = 60_000
"""Longest time that a page may take on a busy machine [ms]."""

_FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@contextmanager
def chromium(*flags: str) -> Iterator[Any]:
    """Yields a Chromium without windows, started with further flags."""
    from playwright import sync_api

    with sync_api.sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=CHROMIUM, args=[*_FLAGS, *flags])
        yield launched
        launched.close()


@contextmanager
def another(browser: Any) -> Iterator[Any]:
    """Yields a further Chromium, in processes of its own."""
    launched = browser.browser_type.launch(executable_path=CHROMIUM, args=list(_FLAGS))
    yield launched
    launched.close()


def press(page: Any, *keys: str) -> None:
    """Presses keys one after the other."""
    for key in keys:
        page.keyboard.press(key)


def tab_to(page: Any, label: str, most: int = 60) -> None:
    """Moves the focus by the tabulator to the element with a label or text."""
    for _ in range(most):
        page.keyboard.press("Tab")
        focused = page.evaluate(
            "(() => { const e = document.activeElement; if (e === document.body) return '';"
            " return [e.textContent, e.getAttribute('aria-label'), e.labels?.[0]?.textContent]"
            ".filter(Boolean).join(' '); })()"
        )
        if label in focused:
            return
    raise AssertionError(f"{label!r} cannot be reached by keyboard")


# --- microphone -------------------------------------------------------------------------------------------------------


def microphone(samples: Samples, folder: Path) -> tuple[str, ...]:
    """Returns the flags with which a microphone plays samples at 16 kHz over and over, with pauses.

    Args:
        samples: what is said.
        folder: folder for a file with it.
    """
    file, pause = folder / "microphone.wav", np.zeros(8000, dtype=np.float32)
    file.write_bytes(encode_wav(resample(np.concatenate([pause, samples, pause]), 16000, 48000), 48000))
    return (
        "--use-fake-ui-for-media-stream",
        "--use-fake-device-for-media-stream",
        f"--use-file-for-fake-audio-capture={file}",
        "--autoplay-policy=no-user-gesture-required",
    )


def talk_for(page: Any, seconds: float) -> None:
    """Holds the button down for a time [s]."""
    box = page.locator(".speech .hold").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    time.sleep(seconds)
    page.mouse.up()
