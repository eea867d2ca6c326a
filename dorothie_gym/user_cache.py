"""Cache folder of the user: compiled towns, feature columns and generated corpora are kept here between runs.

The folder is private. Only content that this user has written is read: a folder or file that another user owns or can
write is ignored with a warning, and entries carry a signature by a key that lies in the folder and only its user reads.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import hmac
import logging
import os
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Collection
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

from dorothie_gym.files import write_atomically

CACHE_VARIABLE: Final = "DOROTHIE_GYM_CACHE"
"""Environment variable with the cache folder; an empty value turns caching off."""

KEY_FILE: Final = "key"
"""File in the cache folder with the key of the signatures: 32 random bytes."""

SIGNATURE_LENGTH: Final = 64
"""Characters of a signature: hexadecimal digits of HMAC-SHA-256."""

RECENT: Final = 3600.0
"""Time since the last use in which `remove_least_used` leaves an entry to other processes [s]."""

_KEY_LENGTH: Final = 32

_log = logging.getLogger(__name__)


def cache_folder() -> Path | None:
    """Returns the cache folder, which need not exist, or None if caching is turned off or the folder is not private.

    `$DOROTHIE_GYM_CACHE` if it is set, else `dorothie_gym` in the cache folder of the platform: `$XDG_CACHE_HOME` or
    `~/.cache` on Linux, `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows.
    """
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen is not None:
        folder = Path(chosen).expanduser() if chosen else None
    else:
        folder = user_cache_path("dorothie_gym", appauthor=False, opinion=False)
    return folder if folder is not None and is_private(folder) else None


def is_private(path: Path) -> bool:
    """Returns whether a file or folder does not exist, or belongs to this user and only this user can write to it.

    Otherwise a warning is logged, once for each path. Windows has other permissions, which are not checked.
    """
    if sys.platform == "win32":
        return True
    try:
        found = path.stat()
    except OSError:
        return True  # it does not exist, or its reader reports why it cannot be read
    if found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return True
    _warn(path, "belongs to another user" if found.st_uid != os.geteuid() else "can be written by other users")
    return False


@functools.cache
def _warn(path: Path, reason: str) -> None:
    _log.warning(
        "%s %s; it is not used as a cache. Remove it, run `chmod go-w` on it, or set %s", path, reason, CACHE_VARIABLE
    )


def make_private(folder: Path) -> None:
    """Creates a folder in the cache, and the cache folder, which only this user can read; existing ones stay.

    Raises:
        OSError: it cannot be created.
    """
    for each in (folder.parent, folder):
        each.mkdir(mode=0o700, parents=True, exist_ok=True)


def mark_used(entry: Path) -> None:
    """Sets the time of the last use of an entry of the cache to now, if it can be written."""
    with contextlib.suppress(OSError):
        os.utime(entry)


def remove_least_used(folder: Path, most: int, used: Collection[str]) -> None:
    """Removes the least recently used entries of a folder of the cache until the others fit into a limit.

    Entries are folders, of which each use is marked by `mark_used`. Those that were used within `RECENT` seconds stay,
    because other processes may read them; files stay, too. What cannot be removed is left.

    Args:
        folder: folder of the cache.
        most: limit of all entries together [bytes].
        used: names of entries that stay in any case: those that the calling process uses.

    Raises:
        OSError: the folder cannot be read.
    """
    entries = []
    for entry in folder.iterdir():
        with contextlib.suppress(FileNotFoundError):  # another process removes entries, too
            if entry.is_dir() and not entry.is_symlink():
                entries.append((entry.stat().st_mtime, sum(file.stat().st_size for file in entry.iterdir()), entry))
    total = sum(size for _, size, _ in entries)
    for last_use, size, entry in sorted(entries):
        if total <= most:
            break
        if entry.name not in used and time.time() - last_use > RECENT:
            shutil.rmtree(entry, ignore_errors=True)
            total -= size


def write_signed(path: Path, content: bytes) -> None:
    """Writes content and its signature into a file of the cache, in one step; only this user can read the file.

    Args:
        path: file in a folder of the cache folder; both are created if they are missing.
        content: the content.

    Raises:
        OSError: it cannot be written.
    """
    make_private(path.parent)
    write_atomically(path, content + sign(content, path.parent.parent), shared=True, mode=0o600)


def read_signed(path: Path) -> bytes | None:
    """Returns the content of a file that `write_signed` has written; None if it was written or changed otherwise.

    Raises:
        OSError: it cannot be read.
    """
    if not is_private(path) or not is_private(path.parent):
        return None
    data = path.read_bytes()
    content, signature = data[:-SIGNATURE_LENGTH], data[-SIGNATURE_LENGTH:]
    return content if is_signed(content, signature, path.parent.parent) else None


def sign(content: bytes, cache: Path) -> bytes:
    """Returns the signature of content by the key of a cache folder, which is created if it is missing.

    Raises:
        OSError: the key cannot be created or read, or is not private.
    """
    return hmac.new(_key(cache), content, hashlib.sha256).hexdigest().encode()


def is_signed(content: bytes, signature: bytes, cache: Path) -> bool:
    """Returns whether the signature is that of the content by the key of a cache folder; False without a key.

    Raises:
        OSError: the key cannot be read, or is not private.
    """
    return (cache / KEY_FILE).exists() and hmac.compare_digest(signature, sign(content, cache))


def _key(cache: Path) -> bytes:
    """Returns the key of a cache folder, which is created if it is missing."""
    path = cache / KEY_FILE
    if not path.exists():
        part = cache / f"{KEY_FILE}.{secrets.token_hex(8)}"
        write_atomically(part, secrets.token_bytes(_KEY_LENGTH), mode=0o600)
        try:
            os.link(part, path)  # fails if another process was faster, whose key then counts
        except FileExistsError:
            pass
        finally:
            part.unlink()
    key = path.read_bytes()
    if len(key) != _KEY_LENGTH or not is_private(path):
        raise OSError(f"{path}: is no key of this user; remove the cache folder")
    return key
