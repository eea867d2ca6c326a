"""Registry of everything that is digested: groups of parts, and the values of a part by name."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from fnmatch import fnmatchcase
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

Values = Iterator[tuple[str, object]]
"""Pairs of a name and a value; values of one name are digested one after another."""

KEPT = 16
"""Number of hexadecimal digits that are kept of a digest."""


@dataclass(frozen=True)
class Group:
    """Parts that are computed alike.

    Attributes:
        names: names of the parts.
        values: function from the name of a part to its values.
    """

    names: Sequence[str]
    values: Callable[[str], Values]


GROUPS: dict[str, Group] = {}


def group(*names: str) -> Callable[[Callable[[str], Values]], Callable[[str], Values]]:
    """Registers a function as a group of parts with these names."""

    def register(function: Callable[[str], Values]) -> Callable[[str], Values]:
        GROUPS[function.__name__] = Group(names, function)
        return function

    return register


def part_names(*patterns: str) -> list[str]:
    """Returns the parts, as `group/name`, that match one of the patterns; all parts without a pattern."""
    every = [f"{key}/{name}" for key, found in GROUPS.items() for name in found.names]
    return [part for part in every if not patterns or any(fnmatchcase(part, pattern) for pattern in patterns)]


def values_of(part: str) -> Values:
    key, name = part.split("/", 1)
    return GROUPS[key].values(name)


def digests_of(part: str) -> dict[str, str]:
    """Returns the digest of each named value of a part."""
    found: dict[str, Any] = {}
    for name, value in values_of(part):
        _add(found.setdefault(name, hashlib.sha256()), value)
    return {name: value.hexdigest()[:KEPT] for name, value in found.items()}


def _add(found: Any, value: object) -> None:
    """Adds a value with its structure; numbers count by their bits, and names of classes and modules do not count."""
    if isinstance(value, Enum):
        _add(found, value.value)
    elif isinstance(value, Mapping):
        found.update(b"{")
        for name, item in value.items():
            _add(found, name)
            _add(found, item)
        found.update(b"}")
    elif isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype == object:
            _add(found, array.tolist())
        else:
            found.update(f"{array.dtype} {array.shape}".encode() + array.tobytes())
    elif isinstance(value, list | tuple):
        found.update(b"[")
        for item in value:
            _add(found, item)
        found.update(b"]")
    elif isinstance(value, bytes):
        found.update(b"%d " % len(value) + value)
    elif isinstance(value, float):
        found.update(value.hex().encode())
    elif isinstance(value, str | int | None):
        found.update(f"{value!r} ".encode())
    elif isinstance(value, PurePath):
        _add(found, value.as_posix())
    else:
        raise TypeError(f"{type(value).__qualname__} has no content that could be digested under any class name")


# --- Files ------------------------------------------------------------------------------------------------------------


def session_values(folder: Path) -> Values:
    """Files of a folder by name: tables by their content, headers without the version of the package."""
    for file in sorted(folder.rglob("*")):
        if file.is_dir():
            continue
        name = file.relative_to(folder).as_posix()
        if file.suffix == ".parquet":
            yield name, table_content(pq.read_table(file))
        elif file.name == "session.json":
            yield name, without_versions(json.loads(file.read_bytes()))
        else:
            yield name, file.read_bytes()


def without_versions(page: Any, *more: str) -> Any:
    """A JSON value without the version of the package, and without `more` fields, at any depth."""
    if isinstance(page, dict):
        left_out = {"package_version", "replayed_by", *more}
        return {name: without_versions(value, *more) for name, value in page.items() if name not in left_out}
    return [without_versions(value, *more) for value in page] if isinstance(page, list) else page


def table_content(table: pa.Table, *left_out: str) -> dict[str, object]:
    """Columns of a table with their types; the bytes of Parquet files name the version of their library."""
    return {
        name: (str(table.schema.field(name).type), column_content(table[name].combine_chunks()))
        for name in table.column_names
        if name not in left_out
    }


def column_content(column: Any) -> object:
    if isinstance(column, pa.ChunkedArray):
        column = pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)
    empty = column.is_null().to_numpy(zero_copy_only=False)
    if pa.types.is_list(column.type) or pa.types.is_large_list(column.type):
        lengths = column.value_lengths().fill_null(0).to_numpy(zero_copy_only=False)
        return empty, lengths, column_content(column.flatten())
    if pa.types.is_struct(column.type):
        return empty, {column.type.field(k).name: column_content(row) for k, row in enumerate(column.flatten())}
    if pa.types.is_floating(column.type) or pa.types.is_integer(column.type):
        return empty, column.fill_null(0).to_numpy(zero_copy_only=False)
    return column.to_pylist()
