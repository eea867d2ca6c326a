"""Commands that install extras of this package, for messages."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Final

_ROOT: Final = Path(__file__).parents[2]
CONSTRAINTS: Final = "constraints.txt"
"""File of a checkout with versions that are known to work together."""


def pip_install(extra: str) -> str:
    """Returns the command that installs an extra; in a checkout, from there and with its constraints."""
    if not (_ROOT / CONSTRAINTS).is_file() or not (_ROOT / "pyproject.toml").is_file():
        return f"pip install 'dorothie-gym[{extra}]'"
    if Path.cwd() == _ROOT:
        return f"pip install -c {CONSTRAINTS} '.[{extra}]'"
    return f"pip install -c {shlex.quote(str(_ROOT / CONSTRAINTS))} '{_ROOT}[{extra}]'"
