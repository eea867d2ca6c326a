"""What happens in an environment, handed to a writer decision by decision; the environment does not know of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dorothie_gym.envs.compact import compact
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.snapshot import LightStates, actors_around
from dorothie_gym.sessions import SessionWriter


class SessionRecorder:
    """Records what the roles decide, what comes of it, and once a decision what is around the car.

    Args:
        env: an environment that has just been reset; what happened in the reset is recorded at once.
        writer: where it is written.
    """

    def __init__(self, env: DuoWizardEnv, writer: SessionWriter) -> None:
        self._env, self._writer = env, writer
        self._lights = LightStates(env.town)
        self._frame = env.stage.world.frame
        self._append()

    def record(self, actions: Mapping[str, Mapping[str, Any]]) -> None:
        """Records a decision after it has been played.

        Args:
            actions: what the environment was given, by agent.

        Raises:
            SessionError: something of it cannot be written.
            OSError: the folder cannot be written.
        """
        self._writer.add_decision(self._frame, compact(actions, self._env.limits))
        self._append()

    def _append(self) -> None:
        frames, world = self._env.last_frames, self._env.stage.world
        self._writer.append(self._env.last_events, frames)
        self._frame = world.frame
        if len(frames) and frames[-1, 0] == world.frame:
            self._writer.add_actors(world.frame, actors_around(world))
            self._writer.add_lights(world.frame, self._lights.at(world.time))
            self._writer.add_weather(world.frame, world.weather.values)
