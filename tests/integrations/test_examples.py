"""The examples of docs/integrations.md run as written, where the library is installed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "integrations.md"
LIBRARIES = {"SuperSuit": "supersuit", "RLlib": "ray.rllib", "TorchRL": "torchrl", "BenchMARL": "benchmarl"}


def example(section: str) -> str:
    """The first Python example under a heading; of the page's beginning where the heading is empty."""
    text = PAGE.read_text(encoding="utf-8")
    part = text.split(f"\n## {section}\n", 1)[1] if section else text
    found = re.search(r"```python\n(.*?)```", part, flags=re.DOTALL)
    assert found is not None
    return found.group(1)


def run(code: str, folder: Path) -> str:
    """Runs code in a process of its own: these libraries start threads and processes, and warn a lot."""
    file = folder / "example.py"
    file.write_text(code, encoding="utf-8")
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.long
def test_the_first_example_runs(tmp_path: Path) -> None:
    assert run(example(""), tmp_path).splitlines()[0] == "True"


@pytest.mark.integrations
@pytest.mark.parametrize("library", LIBRARIES)
def test_the_library_runs_its_example(library: str, tmp_path: Path) -> None:
    pytest.importorskip(LIBRARIES[library].split(".")[0], reason="needs the extra 'integrations'", exc_type=ImportError)
    run(example(library), tmp_path)
