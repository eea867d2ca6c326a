"""The table of moves: what leads from one node of a search to another, what it costs, and where it passes."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.town.model import Array

IntArray: TypeAlias = NDArray[np.int64]


class Entry(enum.StrEnum):
    """How a lane of a route is entered."""

    FOLLOW = "follow"
    CHANGE_LEFT = "change_left"
    CHANGE_RIGHT = "change_right"
    U_TURN = "u_turn"


ENTRIES = tuple(Entry)


@dataclass(frozen=True, kw_only=True, eq=False)
class Moves:
    """Edges of the graph, one a row; all arrays are (n,).

    Attributes:
        source, target: nodes.
        cost: metres at 40 km/h that it takes or is worth.
        entry: index in `ENTRIES`; FOLLOW within a lane and across its end.
        lane: that the move ends on.
        leave: distance along the lane before at which the move begins [m].
        land: distance along `lane` at which it ends [m].
        driven: length of a lane change or U-turn itself [m], else 0.
        first, last: cells of the lane before that it passes, both included; none where `last` < `first`.
        onto, until: the same for `lane`.
    """

    source: IntArray
    target: IntArray
    cost: Array
    entry: IntArray
    lane: IntArray
    leave: Array
    land: Array
    driven: Array
    first: IntArray
    last: IntArray
    onto: IntArray
    until: IntArray

    def __len__(self) -> int:
        return len(self.source)

    def take(self, rows: NDArray[np.bool_] | IntArray) -> Moves:
        """Some of the moves."""
        return Moves(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    @classmethod
    def join(cls, tables: Sequence[Moves]) -> Moves:
        """All moves of several tables."""
        return cls(**{f.name: np.concatenate([getattr(table, f.name) for table in tables]) for f in fields(cls)})

    @classmethod
    def make(cls, count: int, **columns: object) -> Moves:
        """Moves from columns that are arrays or single values; those left out are 0, and no cells are passed."""
        table: dict[str, Any] = {}
        for field in fields(cls):
            value = columns.get(field.name, -1 if field.name in ("last", "until") else 0)
            real = field.name in ("cost", "leave", "land", "driven")
            table[field.name] = np.broadcast_to(np.asarray(value, dtype=np.float64 if real else np.int64), count)
        return cls(**table)

    def cheapest(self, nodes: int) -> Moves:
        """Of the moves between the same two nodes only the cheapest, ordered by source and target."""
        key = self.source * nodes + self.target
        order = np.lexsort((self.cost, key))
        key = key[order]
        return self.take(order[np.concatenate(([True], key[1:] != key[:-1]))] if len(key) else order)

    def clear_of(self, blocked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which moves neither end in blocked cells nor pass any; `blocked` has a row for every node."""
        before = np.concatenate(([0], np.cumsum(blocked)))
        on_first = before[np.maximum(self.last + 1, self.first)] - before[self.first]
        on_second = before[np.maximum(self.until + 1, self.onto)] - before[self.onto]
        result: NDArray[np.bool_] = (on_first + on_second == 0) & ~blocked[self.target]
        return result
