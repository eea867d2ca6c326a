"""Vectorised `Navigation-v0`, the result of `gymnasium.make_vec`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.cameras import driver_space
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.driving_vector_env import DrivingVectorEnv
from dorothie_gym.errors import short_repr
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.observation_fields import navigation_space
from dorothie_gym.session.config import CameraConfig, RenderView
from dorothie_gym.session.rewards import NavigationWeights, weights_of
from dorothie_gym.support.action_values import as_array
from dorothie_gym.support.vector_infos import Infos, masked_infos

if TYPE_CHECKING:
    from dorothie_gym.envs.batched_env import Towns
    from dorothie_gym.envs.navigation.batch import DrivingBatch
    from dorothie_gym.tasks.storyboard import StoryboardTemplate


class NavigationVectorEnv(DrivingVectorEnv):
    """Vectorised `NavigationEnv`: observations, rewards, masks and infos are those of single environments.

    ## Observation Space
    `Box(-1, 1, (num_envs, 161), float32)`, see `NavigationEnv`; with `observation="camera"`
    `Box(0, 255, (num_envs, 84, 84, 3), uint8)`, drawn on the threads.

    ## Action Space
    `MultiDiscrete([18] * num_envs)`. `infos["action_mask"]` (num_envs, 18) marks the feasible actions, and so does
    `action_masks()`, which sb3-contrib calls.

    ## Episode End
    Like `NavigationEnv`. `metadata["autoreset_mode"]` selects the reset: by default an environment that ended is reset
    by the next step, whose action it ignores.

    ## Arguments
    - `num_envs`: number of environments.
    - `town`: a town as in `NavigationEnv`, or a sequence of towns over which the environments cycle. `"generated"`
      stands for the first generated towns: one for each environment, at most 64.
    - `threads`: maximum number of threads that step the environments, by default one per processor.
    - `autoreset_mode`: Gymnasium's. `options["reset_mask"]` of `reset` resets some environments only.
    - `render_mode`: None or `"rgb_array"`; `render()` draws the first environment, `render_one(number)` any.
    - The others as in `NavigationEnv`.

    ## Version History
    - v0: first version.
    """

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = (*DrivingVectorEnv.MUTABLE_ATTRIBUTES, "_masks")

    def __init__(
        self,
        num_envs: int = 1,
        town: Towns = DEFAULT_TOWN,
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        guidance: Guidance | str = Guidance.TURNS,
        traffic: str = "light",
        exceptions: float = 0.0,
        reward: str | NavigationWeights = "dense",
        max_seconds: float = 600.0,
        patience: float = 60.0,
        observation: str = "vector",
        camera: CameraConfig | None = None,
        render_mode: str | None = None,
        view: str = "role",
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_view: str = RenderView.MAP,
    ) -> None:
        config = NavigationConfig(
            guidance=guidance,
            traffic=traffic,
            exceptions=exceptions,
            weights=weights_of(reward),
            max_seconds=max_seconds,
            patience=patience,
            observation=observation,
            camera=camera,
        )
        super().__init__(
            num_envs, town, storyboard, config, driver_space(config, navigation_space()), spaces.Discrete(len(ACTIONS)),
            render_mode, view, render_view, threads, autoreset_mode, pedals=False,
        )  # fmt: skip
        self._masks = np.zeros((num_envs, len(ACTIONS)), dtype=np.int8)

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns which actions are feasible now (num_envs, 18)."""
        return self._masks.astype(np.bool_)

    def _checked(self, actions: object) -> NDArray[np.int64]:
        found = as_array("actions", actions)
        if found.shape != (self.num_envs,) or found.dtype.kind not in "iu":
            raise ValueError(f"actions is {short_repr(found)}; it must be {self.num_envs} whole numbers")
        if found.min() < 0 or found.max() >= len(ACTIONS):
            raise ValueError(f"actions is {short_repr(found)}; the numbers must be in 0..{len(ACTIONS) - 1}")
        return found.astype(np.int64)

    def _note(self, batch: DrivingBatch, members: NDArray[np.int64], rows: slice | list[int] = slice(None)) -> None:
        super()._note(batch, members, rows)
        self._masks[members[rows]] = batch.masks[rows]

    def _infos(self, mask: NDArray[np.bool_]) -> Infos:
        return {**masked_infos({"action_mask": self._masks}, mask), **super()._infos(mask)}
