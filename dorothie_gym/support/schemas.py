"""Decoders of types, which are built by one thread at a time.

msgspec describes a type when it first meets it, and keeps the description with the class. msgspec 0.22.0 also keeps an
unfinished description: if a second thread meets the type meanwhile, the process ends in a segmentation fault. So it did
to a server of studies that took up two sessions at the same moment.
"""

from __future__ import annotations

import threading
from typing import Any, Final, TypeVar

import msgspec

_T = TypeVar("_T")

_BUILDING: Final = threading.Lock()
_DECODERS: Final[dict[Any, msgspec.json.Decoder[Any]]] = {}


def decoder(kind: type[_T]) -> msgspec.json.Decoder[_T]:
    """Returns the decoder of JSON that checks a type."""
    with _BUILDING:
        if kind not in _DECODERS:
            _DECODERS[kind] = msgspec.json.Decoder(kind)
        return _DECODERS[kind]


def convert(value: object, kind: type[_T]) -> _T:
    """Converts a JSON value to a type; raises `msgspec.ValidationError` if it does not fit."""
    decoder(kind)
    return msgspec.convert(value, kind)
