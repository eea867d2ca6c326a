"""Batches of points with the data visible at them, as arrays of fixed shape."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.teacher_forced.features.columns import NO_TEXT, Columns, Flags, Ints, Reals
from dorothie_gym.session.recording.trajectory import TENTHS

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.point_table import PointTable

ScalarT = TypeVar("ScalarT", bound=np.generic)


@dataclass(frozen=True, kw_only=True)
class HistorySizes:
    """Sizes of the history in a batch; of longer histories the newest (or nearest) entries are kept.

    Attributes:
        moves: dialogue moves (M).
        utterances: utterances (U).
        actions: physical actions (A).
        window: tokens of the ego's trajectory (W), `window_step` rows apart (paper, section 6: 100 frames, step 4).
        window_step: rows (at 10 Hz) from a token to the next.
        window_objects: nearest objects at each token of the window (V).
        objects: nearest objects now (O).

    Raises:
        ValueError: a size is below 0, or `window_step` below 1; the message names the field.
    """

    moves: int = 32
    utterances: int = 16
    actions: int = 16
    window: int = 25
    window_step: int = 4
    window_objects: int = 8
    objects: int = 32

    def __post_init__(self) -> None:
        """Checks the sizes."""
        for name in HISTORY:
            _check_size(self, name, least=1 if name == "window_step" else 0)


HISTORY: Final = tuple(field.name for field in fields(HistorySizes))
"""Names of the sizes of a history."""


@dataclass(frozen=True, kw_only=True)
class BatchSpec(HistorySizes):
    """Sizes of a batch.

    Attributes:
        landmarks: landmarks (K).
        streets: streets (R).
        strict: whether RfN points hide the earlier acts of the Co-Wizard's own utterance.
        paper_leak: whether the last move of a UfN point is the point's own label, as in the published features; only
            to measure the effect of that leak.

    Raises:
        ValueError: a size is below 0, or `window_step` below 1; the message names the field.
    """

    landmarks: int = 10
    streets: int = 14
    strict: bool = False
    paper_leak: bool = False

    def __post_init__(self) -> None:
        """Checks the sizes."""
        super().__post_init__()
        for name in ("landmarks", "streets"):
            _check_size(self, name, least=0)


def _check_size(sizes: HistorySizes, name: str, *, least: int) -> None:
    value = getattr(sizes, name)
    if value < least:
        raise ValueError(f"{type(sizes).__name__}.{name} is {value}; it must be at least {least}")


@dataclass(frozen=True, eq=False, kw_only=True)
class Batch:
    """Batch of B points, without labels. Sequences are oldest first, with padding at the end; `*_mask` marks entries.

    Padding is 0, or -1 in ids of texts, lanes and streets. Times are seconds since the session began.

    Attributes:
        session: (B,) index in `Columns.sessions`.
        town: (B,) index in `Columns.towns`.
        time: (B,) of the point [s].
        move: (B, M) id of the move, 0..14.
        move_speaker: (B, M) 0 participant, 1 Co-Wizard.
        move_slots: (B, M, 69) bool.
        move_time: (B, M) end of its utterance [s]; the time of the point for an utterance in progress.
        move_text: (B, M) words of the move.
        move_mask: (B, M).
        utterance_text, utterance_recognised: (B, U) its words; the recognised words.
        utterance_speaker: (B, U).
        utterance_time: (B, U) [s].
        utterance_mask: (B, U).
        action: (B, A) 0..7, see `Actions.action`.
        action_angle: (B, A) [degrees, positive left].
        action_up: (B, A) 1, -1 or 0, see `Actions.up`.
        action_time: (B, A) [s].
        action_mask: (B, A).
        window_pose: (B, W, 3) x, y [m], heading [degrees, clockwise].
        window_speed: (B, W) [m/s].
        window_lane: (B, W) lane of the town, -1 unknown.
        window_time: (B, W) [s].
        window_mask: (B, W).
        window_kind, window_values, window_objects_mask: (B, W, V), (B, W, V, 8), (B, W, V) objects at each token, see
            `Objects`.
        kind, values, objects_mask: (B, O), (B, O, 8), (B, O) objects now.
        has_objects: (B,) whether objects were recorded in the session at all.
        landmark_place: (B, K, 2) x, y [m].
        landmark_lane, landmark_street, landmark_text, landmark_mask: (B, K).
        street_text, street_mask: (B, R); place i is street i of the town.
        current_text, current_recognised: (B,) the utterance to be understood (UfN), -1 otherwise.
    """

    session: Ints
    town: Ints
    time: Reals
    move: Ints
    move_speaker: Ints
    move_slots: Flags
    move_time: Reals
    move_text: Ints
    move_mask: Flags
    utterance_text: Ints
    utterance_recognised: Ints
    utterance_speaker: Ints
    utterance_time: Reals
    utterance_mask: Flags
    action: Ints
    action_angle: Reals
    action_up: Ints
    action_time: Reals
    action_mask: Flags
    window_pose: Reals
    window_speed: Reals
    window_lane: Ints
    window_time: Reals
    window_mask: Flags
    window_kind: Ints
    window_values: Reals
    window_objects_mask: Flags
    kind: Ints
    values: Reals
    objects_mask: Flags
    has_objects: Flags
    landmark_place: Reals
    landmark_lane: Ints
    landmark_street: Ints
    landmark_text: Ints
    landmark_mask: Flags
    street_text: Ints
    street_mask: Flags
    current_text: Ints
    current_recognised: Ints

    def __len__(self) -> int:
        """Number of points (B)."""
        return len(self.session)


def gather(columns: Columns, table: PointTable, rows: ArrayLike, spec: BatchSpec | None = None) -> Batch:
    """Returns a batch of points of a table.

    Args:
        columns: the corpus.
        table: its points.
        rows: (B,) rows of the table, in any order.
        spec: sizes; the defaults if None.
    """
    spec = spec or BatchSpec()
    chosen = np.asarray(rows, dtype=np.int64).reshape(-1)
    session = table.session[chosen]
    return Batch(
        session=session,
        town=columns.sessions.town[session],
        time=_as_seconds(table.tenth[chosen]),
        **_moves(columns, table, chosen, spec),
        **_utterances(columns, table, chosen, spec.utterances),
        **_actions(columns, table, chosen, spec.actions),
        **_window(columns, table, chosen, spec),
        **_now(columns, table, chosen, spec.objects),
        has_objects=columns.sessions.has_objects[session],
        **_places(columns, session, spec),
        **_current(columns, table, chosen),
    )


def _newest(start: Ints, stop: Ints, size: int) -> tuple[NDArray[np.int64], Flags]:
    """Returns the last `size` rows of `start:stop` (B, size), oldest first and padded with 0, and their mask."""
    first = np.maximum(stop - size, start).astype(np.int64)
    rows = first[:, None] + np.arange(size)
    mask = rows < stop[:, None]
    return np.where(mask, rows, 0), mask


def _take(column: NDArray[ScalarT], rows: NDArray[np.int64], mask: Flags, filler: int = 0) -> NDArray[ScalarT]:
    """Returns the values at rows, and `filler` where the mask is False."""
    if not len(column):
        return np.full((*rows.shape, *column.shape[1:]), filler, dtype=column.dtype)
    values: NDArray[ScalarT] = column[rows]
    values[~mask] = filler
    return values


def _moves(columns: Columns, table: PointTable, chosen: NDArray[np.int64], spec: BatchSpec) -> dict[str, Any]:
    """Returns the moves of the history, then the earlier moves of the current utterance."""
    start, stop = table.moves_start[chosen], table.moves_stop[chosen]
    spans, spans_stop = table.spans_start[chosen], table.spans_stop[chosen]
    if spec.paper_leak and table.task is Task.UFN:
        spans_stop = spans_stop + 1  # the point's own row follows
    if spec.strict and table.task is Task.RFN:
        spans_stop = spans
    past = (stop - start).astype(np.int64)
    total = past + spans_stop - spans
    place = np.maximum(total - spec.moves, 0)[:, None] + np.arange(spec.moves)
    mask = place < total[:, None]
    behind = place - past[:, None]
    rows = np.where(mask, np.where(behind < 0, place + start[:, None], behind + spans[:, None]), 0)
    moves = columns.moves
    return {
        "move": _take(moves.move, rows, mask),
        "move_speaker": _take(moves.speaker, rows, mask),
        "move_slots": _take(moves.slots, rows, mask),
        "move_time": _as_seconds(np.minimum(_take(moves.tenth, rows, mask), table.tenth[chosen][:, None])),
        "move_text": _take(moves.span_text, rows, mask, NO_TEXT),
        "move_mask": mask,
    }


def _utterances(columns: Columns, table: PointTable, chosen: NDArray[np.int64], size: int) -> dict[str, Any]:
    rows, mask = _newest(table.utterances_start[chosen], table.utterances_stop[chosen], size)
    said = columns.utterances
    return {
        "utterance_text": _take(said.text, rows, mask, NO_TEXT),
        "utterance_recognised": _take(said.recognised_text, rows, mask, NO_TEXT),
        "utterance_speaker": _take(said.speaker, rows, mask),
        "utterance_time": _seconds(said.tenth, rows, mask),
        "utterance_mask": mask,
    }


def _actions(columns: Columns, table: PointTable, chosen: NDArray[np.int64], size: int) -> dict[str, Any]:
    rows, mask = _newest(table.actions_start[chosen], table.actions_stop[chosen], size)
    acts = columns.actions
    return {
        "action": _take(acts.action, rows, mask),
        "action_angle": _take(acts.angle, rows, mask),
        "action_up": _take(acts.up, rows, mask),
        "action_time": _seconds(acts.tenth, rows, mask),
        "action_mask": mask,
    }


def _window(columns: Columns, table: PointTable, chosen: NDArray[np.int64], spec: BatchSpec) -> dict[str, Any]:
    """Returns every `window_step`-th of the last frames, including the last."""
    start, stop = table.frames_start[chosen].astype(np.int64), table.frames_stop[chosen].astype(np.int64)
    step, size = spec.window_step, spec.window
    count = np.minimum((stop - start + step - 1) // step, size)  # tokens that there are
    rows = (stop - 1)[:, None] - step * (count[:, None] - 1 - np.arange(size))
    mask = np.arange(size) < count[:, None]
    rows = np.where(mask, rows, 0)
    frames = columns.frames
    kind, values, present = _objects(columns, _take(frames.look, rows, mask, -1), spec.window_objects)
    return {
        "window_pose": _take(frames.pose, rows, mask),
        "window_speed": _take(frames.speed, rows, mask),
        "window_lane": _take(frames.lane, rows, mask, -1),
        "window_time": _seconds(frames.tenth, rows, mask),
        "window_mask": mask,
        "window_kind": kind,
        "window_values": values,
        "window_objects_mask": present,
    }


def _now(columns: Columns, table: PointTable, chosen: NDArray[np.int64], size: int) -> dict[str, Any]:
    """Returns the objects of the last look."""
    last = table.frames_stop[chosen].astype(np.int64) - 1
    seen = last >= table.frames_start[chosen]
    kind, values, mask = _objects(columns, _take(columns.frames.look, np.where(seen, last, 0), seen, -1), size)
    return {"kind": kind, "values": values, "objects_mask": mask}


def _objects(columns: Columns, look: Ints, size: int) -> tuple[Ints, Reals, Flags]:
    """Returns kind, values and mask of the nearest objects of looks of any shape; -1 means no look."""
    starts = columns.looks.start
    none = look < 0
    safe = np.where(none, 0, look)
    start = np.where(none, 0, starts[safe])
    stop = np.where(none, 0, starts[np.minimum(safe + 1, len(starts) - 1)])
    rows = start[..., None] + np.arange(size)
    mask = rows < stop[..., None]
    rows = np.where(mask, rows, 0)
    return _take(columns.objects.kind, rows, mask), _take(columns.objects.values, rows, mask), mask


def _places(columns: Columns, session: Ints, spec: BatchSpec) -> dict[str, Any]:
    marks, streets = columns.landmarks, columns.streets
    rows, mask = _first(marks.start, session, spec.landmarks)
    street_rows, street_mask = _first(streets.start, session, spec.streets)
    return {
        "landmark_place": _take(marks.place, rows, mask),
        "landmark_lane": _take(marks.lane, rows, mask, -1),
        "landmark_street": _take(marks.street, rows, mask, -1),
        "landmark_text": _take(marks.text, rows, mask, NO_TEXT),
        "landmark_mask": mask,
        "street_text": _take(streets.text, street_rows, street_mask, NO_TEXT),
        "street_mask": street_mask,
    }


def _first(starts: NDArray[np.int64], session: Ints, size: int) -> tuple[NDArray[np.int64], Flags]:
    rows = starts[session][:, None] + np.arange(size)
    mask = rows < starts[session + 1][:, None]
    return np.where(mask, rows, 0), mask


def _current(columns: Columns, table: PointTable, chosen: NDArray[np.int64]) -> dict[str, Any]:
    rows = table.current[chosen].astype(np.int64)
    mask = rows >= 0
    rows = np.where(mask, rows, 0)
    return {
        "current_text": _take(columns.utterances.text, rows, mask, NO_TEXT),
        "current_recognised": _take(columns.utterances.recognised_text, rows, mask, NO_TEXT),
    }


def _seconds(tenths: Ints, rows: NDArray[np.int64], mask: Flags) -> Reals:
    return _as_seconds(_take(tenths, rows, mask))


def _as_seconds(tenths: NDArray[np.integer]) -> Reals:
    seconds: Reals = tenths.astype(np.float32) / np.float32(TENTHS)
    return seconds
