"""Requests of browsers: a closed set of bodies with checked fields."""

from __future__ import annotations

from typing import Annotated, Final, TypeVar

import msgspec
from msgspec import Meta, Struct

from dorothie_gym.errors import AnnotationError, one_line
from dorothie_gym.lab.annotation.rows import ChangeRows, Label

MAX_BODY: Final = 256 * 1024
"""Largest body of a request [bytes]; the marks of an utterance take 1 kB."""

_Edit = Annotated[int, Meta(ge=0, lt=2**53)]
_Body = TypeVar("_Body", bound=Struct)


class RequestError(AnnotationError):
    """A request is malformed."""


class Step(Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Undo or redo.

    Attributes:
        base: number of the last edit that the browser has seen.
        again: whether it was sent before and got no answer; then it counts once.
    """

    base: _Edit
    again: bool = False


class Mark(Step, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """New marks: the change, and its description."""

    change: ChangeRows
    label: Annotated[str, Meta(max_length=80)] = ""


class Adopt(Step, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Marks of an annotator for an utterance, to be copied into the final version."""

    speaker: Label
    utterance: Annotated[int, Meta(ge=0, lt=2**53)]
    annotator: Label


def decode(content: bytes, kind: type[_Body]) -> _Body:
    """Returns the body of a request; raises `RequestError` if it is malformed."""
    try:
        return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RequestError(f"malformed request: {one_line(error)}") from None
