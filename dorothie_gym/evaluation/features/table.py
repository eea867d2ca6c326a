"""The points of a task: where each stands in the columns, what is visible there, and its label."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.evaluation.features.columns import Columns, Flags, Ints, Reals
from dorothie_gym.sessions import Fold, Task


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


def points(columns: Columns, task: Task, fold: Fold | str | None = None) -> PointTable:
    """Returns the points of a task.

    Args:
        columns: the corpus.
        task: the task.
        fold: sessions of this fold only, or of several ("val", "test", "seen", "unseen"); None takes all.

    Raises:
        SessionError: the fold is unknown.
    """
    raise NotImplementedError
