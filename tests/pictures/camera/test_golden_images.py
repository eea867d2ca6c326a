"""Pictures of towns are those that were kept, and equal in bytes in other processes and threads."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tests.pictures.camera.golden_images import FOLDER, IMAGES, draw, kept

MEAN, LARGE = 1.5, 14.0
"""Allowed differences from a kept picture, as mean and as 99th percentile: rounding of other machines [0..255]."""

DRAWN = ("dusk", "rain", "tunnel")
"""Pictures whose bytes are compared: between them, they use lamps, shadows, rain and several sheets of ground."""


@pytest.mark.parametrize("name", IMAGES)
def test_a_picture_looks_as_it_was_kept(name: str) -> None:
    """After a wanted change: `python -m tests.pictures.camera.golden_images`, and look at the pictures."""
    picture = draw(IMAGES[name]).astype(float)
    difference = np.abs(picture - kept(name))
    assert difference.mean() <= MEAN
    assert np.quantile(difference, 0.99) <= LARGE


def test_kept_pictures_differ_by_more_than_the_tolerance() -> None:
    pictures = {name: kept(name).astype(float) for name in IMAGES}
    for name, picture in pictures.items():
        for other in pictures.keys() - {name}:
            assert np.abs(picture - pictures[other]).mean() > 3.0 * MEAN, (name, other)


def test_kept_pictures_are_small() -> None:
    files = list(FOLDER.iterdir())
    assert {file.stem for file in files} == set(IMAGES)
    assert sum(file.stat().st_size for file in files) < 300_000


def digest_of(names: Sequence[str]) -> str:
    """Returns a digest of some pictures."""
    return hashlib.sha256(b"".join(draw(IMAGES[name]).tobytes() for name in names)).hexdigest()


@pytest.mark.long
def test_other_processes_and_numbers_of_threads_draw_the_same_bytes() -> None:
    script = f"from tests.pictures.camera.test_golden_images import digest_of; print(digest_of({DRAWN!r}))"
    runs = [
        subprocess.Popen(
            [sys.executable, "-W", "error", "-c", script],
            cwd=Path(__file__).parents[3],
            text=True,
            env={**os.environ, "NUMBA_NUM_THREADS": count, "PYTHONHASHSEED": count},
            stdout=subprocess.PIPE,
        )
        for count in ("1", "2")
    ]
    answers = {run.communicate()[0].strip() for run in runs}
    assert all(run.returncode == 0 for run in runs)
    assert answers == {digest_of(DRAWN)}


def test_threads_that_draw_at_once_draw_the_same_bytes() -> None:
    names = [*DRAWN, "day"] * 3
    expected = [draw(IMAGES[name]) for name in names]
    with ThreadPoolExecutor(2) as pool:
        for picture, alone in zip(pool.map(lambda name: draw(IMAGES[name]), names), expected, strict=True):
            np.testing.assert_array_equal(picture, alone)
