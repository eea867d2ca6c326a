"""Numbered enums whose members also have a spelling."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class LabelledInt(IntEnum):
    """An integer enum whose members are written `NAME = id, "Label"`.

    Attributes:
        label: the spelling in files, tables and SDN.
    """

    label: str

    # The default is never used by a member: it lets type checkers accept the look-up by number, `Enum(3)`.
    def __new__(cls, value: int, label: str = "") -> Self:
        """Makes a member from its number and its spelling."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.label = label
        return member
