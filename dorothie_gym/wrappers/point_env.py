"""An environment whose steps are the points of a session: history in, prediction out, the truth goes on."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import gymnasium as gym
from gymnasium.error import ResetNeeded

from dorothie_gym.sessions import Point, Session, Task, View, final_view
from dorothie_gym.spaces import Observation, SpaceLimits
from dorothie_gym.world.town import Town
from dorothie_gym.wrappers.history_space import check_action, encode_objects, encode_view, history_space
from dorothie_gym.wrappers.point_rules import RULES


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

    def _view(self) -> View:
        return final_view(self._now()[0], self.task) if self._point is None else self._point.view

    def _observe(self) -> Observation:
        view, (session, town) = self._view(), self._now()
        return {**encode_view(view, self.limits), **encode_objects(session, view.frame, town, self.limits)}
