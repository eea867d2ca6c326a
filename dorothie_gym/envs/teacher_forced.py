"""Base class of the three task environments on recorded sessions (teacher forcing)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from gymnasium.error import ResetNeeded

from dorothie_gym.archive.corpus import Corpus, CorpusEntry, Fold
from dorothie_gym.archive.prediction_points import DecisionPoint, InferencePoint, Point, task_points
from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.point_env import PointEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced.metrics import (
    ActionAccuracy,
    ArgumentAccuracy,
    JointAccuracy,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
)
from dorothie_gym.evaluation.teacher_forced.predictions import (
    ActionPredictions,
    ActPredictions,
    act_labels,
    action_labels,
)
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.scenario import ResetOptions, check_options
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.actions import ActionMapping, StepInfo
    from dorothie_gym.session.spaces.fields import SpaceLimits

DEFAULT: Final = "default"
"""Name of the corpus that is generated once and kept in the user's cache folder."""

ALL: Final = "all"

SPLITS: Final[Mapping[str, str]] = {fold.value.replace("/", "_"): fold.value for fold in Fold}
"""Fold of each split; `val` and `test` contain both seen and unseen towns."""

CACHED_SESSIONS: Final = 16
"""Number of sessions that an environment keeps in memory; the least recently used one is dropped."""


class TeacherForcedEnv(PointEnv):
    """Base class of the three tasks on recorded sessions.

    ## Description
    An episode walks through the prediction points of one recorded session. The observations follow the recording;
    predictions do not affect them (teacher forcing).

    ## Observation Space
    A `Dict` with the history recorded before the point, see `dorothie_gym.archive.visibility` for its extent and
    `history_fields` for the fields. Moves and actions are sorted newest first.

    ## Rewards
    The mean of `info["reward_terms"]`, the two metrics of the task per point.

    ## Episode End
    Terminates after the last point of the session; the last observation shows the whole recording. Episodes are never
    truncated.

    ## Arguments
    - `corpus`: `"default"` (a small corpus that is generated once and kept in the user's cache folder), a folder of
      sessions in any layout, a `Corpus`, or a sequence of sessions.
    - `split`: `"all"`, or the fold of the sessions: `"train"`, `"val"`, `"val_seen"`, `"val_unseen"`, `"test"`,
      `"test_seen"`, `"test_unseen"`.
    - `limits`: sizes of the observation tables.
    - `strict`: whether RfN points hide the earlier acts of the Co-Wizard's own utterance; no effect on other tasks.
    - `render_mode`: None or `"ansi"`.

    `reset(options={"session": number or name})` selects the session, which is drawn at random otherwise; sessions
    without a point of the task are skipped. The infos hold `session` (name) and, of the last step, `index` (number of
    the event), `label` (the correct action) and `reward_terms` (NaN: not defined), and `metrics` of the episode so far
    (NaN: not defined yet). After a reset, index and classes are -1 and the terms 0.

    Raises:
        SessionError: if there are no sessions, one cannot be read, or none has a point of the task.
        ValueError: if `split`, `render_mode` or an action is invalid, or a session has more landmarks or streets than
            `limits`; the message names the field.
        CacheError: if the default corpus cannot be kept.
    """

    of_task: ClassVar[Task]
    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = (*PointEnv.MUTABLE_ATTRIBUTES, "_session", "_town", "_done")

    def __init__(
        self,
        corpus: Corpus | Path | str | Sequence[Session] = DEFAULT,
        *,
        split: str = ALL,
        limits: SpaceLimits | None = None,
        strict: bool = False,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(self.of_task, limits, render_mode)
        self._library = _Library(corpus, split, self.of_task, self.limits, strict)
        self._session: Session | None = None
        self._town: Town | None = None
        self._done: list[tuple[ActionMapping, Point]] = []

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the names of the sessions and the sizes of the tables."""
        return {**super().compatibility(), "the sessions": self._library.names, "the limits": self.limits}

    def _begin(self, seed: int | None, options: ResetOptions) -> Iterator[Point]:
        check_options(options, "session")
        wanted = options.get("session")
        order = self.np_random.permutation(len(self._library)).tolist() if wanted is None else [self._number(wanted)]
        for number in order:
            self._session, points = self._library.read(number)
            if points:
                self._done = []
                self._town = find_town(self._session.header.town, self._library.maps(number))
                return iter(points)
        raise SessionError(f"none of the {len(order)} sessions has a point of the task {self.task.value}")

    def _number(self, wanted: object) -> int:
        names = self._library.names
        if isinstance(wanted, str) and wanted in names:
            return names.index(wanted)
        if isinstance(wanted, int) and 0 <= wanted < len(names):
            return wanted
        raise ValueError(f"option 'session' is {wanted!r}; it must be a number below {len(names)} or a session's name")

    def _now(self) -> tuple[Session, Town | None]:
        if self._session is None:
            raise ResetNeeded("no episode has begun: call reset() first")
        return self._session, self._town

    def _info(self) -> StepInfo:
        session, _ = self._now()
        return {"session": session.name}

    def _judge(self, action: ActionMapping, point: Point) -> None:
        self._done.append((action, point))

    def _metrics(self) -> StepInfo:
        actions, points = [action for action, _ in self._done], [point for _, point in self._done]
        if not points:
            return {"metrics": dict.fromkeys(_DECISION_METRICS if self.task is Task.NFD else _ACT_METRICS, math.nan)}
        if self.task is Task.NFD:
            found = _decision_metrics(actions, [point for point in points if isinstance(point, DecisionPoint)])
        else:
            found = _act_metrics(actions, [point for point in points if isinstance(point, InferencePoint)])
        return {"metrics": found}


class _Library(CachedViews):
    """Sessions of a split, read on demand.

    Args:
        corpus: as in `TeacherForcedEnv`.
        split: as in `TeacherForcedEnv`.
        task: task of the points.
        limits: maximum numbers of landmarks and streets.
        strict: as in `TeacherForcedEnv`.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("read",)

    def __init__(
        self, corpus: Corpus | Path | str | Sequence[Session], split: str, task: Task, limits: SpaceLimits, strict: bool
    ) -> None:
        if split not in (ALL, *SPLITS):
            raise ValueError(f"split is {split!r}; it must be one of {', '.join((ALL, *SPLITS))}")
        self._task, self._limits, self._strict = task, limits, strict
        found = _sessions(corpus, split)
        self.names = [one.name for one in found]
        self._found = found

    @cached_property
    def read(self) -> Callable[[int], tuple[Session, tuple[Point, ...]]]:
        """Reads a session and its points, or returns them once more."""
        return lru_cache(maxsize=CACHED_SESSIONS)(self._read)

    def __len__(self) -> int:
        return len(self.names)

    def maps(self, number: int) -> Path | None:
        """Returns the folder of the maps that belong to a session, or None."""
        found = self._found[number]
        return None if isinstance(found, Session) else found.maps

    def _read(self, number: int) -> tuple[Session, tuple[Point, ...]]:
        found = self._found[number]
        session = found if isinstance(found, Session) else found.load()
        _check_size(session, self._limits)
        return session, task_points(session, self._task, strict=self._strict)


def _sessions(corpus: Corpus | Path | str | Sequence[Session], split: str) -> Sequence[CorpusEntry | Session]:
    """Returns the sessions of a split, or entries that load them."""
    if isinstance(corpus, str) and corpus == DEFAULT:
        # Imported here: the simulation is slow to import, and only the default corpus needs it.
        from dorothie_gym.evaluation.rollout.corpus_cache import default_corpus

        corpus = default_corpus()
    if isinstance(corpus, Path | str):
        corpus = Corpus.load(corpus)
    if isinstance(corpus, Corpus):
        chosen = corpus if split == ALL else corpus.filter(fold=SPLITS[split])
        if not len(chosen):
            folds = ", ".join(fold.value.replace("/", "_") for fold in corpus.folds) or "no folds"
            raise SessionError(f"{corpus.root}: split {split!r} has no session; there are {folds}")
        return chosen.entries
    if not corpus:
        raise SessionError("corpus is empty; give a folder of sessions, some sessions, or 'default'")
    if split != ALL:
        raise ValueError(f"split is {split!r}, but sessions in memory lie in no fold: it must be {ALL!r}")
    return tuple(corpus)


def _check_size(session: Session, limits: SpaceLimits) -> None:
    for name, size in (("landmarks", limits.landmarks), ("streets", limits.streets)):
        count = len(session.header.landmarks if name == "landmarks" else session.header.street_names)
        if count > size:
            raise ValueError(f"session {session.name} has {count} {name}; SpaceLimits.{name} is {size}: raise it")


_ACT_METRICS: Final = MappingProxyType(
    {"move_accuracy": MoveAccuracy(), "slot_f1": SlotF1(), "slot_score_paper": SlotScorePaper()}
)
_DECISION_METRICS: Final = MappingProxyType(
    {"action_accuracy": ActionAccuracy(), "argument_accuracy": ArgumentAccuracy(), "joint_accuracy": JointAccuracy()}
)


def _act_metrics(actions: Sequence[ActionMapping], points: Sequence[InferencePoint]) -> dict[str, float]:
    predicted = ActPredictions(
        moves=np.array([action["move"] for action in actions], dtype=np.int64),
        slots=np.array([action["slots"] for action in actions], dtype=np.bool_),
    )
    labels = act_labels(points)
    return {name: float(metric.compute(predicted, labels)) for name, metric in _ACT_METRICS.items()}


def _decision_metrics(actions: Sequence[ActionMapping], points: Sequence[DecisionPoint]) -> dict[str, float]:
    predicted = ActionPredictions(
        actions=np.array([action["action"] for action in actions], dtype=np.int64),
        angles=np.array([action["angle"] for action in actions], dtype=np.float64),
    )
    labels = action_labels(points)
    return {name: float(metric.compute(predicted, labels)) for name, metric in _DECISION_METRICS.items()}
