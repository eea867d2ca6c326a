"""Lookup of the town of a session."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from dorothie_gym.maps import Town, load_town, town_names

_NAME: Final = re.compile(r"\w{1,60}")
_SUFFIXES: Final = (".xodr", ".yaml", ".yml")


def find_town(name: str, maps: Path | None) -> Town | None:
    """Returns the town of a name: a shipped one, or the file `<name>.xodr` or `.yaml` in a folder of maps; or None.

    Raises:
        TownError: the file is malformed.
    """
    if not _NAME.fullmatch(name):  # a name from a file must not be a path
        return None
    if name in town_names():
        return load_town(name)
    candidates = [] if maps is None else [maps / f"{name}{suffix}" for suffix in _SUFFIXES]
    return next((load_town(path) for path in candidates if path.is_file()), None)
