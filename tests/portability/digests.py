"""Digests of what the package computes; `python -m tests.portability.digests [--freeze] [PATTERN...]`.

Patterns select parts, such as `sessions/brookside *`; `--freeze` keeps the digests as what the package has to compute.
"""

from __future__ import annotations

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tests.portability import commands, sessions
from tests.portability.parts import digests_of, part_names

FROZEN = Path(__file__).with_name("frozen.json")
"""File of the digests that the package has to compute."""

LIBRARIES = ("numpy", "numba", "scipy", "gymnasium", "highway-env", "torch", "typer", "click", "rich")
"""Libraries whose other releases may give other digests."""

__all__ = ["FROZEN", "computed", "frozen", "library_versions", "main"]

assert commands and sessions  # imported for their groups
TEXTS = ("help_texts", "error_lines")


def computed(*patterns: str) -> dict[str, dict[str, str]]:
    """Returns the digests of the parts that match; parts whose files are missing here are left out."""
    return {part: digests_of(part) for part in part_names(*patterns) if not sessions.missing(part)}


def frozen() -> Any:
    return json.loads(FROZEN.read_text(encoding="utf-8"))


def library_versions() -> dict[str, str]:
    return {name: version(name) for name in LIBRARIES}


def freeze(*patterns: str) -> None:
    """Keeps the digests of the parts that match, and says what changed; parts that no longer exist are removed."""
    before: dict[str, dict[str, str]] = frozen()["parts"] if FROZEN.exists() else {}
    found = computed(*patterns)
    parts = {part: found.get(part, before.get(part)) for part in part_names()}
    for part in sorted({*before, *parts}):
        if before.get(part) != parts.get(part):
            print(f"{'changed' if before.get(part) and parts.get(part) else 'new or left'}: {part}", file=sys.stderr)
    lines = ",\n".join(f"  {json.dumps(part)}: {json.dumps(kept)}" for part, kept in parts.items() if kept is not None)
    versions = json.dumps(library_versions())
    FROZEN.write_text(f'{{\n "libraries": {versions},\n "parts": {{\n{lines}\n }}\n}}\n', encoding="utf-8")


def main() -> None:
    patterns = [word for word in sys.argv[1:] if word != "--freeze"]
    if "--freeze" in sys.argv[1:]:
        freeze(*patterns)
        return
    found: dict[str, dict[str, str]] = {}
    for part in part_names(*patterns):
        start = time.perf_counter()
        found |= computed(part)
        print(f"{part}: {time.perf_counter() - start:.1f} s", file=sys.stderr)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
