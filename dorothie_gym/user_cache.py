"""Cache folder of the user: compiled towns, feature columns and generated corpora are kept here between runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

CACHE_VARIABLE: Final = "DOROTHIE_GYM_CACHE"
"""Environment variable with the cache folder; an empty value turns caching off."""


def cache_folder() -> Path | None:
    """Returns the cache folder, which need not exist, or None if caching is turned off.

    `$DOROTHIE_GYM_CACHE` if it is set, else `dorothie_gym` in the cache folder of the platform: `$XDG_CACHE_HOME` or
    `~/.cache` on Linux, `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows.
    """
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen is not None:
        return Path(chosen).expanduser() if chosen else None
    return user_cache_path("dorothie_gym", appauthor=False, opinion=False)
