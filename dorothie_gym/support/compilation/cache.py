"""Machine code on disk, named by content: the fingerprint of a function is part of the name of its files.

An update of the package compiles only functions that are different, or that call different ones; copies of the package
share equal functions. The folder is `compiled` in the user's cache folder, or `NUMBA_CACHE_DIR`.

A file holds the machine code for one signature and processor. It is signed under its name, by a key in the same folder:
damaged machine code would end the process without a message.
"""

from __future__ import annotations

import contextlib
import enum
import functools
import hashlib
import os
import pickle
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any, Final, Protocol, runtime_checkable

import llvmlite
import numba
import numpy as np
from numba.core.serialize import dumps

from dorothie_gym.support.compilation.numba_classes import CompileResultCacheImpl, FunctionCache
from dorothie_gym.support.files import PART
from dorothie_gym.support.user_cache import cache_folder, discard, is_private, mark_used, read_signed, write_signed

# --- Fingerprints -----------------------------------------------------------------------------------------------------
# Fingerprints of compiled functions: hashes of the code of a function and of all code of the package that it uses.
#
# A function with the same fingerprint has the same machine code, wherever its file is and whenever it was written.
# numba itself goes by the modification time of the function's own file.

PACKAGE: Final = "dorothie_gym"

COMPILER: Final = ("__init__.py", "dispatcher.py", "numba_classes.py", "records.py")
"""Files of this package that decide about machine code."""

_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), np.generic, np.dtype)


@runtime_checkable
class Compilable(Protocol):
    """Function that numba compiles.

    Attributes:
        py_func: the function in Python.
        targetoptions: options of the compiler.
    """

    py_func: FunctionType
    targetoptions: dict[str, object]


def fingerprint(function: Compilable) -> str:
    """Returns a hash of a function, of the functions that it calls, and of the constants that they read.

    Raises:
        TypeError: a function reads a global whose content is unknown.
    """
    texts = _texts(function)
    digest = hashlib.sha256(_compiler().encode())
    for name in sorted(texts):
        digest.update(f"\0{name}\0{texts[name]}".encode())
    return digest.hexdigest()


@functools.cache
def _compiler() -> str:
    """Returns the versions of the compilers, and a hash of the package's own part of it."""
    own = "".join(_file_hash(str(Path(__file__).with_name(name))) for name in COMPILER)
    return f"{sys.version_info[:2]} {numba.__version__} {llvmlite.__version__} {np.__version__} {own}"


def _texts(function: Compilable) -> dict[str, str]:
    """Returns the code of each function by its name, and in angle brackets the hash of each source file."""
    texts: dict[str, str] = {}
    queue = [function]
    while queue:
        taken = queue.pop()
        name = _name(taken.py_func)
        if name not in texts:
            texts[name] = ""  # a function may call itself
            lines = [repr(sorted(taken.targetoptions.items())), *_code_lines(taken.py_func)]
            for used, value in _globals(taken.py_func):
                lines.append(f"{used} = {_text(value, name, texts, queue)}")
            texts[name] = "\n".join(lines)
    return texts


def _name(function: FunctionType) -> str:
    return f"{function.__module__}.{function.__qualname__}"


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yields the code of a function, and of the functions and comprehensions in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _code_lines(function: FunctionType) -> Iterator[str]:
    """Yields the parts that determine the machine code: no comments, docstrings or line numbers."""
    for code in _codes(function.__code__):
        constants = code.co_consts
        if code is function.__code__ and function.__doc__ is not None and constants[:1] == (function.__doc__,):
            constants = constants[1:]
        plain = [(type(value).__name__, value) for value in constants if not isinstance(value, CodeType)]
        yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_cellvars} {code.co_freevars} {plain!r}"
    yield repr((function.__defaults__, function.__kwdefaults__))


def _globals(function: FunctionType) -> Iterator[tuple[str, object]]:
    """Yields the global and enclosing variables that a function reads, by name."""
    names = sorted({name for code in _codes(function.__code__) for name in code.co_names})
    for name in names:
        if name in function.__globals__:
            yield name, function.__globals__[name]
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _text(value: object, reader: str, texts: dict[str, str], queue: list[Compilable]) -> str:
    """Describes the content of a global; lists compiled functions in the queue, and source files in the texts."""
    if isinstance(value, (enum.Enum, *_PLAIN)):
        return f"{type(value).__name__}({value!r})"
    if isinstance(value, tuple | list):
        return f"{type(value).__name__}({', '.join(_text(item, reader, texts, queue) for item in value)})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, enum.EnumType):
        members: dict[str, enum.Enum] = dict(value.__members__)
        return repr([(name, member.value) for name, member in members.items()])
    if isinstance(value, Compilable):
        queue.append(value)
        return _name(value.py_func)
    home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None) or ""
    if home.split(".")[0] == PACKAGE:
        # a function in Python with a compiled counterpart, an intrinsic, a class: all of its file counts
        file = sys.modules[home].__file__
        texts[f"<{home}>"] = _file_hash(str(file))
        return home
    if isinstance(value, ModuleType | type | FunctionType | BuiltinFunctionType | np.ufunc | Callable):
        return f"{home}.{getattr(value, '__name__', '')}"
    raise TypeError(f"{reader} reads a global of the type {type(value).__name__}, whose content is unknown")


@functools.cache
def _file_hash(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


# --- Files ------------------------------------------------------------------------------------------------------------

NUMBA_VARIABLE: Final = "NUMBA_CACHE_DIR"
"""numba's own environment variable for the folder of machine code; it takes precedence over the user's cache folder."""

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
                with contextlib.suppress(OSError):  # another process may also delete them
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
