"""Files and folders that appear whole or not at all, and the type of the JSON values in them."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeAlias

PART: Final = ".part"
"""Ending of the name of a file or folder that is being written."""

JsonValue: TypeAlias = "str | int | float | bool | Sequence[JsonValue] | Mapping[str, JsonValue] | None"
"""Value of JSON types: text, number, true or false, list, object with text keys, or null."""


_UNSUPPORTED: Final = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Errors of file systems that cannot sync a file or a folder."""


def sync(path: Path) -> None:
    """Returns when a file, or the names in a folder, are on the disk; at once where the file system cannot do that.

    Raises:
        OSError: it cannot be written, or the file is missing.
    """
    is_folder = path.is_dir()
    if is_folder and not (hasattr(os, "O_DIRECTORY") and os.access(path, os.R_OK)):
        return  # Windows syncs no folders, and a folder may be closed to its readers
    descriptor = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)  # Windows syncs only writable files
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        os.close(descriptor)


def make_folder(folder: Path, *, parents: bool = False) -> None:
    """Creates a folder, and its parents if requested, unless it exists, and syncs it. Errors as in `Path.mkdir`."""
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=parents, exist_ok=True)
    for each in made:
        sync(each.parent)


@contextmanager
def replacing(path: Path, *, shared: bool = False, synced: bool = True) -> Iterator[Path]:
    """Yields a path beside `path` to write to, which replaces `path` in one step when the block is left.

    Readers see the old file or the whole new one, even if the process dies or, with `synced`, the power fails; after
    the block it is the new one. If the block fails, the part is removed.

    Args:
        path: the file.
        shared: whether several processes may write the file at once: the name of the part is then unique. Otherwise it
            is `path` with the ending `PART`, so that a later write removes the remains of a killed process.
        synced: whether the file is on the disk when the block is left; not needed for data that can be recreated.

    Raises:
        OSError: the file cannot be written, or a pipe or device is there, which a file must not replace; the error
            names `path`.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "Is a pipe or device, not a file", str(path))
    if shared:
        part = path.with_name(f"{path.name[:80]}.{secrets.token_hex(8)}{PART}")
    else:
        part = path.with_name(path.name + PART)
        part.unlink(missing_ok=True)  # a link to another place must not be followed
    try:
        yield part
        if synced:
            sync(part)
        os.replace(part, path)
        if synced:
            sync(path.parent)
    except OSError as error:
        part.unlink(missing_ok=True)
        if error.errno is not None and error.filename in (None, str(part)):
            raise OSError(error.errno, error.strerror, str(path)) from error  # errors of writing name no file
        raise
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def write_atomically(
    path: Path, content: str | bytes, *, shared: bool = False, mode: int | None = None, synced: bool = True
) -> None:
    """Writes a file whole or not at all; a text in UTF-8. Errors as in `replacing`.

    Args:
        path: the file.
        content: text or bytes.
        shared: see `replacing`.
        mode: permissions with which the file is created; those of the process if None.
        synced: see `replacing`.
    """
    with replacing(path, shared=shared, synced=synced) as part:
        if mode is not None:
            part.touch(mode=mode, exist_ok=False)
        part.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def new_folder(folder: Path, *, hidden: bool = False) -> Iterator[Path]:
    """Yields an empty folder beside `folder` to fill, which is renamed to it when the block is left.

    If the block fails, or `folder` exists and is not empty, the new folder is removed.

    Args:
        folder: the folder.
        hidden: whether the name begins with a dot until the folder is whole.

    Raises:
        OSError: the folder cannot be written, or its name is taken.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    prefix = f"{'.' if hidden else ''}{folder.name[:80]}."
    part = Path(tempfile.mkdtemp(prefix=prefix, suffix=PART, dir=folder.parent))
    try:
        part.chmod(0o755)  # temporary folders are closed to other users
        yield part
        part.rename(folder)
    except OSError as error:
        if error.errno is not None and error.filename is None:
            raise OSError(error.errno, error.strerror, str(folder)) from error  # errors of writing name no file
        raise
    finally:
        shutil.rmtree(part, ignore_errors=True)
