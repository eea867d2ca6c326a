"""The points of a task: where each stands in the columns, what is visible there, and its label."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.features.columns import CO_WIZARD, PARTICIPANT, Columns, Flags, Ints, Reals
from dorothie_gym.evaluation.labels import NO_ANGLE
from dorothie_gym.ontology import LABELS
from dorothie_gym.sessions import FOLDS, NO_SPEAKER, Fold, Task
from dorothie_gym.sessions.folds import check_fold


@dataclass(frozen=True, kw_only=True)
class Skipped:
    """A flagged event that is no point, or a point of which a part cannot be scored.

    Attributes:
        session: name of the session.
        event: number of the event; -1 for a whole session that cannot be read.
        reason: why.
    """

    session: str
    event: int
    reason: str


@dataclass(frozen=True, eq=False, kw_only=True)
class PointTable:
    """The points of a task (n,), by session and event.

    What is visible at a point are rows `*_start:*_stop` of the columns: those of tenths strictly before the point's.

    Attributes:
        task: the task.
        session: index of the session in `Columns.sessions`.
        tenth: when the point is [0.1 s].
        event: number of its event in the session.
        row: row of the point itself in `Columns.moves` (UfN, RfN) or `Columns.actions` (NfD): its label, never input.
        handling: 0 nothing, 1 a task exception, 2 an environmental one (`Handled`).
        moves_start, moves_stop: visible rows of `Columns.moves`.
        spans_start, spans_stop: further visible rows of it: earlier acts of the current utterance (UfN, else empty).
        utterances_start, utterances_stop: visible rows of `Columns.utterances`.
        actions_start, actions_stop: visible rows of `Columns.actions`.
        frames_start, frames_stop: visible rows of `Columns.frames`.
        current: row of `Columns.utterances` of the current utterance (UfN), -1 otherwise.
        label_move: (n,) id of the move; -1 in NfD.
        label_slots: (n, 69) slot values; all False in NfD.
        label_action: (n,) class of NfD, 0..5; -1 in UfN and RfN.
        label_angle: (n,) its angle [degrees, positive left]; NaN where unknown, and in UfN and RfN.
        label_belief: (n, 5) way to the next frame dx, dy [m], its heading [degrees], way to the goal dx, dy [m], in the
            town's axes; NaN where unknown.
        skipped: what is no point, or is not scored in whole, and why.
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
    skipped: tuple[Skipped, ...] = ()

    def __len__(self) -> int:
        """Number of points."""
        return len(self.session)


@dataclass(frozen=True, kw_only=True)
class PointCount:
    """How many points of a task a fold has.

    Attributes:
        fold: as `Fold`'s value; empty for sessions outside of folds.
        task: the task.
        flagged: flagged events that are the task's: `points` + `skipped`.
        points: points, all of which are scored (in NfD those of `without_angle` for the action only).
        without_angle: points of NfD whose angle the recording does not know.
        skipped: flagged events that are no point.
    """

    fold: str
    task: Task
    flagged: int
    points: int
    without_angle: int
    skipped: int


def points(columns: Columns, task: Task, fold: Fold | str | None = None) -> PointTable:
    """Returns the points of a task.

    Args:
        columns: the corpus.
        task: the task.
        fold: sessions of this fold only, or of several ("val", "test", "seen", "unseen"); None takes all.

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
    seen: dict[str, Any] = {}
    for name in ("moves", "utterances", "actions", "frames"):
        seen[f"{name}_start"], seen[f"{name}_stop"] = _visible(getattr(columns, name), session, tenth)
    table = PointTable(
        task=task,
        session=session,
        tenth=tenth,
        event=event,
        row=row.astype(np.int32),
        handling=handling,
        **seen,
        **_current(columns, task, row),
        **_labels(columns, task, row),
        label_belief=_belief(columns, session, tenth, (seen["frames_start"], seen["frames_stop"])),
    )
    return replace(table, skipped=tuple(_skipped(columns, table, chosen)))


def point_counts(columns: Columns) -> tuple[PointCount, ...]:
    """Returns how many points of each task each fold has that has sessions; every flagged event is counted once.

    A flagged event that is neither a dialogue move nor a physical action counts as a skipped one of NfD, as do moves of
    neither speaker as skipped ones of RfN.
    """
    found = []
    for fold in sorted(set(columns.sessions.folds), key=lambda name: (name not in tuple(FOLDS), name)):
        inside = np.array([name == fold for name in columns.sessions.folds])
        for task in Task:
            table = points(columns, task)
            mine = inside[table.session]
            left = sum(inside[session] for session, _, reason in columns.unpointed if _task_of(reason) is task)
            without = int(np.isnan(table.label_angle[mine]).sum()) if task is Task.NFD else 0
            count = int(mine.sum())
            found.append(
                PointCount(
                    fold=fold, task=task, flagged=count + left, points=count, without_angle=without, skipped=left
                )
            )
    return tuple(found)


def _task_of(reason: str) -> Task:
    return Task.RFN if reason.startswith(NO_SPEAKER) else Task.NFD


def _sessions_of(columns: Columns, fold: Fold | str | None) -> Flags:
    """Which sessions are in a fold (S,)."""
    if fold is None:
        return np.ones(len(columns.sessions.names), dtype=np.bool_)
    wanted = check_fold(fold)
    return np.array([bool(name) and Fold(name).matches(wanted) for name in columns.sessions.folds], dtype=np.bool_)


def _visible(group: Any, session: Ints, tenth: Ints) -> tuple[Ints, Ints]:
    """First row and end of the rows of a group that are of tenths strictly before each point's."""
    # Rows rise by session and tenth: a number that rises with both finds both ends.
    span = np.int64(1) << 32
    rows = group.session.astype(np.int64) * span + group.tenth
    first = session.astype(np.int64) * span
    start = np.searchsorted(rows, first, side="left")
    return start.astype(np.int32), np.searchsorted(rows, first + tenth, side="left").astype(np.int32)


def _current(columns: Columns, task: Task, row: NDArray[np.int64]) -> dict[str, Any]:
    """The utterance to be understood, and its earlier acts."""
    if task is not Task.UFN:
        nothing = np.zeros(len(row), dtype=np.int32)
        return {"spans_start": nothing, "spans_stop": nothing, "current": nothing - 1}
    utterance = columns.moves.utterance[row]
    first = np.searchsorted(columns.moves.utterance, utterance, side="left")  # moves lie in the order of utterances
    return {"spans_start": first.astype(np.int32), "spans_stop": row.astype(np.int32), "current": utterance}


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


def _belief(columns: Columns, session: Ints, tenth: Ints, seen: tuple[Ints, Ints]) -> Reals:
    """What the belief head is to predict (n, 5)."""
    frames, goals = columns.frames, columns.goals
    labels = np.full((len(session), 5), np.nan, dtype=np.float32)
    start, stop = seen
    known = stop > start
    here = np.zeros((len(session), 2), dtype=np.float32)
    here[known] = frames.pose[stop[known] - 1, :2]
    inside = known & (stop < len(frames.session))
    inside[inside] = frames.session[stop[inside]] == session[inside]
    labels[inside, :2] = frames.pose[stop[inside], :2] - here[inside]
    labels[inside, 2] = frames.pose[stop[inside], 2]
    _, goal = _visible(goals, session, tenth)
    ahead = known & (goal < len(goals.session))
    ahead[ahead] = goals.session[goal[ahead]] == session[ahead]
    labels[ahead, 3:] = goals.place[goal[ahead]] - here[ahead]
    return labels


def _skipped(columns: Columns, table: PointTable, chosen: Flags) -> Iterator[Skipped]:
    names = columns.sessions.names
    for name, reason in columns.unreadable:
        yield Skipped(session=name, event=-1, reason=reason)
    for session, event, reason in columns.unpointed:
        if chosen[session] and _task_of(reason) is table.task:
            yield Skipped(session=names[session], event=event, reason=reason)
    if table.task is Task.NFD:
        for row in np.flatnonzero(np.isnan(table.label_angle)).tolist():
            yield Skipped(session=names[table.session[row]], event=int(table.event[row]), reason=NO_ANGLE)
