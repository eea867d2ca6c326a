"""The page of changes names files, and names in them, that exist."""

from __future__ import annotations

import re

import pytest

from tests.changes.working_copy import PAGE, ROOT

ROWS = re.findall(r"(?m)^\| (?:\d+|-) \| `([^`]+)` \| (.+) \|$", PAGE.read_text(encoding="utf-8"))


@pytest.mark.parametrize(("file", "edit"), ROWS, ids=[f"{number}" for number in range(len(ROWS))])
def test_files_and_names_of_the_page_exist(file: str, edit: str) -> None:
    path = ROOT / file
    assert path.exists(), file
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    for name in re.findall(r"`([A-Za-z_][\w.]*)`", edit) if text else ():
        if "NAME" not in name:
            assert all(part in text for part in name.split(".")), f"{file} has no {name}"
