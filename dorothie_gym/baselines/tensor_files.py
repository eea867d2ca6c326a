"""Writing of safetensors files, with the errors of other files."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from safetensors import SafetensorError
from safetensors.torch import save_file
from torch import Tensor

_SYSTEM_ERROR: Final = re.compile(r"\(os error (\d+)\)")
"""End of the message of a `SafetensorError` that an error of the operating system has caused."""


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
