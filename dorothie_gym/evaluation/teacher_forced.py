"""The three tasks as Gymnasium environments: history in, prediction out, the record goes on whatever is predicted."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from dorothie_gym.evaluation.history_space import act_space, check_action, decision_space, encode_view, history_space
from dorothie_gym.evaluation.metrics import (
    ActionAccuracy,
    ArgumentAccuracy,
    JointAccuracy,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
)
from dorothie_gym.evaluation.predictions import ActionPredictions, ActPredictions
from dorothie_gym.sessions import (
    DecisionPoint,
    InferencePoint,
    Session,
    SessionError,
    Task,
    View,
    final_view,
    load_sessions,
    nfd_points,
    rfn_points,
    split_by_name,
    ufn_points,
)
from dorothie_gym.spaces import Observation, SpaceLimits

PointT = TypeVar("PointT", InferencePoint, DecisionPoint)
Split = Literal["all", "train", "test"]


class TeacherForcedEnv(gym.Env[Observation, dict[str, Any]], Generic[PointT]):
    """What the three tasks have in common.

    ## Description
    An episode walks through the points of one recorded session. What is predicted never changes what is observed next.

    ## Observation Space
    A dict of what was recorded before the point (see `dorothie_gym.sessions.points`), newest first in the histories:

    | field | shape | content |
    |---|---|---|
    | `utterance` | text | UfN only: the words whose act is to be inferred |
    | `time` | (1,) | of the point [s] |
    | `moves` | (16,) | last moves of both speakers, 15 where there is none |
    | `move_speakers` | (16,) | who spoke: 0 nobody, 1 participant, 2 Co-Wizard |
    | `move_slots`, `move_times` | (16, 69), (16,) | slots in the order of `LABELS`, when it was over [s] |
    | `participant_text`, `co_wizard_text` | text | last utterance of each |
    | `actions` | (16,) | last physical actions, 0 where there is none |
    | `action_angles`, `action_times` | (16,) each | angles [degrees, positive left], when [s] |
    | `pose`, `speed` | (3,), (1,) | car's x, y [m], heading [rad, clockwise]; speed [m/s] |
    | `street_names` | (streets,) | id of each street's `StreetName` |
    | `landmarks` | (landmarks, 6) | those that are not hidden, columns as in `LandmarkColumn` |

    ## Episode End
    Terminated after the session's last point; the last observation is of the whole record.

    ## Arguments
    sessions: a folder of sessions, or the sessions; None takes a few that are played once and kept in a cache.
    split: "all" sessions, or the first half by name ("train"), or the rest ("test").
    limits: sizes of the observation's tables.
    render_mode: None or "ansi".

    `reset(options={"session": n or name})` chooses the session, which is drawn at random otherwise. The infos hold
    `session` (name), `points_left` and, after a step, `index` (number of the event), `label` (in the form of an
    action), `score` (the reward) and `metrics` of the episode so far (None: not defined yet). Sessions without a point
    of the task are left out, and named in `sessions_without_points`.

    Raises:
        SessionError: there are no sessions, one cannot be read, or none has a point of the task.
        ValueError: `split`, `render_mode` or an action is not one of those above, or a session has more landmarks or
            streets than `limits`; the message names the field.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["ansi"], "render_fps": 2}  # type: ignore[misc]
    task: ClassVar[Task]

    def __init__(
        self,
        sessions: Path | str | Sequence[Session] | None = None,
        *,
        split: Split = "all",
        limits: SpaceLimits | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or 'ansi'")
        self.render_mode = render_mode
        self._limits = limits or SpaceLimits()
        chosen = _choose(_find(sessions), split)
        for session in chosen:
            _check_size(session, self._limits)
        found = [(session, tuple(self._points_of(session))) for session in chosen]
        self._sessions: list[tuple[Session, tuple[PointT, ...]]] = [
            (session, points) for session, points in found if points
        ]
        self.sessions_without_points = tuple(session.name for session, points in found if not points)
        if not self._sessions:
            raise SessionError(f"none of the {len(found)} sessions has a point of the task {self.task.value}")
        self.observation_space = history_space(self.task, self._limits)
        self.action_space = self._action_space()
        self._points: tuple[PointT, ...] = ()
        self._actions: list[Mapping[str, Any]] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a session and shows its first point."""
        super().reset(seed=seed)
        self._session, self._points = self._sessions[self._number(options or {})]
        self._actions = []
        return self._observe(), self._info()

    def step(self, action: dict[str, Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Scores the prediction at the point shown, and shows the next."""
        if len(self._actions) >= len(self._points):
            raise ValueError("there is no point to predict: call reset first")
        assert isinstance(self.action_space, spaces.Dict)
        self._actions.append(check_action(action, self.action_space))
        done = self._points[: len(self._actions)]
        point = done[-1]
        reward = self._score(self._actions[-1], point)
        info = {
            **self._info(),
            "index": point.index,
            "label": self._label(point),
            "score": reward,
            "metrics": {
                key: None if np.isnan(value) else value for key, value in self._metrics(self._actions, done).items()
            },
        }
        return self._observe(), reward, len(done) == len(self._points), False, info

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
    def _points_of(self, session: Session) -> Sequence[PointT]:
        """The points of the task in a session that can be scored."""

    @abstractmethod
    def _action_space(self) -> spaces.Dict:
        """The space of predictions."""

    @abstractmethod
    def _label(self, point: PointT) -> dict[str, Any]:
        """The prediction that would be right."""

    @abstractmethod
    def _score(self, action: Mapping[str, Any], point: PointT) -> float:
        """The reward of one prediction."""

    @abstractmethod
    def _metrics(self, actions: Sequence[Mapping[str, Any]], points: Sequence[PointT]) -> dict[str, float]:
        """The metrics of the task over some predictions."""

    def _number(self, options: Mapping[str, Any]) -> int:
        wanted = options.get("session")
        if wanted is None:
            return int(self.np_random.integers(len(self._sessions)))
        names = [session.name for session, _ in self._sessions]
        if isinstance(wanted, str) and wanted in names:
            return names.index(wanted)
        if isinstance(wanted, int) and 0 <= wanted < len(names):
            return wanted
        raise ValueError(f"option 'session' is {wanted!r}; it must be a number below {len(names)} or a session's name")

    def _view(self) -> View:
        if len(self._actions) < len(self._points):
            return self._points[len(self._actions)].view
        return final_view(self._session, self.task)

    def _observe(self) -> Observation:
        return encode_view(self._view(), self._limits)

    def _info(self) -> dict[str, Any]:
        return {"session": self._session.name, "points_left": len(self._points) - len(self._actions)}


class _ActEnv(TeacherForcedEnv[InferencePoint]):
    """The reward and metrics of UfN and RfN."""

    def _action_space(self) -> spaces.Dict:
        return act_space()

    def _label(self, point: InferencePoint) -> dict[str, Any]:
        return {"move": int(point.act.move), "slots": np.array(point.act.vector, dtype=np.int8)}

    def _score(self, action: Mapping[str, Any], point: InferencePoint) -> float:
        return float(int(action["move"]) == int(point.act.move))

    def _metrics(self, actions: Sequence[Mapping[str, Any]], points: Sequence[InferencePoint]) -> dict[str, float]:
        predicted = ActPredictions(
            moves=np.array([action["move"] for action in actions], dtype=np.int64),
            slots=np.array([action["slots"] for action in actions], dtype=np.bool_),
        )
        return {
            "move_accuracy": MoveAccuracy().compute(predicted, points),
            "slot_f1": SlotF1().compute(predicted, points),
            "slot_score_paper": SlotScorePaper().compute(predicted, points),
        }


class UfNEnv(_ActEnv):
    """Understanding from navigation: what does the participant mean?

    ## Action Space
    `move` Discrete(15), `slots` MultiBinary(69).

    ## Rewards
    1 if the move is right, else 0 (its mean is the move accuracy; slots are scored in `info["metrics"]`).

    ## Version History
    v0. The rest as in `TeacherForcedEnv`.
    """

    task = Task.UFN

    def _points_of(self, session: Session) -> Sequence[InferencePoint]:
        return tuple(ufn_points(session))


class RfNEnv(_ActEnv):
    """Response from navigation: what does the Co-Wizard say next?

    ## Action Space
    `move` Discrete(15), `slots` MultiBinary(69).

    ## Rewards
    1 if the move is right, else 0 (its mean is the move accuracy; slots are scored in `info["metrics"]`).

    ## Version History
    v0. The rest as in `TeacherForcedEnv`.
    """

    task = Task.RFN

    def _points_of(self, session: Session) -> Sequence[InferencePoint]:
        return tuple(rfn_points(session))


class NfDEnv(TeacherForcedEnv[DecisionPoint]):
    """Navigation from dialogue: where does the Co-Wizard drive next?

    ## Action Space
    `action` Discrete(6), a class of `PhysicalAction.nfd_class`; `angle` Discrete(360, start=-180), its argument
    [degrees, positive left], 0 for actions that take none.

    ## Rewards
    1 if the action is right and the angle within 15 degrees, on the circle, else 0 (its mean is the joint accuracy).
    Points whose angle the recording does not know are left out, and counted in `points_without_angle`.

    ## Version History
    v0. The rest as in `TeacherForcedEnv`.
    """

    task = Task.NFD
    points_without_angle: int = 0

    def _points_of(self, session: Session) -> Sequence[DecisionPoint]:
        points = tuple(nfd_points(session))
        known = tuple(point for point in points if not np.isnan(point.angle))
        self.points_without_angle += len(points) - len(known)
        return known

    def _action_space(self) -> spaces.Dict:
        return decision_space()

    def _label(self, point: DecisionPoint) -> dict[str, Any]:
        # 179.6 degrees is nearest to 180, which the space holds as -180.
        return {"action": point.action.nfd_class, "angle": (round(point.angle) + 180) % 360 - 180}

    def _score(self, action: Mapping[str, Any], point: DecisionPoint) -> float:
        return JointAccuracy().compute(_decisions([action]), [point])

    def _metrics(self, actions: Sequence[Mapping[str, Any]], points: Sequence[DecisionPoint]) -> dict[str, float]:
        predicted = _decisions(actions)
        return {
            "action_accuracy": ActionAccuracy().compute(predicted, points),
            "argument_accuracy": ArgumentAccuracy().compute(predicted, points),
            "joint_accuracy": JointAccuracy().compute(predicted, points),
        }


def _decisions(actions: Sequence[Mapping[str, Any]]) -> ActionPredictions:
    return ActionPredictions(
        actions=np.array([action["action"] for action in actions], dtype=np.int64),
        angles=np.array([action["angle"] for action in actions], dtype=np.float64),
    )


def _find(sessions: Path | str | Sequence[Session] | None) -> tuple[Session, ...]:
    if sessions is None:
        # Playing sessions needs the environments, which are slow to import: only where it is asked for.
        from dorothie_gym.rollout.corpus import default_corpus

        return load_sessions(default_corpus())
    if isinstance(sessions, Path | str):
        return load_sessions(sessions)
    if not sessions:
        raise SessionError("sessions is empty; give a folder of sessions, some sessions, or None")
    return tuple(sessions)


def _check_size(session: Session, limits: SpaceLimits) -> None:
    for name, size in (("landmarks", limits.landmarks), ("streets", limits.streets)):
        count = len(session.header.landmarks if name == "landmarks" else session.header.street_names)
        if count > size:
            raise ValueError(f"session {session.name} has {count} {name}; SpaceLimits.{name} is {size}: raise it")


def _choose(sessions: tuple[Session, ...], split: Split) -> tuple[Session, ...]:
    if split == "all":
        return sessions
    if split not in ("train", "test"):
        raise ValueError(f"split is {split!r}; it must be 'all', 'train' or 'test'")
    train, test = split_by_name(sessions)
    if not train:
        raise SessionError(f"split {split!r} needs at least 2 sessions, there is {len(sessions)}")
    return train if split == "train" else test
