"""The units that a dialogue falls into."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class UnitEnd(StrEnum):
    """How a dialogue unit ends."""

    COMPLETED = "completed"
    INTERRUPTED = "interrupted"
    FULFILLED = "fulfilled"
    ABANDONED = "abandoned"


class DialogueUnit(StrEnum):
    """A stretch of dialogue.

    A transaction is everything said about one subgoal; an exchange is what follows from one initiating utterance.
    Exchanges may overlap.
    """

    TRANSACTION = "transaction"
    EXCHANGE = "exchange"

    @property
    def ends(self) -> tuple[UnitEnd, ...]:
        """The ways in which the unit may end."""
        return _ENDS[self]


_ENDS: Mapping[DialogueUnit, tuple[UnitEnd, ...]] = MappingProxyType(
    {
        DialogueUnit.TRANSACTION: (UnitEnd.COMPLETED, UnitEnd.INTERRUPTED, UnitEnd.ABANDONED),
        DialogueUnit.EXCHANGE: (UnitEnd.FULFILLED, UnitEnd.ABANDONED),
    }
)
