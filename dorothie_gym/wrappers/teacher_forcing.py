"""A task on a live session: policies play, a learner is asked at each point, the policies' truth goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.engine.recorder import LightStates, actors_around
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.policies.policy import policy_seed
from dorothie_gym.recording import Event, Point, Scene, SceneTable, Session, Task, task_points, trajectory_of
from dorothie_gym.recording.surroundings import Rows, light_rows, weather_rows
from dorothie_gym.spaces import SpaceLimits
from dorothie_gym.wrappers.point_env import PointEnv

MOST_SILENT = 20
"""After so many sessions in a row without a point of the task, it is clear that the policies make none."""


LOOKS: Final = 4
"""Looks around that are kept: a point of a decision sees the one before, or the one before that."""


class TeacherForcing(PointEnv):
    """The three tasks over a live `DuoWizardEnv`.

    ## Description
    Policies play a session for all three roles. At each point of the task the learner is asked what the role does; it
    earns what its answer is worth beside what the policy did, which is what happens. So there are as many sessions to
    learn from as there are seeds.

    ## Observation Space
    As of `dorothie_gym.benchmark.TeacherForcedEnv`: what was there before the point, in `history_space` of the task.

    ## Action Space
    UfN, RfN: `move` Discrete(15), `slots` MultiBinary(69). NfD: `action` Discrete(6), `angle` Discrete(360,
    start=-180) [degrees, positive left].

    ## Rewards
    The mean of `info["reward_terms"]`, see `dorothie_gym.wrappers.point_env`.

    ## Episode End
    Terminated when the session is over; one episode is one session. A session without a point is passed over.

    ## Arguments
    - `env`: where the session is played.
    - `task`: `Task` or its value: "ufn", "rfn", "nfd".
    - `policies`: who plays, by role: "scripted" (default), "silent", "random", or a `Policy`.
    - `limits`: sizes of the observation's tables; those of the town's where None.
    - `render_mode`: None or "ansi".

    `reset(seed=...)` plays the session that `DuoWizardEnv` and `play_session` have for this seed. The infos hold
    `session` (its name) and `seed`; after a step `index` (number of the event), `label` and `reward_terms`.

    Raises:
        ValueError: `task`, `policies`, `render_mode` or an action is none of those above; the message names the field.
        SessionError: the policies make no point of the task.

    ## Version History
    v0.
    """

    def __init__(
        self,
        env: DuoWizardEnv,
        task: Task | str,
        *,
        policies: Mapping[Role | str, str | Policy[Any]] | None = None,
        limits: SpaceLimits | None = None,
        render_mode: str | None = None,
    ) -> None:
        if task not in set(Task):
            raise ValueError(f"task is {str(task)!r}; it must be one of {', '.join(Task)}")
        super().__init__(Task(task), limits or env.limits, render_mode)
        self.duo = env
        self.policies = _cast(policies or {}, env)
        self._record: _Record

    def close(self) -> None:
        """Closes the environment inside."""
        self.duo.close()

    def _begin(self, seed: int | None, options: Mapping[str, Any]) -> Iterator[Point]:
        for _ in range(MOST_SILENT):
            chosen = seed if seed is not None else int(self.np_random.integers(2**31))
            points = self._play(chosen, options)
            first = next(points, None)
            if first is not None:
                return _before(first, points)
            seed = None  # the next is drawn
        raise SessionError(f"task {self.task}: {MOST_SILENT} sessions had no point; give policies that talk and drive")

    def _play(self, seed: int, options: Mapping[str, Any]) -> Iterator[Point]:
        """Plays a session, and yields each point as it happens."""
        observations, _ = self.duo.reset(seed=seed, options=dict(options))
        session_seed = self.duo.scenario.seed
        states = {
            role: policy.initial_state(policy_seed(session_seed, role), self.duo.town)
            for role, policy in self.policies.items()
        }
        self._record = _Record(self.duo)
        asked = -1
        while True:
            if self._record.append():
                for point in task_points(self._record.session(), self.task, since=asked + 1):
                    asked = point.index
                    yield point
            if not self.duo.agents:
                return
            actions = {}
            for role, policy in self.policies.items():
                actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
            observations, *_ = self.duo.step(actions)

    def _now(self) -> tuple[Session, Town | None]:
        return self._record.session(), self.duo.town

    def _info(self) -> dict[str, Any]:
        header = self._record.header
        return {"session": self._record.session().name, "seed": header.seed}


class _Record:
    """What has happened so far in a session that is being played, as `SessionRecorder` would write it down."""

    def __init__(self, env: DuoWizardEnv) -> None:
        self.header = env.session_header()
        self._env = env
        self._lights = LightStates(env.town)
        self._events: list[Event] = []
        self._rows: list[NDArray[np.float64]] = []
        self._looks: deque[_Look] = deque(maxlen=LOOKS)
        self._session: Session | None = None

    def append(self) -> bool:
        """Adds what the last decision brought; returns whether there may be a point in it."""
        events, rows, world = self._env.last_events, self._env.last_frames, self._env.stage.world
        self._events += events
        self._rows.append(rows.copy())
        if len(rows) and rows[-1, 0] == world.frame:
            lights = light_rows(self._lights.at(world.time))
            self._looks.append(_Look(world.frame, actors_around(world), lights, weather_rows(world.weather.values)))
        self._session = None
        return any(event.flagged for event in events)

    def session(self) -> Session:
        """Returns the session so far, of its surroundings the last looks only."""
        if self._session is None:
            self._session = Session(
                header=self.header,
                events=tuple(self._events),
                trajectory=trajectory_of(np.concatenate(self._rows)),
                complete=False,
                scene=self._scene(),
            )
        return self._session

    def _scene(self) -> Scene:
        if not self._looks:
            return Scene()
        frames = np.array([look.frame for look in self._looks], dtype=np.int64)
        return Scene(
            actors=_table(frames, [look.actors for look in self._looks]),
            lights=_table(frames, [look.lights for look in self._looks]),
            weather=_table(frames, [look.weather for look in self._looks]),
        )


def _table(frames: NDArray[np.int64], rows: list[Rows]) -> SceneTable:
    offsets = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
    return SceneTable(frames, offsets, np.concatenate(rows))


@dataclass(frozen=True)
class _Look:
    """What was around the car at a frame."""

    frame: int
    actors: Rows
    lights: Rows
    weather: Rows


def _before(first: Point, others: Iterator[Point]) -> Iterator[Point]:
    yield first
    yield from others


def _cast(wanted: Mapping[Role | str, str | Policy[Any]], env: DuoWizardEnv) -> dict[Role, Policy[Any]]:
    for name in wanted:
        if name not in AGENT_ROLES:
            raise ValueError(f"policies has {str(name)!r}; the roles are {', '.join(AGENT_ROLES)}")
    cast: dict[Role, Policy[Any]] = {}
    for role in AGENT_ROLES:
        policy = wanted.get(role, "scripted")
        cast[role] = make_policy(policy, role, env.limits) if isinstance(policy, str) else policy
        if cast[role].role is not role:
            raise ValueError(f"policies has one of {cast[role].role} for {role}")
    return cast
