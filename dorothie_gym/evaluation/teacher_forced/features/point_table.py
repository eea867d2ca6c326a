"""Points of a task: position in the columns, visible rows, and label of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.corpus import Fold, check_fold
from dorothie_gym.archive.visibility import Moments, RowRange, Task, earlier_spans, visible_rows
from dorothie_gym.evaluation.teacher_forced.features.columns import CO_WIZARD, PARTICIPANT, Columns, Flags, Ints, Reals
from dorothie_gym.evaluation.teacher_forced.labels import NO_ANGLE, Unscored
from dorothie_gym.ontology.dialogue_acts import LABELS


@dataclass(frozen=True, eq=False, kw_only=True)
class PointTable:
    """Points of a task (n,), by session and event.

    Rows `*_start:*_stop` of the columns are visible at a point, by the rule of `dorothie_gym.archive.visibility`.

    Attributes:
        task: the task.
        session: index of the session in `Columns.sessions`.
        tenth: time of the point [0.1 s].
        event: number of its event in the session.
        row: row of the point itself in `Columns.moves` (UfN, RfN) or `Columns.actions` (NfD): its label, never input.
        handling: 0 none, 1 a task exception, 2 an environmental one (`Handled`).
        moves_start, moves_stop: visible rows of `Columns.moves`.
        spans_start, spans_stop: further visible rows of it: earlier acts of the utterance of the point (NfD: none).
        utterances_start, utterances_stop: visible rows of `Columns.utterances`.
        actions_start, actions_stop: visible rows of `Columns.actions`.
        frames_start, frames_stop: visible rows of `Columns.frames`.
        current: row of `Columns.utterances` of the current utterance (UfN), -1 otherwise.
        label_move: (n,) id of the move; -1 in NfD.
        label_slots: (n, 69) slot values; all False in NfD.
        label_action: (n,) class of NfD, 0..5; -1 in UfN and RfN.
        label_angle: (n,) its angle [degrees, positive left]; NaN where unknown, and in UfN and RfN.
        label_belief: (n, 5) displacement to the next frame dx, dy [m], its heading [degrees], displacement to the goal
            dx, dy [m], in the town's axes; NaN where unknown.
        skipped: flagged events that are points of no task (`task` None), and points of this task that are scored in
            part, with reasons. Sessions that cannot be read are in `Columns.unreadable`.
    """

    task: Task
    session: Ints
    tenth: Ints
    event: Ints
    row: Ints
    handling: Ints
    moves_start: Ints
    moves_stop: Ints
    spans_start: Ints
    spans_stop: Ints
    utterances_start: Ints
    utterances_stop: Ints
    actions_start: Ints
    actions_stop: Ints
    frames_start: Ints
    frames_stop: Ints
    current: Ints
    label_move: Ints
    label_slots: Flags
    label_action: Ints
    label_angle: Reals
    label_belief: Reals
    skipped: tuple[Unscored, ...] = ()

    def __len__(self) -> int:
        """Number of points."""
        return len(self.session)


def points(columns: Columns, task: Task, fold: Fold | str | None = None) -> PointTable:
    """Returns the points of a task.

    Args:
        columns: the corpus.
        task: the task.
        fold: sessions of this fold only, or of several folds ("val", "test", "seen", "unseen"); None for all.

    Raises:
        SessionError: the fold is unknown.
    """
    chosen = _sessions_of(columns, fold)
    if task is Task.NFD:
        acts = columns.actions
        row = np.flatnonzero(acts.flagged & chosen[acts.session])
        session, tenth, event, handling = (
            column[row] for column in (acts.session, acts.tenth, acts.event, acts.handling)
        )
    else:
        moves = columns.moves
        speaker = PARTICIPANT if task is Task.UFN else CO_WIZARD
        row = np.flatnonzero(moves.flagged & (moves.speaker == speaker) & chosen[moves.session])
        session, tenth, event, handling = (
            column[row] for column in (moves.session, moves.point_tenth, moves.event, moves.handling)
        )
    moments = Moments(session, tenth)
    seen = visible_rows(columns.times, task, moments, event)
    table = PointTable(
        task=task,
        session=session,
        tenth=tenth,
        event=event,
        row=row.astype(np.int32),
        handling=handling,
        moves_start=seen.moves.start,
        moves_stop=seen.moves.stop,
        utterances_start=seen.utterances.start,
        utterances_stop=seen.utterances.stop,
        actions_start=seen.actions.start,
        actions_stop=seen.actions.stop,
        frames_start=seen.frames.start,
        frames_stop=seen.frames.stop,
        **_current(columns, task, row),
        **_labels(columns, task, row),
        label_belief=_belief(columns, moments, seen.frames),
    )
    return replace(table, skipped=tuple(_skipped(columns, table, chosen)))


def _sessions_of(columns: Columns, fold: Fold | str | None) -> Flags:
    """Returns the mask of the sessions of a fold (S,)."""
    if fold is None:
        return np.ones(len(columns.sessions.names), dtype=np.bool_)
    wanted = check_fold(fold)
    return np.array([bool(name) and Fold(name).matches(wanted) for name in columns.sessions.folds], dtype=np.bool_)


def _current(columns: Columns, task: Task, row: NDArray[np.int64]) -> dict[str, Any]:
    """Returns the earlier moves of each point's own utterance, and the utterance itself where it is visible."""
    nothing = np.zeros(len(row), dtype=np.int32)
    if task is Task.NFD:
        return {"spans_start": nothing, "spans_stop": nothing, "current": nothing - 1}
    spans = earlier_spans(columns.moves.utterance, row)
    current = columns.moves.utterance[row] if task is Task.UFN else nothing - 1
    return {"spans_start": spans.start, "spans_stop": spans.stop, "current": current}


def _labels(columns: Columns, task: Task, row: NDArray[np.int64]) -> dict[str, Any]:
    count = len(row)
    if task is Task.NFD:
        return {
            "label_move": np.full(count, -1, dtype=np.int32),
            "label_slots": np.zeros((count, len(LABELS)), dtype=np.bool_),
            "label_action": columns.actions.action[row],
            "label_angle": columns.actions.label_angle[row],
        }
    return {
        "label_move": columns.moves.move[row],
        "label_slots": columns.moves.slots[row],
        "label_action": np.full(count, -1, dtype=np.int32),
        "label_angle": np.full(count, np.nan, dtype=np.float32),
    }


def _belief(columns: Columns, points: Moments, seen: RowRange) -> Reals:
    """Returns the labels of the belief head (n, 5)."""
    frames, goals, session = columns.frames, columns.goals, points.session
    labels = np.full((len(session), 5), np.nan, dtype=np.float32)
    start, stop = seen.start, seen.stop
    known = stop > start
    here = np.zeros((len(session), 2), dtype=np.float32)
    here[known] = frames.pose[stop[known] - 1, :2]
    inside = known & (stop < len(frames.session))
    inside[inside] = frames.session[stop[inside]] == session[inside]
    labels[inside, :2] = frames.pose[stop[inside], :2] - here[inside]
    labels[inside, 2] = frames.pose[stop[inside], 2]
    goal = Moments(goals.session, goals.tenth).rows_before(points).stop
    ahead = known & (goal < len(goals.session))
    ahead[ahead] = goals.session[goal[ahead]] == session[ahead]
    labels[ahead, 3:] = goals.place[goal[ahead]] - here[ahead]
    return labels


def _skipped(columns: Columns, table: PointTable, chosen: Flags) -> Iterator[Unscored]:
    names = columns.sessions.names
    for session, event, reason in columns.unpointed:
        if chosen[session]:
            yield Unscored(session=names[session], event=event, task=None, reason=reason)
    if table.task is Task.NFD:
        for row in np.flatnonzero(np.isnan(table.label_angle)).tolist():
            yield Unscored(
                session=names[table.session[row]], event=int(table.event[row]), task=Task.NFD, reason=NO_ANGLE
            )
