"""The page of all modules is that of the docstrings."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def test_page_has_the_first_sentence_of_each_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    generator = importlib.import_module("module_page")
    text = generator.PAGE.read_text(encoding="utf-8")
    assert text == generator.modules(), "modules.md is out of date: run python docs/pages.py modules"
    assert "- `duo_wizard_v0.py`: " in text and "## dorothie_gym/sim/ego" in text


def test_each_module_has_a_docstring(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    lines = importlib.import_module("module_page").PAGE.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.startswith("- `") and line.endswith("`: ")] == []
