"""Disk space that the extra `speech` adds to the package."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import pytest

requirements = pytest.importorskip("packaging.requirements", reason="needs packaging to read requirements")
names = pytest.importorskip("packaging.utils")

LARGEST = 120e6
"""Largest size of the extra [bytes]."""


def needed(name: str, extra: str, found: set[str]) -> set[str]:
    """Adds the distributions that a distribution needs with an extra, and what they need; returns `found`."""
    for line in importlib.metadata.requires(name) or ():
        requirement = requirements.Requirement(line)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        other = names.canonicalize_name(requirement.name)
        if other not in found:
            found.add(other)
            for wanted in requirement.extras or {""}:
                needed(other, wanted, found)
    return found


def size(name: str) -> int:
    """Returns the size of the files of a distribution [bytes], without the bytecode that Python adds."""
    files = importlib.metadata.files(name) or ()
    paths = (Path(str(file.locate())) for file in files if "__pycache__" not in file.parts)
    return sum(path.stat().st_size for path in paths if path.is_file())


def test_extra_adds_at_most_120_mb() -> None:
    added = needed("dorothie-gym", "speech", set()) - needed("dorothie-gym", "", set())
    assert {"hibari-tts", "pocketsphinx", "soundfile"} <= added
    sizes = {name: size(name) for name in added}
    assert sum(sizes.values()) < LARGEST, sizes
    assert sizes["hibari-tts"] > 1e6, "its voice is among the files"
