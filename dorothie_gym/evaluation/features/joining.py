"""Columns of sessions, put one after another."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.features.columns import GROUPS, NO_TEXT, Columns, Sessions, TownGraph
from dorothie_gym.evaluation.features.extraction import SessionColumns

_STARTS = {"landmarks": "place", "streets": "text"}
"""Groups whose rows are found by session, with a column that tells their number."""


def join(
    key: str,
    names: Sequence[str],
    folds: Sequence[str],
    parts: Sequence[SessionColumns],
    towns: Sequence[TownGraph],
    unreadable: Sequence[tuple[str, str]],
) -> Columns:
    """Returns the columns of sessions as those of a corpus.

    Args:
        key: hash of all that decided them.
        names: names of the sessions.
        folds: their folds.
        parts: their columns, in the same order.
        towns: the towns that occur.
        unreadable: sessions that could not be read, (name, reason) each.
    """
    pool: dict[str, int] = {}
    rows = [_Shifted(part, pool) for part in parts]
    groups: dict[str, Any] = {}
    for group, kind in GROUPS.items():
        if group != "sessions":
            wanted = [field.name for field in dataclasses.fields(kind)]
            groups[group] = kind(**{name: _column(rows, group, name) for name in wanted})
    number = {town.name: index for index, town in enumerate(towns)}
    groups["sessions"] = Sessions(
        names=tuple(names),
        folds=tuple(folds),
        town=np.array([number[part.town] for part in parts], dtype=np.int32),
        has_objects=np.concatenate([part.arrays["sessions.has_objects"] for part in parts]),
    )
    return Columns(
        key=key,
        **groups,
        texts=tuple(pool),
        towns=tuple(towns),
        unreadable=tuple(unreadable),
        unpointed=tuple((index, *found) for index, part in enumerate(parts) for found in part.unpointed),
    )


class _Shifted:
    """The arrays of a session, with texts as numbers of the corpus."""

    def __init__(self, part: SessionColumns, pool: dict[str, int]) -> None:
        self.arrays = part.arrays
        numbers = np.array([pool.setdefault(text, len(pool)) for text in part.texts] + [NO_TEXT], dtype=np.int32)
        self._numbers = numbers  # -1 picks the last, which is -1

    def column(self, group: str, name: str) -> NDArray[Any]:
        found = self.arrays[f"{group}.{name}"]
        return self._numbers[found] if name.endswith("text") else found

    def count(self, group: str) -> int:
        return len(next(rows for name, rows in self.arrays.items() if name.startswith(f"{group}.")))


_POINTS_AT = {("moves", "utterance"): "utterances", ("frames", "look"): "looks", ("looks", "start"): "objects"}
"""Columns that hold rows of another group."""


def _column(rows: Sequence[_Shifted], group: str, name: str) -> NDArray[Any]:
    if name == "session":
        return np.repeat(np.arange(len(rows), dtype=np.int32), [row.count(group) for row in rows])
    if name == "start" and group in _STARTS:
        return np.concatenate(([0], np.cumsum([row.count(group) for row in rows]))).astype(np.int64)
    columns = [row.column(group, name) for row in rows]
    target = _POINTS_AT.get((group, name))
    if target is not None:
        first = np.concatenate(([0], np.cumsum([row.count(target) for row in rows])))
        # -1 means that there is none
        columns = [
            np.where(column >= 0, column + start, column).astype(column.dtype)
            for column, start in zip(columns, first, strict=False)
        ]
        if name == "start":
            columns.append(first[-1:].astype(np.int64))
    return np.concatenate(columns)
