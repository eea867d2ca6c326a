"""Fingerprints of compiled functions: hashes of the code of a function and of everything in the package that it uses.

A function with the same fingerprint has the same machine code, wherever its file is and whenever it was written. numba
itself goes by the modification time of the function's own file.
"""

from __future__ import annotations

import enum
import functools
import hashlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Final, Protocol, runtime_checkable

import llvmlite
import numba
import numpy as np

PACKAGE: Final = "dorothie_gym"

COMPILER: Final = ("__init__.py", "by_reference.py", "dispatcher.py", "shortcuts.py")
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
