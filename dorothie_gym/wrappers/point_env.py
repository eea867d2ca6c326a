"""Environment base class whose steps are the prediction points of a session, and the scoring rules."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from dorothie_gym.maps import Town
from dorothie_gym.recording import (
    ANGLE_TOLERANCE,
    DecisionPoint,
    InferencePoint,
    Point,
    PointView,
    Session,
    Task,
    angle_error,
    final_view,
)
from dorothie_gym.spaces import Observation, SpaceLimits
from dorothie_gym.wrappers.history_space import (
    act_space,
    check_action,
    decision_space,
    encode_objects,
    encode_view,
    history_space,
)

Action: TypeAlias = Mapping[str, Any]
PointT = TypeVar("PointT", InferencePoint, DecisionPoint)


class PointRules(ABC, Generic[PointT]):
    """The rules of a task.

    Attributes:
        terms: names of what a prediction earns, each in [0, 1]: the per-point form of the task's two metrics in the
            paper's table. The reward is their mean.
    """

    terms: ClassVar[tuple[str, ...]]

    @property
    @abstractmethod
    def action_space(self) -> spaces.Dict:
        """The space of predictions."""

    @abstractmethod
    def label(self, point: PointT) -> dict[str, Any]:
        """Returns the prediction that would be right."""

    @abstractmethod
    def score(self, action: Action, point: PointT) -> dict[str, float]:
        """Returns what a prediction earns, by the names of `terms`; an undefined term is left out."""


class ActRules(PointRules[InferencePoint]):
    """UfN and RfN: `move` is 1 if the move is right, `slots` is F1 over the (slot, value) pairs of the point.

    Where there is no slot and none is predicted, `slots` is 1: nothing to say, and nothing said.
    """

    terms = ("move", "slots")

    @property
    def action_space(self) -> spaces.Dict:
        """`move` and `slots`."""
        return act_space()

    def label(self, point: InferencePoint) -> dict[str, Any]:
        """Returns the act of the point."""
        return {"move": int(point.act.move), "slots": np.array(point.act.vector, dtype=np.int8)}

    def score(self, action: Action, point: InferencePoint) -> dict[str, float]:
        """Returns `move` and `slots`."""
        truth, guess = np.array(point.act.vector, dtype=np.bool_), np.asarray(action["slots"], dtype=np.bool_)
        hits, named = int((truth & guess).sum()), int(truth.sum() + guess.sum())
        right = int(action["move"]) == int(point.act.move)
        return {"move": float(right), "slots": 2.0 * hits / named if named else 1.0}


class DecisionRules(PointRules[DecisionPoint]):
    """NfD: `action` is 1 if the action is right, `joint` if the angle is as well, within 15 degrees on the circle.

    Where the recording does not know the angle, `joint` is undefined.
    """

    terms = ("action", "joint")

    @property
    def action_space(self) -> spaces.Dict:
        """`action` and `angle`."""
        return decision_space()

    def label(self, point: DecisionPoint) -> dict[str, Any]:
        """Returns the action of the point, its angle in whole degrees; 0 where the recording does not know it."""
        angle = 0.0 if np.isnan(point.angle) else point.angle
        # 179.6 degrees is nearest to 180, which the space holds as -180.
        return {"action": point.action.nfd_class, "angle": (round(angle) + 180) % 360 - 180}

    def score(self, action: Action, point: DecisionPoint) -> dict[str, float]:
        """Returns `action` and, where the angle is known, `joint`."""
        right = int(action["action"]) == point.action.nfd_class
        if np.isnan(point.angle):
            return {"action": float(right)}
        near = angle_error(float(action["angle"]), point.angle) < ANGLE_TOLERANCE
        return {"action": float(right), "joint": float(right and near)}


RULES: Final[Mapping[Task, PointRules[Any]]] = {
    Task.UFN: ActRules(),
    Task.RFN: ActRules(),
    Task.NFD: DecisionRules(),
}


class PointEnv(gym.Env[Observation, dict[str, Any]]):
    """What recorded and live sessions have in common when a task is played on them point by point.

    An episode is one session. What is predicted never changes what is observed next.

    Attributes:
        task: what is to be predicted.
        limits: sizes of the observation's tables.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["ansi"], "render_fps": 2}  # type: ignore[misc]

    def __init__(self, task: Task, limits: SpaceLimits | None, render_mode: str | None) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or 'ansi'")
        self.task = task
        self.limits = limits or SpaceLimits()
        self.render_mode = render_mode
        self.rules = RULES[task]
        self.observation_space = history_space(task, self.limits)
        self.action_space = self.rules.action_space
        self._points: Iterator[Point] = iter(())
        self._point: Point | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a session and shows its first point."""
        super().reset(seed=seed)
        self._points = self._begin(seed, options or {})
        self._point = next(self._points)
        return self._observe(), self._info()

    def step(self, action: dict[str, Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Scores the prediction at the point that is shown, and shows the next.

        Raises:
            ValueError: the action is malformed; the message names the field.
            gymnasium.error.ResetNeeded: there is no point to predict.
        """
        point = self._point
        if point is None:
            raise ResetNeeded("there is no point to predict: call reset() first")
        check_action(action, self.rules.action_space)
        terms = self.rules.score(action, point)
        self._point = next(self._points, None)
        info = {
            **self._info(),
            "index": point.index,
            "label": self.rules.label(point),
            "reward_terms": terms,
            **self._judge(action, point),
        }
        return self._observe(), sum(terms.values()) / len(terms), self._point is None, False, info

    def render(self) -> str | None:
        """Returns the talk so far and the words to be inferred, one utterance a line."""
        if self.render_mode is None:
            return None
        view = self._view()
        lines: list[str] = [
            f"{move.frame:6d} {move.speaker.value:>11}: {move.span} [{move.act}]" for move in view.moves
        ]
        return "\n".join([*lines, f"{view.frame:6d} {self.task.value:>11}? {view.utterance}"])

    @abstractmethod
    def _begin(self, seed: int | None, options: Mapping[str, Any]) -> Iterator[Point]:
        """Begins a session that has a point, and yields its points as they come."""

    @abstractmethod
    def _now(self) -> tuple[Session, Town | None]:
        """The session that is played, as far as it is known, and its town, where that is known."""

    @abstractmethod
    def _info(self) -> dict[str, Any]:
        """What the infos tell besides the score."""

    def _judge(self, action: Mapping[str, Any], point: Point) -> dict[str, Any]:
        """What the info of a step tells further of a prediction."""
        return {}

    def _view(self) -> PointView:
        return final_view(self._now()[0], self.task) if self._point is None else self._point.view

    def _observe(self) -> Observation:
        view, (session, town) = self._view(), self._now()
        return {**encode_view(view, self.limits), **encode_objects(session, view.frame, town, self.limits)}
