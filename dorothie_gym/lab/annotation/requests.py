"""Requests of browsers: a closed set of bodies with checked fields."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from dorothie_gym.lab.annotation.rows import ChangeRows, Label

_Edit = Annotated[int, Meta(ge=0, lt=2**53)]


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
