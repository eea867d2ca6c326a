"""Cache folder of the user: compiled towns, feature columns and generated corpora are kept here between runs.

The folder is private. Only content that this user has written is read: a folder or file that another user owns or can
write is ignored with a warning, and entries carry a signature by a key in the folder that only its user can read.
An entry that is damaged, or stored under the name of another one, is removed and recreated.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import hmac
import json
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

from dorothie_gym.support.files import write_atomically

CACHE_VARIABLE: Final = "DOROTHIE_GYM_CACHE"
"""Environment variable with the cache folder; an empty value turns caching off."""

KEY_FILE: Final = "key"
"""File in the cache folder with the key of the signatures: 32 random bytes."""

SIGNATURE_LENGTH: Final = 64
"""Characters of a signature: hexadecimal digits of HMAC-SHA-256."""

SEAL_FILE: Final = "seal"
"""File in a folder of the cache with the signed hashes of its other files."""

RECENT: Final = 3600.0
"""Time since the last use in which `remove_least_used` leaves an entry to other processes [s]."""

_KEY_LENGTH: Final = 32

_damage_reported = False

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

    A file in the place of a folder of the cache is damage, and is removed.

    Raises:
        OSError: it cannot be created.
    """
    if folder.is_file() and folder.parent == cache_folder():
        discard(folder, "it is a file, not a folder")
    for each in (folder.parent, folder):
        each.mkdir(mode=0o700, parents=True, exist_ok=True)


def mark_used(entry: Path) -> None:
    """Sets the time of the last use of an entry of the cache to now, if it can be written."""
    with contextlib.suppress(OSError):
        os.utime(entry)


def remove_least_used(folder: Path, most: int, used: Collection[str]) -> None:
    """Removes the least recently used entries of a folder of the cache until the others fit into a limit.

    Entries are folders, of which each use is marked by `mark_used`. Those that were used within `RECENT` seconds stay,
    because other processes may read them; files are also kept. Entries that cannot be removed are kept.

    Args:
        folder: folder of the cache.
        most: limit of all entries together [bytes].
        used: names of entries that stay in any case: those that the calling process uses.

    Raises:
        OSError: the folder cannot be read.
    """
    entries = []
    for entry in folder.iterdir():
        with contextlib.suppress(FileNotFoundError):  # another process may also remove entries
            if entry.is_dir() and not entry.is_symlink():
                entries.append((entry.stat().st_mtime, sum(file.stat().st_size for file in entry.iterdir()), entry))
    total = sum(size for _, size, _ in entries)
    for last_use, size, entry in sorted(entries):
        if total <= most:
            break
        if entry.name not in used and time.time() - last_use > RECENT:
            shutil.rmtree(entry, ignore_errors=True)
            total -= size


# --- Signed entries -----------------------------------------------------------------------------------------------


def write_signed(path: Path, content: bytes, keys: Path | None = None) -> None:
    """Writes content and its signature into a file of the cache, in one step; only this user can read the file.

    Args:
        path: file in a folder of the cache folder; both are created if they are missing.
        content: the content.
        keys: folder of the key; that of the cache folder if None.

    Raises:
        OSError: it cannot be written.
    """
    make_private(path.parent)
    if path.is_dir():
        discard(path, "it is a folder, not a file")
    signature = sign(content, path.parent.parent if keys is None else keys, path.name)
    # A file that a power failure has emptied does not match its signature: it need not be synced.
    write_atomically(path, content + signature, shared=True, mode=0o600, synced=False)


def read_signed(path: Path, keys: Path | None = None) -> bytes | None:
    """Returns the content of a file that `write_signed` has written under its name.

    A file with other content is removed (`discard`), so that it can be rewritten.

    Args:
        path: file in a folder of the cache folder.
        keys: as for `write_signed`.

    Returns:
        The content; None if the file is missing, damaged, or not this user's.
    """
    if not is_private(path.parent) or not is_private(path):
        return None
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe would block the reader
            discard(path, "it is no regular file")
            return None
        data = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, MemoryError) as error:
        discard(path, f"it cannot be read: {error}")
        return None
    content, signature = data[:-SIGNATURE_LENGTH], data[-SIGNATURE_LENGTH:]
    keys = path.parent.parent if keys is None else keys
    try:
        sound = is_signed(content, signature, keys, path.name)
    except OSError as error:
        report_damage(keys / KEY_FILE, f"it cannot be read: {error}")
        return None
    if not sound:
        discard(path, "its signature is wrong")
    return content if sound else None


def discard(entry: Path, reason: str) -> None:
    """Removes a damaged file or folder of the cache, where that is possible.

    The first one in a process is logged as a warning, since damaged memory or a damaged disk harms more than a cache;
    all others at level DEBUG.
    """
    with contextlib.suppress(OSError):
        remove(entry)
    report_damage(entry, reason)


def remove(entry: Path) -> None:
    """Removes a file, link or folder of the cache, which need not exist; raises `OSError` if that is not possible."""
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        entry.unlink(missing_ok=True)


def report_damage(entry: Path, reason: str) -> None:
    """Logs that an entry of the cache is damaged, see `discard`."""
    global _damage_reported
    level = logging.DEBUG if _damage_reported else logging.WARNING
    _damage_reported = True
    _log.log(level, "%s in the cache is damaged (%s); what is damaged there is made again", entry, reason)


def sign(content: bytes, cache: Path, name: str = "") -> bytes:
    """Returns the signature of content under a name by the key of a folder, which is created if it is missing.

    Raises:
        OSError: the key cannot be created or read, or is not private.
    """
    signature = hmac.new(_key(cache), f"{name}\0".encode(), hashlib.sha256)
    signature.update(content)
    return signature.hexdigest().encode()


def is_signed(content: bytes, signature: bytes, cache: Path, name: str = "") -> bool:
    """Returns whether the signature is that of `sign`; False without a key.

    Raises:
        OSError: the key cannot be read, or is not private.
    """
    return (cache / KEY_FILE).exists() and hmac.compare_digest(signature, sign(content, cache, name))


def _key(cache: Path) -> bytes:
    """Returns the key of a folder, which is created if it is missing or damaged."""
    path = cache / KEY_FILE
    if not is_private(path):
        raise OSError(f"{path}: is no key of this user; remove it")
    with contextlib.suppress(PermissionError):
        key = path.read_bytes() if path.is_file() else b""
        if len(key) == _KEY_LENGTH:
            return key
    if path.exists() or path.is_symlink():
        discard(path, "it is no key; entries with its signature are not read any more")
    part = cache / f"{KEY_FILE}.{secrets.token_hex(8)}"
    write_atomically(part, secrets.token_bytes(_KEY_LENGTH), mode=0o600)
    try:
        os.link(part, path)  # fails if another process was faster, whose key then counts
    except FileExistsError:
        pass
    finally:
        part.unlink()
    return path.read_bytes()


# --- Sealed folders -----------------------------------------------------------------------------------------------


def seal(folder: Path, name: str, keys: Path) -> None:
    """Writes a signed list of the hashes of all files in a folder that will become an entry of the cache.

    Args:
        folder: folder with all of its files, under any name.
        name: its name in the cache.
        keys: folder of the key.

    Raises:
        OSError: a file cannot be read or written.
    """
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    files = {path.relative_to(folder).as_posix(): _file_hash(path) for path in found}
    content = json.dumps(files).encode()
    (folder / SEAL_FILE).write_bytes(content + sign(content, keys, name))


def is_sealed(folder: Path, keys: Path) -> bool:
    """Returns whether all files of the seal of a folder are as they were; other files in the folder do not count."""
    if not is_private(folder):
        return False
    try:
        data = (folder / SEAL_FILE).read_bytes() if (folder / SEAL_FILE).is_file() else b""
        content, signature = data[:-SIGNATURE_LENGTH], data[-SIGNATURE_LENGTH:]
        if not is_signed(content, signature, keys, folder.name):
            return False
        files: dict[str, str] = json.loads(content)
        return all((folder / file).is_file() and _file_hash(folder / file) == digest for file, digest in files.items())
    except OSError:
        return False


def _file_hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
