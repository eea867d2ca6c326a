"""Machine code on disk, named by content: the fingerprint of a function is part of the name of its files.

An update of the package compiles only functions that are different, or that call different ones; copies of the package
share what is equal in them. The folder is `compiled` in the user's cache folder, or `NUMBA_CACHE_DIR`.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile

from dorothie_gym.compilation.fingerprint import Compilable, fingerprint
from dorothie_gym.user_cache import cache_folder, is_private

if TYPE_CHECKING:
    from collections.abc import Iterator

NUMBA_VARIABLE: Final = "NUMBA_CACHE_DIR"
"""numba's own environment variable for the folder of machine code; it goes before the user's cache folder."""

KEPT: Final = 14 * 24 * 3600.0
"""Time without a read after which files of other versions of a function are deleted [s]."""

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


class _Files(CompileResultCacheImpl):  # type: ignore[misc]  # numba has no type information
    """Reading and writing of results of the compiler; the folder is made when the first one is written."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @property
    def locator(self) -> _Files:
        return self

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)


class ContentCache(FunctionCache):  # type: ignore[misc]  # numba has no type information
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
        """Returns whether there is no machine code of this version of the function."""
        return not self._is_open() or not self._index().exists()

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Returns the machine code for a signature, None if there is none that can be read."""
        if not self._is_open():
            return None
        try:
            found = super().load_overload(sig, target_context)
            if found is not None:
                os.utime(self._index())
        except (EOFError, pickle.UnpicklingError):  # a damaged file
            with contextlib.suppress(OSError):
                self.flush()
            return None
        except OSError:
            return None
        return found

    def save_overload(self, sig: object, data: Any) -> None:
        """Writes the machine code for a signature, and deletes old versions of the function."""
        if not self._is_open():
            _warn_once("caching is turned off, or other users can write to the folder")
            return
        try:
            super().save_overload(sig, data)
            self._delete_others()
        except OSError as error:
            _warn_once(f"{self._folder} cannot be written ({error.strerror})")

    def _is_open(self) -> bool:
        folder = compiled_folder()
        if folder is None:
            return False
        if folder != self._folder:
            stamp = fingerprint(self._function)
            self._folder = folder
            self._base = f"{self._stem()}{stamp[:24]}.py{sys.version_info[0]}{sys.version_info[1]}"
            self._impl = _Files(folder)
            self._cache_file = IndexDataCacheFile(cache_path=str(folder), filename_base=self._base, source_stamp=stamp)
        return True

    def _stem(self) -> str:
        module = self._py_func.__module__.removeprefix("dorothie_gym.")
        return f"{module}.{self._py_func.__qualname__}-".replace("<", "").replace(">", "")

    def _index(self) -> Path:
        assert self._folder is not None
        return self._folder / f"{self._base}.nbi"

    def _others(self) -> Iterator[Path]:
        assert self._folder is not None
        for index in self._folder.glob(f"{self._stem()}*.nbi"):
            if index.stem != self._base and time.time() - index.stat().st_mtime > KEPT:
                yield index

    def _delete_others(self) -> None:
        for index in self._others():
            for file in [index, *index.parent.glob(f"{index.stem}.*.nbc")]:
                file.unlink(missing_ok=True)


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
