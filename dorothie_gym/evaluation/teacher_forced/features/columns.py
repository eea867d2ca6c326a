"""Corpus as columns: one row per move, utterance, action, frame and so on, session after session.

All times are at the rate of the benchmark, 10 Hz: `tenth` is the number of the tenth of a second since the start of the
session. `texts` holds every distinct text once; columns that end in `text` are its
indices, -1 for none. Rows of a session are contiguous, in the order in which they become visible.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Moments, RecordTimes

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Ints: TypeAlias = NDArray[np.int32]
Reals: TypeAlias = NDArray[np.float32]
Flags: TypeAlias = NDArray[np.bool_]

NO_TEXT: Final = -1
"""Index of a missing text."""

PARTICIPANT, CO_WIZARD = 0, 1
"""Values of columns `speaker`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SessionRows:
    """Sessions (S,), ordered by fold, town, seed and content, independent of their names.

    Attributes:
        names: name of each.
        folds: fold of each session, as `Fold`'s value; empty for a session in no fold.
        town: index of its town in `Columns.towns`.
        has_objects: whether the objects around the ego were recorded.
    """

    names: tuple[str, ...]
    folds: tuple[str, ...]
    town: Ints
    has_objects: Flags


@dataclass(frozen=True, eq=False, kw_only=True)
class MoveRows:
    """Dialogue moves of both speakers (n,), those of an utterance together, flagged or not.

    Attributes:
        session: index of its session.
        tenth: end of its utterance; the move is visible after it.
        point_tenth: time of its own event as a point; in recordings of people it may be before `tenth`.
        event: number of its event in the session.
        speaker: 0 participant, 1 Co-Wizard.
        utterance: row of `Columns.utterances`.
        move: id of its `DialogueMove`, 0..14.
        slots: (n, 69) its slot values, in the order of `LABELS`.
        span_text: words of this move.
        flagged: whether it is a point of the benchmark.
        handling: exception that its exchange handles: 0 none, 1 task, 2 environmental (a label, no input).
    """

    session: Ints
    tenth: Ints
    point_tenth: Ints
    event: Ints
    speaker: Ints
    utterance: Ints
    move: Ints
    slots: Flags
    span_text: Ints
    flagged: Flags
    handling: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class UtteranceRows:
    """Utterances (n,) of both speakers.

    Attributes:
        session: index of its session.
        tenth: end of the utterance.
        speaker: 0 participant, 1 Co-Wizard.
        text: its words.
        recognised_text: words from the speech recogniser, -1 for none.
    """

    session: Ints
    tenth: Ints
    speaker: Ints
    text: Ints
    recognised_text: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class ActionRows:
    """Physical actions (n,), flagged or not.

    Attributes:
        session: index of its session.
        tenth: when it was done.
        event: number of its event in the session.
        action: `PhysicalAction` less 1: 0..5 are the classes of NfD, 6 is SpeedChange, 7 LightChange.
        angle: argument as shown in a history [degrees, positive left]: -180 for a U-turn, 0 if it has none or
            it is not known (`history_angle`).
        up: 1 for faster or on, -1 for slower or off, 0 for other actions.
        label_angle: argument as NfD's label [degrees]: 0 for an action that takes none, NaN if unknown.
        flagged: whether it is a point of NfD.
        handling: as in `MoveRows`, by the rule of `handling_of_events`.
    """

    session: Ints
    tenth: Ints
    event: Ints
    action: Ints
    angle: Reals
    up: Ints
    label_angle: Reals
    flagged: Flags
    handling: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameRows:
    """Poses of the ego (n,), ten rows a second.

    Attributes:
        session: index of its session.
        tenth: when.
        pose: (n, 3) x, y [m], heading [degrees, clockwise from east, in [-180, 180)].
        speed: over the tenth before [m/s]; 0 in a session's first row.
        lane: lane of the town, -1 if unknown.
        look: row of `Columns.looks` that was the last then, -1 before the first.
    """

    session: Ints
    tenth: Ints
    pose: Reals
    speed: Reals
    lane: Ints
    look: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class LookRows:
    """Times (n,) at which the objects around the ego were recorded, about twice a second.

    Attributes:
        session: index of its session.
        tenth: when.
        start: first row of `Columns.objects` of each, and one more: those of look i are `start[i]:start[i + 1]`.
    """

    session: Ints
    tenth: Ints
    start: NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class ObjectRows:
    """Perceived objects around the ego (n,), the nearest of each look first.

    Attributes:
        kind: see `dorothie_gym.archive.ObjectKind`.
        values: (n, 8) columns as in `dorothie_gym.archive.OBJECT_VALUES`, relative to the car as it was at the look.
    """

    kind: Ints
    values: Reals


@dataclass(frozen=True, eq=False, kw_only=True)
class LandmarkRows:
    """Landmarks that are not hidden from the Co-Wizard (n,).

    Attributes:
        start: (S + 1,) those of session s are `start[s]:start[s + 1]`.
        place: (n, 2) x, y [m].
        lane: lane of the town that it is at, -1 if unknown.
        street: number of its street, -1 for none.
        text: its name.
    """

    start: NDArray[np.int64]
    place: Reals
    lane: Ints
    street: Ints
    text: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class StreetRows:
    """Streets of each session's town (n,), in the order of their numbers.

    Attributes:
        start: (S + 1,) those of session s are `start[s]:start[s + 1]`.
        text: its name.
    """

    start: NDArray[np.int64]
    text: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class GoalRows:
    """Reached subgoals: labels of the belief head, never inputs (they include hidden landmarks).

    The goal at a point is the first of the session that is reached after the point.

    Attributes:
        session: index of its session (n,).
        tenth: when the subgoal was completed.
        place: (n, 2) x, y [m] of its landmark.
    """

    session: Ints
    tenth: Ints
    place: Reals


@dataclass(frozen=True, eq=False, kw_only=True)
class TownGraph:
    """Lane graph of a town (L lanes, E edges, s streets); without lanes if the town is unknown.

    Attributes:
        name: name of the town.
        lanes: (L, 14) columns as in `dorothie_gym.maps.lane_graph.FEATURES` [m, degrees].
        road: (L,) number of its road within the town, 0.. without gaps.
        junction: (L,) 0 outside of junctions, else 1.. without gaps.
        street: (L,) its street, -1 for none.
        edges: (2, E) from and to.
        edge_types: (E,) index in `dorothie_gym.maps.lane_graph.EDGE_TYPES`.
        member_start: (s + 1,) `members[member_start[i]:member_start[i + 1]]` are the lanes of street i.
        members: the lanes of all streets.
    """

    name: str
    lanes: Reals
    road: Ints
    junction: Ints
    street: Ints
    edges: Ints
    edge_types: Ints
    member_start: Ints
    members: Ints


@dataclass(frozen=True, eq=False, kw_only=True)
class Columns:
    """Corpus as columns; arrays may be memory maps of files.

    Attributes:
        key: hash of all that determines the content, sources included; key of the cache.
        texts: every distinct text: utterances, recognised words, names of streets and landmarks.
        towns: towns of the sessions, by name.
        unreadable: sessions that could not be read, (name, reason) each.
        unpointed: flagged events that are not points, (session, event, reason) each.
    """

    key: str
    sessions: SessionRows
    moves: MoveRows
    utterances: UtteranceRows
    actions: ActionRows
    frames: FrameRows
    looks: LookRows
    objects: ObjectRows
    landmarks: LandmarkRows
    streets: StreetRows
    goals: GoalRows
    texts: tuple[str, ...]
    towns: tuple[TownGraph, ...]
    unreadable: tuple[tuple[str, str], ...] = ()
    unpointed: tuple[tuple[int, int, str], ...] = ()

    @functools.cached_property
    def times(self) -> RecordTimes:
        """Times that determine visibility at a point, in tenths of a second."""
        said, moves = self.utterances, self.moves
        first = np.searchsorted(moves.utterance, np.arange(len(said.tenth) + 1))  # moves are in the order of utterances
        return RecordTimes(
            utterances=Moments(said.session, said.tenth),
            last_events=moves.event[first[1:] - 1],
            first_moves=first,
            actions=Moments(self.actions.session, self.actions.tenth),
            frames=Moments(self.frames.session, self.frames.tenth),
        )

    @functools.cached_property
    def content(self) -> str:
        """Hash of the content, independent of the layout of the corpus and of the version of the package."""
        names = [self.sessions.folds, self.texts, [town.name for town in self.towns]]
        digest = hashlib.sha256(json.dumps(names).encode())
        for part in (*(getattr(self, group) for group in GROUPS), *self.towns):
            for field in dataclasses.fields(part):
                values = getattr(part, field.name)
                if isinstance(values, np.ndarray):
                    digest.update(f"{field.name} {values.dtype.str} {values.shape}\n".encode())
                    digest.update(values.tobytes())
        return digest.hexdigest()


GROUPS: Final[dict[str, type[DataclassInstance]]] = {
    "sessions": SessionRows, "moves": MoveRows, "utterances": UtteranceRows, "actions": ActionRows, "frames": FrameRows,
    "looks": LookRows, "objects": ObjectRows, "landmarks": LandmarkRows, "streets": StreetRows, "goals": GoalRows,
}  # fmt: skip
"""Groups of `Columns`, which hold arrays over the whole corpus."""
