"""Page of all modules with the first sentence of each and what it defines, `docs/modules.md`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from vocabulary_page import GENERATED

DOCS = Path(__file__).parent
PAGE = DOCS / "modules.md"
PACKAGES = (DOCS.parent / "dorothie_gym", DOCS.parent / "benchmarks")

TOP = f"""# All modules

{GENERATED.replace("environments", "modules")}

One line for each file of the package and of the benchmarks: the first of its docstring, and the public classes and
functions that it defines. [Architecture](architecture.md) describes how the folders depend on each other, and [What a
change costs](changes.md) where common changes begin.
"""


def modules() -> str:
    """Returns the page."""
    lines = [TOP.rstrip("\n")]
    rows = (row for package in PACKAGES for row in _rows(package))
    for folder, files in groupby(rows, key=lambda row: row[0]):
        lines += ["", f"## {folder}", ""]
        lines += [f"- `{name}`: {text}" if name else text for _, name, text in _introduced(files)]
    return "\n".join((*lines, ""))


def _introduced(files: Iterator[tuple[str, str, str]]) -> Iterator[tuple[str, str, str]]:
    """Yields the files of a folder; the text of the package itself comes first, as a paragraph."""
    for folder, name, text in files:
        if name != "__init__.py":
            yield folder, name, text
        elif text:
            yield folder, "", f"{text}\n"


def _rows(package: Path) -> Iterator[tuple[str, str, str]]:
    """Yields folder, file name, and first sentence with public names of each module, folder by folder."""
    for path in sorted(package.rglob("*.py"), key=lambda path: (path.parent.parts, path.name)):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        text = " ".join((ast.get_docstring(tree) or "").split("\n\n")[0].split())
        if path.name != "__init__.py" and (defined := list(_public_names(tree))):
            text = f"{text} *({', '.join(defined)})*" if text else text
        yield path.parent.relative_to(package.parent).as_posix(), path.name, text


def _public_names(tree: ast.Module) -> Iterator[str]:
    """Yields the public classes and functions of a module, as code."""
    for statement in tree.body:
        if isinstance(statement, ast.ClassDef | ast.FunctionDef) and not statement.name.startswith("_"):
            yield f"`{statement.name}`"
