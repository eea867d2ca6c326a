"""Labels of a corpus: the correct answer at every point, its part of the corpus, and unscored events with reasons.

Scores are given for each *part*: "seen" and "unseen" (towns), or "all" where sessions are not divided by town.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.corpus import Corpus, CorpusEntry, Fold
from dorothie_gym.archive.prediction_points import at_tenths, nfd_points, rfn_points, ufn_points, unpointed_events
from dorothie_gym.archive.visibility import Task
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis.exception_attribution import Handled, handling_of_events
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ActionPredictions,
    ActPredictions,
    act_labels,
    action_labels,
    joined_actions,
    joined_acts,
)

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

Split: TypeAlias = Literal["train", "val", "test", "all"]
SPLITS: Final[tuple[Split, ...]] = ("train", "val", "test", "all")

SEEN: Final = "seen"
UNSEEN: Final = "unseen"
ALL: Final = "all"
PARTS: Final = (SEEN, UNSEEN, ALL)
"""Parts in display order."""

NO_ANGLE: Final = "the recording does not know its angle: only the action is scored"
"""Reason why a point of NfD is scored in part only."""

HALVES: Final = "the first half of the sessions by name trains, the second half tests"
"""Division of a corpus without folds, in words."""


@dataclass(frozen=True, kw_only=True)
class Unscored:
    """Flagged event that is not scored, or scored in part only.

    Attributes:
        session: name of the session.
        event: number of the event.
        task: task of the point; None if the event is a point of no task.
        reason: reason in words.
    """

    session: str
    event: int
    task: Task | None
    reason: str

    def to_json(self) -> dict[str, object]:
        """Returns the fields."""
        task = None if self.task is None else self.task.value
        return {"session": self.session, "event": self.event, "task": task, "reason": self.reason}


@dataclass(frozen=True, eq=False, kw_only=True)
class TaskLabels:
    """Labels of n points of one task, by session and event.

    Attributes:
        task: the task.
        sessions: (n,) names of the sessions.
        events: (n,) numbers of the events, counted from 0 within the session.
        parts: (n,) part of the corpus.
        handled: (n,) kind of exception that the exchange of the point handles, values of `Handled`.
        labels: the labels in the form of a prediction.
    """

    task: Task
    sessions: NDArray[np.str_]
    events: NDArray[np.int64]
    parts: NDArray[np.str_]
    handled: NDArray[np.str_]
    labels: ActPredictions | ActionPredictions

    def __len__(self) -> int:
        return len(self.events)

    def rows(self) -> dict[tuple[str, int], int]:
        """Returns the row of each point by session and event."""
        keys = zip(self.sessions.tolist(), self.events.tolist(), strict=True)
        return {key: row for row, key in enumerate(keys)}


@dataclass(kw_only=True)
class FoldCount:
    """Counts of one fold.

    Attributes:
        sessions: number of readable sessions.
        flagged: number of flagged events.
        points: number of points of each task.
        skipped: number of flagged events that are points of no task.
    """

    sessions: int = 0
    flagged: int = 0
    points: Counter[Task] = field(default_factory=Counter)
    skipped: int = 0

    def to_json(self) -> dict[str, int]:
        """Returns the counts: `flagged` is the sum of `ufn`, `rfn`, `nfd` and `skipped`."""
        tasks = {task.value: self.points[task] for task in Task}
        return {"sessions": self.sessions, "flagged": self.flagged, **tasks, "skipped": self.skipped}


@dataclass(frozen=True, eq=False, kw_only=True)
class CorpusLabels:
    """Labels of the chosen sessions, and counts of the whole corpus.

    Attributes:
        root: folder of the corpus.
        split: chosen split.
        division: rule of the division, in words.
        tasks: labels of each task.
        part_of: part of each chosen session, by name.
        others: names of the sessions outside the split.
        incomplete: chosen sessions that were interrupted; their recorded points are used.
        counts: counts of each fold of the whole corpus, by name of the fold.
        skipped: flagged events of the chosen sessions that are unscored or scored in part.
        unreadable: reason for each unreadable session of the whole corpus, by name.
    """

    root: Path
    split: Split
    division: str
    tasks: Mapping[Task, TaskLabels]
    part_of: Mapping[str, str]
    others: frozenset[str]
    incomplete: tuple[str, ...]
    counts: Mapping[str, FoldCount]
    skipped: tuple[Unscored, ...]
    unreadable: Mapping[str, str]

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the chosen sessions, in display order."""
        there = set(self.part_of.values())
        return tuple(part for part in PARTS if part in there)


def labels_of(corpus: Corpus | Path | str, split: Split = "test") -> CorpusLabels:
    """Reads the labels of a corpus.

    Args:
        corpus: corpus or its folder, of any layout.
        split: "train", "val", "test" or "all": the sessions in folds of that name; without folds, the first half by
            name is "train" and the second "test".

    Raises:
        SessionError: no session can be read, two sessions have the same name, or the split is empty; the message
            names the splits of the corpus.
    """
    if not isinstance(corpus, Corpus):
        corpus = Corpus.load(corpus)
    _check_names(corpus)
    part_of, division = _divide(corpus, split)
    reader = _Reader(part_of)
    for entry in corpus.entries:
        reader.read(entry)
    if not reader.read_sessions & set(part_of):
        reasons = "; ".join(reader.unreadable.values())
        raise SessionError(f"{corpus.root}: no session of the split {split!r} can be read ({reasons})")
    return CorpusLabels(
        root=corpus.root,
        split=split,
        division=division,
        tasks={task: reader.labels(task) for task in Task},
        part_of={name: part for name, part in part_of.items() if name in reader.read_sessions},
        others=frozenset(entry.name for entry in corpus.entries) - set(part_of),
        incomplete=tuple(reader.incomplete),
        counts=reader.counts,
        skipped=tuple(reader.skipped),
        unreadable=reader.unreadable,
    )


class _Reader:
    """Collects the labels, session by session."""

    def __init__(self, part_of: Mapping[str, str]) -> None:
        self._part_of = part_of
        self._keys: dict[Task, list[tuple[str, int, str, str]]] = {task: [] for task in Task}
        self._acts: dict[Task, list[ActPredictions]] = {task: [] for task in Task}
        self._actions: list[ActionPredictions] = []
        self.counts: dict[str, FoldCount] = {}
        self.skipped: list[Unscored] = []
        self.unreadable: dict[str, str] = {}
        self.incomplete: list[str] = []
        self.read_sessions: set[str] = set()

    def read(self, entry: CorpusEntry) -> None:
        try:
            session = entry.load()
            ufn, rfn, nfd = tuple(ufn_points(session)), tuple(rfn_points(session)), tuple(nfd_points(session))
        except SessionError as error:
            self.unreadable[entry.name] = str(error)
            return
        self.read_sessions.add(entry.name)
        events = {
            Task.UFN: [point.index for point in ufn],
            Task.RFN: [point.index for point in rfn],
            Task.NFD: [point.index for point in nfd],
        }
        chosen = entry.name in self._part_of
        self._count(session, entry, events, chosen)
        if not chosen:
            return
        self._acts[Task.UFN].append(act_labels(ufn))
        self._acts[Task.RFN].append(act_labels(rfn))
        self._actions.append(action_labels(nfd))
        handled = handling_of_events(Units(at_tenths(session)))
        for task, numbers in events.items():
            part = self._part_of[entry.name]
            self._keys[task] += [(entry.name, event, part, handled.get(event, Handled.NONE)) for event in numbers]
        unknown = np.isnan(self._actions[-1].angles).tolist()
        self.skipped += [
            Unscored(session=entry.name, event=event, task=Task.NFD, reason=NO_ANGLE)
            for event, is_unknown in zip(events[Task.NFD], unknown, strict=True)
            if is_unknown
        ]
        if not session.complete:
            self.incomplete.append(entry.name)

    def labels(self, task: Task) -> TaskLabels:
        keys = self._keys[task]
        return TaskLabels(
            task=task,
            sessions=np.array([key[0] for key in keys], dtype=np.str_),
            events=np.array([key[1] for key in keys], dtype=np.int64),
            parts=np.array([key[2] for key in keys], dtype=np.str_),
            handled=np.array([key[3] for key in keys], dtype=np.str_),
            labels=joined_actions(self._actions) if task is Task.NFD else joined_acts(self._acts[task]),
        )

    def _count(self, session: Session, entry: CorpusEntry, events: Mapping[Task, Sequence[int]], chosen: bool) -> None:
        fold = "" if entry.fold is None else entry.fold.value
        count = self.counts.setdefault(fold, FoldCount())
        count.sessions += 1
        count.flagged += sum(event.flagged for event in session.events)
        for task, numbers in events.items():
            count.points[task] += len(numbers)
        none = unpointed_events(session)
        count.skipped += len(none)
        if chosen:
            self.skipped += [Unscored(session=entry.name, event=event, task=None, reason=why) for event, why in none]


def _check_names(corpus: Corpus) -> None:
    seen: dict[str, Path] = {}
    for entry in corpus.entries:
        if entry.name in seen:
            raise SessionError(
                f"{entry.path}: {seen[entry.name]} has the same name; predictions name sessions by their folders: "
                "rename one of them"
            )
        seen[entry.name] = entry.path


def _divide(corpus: Corpus, split: Split) -> tuple[dict[str, str], str]:
    """Returns the part of each session of the split by name, and the rule of the division."""
    if split not in SPLITS:
        raise SessionError(f"split: {split!r} is unknown; choose from {', '.join(SPLITS)}")
    if split == ALL:
        return {entry.name: ALL for entry in corpus.entries}, "all sessions"
    if any(entry.fold is not None for entry in corpus.entries):
        chosen = {e.name: _part(e.fold) for e in corpus.entries if e.fold is not None and e.fold.matches(split)}
        there = sorted({fold.value.split("/")[0] for fold in corpus.folds})
        division = "by the folders train, val and test"
    else:
        chosen = {entry.name: ALL for entry in _halves(corpus.entries, split)}
        there = ["train", "test"] if len(corpus) > 1 else []
        division = HALVES
    if not chosen:
        known = ", ".join([*there, ALL])
        hint = "" if there else "; two sessions or more are divided into train and test"
        raise SessionError(f"{corpus.root}: has no session of the split {split!r}, only of {known}{hint}")
    return chosen, division


def _halves(entries: Sequence[CorpusEntry], split: Split) -> Iterator[CorpusEntry]:
    ordered = sorted(entries, key=lambda entry: entry.name)
    middle = len(ordered) // 2
    if middle and split in ("train", "test"):
        yield from ordered[:middle] if split == "train" else ordered[middle:]


def _part(fold: Fold) -> str:
    part = fold.value.split("/")[-1]
    return part if part in (SEEN, UNSEEN) else ALL
