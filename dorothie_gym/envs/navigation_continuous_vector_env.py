"""Vectorised `Navigation-continuous-v0`, the result of `gymnasium.make_vec`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.cameras import driver_space
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.driving_vector_env import DrivingVectorEnv
from dorothie_gym.envs.navigation_continuous_v0 import control_space, controls_of, path_space
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.session.config import CameraConfig, RenderView
from dorothie_gym.session.rewards import NavigationWeights, weights_of

if TYPE_CHECKING:
    from dorothie_gym.envs.batched_env import Towns
    from dorothie_gym.tasks.storyboard import StoryboardTemplate


class NavigationContinuousVectorEnv(DrivingVectorEnv):
    """Vectorised `NavigationContinuousEnv`: observations, rewards and infos are those of single environments.

    ## Observation Space
    `Box(-1, 1, (num_envs, n), float32)`, see `NavigationContinuousEnv`; with `observation="camera"`
    `Box(0, 255, (num_envs, 84, 84, 3), uint8)`, drawn on the threads.

    ## Action Space
    `Box(-1, 1, (num_envs, 3), float32)`: throttle, steer and brake of each environment; with `control="acceleration"`
    acceleration and steer.

    ## Episode End
    Like `NavigationContinuousEnv`, with the autoreset modes of `NavigationVectorEnv`.

    ## Arguments
    `num_envs`, `town`, `threads`, `autoreset_mode` and `render_mode` as in `NavigationVectorEnv`, the others as in
    `NavigationContinuousEnv`.

    ## Version History
    - v0: first version.
    """

    def __init__(
        self,
        num_envs: int = 1,
        town: Towns = DEFAULT_TOWN,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        traffic: str = "light",
        exceptions: float = 0.0,
        reward: str | NavigationWeights = "dense",
        max_seconds: float = 600.0,
        patience: float = 60.0,
        decision_frequency: float = 10.0,
        control: str = "pedals",
        observation: str = "vector",
        camera: CameraConfig | None = None,
        render_mode: str | None = None,
        view: str = "role",
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_view: str = RenderView.MAP,
    ) -> None:
        config = NavigationConfig(
            traffic=traffic,
            exceptions=exceptions,
            weights=weights_of(reward),
            max_seconds=max_seconds,
            patience=patience,
            decision_frequency=decision_frequency,
            observation=observation,
            camera=camera,
        )
        super().__init__(
            num_envs, town, storyboard, config, driver_space(config, path_space()), control_space(control), render_mode,
            view, render_view, threads, autoreset_mode, pedals=True,
        )  # fmt: skip

        self.control = control

    def _checked(self, actions: object) -> NDArray[np.float64]:
        return controls_of("actions", actions, self.control, (self.num_envs,))
