"""What environments of a drive have in common: town, sessions, pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, TypeAlias, TypeVar

import gymnasium as gym
from numpy.typing import NDArray

from dorothie_gym.navigation.config import NavigationConfig
from dorothie_gym.navigation.drive import Drive
from dorothie_gym.navigation.observations import Vector
from dorothie_gym.tasks import StoryboardTemplate, load_template
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town import Town, load_town

Info: TypeAlias = dict[str, Any]
Action = TypeVar("Action")


class DriveEnv(gym.Env[Vector, Action]):
    """A drive in a town; subclasses say what is observed and what can be done."""

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": ["human", "rgb_array"],
        "render_fps": 2,
    }

    def __init__(
        self, town: str | Path | Town, storyboard: str | Path | StoryboardTemplate | None, config: NavigationConfig,
        render_mode: str | None,
    ) -> None:  # fmt: skip
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(
                f"render_mode is {render_mode!r}; it must be None or one of {self.metadata['render_modes']}"
            )
        self.config, self.render_mode = config, render_mode
        self.town = town if isinstance(town, Town) else load_town(town)
        self.template = load_template(storyboard) if isinstance(storyboard, str | Path) else storyboard
        self._network = TownNetwork(self.town)
        self._drive: Drive | None = None
        self._painter: Any = None

    @property
    def drive(self) -> Drive:
        """The session being played; raises `gymnasium.error.ResetNeeded` before the first reset."""
        if self._drive is None:
            raise gym.error.ResetNeeded("no session is being played: call reset() first")
        return self._drive

    def begin(self, seed: int | None, options: Mapping[str, Any] | None) -> Drive:
        """Begins a session, see `reset`."""
        super().reset(seed=seed)
        session = seed if seed is not None else int(self.np_random.integers(2**31))
        scenario = (options or {}).get("scenario")
        self._drive = Drive.begin(self.town, self._network, self.template, self.config, session, scenario)
        if self.render_mode == "human":
            self.render()
        return self._drive

    def render(self) -> NDArray[Any] | None:
        """Draws the aerial view: an array (800, 1280, 3), or in a window in human mode (then returns None)."""
        if self.render_mode is None:
            raise RuntimeError("render() needs render_mode='rgb_array' or 'human' when the environment is made")
        from dorothie_gym.envs.painter import Painter

        if self._painter is None:
            self._painter = Painter(human=self.render_mode == "human")
        frame: NDArray[Any] | None = self._painter.paint(self.drive.stage)
        return frame

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._painter is not None:
            self._painter.close()
            self._painter = None
