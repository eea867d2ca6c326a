"""Machine code on disk, named by content: the fingerprint of a function is part of the name of its files.

An update of the package compiles only functions that are different, or that call different ones; copies of the package
share equal functions. The folder is `compiled` in the user's cache folder, or `NUMBA_CACHE_DIR`.

A file holds the machine code for one signature and processor. It is signed under its name, by a key in the same folder:
damaged machine code would end the process without a message.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import sys
import time
import warnings
from pathlib import Path
from typing import Any, Final

from numba.core.serialize import dumps

from dorothie_gym.support.compilation.fingerprint import Compilable, fingerprint
from dorothie_gym.support.compilation.numba_classes import CompileResultCacheImpl, FunctionCache
from dorothie_gym.support.files import PART
from dorothie_gym.support.user_cache import cache_folder, discard, is_private, mark_used, read_signed, write_signed

NUMBA_VARIABLE: Final = "NUMBA_CACHE_DIR"
"""numba's own environment variable for the folder of machine code; it goes before the user's cache folder."""

KEPT: Final = 14 * 24 * 3600.0
"""Time without a read after which files of other versions of a function are deleted [s]."""

ENDING: Final = ".code"
"""Ending of the names of the files."""

_OLD_ENDING: Final = ".nbi"
"""Ending of the index files of earlier versions of the package, which left their machine code in numba's own form."""

_UNPICKLING_ERRORS: Final = (
    ImportError, AttributeError, TypeError, ValueError, LookupError, EOFError, pickle.UnpicklingError
)  # fmt: skip
"""Errors of `pickle` for objects of other versions of their classes."""

_warned = False


def compiled_folder() -> Path | None:
    """Returns the folder of the machine code, which need not exist; None if caching is off or it is not private."""
    chosen, cache = os.environ.get(NUMBA_VARIABLE), cache_folder()
    if chosen:
        folder = Path(chosen).expanduser()
    elif cache is not None:
        folder = cache / "compiled"
    else:
        return None
    return folder if is_private(folder) else None


class _Impl(CompileResultCacheImpl):
    """Conversion of results of the compiler."""

    def __init__(self) -> None:
        """Needs no function: files are named by `_Files`."""

    @property
    def locator(self) -> _Impl:
        return self

    def ensure_cache_path(self) -> None:
        """Does nothing: the folder is made when the first file is written."""


class _Files:
    """Signed files of one version of a function, in place of numba's index and data files.

    Args:
        folder: folder of the files and of their key.
        base: prefix of their names.
    """

    def __init__(self, folder: Path, base: str) -> None:
        self._folder, self._base = folder, base

    def load(self, key: object) -> object:
        """Returns the result of the compiler for a key, None if there is none that can be read."""
        path = self._path(key)
        content = read_signed(path, self._folder)
        if content is None:
            return None
        try:
            kept, data = pickle.loads(content)
        except _UNPICKLING_ERRORS as error:
            discard(path, f"it is of another version: {error}")
            return None
        if kept != key:  # types of the same name
            return None
        mark_used(path)
        return data

    def save(self, key: object, data: object) -> None:
        """Writes the result of the compiler for a key; raises `OSError` if that is not possible."""
        write_signed(self._path(key), dumps((key, data)), self._folder)

    def has_any(self) -> bool:
        """Returns whether there is a file that can be read."""
        files = self._folder.glob(f"{self._base}.*{ENDING}")
        return any(read_signed(path, self._folder) is not None for path in files)

    def _path(self, key: object) -> Path:
        digest = hashlib.sha256(repr(key).encode()).hexdigest()
        return self._folder / f"{self._base}.{digest[:16]}{ENDING}"


class ContentCache(FunctionCache):
    """Cache of a compiled function. Files that cannot be read or written cost time, never the result."""

    def __init__(self, function: Compilable) -> None:
        """Leaves the files alone until the function is called: the functions that it calls are not known before."""
        self._function, self._py_func = function, function.py_func
        self._name = repr(self._py_func)
        self._folder: Path | None = None
        self._base = ""
        self.enable()

    @property
    def cache_path(self) -> str | None:
        """Folder of the files, None if caching is turned off."""
        folder = compiled_folder()
        return None if folder is None else str(folder)

    def is_empty(self) -> bool:
        """Returns whether there is no machine code of this version of the function that can be read."""
        return self._open() is None or not self._cache_file.has_any()

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Returns the machine code for a signature, None if there is none that can be read."""
        return super().load_overload(sig, target_context) if self._open() is not None else None

    def save_overload(self, sig: object, data: Any) -> None:
        """Writes the machine code for a signature, and deletes old versions of the function."""
        folder = self._open()
        if folder is None:
            _warn_once("caching is turned off, or other users can write to the folder")
            return
        try:
            super().save_overload(sig, data)
            self._delete_others(folder)
        except OSError as error:
            _warn_once(f"{folder} cannot be written ({error.strerror or error})")

    def _open(self) -> Path | None:
        """Returns the folder of the files, whose names are then known; None if caching is off."""
        folder = compiled_folder()
        if folder is None:
            return None
        if folder != self._folder:
            stamp = fingerprint(self._function)
            self._folder = folder
            self._base = f"{self._stem()}{stamp[:24]}.py{sys.version_info[0]}{sys.version_info[1]}"
            self._impl = _Impl()
            self._cache_file = _Files(folder, self._base)
        return folder

    def _stem(self) -> str:
        module = self._py_func.__module__.removeprefix("dorothie_gym.")
        return f"{module}.{self._py_func.__qualname__}-".replace("<", "").replace(">", "")

    def _delete_others(self, folder: Path) -> None:
        """Deletes files of other versions of the function, and parts of files, that were not used for `KEPT`."""
        for file in folder.glob(f"{self._stem()}*"):
            if file.suffix in (ENDING, _OLD_ENDING, PART) and not self._is_current(file):
                with contextlib.suppress(OSError):  # another process deletes them, too
                    if time.time() - file.lstat().st_mtime > KEPT:
                        self._delete(file)

    def _is_current(self, file: Path) -> bool:
        return file.suffix == ENDING and file.name.startswith(f"{self._base}.")

    def _delete(self, file: Path) -> None:
        file.unlink()
        if file.suffix == _OLD_ENDING:
            for data in file.parent.glob(f"{file.stem}.*.nbc"):
                data.unlink()


def _warn_once(reason: str) -> None:
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(
            f"the compiled simulation cannot be kept: {reason}. It is compiled again in every process; set "
            "DOROTHIE_GYM_CACHE or NUMBA_CACHE_DIR to a writable folder",
            RuntimeWarning,
            stacklevel=2,
        )
