"""The five files with which docs/architecture.md opens: short, and each names the next one."""

from __future__ import annotations

import ast
import re
from itertools import pairwise

from tests.ways.tracing import PACKAGE, PAGE

MOST_LINES = 299


def first_files() -> list[str]:
    """Returns the files that the page lists first, without the folder of the package."""
    section = PAGE.read_text(encoding="utf-8").split("\n## ")[1]
    assert section.startswith("Read these five first\n")
    return re.findall(r"(?m)^\d\. `dorothie_gym/([^`]+)`", section)


def test_page_opens_with_five_short_files() -> None:
    lines = {name: len((PACKAGE / name).read_text(encoding="utf-8").splitlines()) for name in first_files()}
    assert len(lines) == 5
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}


def test_docstring_of_each_file_names_the_next_one() -> None:
    files = first_files()
    for name, following in pairwise(files):
        docstring = ast.get_docstring(ast.parse((PACKAGE / name).read_text(encoding="utf-8")))
        assert docstring is not None and f"Next: `{following}`" in docstring, name
