"""Base class of environments whose steps are the prediction points of a session, and the scoring rules."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from dorothie_gym.archive.prediction_points import (
    ANGLE_TOLERANCE,
    DecisionPoint,
    InferencePoint,
    Point,
    PointView,
    angle_error,
    final_view,
)
from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.history_space import (
    act_space,
    check_action,
    decision_space,
    encode_objects,
    encode_view,
    history_space,
)
from dorothie_gym.ontology.dialogue_acts import LABELS
from dorothie_gym.session.rewards import ACT_TERMS, DECISION_TERMS, act_terms, decision_terms
from dorothie_gym.session.spaces.actions import ActionDict, ActionMapping, StepInfo
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.support.copying import Restorable
from dorothie_gym.support.input_files import settings_of

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session
    from dorothie_gym.session.scenario import ResetOptions

Label: TypeAlias = dict[str, int | NDArray[np.int8]]
"""Correct prediction of a point, in the action space of the task."""

PointT = TypeVar("PointT", InferencePoint, DecisionPoint)


class PointRules(ABC, Generic[PointT]):
    """Scoring rules of a task.

    Attributes:
        terms: names of the reward terms, each in [0, 1]: the two metrics of the task in the paper, per point.
            The reward is their mean.
    """

    terms: ClassVar[tuple[str, ...]]

    @property
    @abstractmethod
    def action_space(self) -> spaces.Dict:
        """Action space of the predictions."""

    @abstractmethod
    def label(self, point: PointT) -> Label:
        """Returns the correct prediction."""

    @abstractmethod
    def score(self, action: ActionMapping, point: PointT) -> dict[str, float]:
        """Returns the reward terms of a prediction, by name; undefined terms are omitted."""

    @property
    @abstractmethod
    def no_label(self) -> Label:
        """Placeholder for the correct prediction before the first one: -1 for numbers of classes, and zeros."""


class ActRules(PointRules[InferencePoint]):
    """UfN and RfN: `move` is 1 for the correct move, `slots` is F1 over the (slot, value) pairs of the point.

    `slots` is 1 if neither the point nor the prediction has slot values.
    """

    terms = ACT_TERMS

    @property
    def action_space(self) -> spaces.Dict:
        """Action space with `move` and `slots`."""
        return act_space()

    @property
    def no_label(self) -> Label:
        """Move -1 and no slots."""
        return {"move": -1, "slots": np.zeros(len(LABELS), dtype=np.int8)}

    def label(self, point: InferencePoint) -> Label:
        """Returns the act of the point."""
        return {"move": int(point.act.move), "slots": np.array(point.act.vector, dtype=np.int8)}

    def score(self, action: ActionMapping, point: InferencePoint) -> dict[str, float]:
        """Returns `move` and `slots`."""
        truth, guess = np.array(point.act.vector, dtype=np.bool_), np.asarray(action["slots"], dtype=np.bool_)
        return act_terms(int(action["move"]) == int(point.act.move), truth, guess)


class DecisionRules(PointRules[DecisionPoint]):
    """NfD: `action` is 1 for the correct action, `joint` if the angle is also correct within 15 degrees on the circle.

    `joint` is undefined if the recording lacks the angle.
    """

    terms = DECISION_TERMS

    @property
    def action_space(self) -> spaces.Dict:
        """Action space with `action` and `angle`."""
        return decision_space()

    @property
    def no_label(self) -> Label:
        """Action -1 and angle 0."""
        return {"action": -1, "angle": 0}

    def label(self, point: DecisionPoint) -> Label:
        """Returns the action of the point and its angle in whole degrees, 0 if the recording lacks the angle."""
        angle = 0.0 if np.isnan(point.angle) else point.angle
        # 179.6 degrees rounds to 180, which the space represents as -180.
        return {"action": point.action.nfd_class, "angle": (round(angle) + 180) % 360 - 180}

    def score(self, action: ActionMapping, point: DecisionPoint) -> dict[str, float]:
        """Returns `action` and, if the angle is known, `joint`."""
        error = None if np.isnan(point.angle) else angle_error(float(action["angle"]), point.angle)
        is_right = int(action["action"]) == point.action.nfd_class
        return decision_terms(is_right, None if error is None else error < ANGLE_TOLERANCE)


RULES: Final[Mapping[Task, PointRules[Any]]] = {
    Task.UFN: ActRules(),
    Task.RFN: ActRules(),
    Task.NFD: DecisionRules(),
}


_METADATA: dict[str, object] = {"render_modes": ["ansi"], "render_fps": 2}


class PointEnv(Restorable, gym.Env[Observation, ActionDict]):
    """Base class of the task environments on recorded and live sessions.

    An episode is one session, a step one prediction point. Predictions do not affect later observations.

    Attributes:
        task: the task.
        limits: sizes of the observation tables.
        rules: scoring rules of the task.
    """

    metadata = _METADATA
    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ("_points", "_point", "_np_random", "_np_random_seed")

    def __init__(self, task: Task, limits: SpaceLimits | None, render_mode: str | None) -> None:
        if render_mode not in (None, "ansi"):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or 'ansi'")
        self.task = task
        self.limits = SpaceLimits() if limits is None else settings_of(limits, SpaceLimits, "limits")
        self.render_mode = render_mode
        self.rules: PointRules[Any] = RULES[task]
        self.observation_space = history_space(task, self.limits)
        self.action_space = self.rules.action_space
        self._points: Iterator[Point] = iter(())
        self._point: Point | None = None

    def reset(self, *, seed: int | None = None, options: ResetOptions | None = None) -> tuple[Observation, StepInfo]:
        """Starts a session and returns the observation of its first point."""
        super().reset(seed=seed)
        self._points = self._begin(seed, options or {})
        self._point = next(self._points)
        score = {"index": -1, "label": self.rules.no_label, "reward_terms": dict.fromkeys(self.rules.terms, 0.0)}
        return self._observe(), {**self._info(), **score, **self._metrics()}

    def step(self, action: ActionDict) -> tuple[Observation, float, bool, bool, StepInfo]:
        """Scores the prediction at the current point and moves to the next.

        Raises:
            ValueError: if the action is malformed; the message names the field.
            gymnasium.error.ResetNeeded: if there is no current point.
        """
        point = self._point
        if point is None:
            raise ResetNeeded("there is no point to predict: call reset() first")
        check_action(action, self.rules.action_space)
        terms = self.rules.score(action, point)
        self._point = next(self._points, None)
        self._judge(action, point)
        info = {
            **self._info(),
            "index": point.index,
            "label": self.rules.label(point),
            "reward_terms": {name: terms.get(name, math.nan) for name in self.rules.terms},
            **self._metrics(),
        }
        return self._observe(), sum(terms.values()) / len(terms), self._point is None, False, info

    def render(self) -> str | None:
        """Returns the dialogue so far and the words to be inferred, one utterance per line."""
        if self.render_mode is None:
            return None
        view = self._view()
        lines: list[str] = [
            f"{move.frame:6d} {move.speaker.value:>11}: {move.span} [{move.act}]" for move in view.moves
        ]
        return "\n".join([*lines, f"{view.frame:6d} {self.task.value:>11}? {view.utterance}"])

    @abstractmethod
    def _begin(self, seed: int | None, options: ResetOptions) -> Iterator[Point]:
        """Starts a session with at least one point and yields its points in order."""

    @abstractmethod
    def _now(self) -> tuple[Session, Town | None]:
        """Returns the session so far and its town, if known."""

    @abstractmethod
    def _info(self) -> StepInfo:
        """Returns the entries of the infos except the score."""

    def _judge(self, action: ActionMapping, point: Point) -> None:  # most have nothing to note
        """Records a prediction."""

    def _metrics(self) -> StepInfo:
        """Returns the entries of the infos that follow from all predictions so far."""
        return {}

    def _view(self) -> PointView:
        return final_view(self._now()[0], self.task) if self._point is None else self._point.view

    def _observe(self) -> Observation:
        view, (session, town) = self._view(), self._now()
        return {**encode_view(view, self.limits), **encode_objects(session, view.frame, town, self.limits)}
