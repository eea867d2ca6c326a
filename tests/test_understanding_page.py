"""The page of what the car understands shows what the parser reads."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def test_page_is_that_of_the_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    generator = importlib.import_module("understanding_page")
    hint = "understanding.md is out of date: run python docs/pages.py understanding"
    assert generator.PAGE.read_text(encoding="utf-8") == generator.understanding(), hint
