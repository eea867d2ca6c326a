"""How a prediction at a point is made and what it earns: the rules of the three tasks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import numpy as np
from gymnasium import spaces

from dorothie_gym.sessions import ANGLE_TOLERANCE, DecisionPoint, InferencePoint, Task, angle_error
from dorothie_gym.wrappers.history_space import act_space, decision_space

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
