"""Writing and reading of safetensors files, with the errors of other files."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, NoReturn

import torch
from msgspec import Meta
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from dorothie_gym.errors import InputFileError, one_line, short_repr
from dorothie_gym.support.input_files import MAX_WEIGHTS, MIB, check_file, checked, parse_json

_SYSTEM_ERROR: Final = re.compile(r"\(os error (\d+)\)")
"""End of the message of a `SafetensorError` that an error of the operating system has caused."""

_LENGTH: Final = 8
"""Size of the length of the header, before the header [bytes]."""

_MAX_HEADER: Final = 95 * MIB
"""Largest header [bytes]; safetensors reads at most 100 MB."""

_METADATA: Final = "__metadata__"

_SIZES: Final[Mapping[str, int]] = MappingProxyType(
    {
        "BOOL": 1, "U8": 1, "I8": 1, "U16": 2, "I16": 2, "F16": 2, "BF16": 2, "U32": 4, "I32": 4, "F32": 4, "U64": 8,
        "I64": 8, "F64": 8,
    }
)  # fmt: skip
"""Sizes of the types of numbers that the package reads [bytes]."""

_WEIGHTS: Final = (torch.float16, torch.bfloat16, torch.float32, torch.float64)
"""Types in which floating-point weights may be stored."""

_MOMENTS: Final = frozenset(["exp_avg", "exp_avg_sq", "max_exp_avg_sq", "square_avg", "momentum_buffer", "grad_avg"])
"""Quantities of Adam, RMSprop and SGD for each parameter, of its shape."""

_STEP: Final = "step"
"""Number of steps of an optimiser, for each parameter."""

_Whole = Annotated[int, Meta(ge=0, lt=2**53)]


def save_tensors(tensors: Mapping[str, Tensor], path: Path, metadata: Mapping[str, str] | None = None) -> None:
    """Writes tensors into a safetensors file.

    Args:
        tensors: contiguous tensors without common memory, by name.
        path: the file.
        metadata: texts in the header of the file, by name.

    Raises:
        OSError: the file cannot be written, for instance because the disk is full.
    """
    try:
        save_file(dict(tensors), path, metadata=None if metadata is None else dict(metadata))
    except SafetensorError as error:
        found = _SYSTEM_ERROR.search(str(error))
        if found is None:
            raise
        number = int(found[1])
        raise OSError(number, os.strerror(number), str(path)) from None


# --- Reading ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredTensor:
    """Entry of the header of a file.

    Attributes:
        dtype: type of the numbers, as safetensors names it.
        shape: sizes of the axes.
        data_offsets: first byte of the numbers, and the byte after the last, counted from the end of the header.
    """

    dtype: str
    shape: tuple[_Whole, ...]
    data_offsets: tuple[_Whole, _Whole]

    @property
    def size(self) -> int:
        """Number of bytes that the shape takes."""
        return math.prod(self.shape) * _SIZES[self.dtype]


@dataclass(frozen=True)
class TensorHeader:
    """Header of a file.

    Attributes:
        tensors: entries by name.
        metadata: texts by name.
    """

    tensors: Mapping[str, StoredTensor]
    metadata: Mapping[str, str]


def read_header(path: Path, limit: int = MAX_WEIGHTS) -> TensorHeader:
    """Returns the header of a safetensors file; checks that it describes the file.

    Args:
        path: the file.
        limit: largest size of the file [bytes].

    Raises:
        InputFileError: it is not a regular file, too large, truncated, or its header is damaged; the message names the
            tensor.
        OSError: it is missing or cannot be read.
    """
    check_file(path, limit)
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size - _LENGTH
        length = int.from_bytes(file.read(_LENGTH), "little")
        if not 0 <= length <= size:
            _fail(path, f"its header takes {length} bytes, and the file has {max(size, 0)} for it; is it cut off?")
        if length > _MAX_HEADER:
            _fail(path, f"its header takes {length} bytes; expected at most {_MAX_HEADER}")
        content = file.read(length)
    page = _parsed(path, content)
    metadata = checked(page.get(_METADATA) or {}, dict[str, str], f"{path}, {_METADATA}")
    tensors = {name: _entry(path, name, value) for name, value in page.items() if name != _METADATA}
    _check_places(path, tensors, size - length)
    return TensorHeader(tensors, metadata)


def _parsed(path: Path, content: bytes) -> Mapping[str, object]:
    """Returns the JSON object of a header."""
    try:
        page = parse_json(content.decode("utf-8"), path)
    except UnicodeDecodeError:
        _fail(path, "its header is no text")
    except InputFileError as error:
        raise InputFileError(path, error.reason, f"header, {error.place}" if error.place else "header") from None
    if not isinstance(page, Mapping):
        _fail(path, "its header is no JSON object")
    return page


def _entry(path: Path, name: str, value: object) -> StoredTensor:
    found = checked(value, StoredTensor, f"{path}, {tensor_name(name)}")
    if found.dtype not in _SIZES:
        known = ", ".join(_SIZES)
        _fail(path, f"{tensor_name(name)} has the type {short_repr(found.dtype)}; expected one of {known}")
    first, end = found.data_offsets
    if end - first != found.size:
        shape = f"{found.dtype} of the shape {list(found.shape)}"
        _fail(path, f"{tensor_name(name)} has {end - first} bytes; expected {found.size}, which {shape} takes")
    return found


def _check_places(path: Path, tensors: Mapping[str, StoredTensor], size: int) -> None:
    """Checks that the tensors are contiguous and fill the bytes after the header."""
    at = 0
    for name, found in sorted(tensors.items(), key=lambda item: item[1].data_offsets):
        first, end = found.data_offsets
        if first != at:
            _fail(path, f"{tensor_name(name)} begins at byte {first}; expected {at}, where the one before it ends")
        if end > size:
            _fail(path, f"{tensor_name(name)} ends at byte {end}, and the file has {size} of them; is it cut off?")
        at = end
    if at != size:
        _fail(path, f"it has {size} bytes behind its header; expected {at}, which its tensors take")


def read_tensors(path: Path, limit: int = MAX_WEIGHTS) -> tuple[dict[str, Tensor], Mapping[str, str]]:
    """Returns the tensors of a safetensors file by name, and its metadata; arguments and errors as in `read_header`."""
    header = read_header(path, limit)
    try:
        with safe_open(path, framework="pt") as file:
            return {name: file.get_tensor(name) for name in header.tensors}, header.metadata
    except SafetensorError as error:
        _fail(path, one_line(error))


def _fail(path: Path, reason: str) -> NoReturn:
    raise InputFileError(path, f"cannot be read as safetensors: {reason}")


def tensor_name(name: str) -> str:
    """Returns the place of a tensor in a message."""
    return f"tensor {short_repr(name)}"


# --- Checks -----------------------------------------------------------------------------------------------------------


def check_tensors(path: Path, found: Mapping[str, Tensor], wanted: Mapping[str, Tensor], prefix: str = "") -> None:
    """Checks that tensors of a file are those of a network: the same names, shapes and kinds of numbers.

    Floating-point numbers may be stored with any number of bits; as those of the network they must be finite.

    Args:
        path: the file.
        found: tensors of the file by name.
        wanted: tensors of the network by name.
        prefix: prefix of both names in the file.

    Raises:
        InputFileError: a tensor is missing, unknown, or has another shape or type; the message names it.
    """
    for name, own in wanted.items():
        if name not in found:
            raise InputFileError(path, f"is missing; expected {_described(own)}", tensor_name(prefix + name))
        check_tensor(path, prefix + name, found[name], own)
    refuse_unknown(path, (prefix + name for name in found if name not in wanted))


def refuse_unknown(path: Path, names: Iterable[str]) -> None:
    """Raises `InputFileError` if there are names of tensors that do not belong into a file."""
    surplus = sorted(names)
    if surplus:
        more = f", like {len(surplus) - 1} more" if len(surplus) > 1 else ""
        raise InputFileError(
            path, f"does not belong to the model{more}; expected no such tensor", tensor_name(surplus[0])
        )


def check_tensor(path: Path, name: str, found: Tensor, wanted: Tensor) -> None:
    """Checks the shape and the numbers of one tensor, as `check_tensors`."""
    types = _WEIGHTS if wanted.is_floating_point() else (wanted.dtype,)
    if found.shape != wanted.shape or found.dtype not in types:
        shown = f"{_type(found)} {tuple(found.shape)}"
        raise InputFileError(path, f"is {shown}; expected {_described(wanted)}", tensor_name(name))
    if wanted.is_floating_point() and not bool(found.to(wanted.dtype).isfinite().all()):
        raise InputFileError(path, "has a weight that is no finite number", tensor_name(name))


def check_optimiser(
    path: Path, found: Mapping[str, Tensor], parameters: Sequence[Tensor], prefix: str, mark: str
) -> None:
    """Checks the state of an optimiser: the quantities of Adam, RMSprop or SGD, with the shapes of the parameters.

    Args:
        path: the file.
        found: tensors by name: number of the parameter, `mark`, quantity.
        parameters: parameters of the optimiser in their order.
        prefix: prefix of the names in the file.
        mark: character between number and quantity.

    Raises:
        InputFileError: as in `check_tensors`.
    """
    for name, value in found.items():
        number, _, quantity = name.partition(mark)
        known = quantity == _STEP or quantity in _MOMENTS
        if not known or not number.isascii() or not number.isdecimal() or int(number) >= len(parameters):
            refuse_unknown(path, [prefix + name])
        parameter = parameters[int(number)]
        check_tensor(path, prefix + name, value, torch.zeros(()) if quantity == _STEP else parameter)


def _described(wanted: Tensor) -> str:
    numbers = "floating-point numbers" if wanted.is_floating_point() else _type(wanted)
    return f"{numbers} {tuple(wanted.shape)}"


def _type(tensor: Tensor) -> str:
    return str(tensor.dtype).removeprefix("torch.")
