"""Task environment on live sessions: policies play, and a learner predicts their actions at each point."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.prediction_points import Point, task_points
from dorothie_gym.archive.visibility import Task
from dorothie_gym.envs.point_env import PointEnv
from dorothie_gym.errors import SessionError, StateError
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, policy_inputs
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.actor_table import actors_around
from dorothie_gym.session.recorder import LightStates
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.recording.surroundings import Rows, SceneTable, Surroundings, light_rows, weather_rows
from dorothie_gym.session.recording.trajectory import trajectory_of

if TYPE_CHECKING:
    from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.events import Event
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.session.spaces.fields import SpaceLimits

MAX_SILENT_SESSIONS = 20
"""Maximum number of consecutive sessions without a point of the task before an error is raised."""


SNAPSHOTS: Final = 4
"""Number of latest snapshots of the surroundings that are kept; points refer to one of the last two."""


class TeacherForcing(PointEnv):
    """Environment of the three tasks on a live `DuoWizardEnv`.

    ## Description
    Policies play all three roles of a session. At each point of the task the learner predicts the action of the role
    and is rewarded for the agreement with the policy, whose action is executed. Every seed yields another session.

    ## Observation Space
    `history_space` of the task, as in `UfN-v0`, `RfN-v0` and `NfD-v0`: the history before the point.

    ## Action Space
    UfN, RfN: `move` Discrete(15), `slots` MultiBinary(69). NfD: `action` Discrete(6), `angle` Discrete(360,
    start=-180) [degrees, positive left].

    ## Rewards
    The mean of `info["reward_terms"]`, see `dorothie_gym.envs.point_env`.

    ## Episode End
    Terminates at the end of the session; one episode is one session. Sessions without a point are skipped.

    ## Arguments
    - `env`: environment of the session.
    - `task`: `Task` or its value: "ufn", "rfn", "nfd".
    - `policies`: policy of each role: "scripted" (default), "silent", "random", or a `Policy`.
    - `limits`: sizes of the observation tables; None for the sizes of the town.
    - `strict`: whether RfN points hide the earlier acts of the Co-Wizard's own utterance; no effect on other tasks.
    - `render_mode`: None or "ansi".

    `reset(seed=...)` plays the same session as `DuoWizardEnv` and `play_session` with this seed. The infos hold
    `session` (its name) and `seed`; of the last step `index` (number of the event), `label` and `reward_terms`, as in
    `TeacherForcedEnv`.

    Raises:
        ValueError: if `task`, `policies`, `render_mode` or an action is invalid; the message names the field.
        SessionError: if the policies produce no point of the task.

    ## Version History
    v0.
    """

    def __init__(
        self,
        env: DuoWizardEnv,
        task: Task | str,
        *,
        policies: Mapping[Role | str, str | AnyPolicy] | None = None,
        limits: SpaceLimits | None = None,
        strict: bool = False,
        render_mode: str | None = None,
    ) -> None:
        if task not in set(Task):
            raise ValueError(f"task is {str(task)!r}; it must be one of {', '.join(Task)}")
        super().__init__(Task(task), limits or env.limits, render_mode)
        self.duo, self._strict = env, strict
        self.policies = _cast(policies or {}, env)
        self._record: _Record

    def close(self) -> None:
        """Closes the wrapped environment."""
        self.duo.close()

    def __getstate__(self) -> dict[str, object]:
        raise StateError(
            "a session that is played while it is predicted cannot be copied: copy the wrapped DuoWizardEnv, or record "
            "the session and use UfN-v0, RfN-v0 or NfD-v0"
        )

    def mutable_values(self) -> dict[str, object]:
        """Raises `StateError`: the policies that play the session are in the middle of their steps."""
        return self.__getstate__()

    def _begin(self, seed: int | None, options: Mapping[str, object]) -> Iterator[Point]:
        for _ in range(MAX_SILENT_SESSIONS):
            chosen = seed if seed is not None else int(self.np_random.integers(2**31))
            points = self._play(chosen, options)
            first = next(points, None)
            if first is not None:
                return _before(first, points)
            seed = None  # the next is drawn
        raise SessionError(
            f"task {self.task}: {MAX_SILENT_SESSIONS} sessions had no point; give policies that talk and drive"
        )

    def _play(self, seed: int, options: Mapping[str, object]) -> Iterator[Point]:
        """Plays a session and yields each point at its time."""
        self.duo.reset(seed=seed, options=dict(options))
        session_seed = self.duo.scenario.seed
        states = {
            role: policy.initial_state(policy_seed(session_seed, role), self.duo.town)
            for role, policy in self.policies.items()
        }
        self._record = _Record(self.duo)
        asked = -1
        while True:
            if self._record.append():
                session = self._record.session()
                for point in task_points(session, self.task, since=asked + 1, strict=self._strict):
                    asked = point.index
                    yield point
            if not self.duo.agents:
                return
            inputs, actions = policy_inputs(self.duo.engine, self.policies), {}
            for role, policy in self.policies.items():
                actions[str(role)], states[role] = policy.step(inputs[role], states[role])
            self.duo.step(actions)

    def _now(self) -> tuple[Session, Town | None]:
        return self._record.session(), self.duo.town

    def _info(self) -> StepInfo:
        header = self._record.header
        return {"session": self._record.session().name, "seed": header.seed}


class _Record:
    """Record of the current session so far, with the content that `SessionRecorder` writes."""

    def __init__(self, env: DuoWizardEnv) -> None:
        self.header = env.session_header()
        self._env = env
        self._lights = LightStates(env.town)
        self._events: list[Event] = []
        self._rows: list[NDArray[np.float64]] = []
        self._snapshots: deque[_Snapshot] = deque(maxlen=SNAPSHOTS)
        self._session: Session | None = None

    def append(self) -> bool:
        """Adds the last decision; returns whether it may contain a point."""
        events, rows, world = self._env.last_events, self._env.last_frames, self._env.session.world
        self._events += events
        self._rows.append(rows.copy())
        if len(rows) and rows[-1, 0] == world.frame:
            lights = light_rows(self._lights.at(world.time))
            self._snapshots.append(
                _Snapshot(world.frame, actors_around(world), lights, weather_rows(world.weather.values))
            )
        self._session = None
        return any(event.flagged for event in events)

    def session(self) -> Session:
        """Returns the session so far, with the latest snapshots of the surroundings only."""
        if self._session is None:
            self._session = Session(
                header=self.header,
                events=tuple(self._events),
                trajectory=trajectory_of(np.concatenate(self._rows)),
                complete=False,
                scene=self._scene(),
            )
        return self._session

    def _scene(self) -> Surroundings:
        if not self._snapshots:
            return Surroundings()
        frames = np.array([snapshot.frame for snapshot in self._snapshots], dtype=np.int64)
        return Surroundings(
            actors=_table(frames, [snapshot.actors for snapshot in self._snapshots]),
            lights=_table(frames, [snapshot.lights for snapshot in self._snapshots]),
            weather=_table(frames, [snapshot.weather for snapshot in self._snapshots]),
        )


def _table(frames: NDArray[np.int64], rows: list[Rows]) -> SceneTable:
    offsets = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
    return SceneTable(frames, offsets, np.concatenate(rows))


@dataclass(frozen=True)
class _Snapshot:
    """Snapshot of the surroundings of the car at a frame."""

    frame: int
    actors: Rows
    lights: Rows
    weather: Rows


def _before(first: Point, others: Iterator[Point]) -> Iterator[Point]:
    yield first
    yield from others


def _cast(wanted: Mapping[Role | str, str | AnyPolicy], env: DuoWizardEnv) -> dict[Role, AnyPolicy]:
    for name in wanted:
        if name not in AGENT_ROLES:
            raise ValueError(f"policies has {str(name)!r}; the roles are {', '.join(AGENT_ROLES)}")
    cast: dict[Role, AnyPolicy] = {}
    for role in AGENT_ROLES:
        policy = wanted.get(role, "scripted")
        cast[role] = make_policy(policy, role, env.limits) if isinstance(policy, str) else policy
        if cast[role].role is not role:
            raise ValueError(f"policies has one of {cast[role].role} for {role}")
    return cast
