"""Towns that were read before, kept between runs in the user's cache folder.

What is kept there is never trusted: an entry is found by what the file holds and by which version of the program reads
it, and carries a checksum. Whatever is stale, damaged or out of reach is read anew from the file and replaced. (This
guards against accidents; somebody who can write to the user's cache folder can write to their programs as well.)
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from dorothie_gym.world.town.archive import FORMAT, ArchiveError, pack, unpack
from dorothie_gym.world.town.model import Town

CACHE_VARIABLE = "DOROTHIE_GYM_CACHE"
"""Environment variable that names the cache folder; if it is set to nothing, no town is kept."""

MOST_TOWNS = 64
"""When there are more, those that were written first are removed: a town takes up to some megabytes."""

_log = logging.getLogger(__name__)


def through_cache(path: Path, read: Callable[[Path], Town]) -> Town:
    """The town in a file: as it was kept when it was read before, else read and kept for the next time.

    Args:
        path: the file.
        read: reads it where there is no entry; its errors are passed on, and nothing is kept then.
    """
    folder = cache_folder()
    compiler = compiler_digest() if folder is not None else None
    content = _content(path)
    if folder is None or compiler is None or content is None:
        return read(path)
    key = _key(compiler, path, content)
    town = _recall(folder, key)
    if town is None:
        town = read(path)
        if _content(path) == content:  # else it changed meanwhile, and nobody knows which version this is
            _keep(folder, key, town)
    return town


def cache_folder() -> Path | None:
    """Folder that towns are kept in, whether it exists or not; None if none are to be kept.

    `$DOROTHIE_GYM_CACHE/towns` if that is set; else within the user's cache folder: `$XDG_CACHE_HOME` or `~/.cache`,
    on macOS `~/Library/Caches`, on Windows `%LOCALAPPDATA%`.
    """
    wish = os.environ.get(CACHE_VARIABLE)
    if wish is not None:
        return Path(wish) / "towns" if wish else None
    try:
        if sys.platform == "win32":
            named = os.environ.get("LOCALAPPDATA")
            base = Path(named) if named else Path.home() / "AppData" / "Local"
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            named = os.environ.get("XDG_CACHE_HOME", "")
            base = Path(named) if Path(named).is_absolute() else Path.home() / ".cache"
    except RuntimeError:  # a user without a home
        return None
    return base / "dorothie_gym" / "towns"


@functools.cache
def compiler_digest() -> str | None:
    """Digest of all that decides which town a file becomes besides the file; None where our sources are not at hand.

    These are the sources of this package and the releases of the libraries that compute for it: another release of
    them may round differently.
    """
    digest = hashlib.sha256(f"format {FORMAT}, numpy {np.__version__}".encode())
    digest.update(f"scipy {importlib.metadata.version('scipy')}".encode())
    sources = sorted(_sources(files("dorothie_gym.world.town"), ""))
    for name, text in sources:
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest() if sources else None


def _sources(folder: Traversable, prefix: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        name = f"{prefix}/{entry.name}"
        if entry.is_dir():
            yield from _sources(entry, name)
        elif name.endswith(".py"):
            yield name, entry.read_bytes()


def _content(path: Path) -> bytes | None:
    """What a file holds; None if it cannot be read, which whoever compiles it will say in better words."""
    try:
        return path.read_bytes()
    except OSError:
        return None


def _key(compiler: str, path: Path, content: bytes) -> str:
    """What an entry is filed under. A town is named like its file, and the suffix says which language it is in."""
    digest = hashlib.sha256(f"{compiler} {path.suffix.lower()} {path.stem!r}\n".encode())
    digest.update(content)
    return digest.hexdigest()


def _recall(folder: Path, key: str) -> Town | None:
    entry = folder / f"{key}.npz"
    try:
        return unpack(entry.read_bytes(), key)
    except FileNotFoundError:
        return None
    except (OSError, ArchiveError) as error:
        _log.debug("the cached town %s is of no use and is read anew: %s", entry, error)
        return None


def _keep(folder: Path, key: str, town: Town) -> None:
    """Writes an entry in one step, so that other processes see all of it or nothing of it."""
    data = pack(town, key)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".tmp", delete=False) as draft:
            try:
                draft.write(data)
                draft.close()
                os.replace(draft.name, folder / f"{key}.npz")
            except OSError:
                draft.close()
                os.unlink(draft.name)
                raise
        _prune(folder)
    except OSError as error:
        _log.debug("the town %s cannot be kept in %s: %s", town.name, folder, error)


def _prune(folder: Path) -> None:
    """Removes the oldest entries where there are too many, and drafts of processes that were killed with them."""
    entries = [entry for entry in folder.iterdir() if entry.suffix in (".npz", ".tmp")]
    if len(entries) > MOST_TOWNS:
        entries.sort(key=lambda entry: (entry.stat().st_mtime_ns, entry.name))
        for entry in entries[:-MOST_TOWNS]:
            entry.unlink(missing_ok=True)
