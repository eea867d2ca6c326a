from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording import Event, Session, SessionHeader
from dorothie_gym.wrappers.record_session import RecordSession
from tests.session.recording.builders import header, rows
from tests.session.recording.dialogues import talk

ROOT = Path(__file__).parents[2]
PERIOD = 15  # frames a decision


class TalkingEnv(ParallelEnv[str, int, int]):
    """Environment that replays the test dialogue, 15 frames per step, without access to the recorder."""

    metadata: dict[str, Any] = {"name": "talking_v0", "render_modes": []}  # noqa: RUF012
    possible_agents = ["participant", "co_wizard"]  # noqa: RUF012

    def __init__(self, steps: int = 20) -> None:
        self.agents: list[str] = []
        self._steps = steps

    def observation_space(self, agent: str) -> spaces.Discrete:
        return spaces.Discrete(1000)

    def action_space(self, agent: str) -> spaces.Discrete:
        return spaces.Discrete(2)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        self.agents = list(self.possible_agents)
        self._seed = 0 if seed is None else seed
        self._frame = 0
        self._show(0, 1)
        return {agent: 0 for agent in self.agents}, {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> Any:
        self._show(self._frame + 1, PERIOD)
        self._frame += PERIOD
        done = self._frame >= self._steps * PERIOD
        agents = self.agents
        self.agents = [] if done else agents
        return (
            {agent: self._frame for agent in agents},
            {agent: 0.0 for agent in agents},
            {agent: done for agent in agents},
            {agent: False for agent in agents},
            {agent: {} for agent in agents},
        )

    def session_header(self) -> SessionHeader:
        return header(seed=self._seed)

    def summary(self) -> dict[str, Any]:
        return {"success": True}

    def close(self) -> None:
        pass

    def _show(self, first: int, count: int) -> None:
        self.last_events: tuple[Event, ...] = tuple(e for e in talk() if first <= e.frame < first + count)
        self.last_frames: NDArray[np.float64] = rows(first, count)


def play(env: Any, steps: int = 20, seed: int = 3) -> list[Any]:
    results = [env.reset(seed=seed)]
    results.extend(env.step({agent: 0 for agent in env.agents}) for _ in range(steps))
    return results


def test_whole_session_is_recorded(tmp_path: Path) -> None:
    env = RecordSession(TalkingEnv(), tmp_path)
    play(env)
    session = Session.load(tmp_path / "seed_3")
    assert env.session_folder == tmp_path / "seed_3"
    assert list(session.events) == talk()
    assert session.trajectory["frame"].tolist() == list(range(301))
    assert (session.complete, session.summary, session.header.seed) == (True, {"success": True}, 3)


def test_recording_does_not_change_the_environment(tmp_path: Path) -> None:
    assert play(RecordSession(TalkingEnv(), tmp_path)) == play(TalkingEnv())


def test_session_left_early_is_incomplete(tmp_path: Path) -> None:
    env = RecordSession(TalkingEnv(), tmp_path)
    play(env, steps=4)
    env.reset(seed=4)
    env.close()
    left = Session.load(tmp_path / "seed_3")
    assert (left.complete, left.trajectory["frame"][-1], len(left.events)) == (False, 60, 6)
    assert not Session.load(tmp_path / "seed_4").complete


def test_two_recordings_are_equal_byte_for_byte(tmp_path: Path) -> None:
    for name in ("one", "other"):
        play(RecordSession(TalkingEnv(), tmp_path / name))
    for file in (tmp_path / "one/seed_3").iterdir():
        assert file.read_bytes() == (tmp_path / "other/seed_3" / file.name).read_bytes()


def test_folder_name_is_configurable_and_existing_one_needs_overwrite(tmp_path: Path) -> None:
    play(RecordSession(TalkingEnv(), tmp_path, name=lambda _: "."))
    assert Session.load(tmp_path).complete
    with pytest.raises(SessionError, match="holds a session already"):
        RecordSession(TalkingEnv(), tmp_path, name=lambda _: ".").reset(seed=3)
    env = RecordSession(TalkingEnv(), tmp_path, name=lambda _: ".", overwrite=True)
    env.reset(seed=5)
    env.close()
    assert Session.load(tmp_path).header.seed == 5


def test_recording_survives_killed_process(tmp_path: Path) -> None:
    code = f"""
        import os
        from tests.wrappers.test_record_session import RecordSession, TalkingEnv
        env = RecordSession(TalkingEnv(), {str(tmp_path)!r})
        env.reset(seed=3)
        for _ in range(7):
            env.step({{agent: 0 for agent in env.agents}})
        os._exit(9)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 9
    session = Session.load(tmp_path / "seed_3")
    assert (session.complete, session.trajectory["frame"][-1]) == (False, 105)
    assert list(session.events) == [event for event in talk() if event.frame <= 105]
