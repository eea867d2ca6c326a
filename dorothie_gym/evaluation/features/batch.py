"""Some points with all that may be seen there, as arrays of fixed shape."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from dorothie_gym.evaluation.features.columns import Columns, Flags, Ints, Reals
from dorothie_gym.evaluation.features.table import PointTable


@dataclass(frozen=True, kw_only=True)
class BatchSpec:
    """How much of each thing is in a batch: the newest, or nearest, where there is more.

    Attributes:
        moves: dialogue moves (M).
        utterances: what was said (U).
        actions: physical actions (A).
        window: tokens of the car's own way (W), `window_step` rows apart (paper, section 6: 100 frames, step 4).
        window_step: rows (at 10 Hz) from a token to the next.
        window_objects: nearest objects at each token of the window (V).
        objects: nearest objects now (O).
        landmarks: landmarks (K).
        streets: streets (R).
        paper_leak: at UfN points the last of the moves is the point's own label, as in the published features. For
            showing what that does; False for anything else.

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
    landmarks: int = 10
    streets: int = 14
    paper_leak: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Batch:
    """B points. Sequences are oldest first, what is missing is at the end; `*_mask` is True where there is something.

    It holds no label. Filling is 0, -1 in ids of texts, lanes and streets. Times are seconds since the session began.

    Attributes:
        session: (B,) index in `Columns.sessions`.
        town: (B,) index in `Columns.towns`.
        time: (B,) of the point [s].
        move: (B, M) id of the move, 0..14.
        move_speaker: (B, M) 0 participant, 1 Co-Wizard.
        move_slots: (B, M, 69) bool.
        move_time: (B, M) when its utterance was over [s].
        move_text: (B, M) words of the move.
        move_mask: (B, M).
        utterance_text, utterance_recognised: (B, U) its words; what was recognised.
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
    """Returns some points of a table with what may be seen there.

    Args:
        columns: the corpus.
        table: its points.
        rows: (B,) which of them, in any order.
        spec: sizes; the default's where None.
    """
    raise NotImplementedError
