"""Reading of files that users provide: regular files of limited size, strict JSON, schemas, and Parquet tables.

Every reader of the package opens such files here. A file that is not a regular file is refused before it is opened, and
no more than the limit of its kind is read. Faults are `InputFileError`; readers with an error class of their own turn
them into it (`raising`).
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
import stat
import tokenize
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final, TypeVar

import msgspec

from dorothie_gym.errors import DorothieGymError, InputFileError, one_line
from dorothie_gym.support.libraries import pa, pc, pq
from dorothie_gym.support.schemas import convert

if typing.TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

_T = TypeVar("_T")

MIB: Final = 2**20

MAX_SMALL_JSON: Final = MIB
"""Largest storyboard, settings or cost file [bytes]."""

MAX_TOWN_YAML: Final = 1_000_000
"""Largest town file in the town language [bytes]: a city of 500 lanes takes 10 kB."""

MAX_OPENDRIVE: Final = 64 * MIB
"""Largest OpenDRIVE file [bytes]; CARLA's towns have up to 20 MB."""

MAX_XML_ELEMENTS: Final = 2_000_000
"""Maximum number of elements of an OpenDRIVE file; each takes some 200 bytes of memory."""

MAX_SESSION_TEXT: Final = 64 * MIB
"""Largest JSON or CSV file of a session or corpus [bytes]; a session of 15 minutes takes 2 MB."""

MAX_RESULT_JSON: Final = 64 * MIB
"""Largest result of a rollout [bytes]; a session takes 1 kB."""

MAX_MODEL_JSON: Final = 16 * MIB
"""Largest description of a trained model [bytes]."""

MAX_WEIGHTS: Final = 1024 * MIB
"""Largest file of weights [bytes]."""

MAX_DEPTH: Final = 40
"""Deepest nesting of JSON."""

MAX_DIGITS: Final = 40
"""Maximum number of digits of a whole number in JSON; a seed of 128 bits has 39."""

MAX_VALUES: Final = 5_000_000
"""Maximum number of values of a JSON file; each takes up to some 100 bytes of memory."""


@contextmanager
def raising(error: Callable[[str], DorothieGymError]) -> Iterator[None]:
    """Turns `InputFileError` into another error with the same message."""
    try:
        yield
    except InputFileError as fault:
        raise error(str(fault)) from None


# --- Bytes and text --------------------------------------------------------------------------------------------------


def read_file(path: Path, limit: int) -> bytes:
    """Returns the content of a regular file, or of a link to one.

    Args:
        path: the file.
        limit: largest size [bytes].

    Raises:
        InputFileError: it is a folder, pipe, socket or device, or larger than `limit`.
        OSError: it is missing or cannot be read.
    """
    check_file(path, limit)
    # A file replaced by a pipe in the meantime neither blocks nor is read.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        _check_kind(os.fstat(file.fileno()), path)
        content = file.read(limit + 1)
    if len(content) > limit:
        raise _too_large(path, limit)
    return content


def check_file(path: Path, limit: int) -> None:
    """Raises as `read_file`, without opening the file: for libraries that open files themselves."""
    try:
        found = path.stat()
    except ValueError as error:  # a null character in the path
        raise InputFileError(path, str(error)) from None
    _check_kind(found, path)
    if found.st_size > limit:
        raise _too_large(path, limit)


def _check_kind(found: os.stat_result, path: Path) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe, socket or device"
        raise InputFileError(path, f"cannot be read: it is {kind}, not a regular file; give a file")


def _too_large(path: Path, limit: int) -> InputFileError:
    return InputFileError(path, f"is larger than {_size(limit)}, the limit of its kind; it is not read")


def _size(size: int) -> str:
    return f"{size // MIB} MiB" if size >= MIB else f"{size // 1000} kB"


def read_text(path: Path, limit: int) -> str:
    """Returns the text of a file in UTF-8, without a byte order mark.

    Raises:
        InputFileError: as `read_file`, or it is not UTF-8.
        OSError: as `read_file`.
    """
    try:
        return read_file(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputFileError(path, f"is not UTF-8 text (byte {error.start}); save it as UTF-8") from None


# --- JSON ------------------------------------------------------------------------------------------------------------

LONG_NUMBER: Final = re.compile(rf"[0-9]{{{MAX_DIGITS + 1}}}")
"""More digits than a whole number may have; texts without them need no check of each number."""


def parse_json(text: str, where: object, *, unique: bool = True, line_breaks: bool = False) -> JsonValue:
    """Returns the value of a JSON text.

    Args:
        text: the text.
        where: file (and line) that messages begin with.
        unique: whether an object that contains a field twice is refused; otherwise its last value counts.
        line_breaks: whether texts may contain line breaks and other control characters.

    Raises:
        InputFileError: it is not JSON, contains NaN or an infinite number, a whole number of more than `MAX_DIGITS`
            digits, more than `MAX_VALUES` values, or is nested more than `MAX_DEPTH` levels deep.
    """
    check_value_count(text, where)
    try:
        value: JsonValue = json.loads(
            text,
            strict=not line_breaks,
            parse_constant=_refuse_constant,
            parse_float=_finite,
            parse_int=_whole if LONG_NUMBER.search(text) else None,
            object_pairs_hook=_unique_fields if unique else None,
        )
    except json.JSONDecodeError as error:
        line = f"line {error.lineno}, " if "\n" in text else ""
        place = f"{line}column {error.colno}"
        raise InputFileError(where, f"not JSON ({error.msg}); is the file cut off?", place) from None
    except InputFileError as error:
        raise InputFileError(where, error.reason, error.place) from None
    except ValueError as error:
        raise InputFileError(where, f"not JSON ({one_line(error)})") from None
    except RecursionError:
        raise InputFileError(where, f"the JSON is nested too deeply (more than {MAX_DEPTH} levels)") from None
    if text.count("[") + text.count("{") > MAX_DEPTH and not _within_depth(value):
        raise InputFileError(where, f"the JSON is nested too deeply (more than {MAX_DEPTH} levels)")
    return value


def check_value_count(text: str | bytes, where: object) -> None:
    """Raises `InputFileError` if a JSON text can hold more than `MAX_VALUES` values."""
    if len(text) <= MAX_VALUES:
        return
    if isinstance(text, bytes):
        count = text.count(b",") + text.count(b"[") + text.count(b"{")
    else:
        count = text.count(",") + text.count("[") + text.count("{")
    if count > MAX_VALUES:
        raise InputFileError(where, f"holds more than {MAX_VALUES} values; it is not read")


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:30]} is too large a number")
    return value


def _whole(text: str) -> int:
    if len(text) > MAX_DIGITS + 1:  # one more for the sign
        raise ValueError(f"a whole number has {len(text)} digits, more than {MAX_DIGITS}")
    return int(text)


def _unique_fields(pairs: list[tuple[str, JsonValue]]) -> dict[str, JsonValue]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise InputFileError("", "is given twice in one object; remove one", f"field {twice[:60]!r}")
    return fields


def _within_depth(value: object) -> bool:
    level = [value]
    for _ in range(MAX_DEPTH + 1):
        level = [
            item
            for each in level
            if isinstance(each, list | dict)
            for item in (each.values() if isinstance(each, dict) else each)
        ]
        if not level:
            return True
    return not any(isinstance(each, list | dict) for each in level)


def read_json(path: Path, limit: int, *, unique: bool = True) -> JsonValue:
    """Returns the JSON value of a file; arguments and errors as in `read_text` and `parse_json`."""
    return parse_json(read_text(path, limit), path, unique=unique)


# --- Schemas ---------------------------------------------------------------------------------------------------------


def checked(value: object, kind: type[_T], where: object) -> _T:
    """Returns a JSON value as a dataclass, typed dictionary or other type; whole numbers are accepted as floats.

    Args:
        value: the value.
        kind: the type; missing fields of dataclasses take their defaults.
        where: file (and place) that messages begin with.

    Raises:
        InputFileError: a field is missing, unknown, of another type, or refused by the check of a dataclass; the
            message names the field.
    """
    try:
        found = convert(value, kind)
    except msgspec.ValidationError as error:
        reason, _, place = str(error).rpartition(" - at `$")
        field = f"field {place.rstrip('`').removeprefix('.')!r}" if reason else ""
        raise InputFileError(where, one_line(reason or place), field) from None
    except (ValueError, OverflowError, RecursionError) as error:
        raise InputFileError(where, one_line(error)) from None
    if unknown := _unknown_field(value, kind):
        raise InputFileError(where, "is unknown in this version", f"field {unknown[:60]!r}")
    return found


def settings_of(value: object, kind: type[_T], name: str) -> _T:
    """Returns settings that are a dataclass already, or a mapping of its fields, as the JSON of `env.spec` has them.

    Args:
        value: the settings.
        kind: the dataclass.
        name: name of the argument, for messages.

    Raises:
        ValueError: they are neither, or a field is wrong; the message names it.
    """
    if isinstance(value, kind):
        return value
    if isinstance(value, Mapping):
        return checked(dict(value), kind, name)
    raise ValueError(f"{name} is a {type(value).__name__}; it must be {kind.__name__}(...), or a mapping of its fields")


def _unknown_field(value: object, kind: object) -> str | None:
    """Returns the first field that a dataclass, or one of its fields, does not have."""
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind) and isinstance(value, Mapping)):
        return None
    types = _types(kind)
    for name, item in value.items():
        if name not in types:
            return str(name)
        if below := _unknown_field(item, types[name]):
            return f"{name}.{below}"
    return None


@cache
def _types(kind: type) -> Mapping[str, object]:
    hints = typing.get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


# --- Arrays and Parquet -----------------------------------------------------------------------------------------------


ARRAY_ERRORS: Final = (
    ValueError, TypeError, EOFError, OverflowError, MemoryError, SyntaxError, RecursionError, tokenize.TokenError
)  # fmt: skip
"""Errors of `numpy.load` for a damaged file: its header is a Python literal."""


@dataclass(frozen=True, kw_only=True)
class ParquetLimits:
    """Limits of a Parquet file.

    Attributes:
        file: largest size of the file [bytes].
        rows: maximum number of rows.
        values: most values of one column, counting those in lists.
        content: largest size of all values without compression, and of all texts without a dictionary [bytes].
    """

    file: int
    rows: int
    values: int
    content: int


def read_parquet(path: Path, limits: ParquetLimits, columns: Sequence[str] | None = None) -> pa.Table:
    """Returns the table of a Parquet file; texts that the file holds are dictionary-encoded.

    The limits are checked in the footer before any other part is read. Texts are read with their dictionary, so that a
    small file cannot expand to texts of many gigabytes.

    Args:
        path: the file.
        limits: largest sizes.
        columns: names of the columns that are read, where they exist; all if None.

    Raises:
        InputFileError: it is not a Parquet file, damaged, or beyond a limit, or has a column twice.
        OSError: it is missing or cannot be read.
    """
    content = read_file(path, limits.file)
    try:
        with pq.ParquetFile(pa.BufferReader(content)) as file:
            names, texts = file.schema_arrow.names, _check_footer(file, path, limits)
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise InputFileError(path, f"has the column {twice[:60]!r} twice")
        wanted = None if columns is None else [name for name in columns if name in names]
        with pq.ParquetFile(pa.BufferReader(content), read_dictionary=texts) as file:
            # One by one: lists of texts keep their dictionary within a row group only.
            groups = [file.read_row_group(k, wanted, use_threads=False) for k in range(file.num_row_groups)]
            table = pa.concat_tables(groups).unify_dictionaries() if groups else file.read(wanted, use_threads=False)
        table.validate(full=True)
    except (pa.ArrowException, OSError, UnicodeDecodeError, RecursionError) as error:  # damaged pages raise OSError
        raise InputFileError(path, f"not a readable Parquet file ({one_line(error)})") from None
    for name in table.column_names:
        if _text_size(table.column(name)) > limits.content:
            raise InputFileError(path, f"column {name[:60]!r} holds more than {_size(limits.content)} of text")
    return table


def _check_footer(file: pa.parquet.ParquetFile, path: Path, limits: ParquetLimits) -> list[str]:
    """Checks the sizes that the footer states; returns the paths of the columns of texts."""
    footer = file.metadata
    if not 0 <= footer.num_rows <= limits.rows:
        raise InputFileError(path, f"has {footer.num_rows} rows; at most {limits.rows} are read")
    groups = [footer.row_group(k) for k in range(footer.num_row_groups)]
    size, texts = 0, []
    for k in range(footer.num_columns):
        chunks = [group.column(k) for group in groups]
        size += sum(chunk.total_uncompressed_size for chunk in chunks)
        if sum(chunk.num_values for chunk in chunks) > limits.values:
            raise InputFileError(path, f"column {footer.schema.column(k).path!r} has more than {limits.values} values")
        if footer.schema.column(k).physical_type == "BYTE_ARRAY":
            texts.append(footer.schema.column(k).path)
    if size > limits.content:
        raise InputFileError(path, f"holds {_size(size)}; at most {_size(limits.content)} are read")
    return texts


def _text_size(column: pa.ChunkedArray) -> int:
    """Returns the size of the texts of a column and of the lists and structs in it, without a dictionary [bytes]."""
    size = 0
    for chunk in column.chunks:
        parts = [chunk]
        while parts:
            part = parts.pop()
            if pa.types.is_struct(part.type):
                parts += part.flatten()
            elif pa.types.is_nested(part.type):
                parts.append(part.values if hasattr(part, "values") else part.flatten())
            elif pa.types.is_dictionary(part.type) and not pa.types.is_primitive(part.type.value_type):
                lengths = pc.binary_length(part.dictionary).cast(pa.int64())
                size += pc.sum(lengths.take(part.indices)).as_py() or 0
    return size
