"""Visibility at a prediction point (teacher forcing): rows of a record that precede the point.

This module alone states the rule; environments read it as a `PointView`, batches as the row ranges of `visible_rows`:

* Frames of the car and physical actions are visible if they were recorded strictly before the point.
* An utterance, with its words and all of its moves, is visible if its last move was recorded strictly before the point.
  At an NfD point, utterances of the point's own time that precede it in the record are visible as well: an action may
  obey an utterance at once.
* At a UfN point, the words of the current utterance and the moves of its earlier spans are visible.
* At an RfN point, the earlier spans of the Co-Wizard's own utterance are visible with their words and moves; no part
  of its other spans is. Under the strict rule no part of the utterance is visible: its spans then have equal inputs and
  different labels.
* Hidden landmarks, which the car does not know, are never visible.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Task(enum.StrEnum):
    """Prediction task (paper, section 5)."""

    UFN = "ufn"
    """Understanding from navigation: the act of the participant's current span."""
    RFN = "rfn"
    """Response from navigation: the act of the Co-Wizard's next span."""
    NFD = "nfd"
    """Navigation from dialogue: the next navigation action and its angle."""


_TIME_BITS: Final = 32
"""Times are below 2 to the power of this."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Session and time of n rows, in ascending order.

    Attributes:
        session: (n,) index of the session.
        time: (n,) time since the session began, in frames or tenths of a second.
    """

    session: NDArray[np.integer]
    time: NDArray[np.integer]

    @classmethod
    def of_one_session(cls, times: ArrayLike) -> Moments:
        """Returns moments (n,) of a single session with index 0."""
        time = np.asarray(times, dtype=np.int64).reshape(-1)
        return cls(np.zeros(len(time), dtype=np.int64), time)

    def rows_before(self, points: Moments) -> RowRange:
        """Returns the rows of each point's session with a time strictly before the point's."""
        first = points.session.astype(np.int64) << _TIME_BITS
        start, stop = np.searchsorted(self._keys, first), np.searchsorted(self._keys, first + points.time)
        return RowRange(start.astype(np.int32), stop.astype(np.int32))

    @cached_property
    def _keys(self) -> NDArray[np.int64]:
        """Numbers (n,) that rise with session and time."""
        return (self.session.astype(np.int64) << _TIME_BITS) + self.time


@dataclass(frozen=True, eq=False)
class RowRange:
    """Rows `start[i]:stop[i]` for each point i; both (n,) int32."""

    start: NDArray[np.int32]
    stop: NDArray[np.int32]


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordTimes:
    """Times that determine visibility in a record of one or several sessions, all in the same unit.

    Attributes:
        utterances: moments of the last move of u utterances of `SPEAKERS`; of one moment by their first event.
        last_events: (u,) number of the event of each utterance's last move.
        first_moves: (u + 1,) the moves of utterance i are rows `first_moves[i]:first_moves[i + 1]` of the moves.
        actions: moments of the physical actions.
        frames: moments of the frames of the car.
    """

    utterances: Moments
    last_events: NDArray[np.integer]
    first_moves: NDArray[np.integer]
    actions: Moments
    frames: Moments


@dataclass(frozen=True, eq=False, kw_only=True)
class VisibleRows:
    """Rows of a record that are visible at n points."""

    utterances: RowRange
    moves: RowRange
    actions: RowRange
    frames: RowRange


def visible_rows(times: RecordTimes, task: Task, points: Moments, events: ArrayLike) -> VisibleRows:
    """Returns the rows that are visible at points of a task; for UfN and RfN see also `earlier_spans`.

    Args:
        times: times of the record.
        task: the task.
        points: moments of n points, in any order.
        events: (n,) number of each point's event in its session.
    """
    said = times.utterances.rows_before(points)
    if task is Task.NFD:
        said = _with_just_heard(times, said, points, np.asarray(events))
    first = times.first_moves.astype(np.int32)
    return VisibleRows(
        utterances=said,
        moves=RowRange(first[said.start], first[said.stop]),
        actions=times.actions.rows_before(points),
        frames=times.frames.rows_before(points),
    )


def _with_just_heard(times: RecordTimes, said: RowRange, points: Moments, events: NDArray[np.integer]) -> RowRange:
    """Adds the utterances of each point's own time up to the first that does not precede the point in the record."""
    through = times.utterances.rows_before(Moments(points.session, points.time + 1)).stop
    stop = said.stop.copy()
    for point in np.flatnonzero(through > stop).tolist():
        while stop[point] < through[point] and times.last_events[stop[point]] < events[point]:
            stop[point] += 1
    return RowRange(said.start, stop)


def earlier_spans(utterance_of_move: NDArray[np.integer], moves: ArrayLike) -> RowRange:
    """Returns the rows of the moves that precede each given move within its own utterance.

    Args:
        utterance_of_move: utterance of each move of a record, ascending.
        moves: (n,) rows of moves.
    """
    rows = np.asarray(moves, dtype=np.int32).reshape(-1)
    return RowRange(np.searchsorted(utterance_of_move, utterance_of_move[rows]).astype(np.int32), rows)
