"""`Navigation-v0`: driving as the Co-Wizard, for reinforcement learning."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.cameras import DriverObservation, driver_space
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.env import DrivingEnv
from dorothie_gym.envs.session_view import metadata_at
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.policies.navigation.actions import ACTIONS
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.observation_fields import DECISION_FREQUENCY, navigation_space
from dorothie_gym.session.rewards import NavigationWeights, weights_of
from dorothie_gym.support.action_values import whole_number

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.config import CameraConfig
    from dorothie_gym.session.scenario import ResetOptions
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.tasks.storyboard import StoryboardTemplate


class NavigationEnv(DrivingEnv[np.int64]):
    """Driving as the Co-Wizard; a built-in participant guides, and the Ad-Wizard may interfere.

    ## Description
    A session of `DuoWizardEnv` with its town, storyboard, traffic and weather, in which the agent chooses only the
    physical actions of the Co-Wizard. The participant is a built-in instructor that guides by dialogue acts with slots;
    the scripted Ad-Wizard plays the exceptions. The belief updates (mental actions) of the Co-Wizard are made
    automatically: the named goal becomes its goal, so that the car slows down near it.

    ## Observation Space
    `Box(-1, 1, (n,), float32)`: see `dorothie_gym.policies.navigation.FIELDS` and, for the slices, `layout()`.
    The vector depends only on the Co-Wizard's observation, the map, and the instructions.

    With `observation="camera"`, `Box(0, 255, (84, 84, 3), uint8)`: the picture of the car's camera, above a dashboard
    in the lowest rows. From the left: icon of the instruction (an arrow into the sector of a turn, lane switch, U-turn,
    stop, start), or needle to the goal that was named; icon of the manoeuvre that the car prepares, in green; distance
    to the instruction's place on gauges of 112 m and 28 m (red once past it), or to the goal on one of 560 m; speed
    (white) and cruise speed (blue) on gauges of 28 m/s, with red marks at the limit; lamps for a hazard ahead and the
    headlights.

    ## Action Space
    `Discrete(18)`: see `NavigationAction`. `info["action_mask"]` marks the feasible actions (int8, for
    `action_space.sample(mask)`), and so does `action_masks()`, which sb3-contrib calls. A turn, lane switch or U-turn
    that is being prepared continues when it is chosen again. An infeasible action is refused and reported in
    `info["refused"]`.

    ## Rewards
    The sum of the terms in `info["reward_terms"]`, see `NavigationWeights`: progress, subgoals, success, collisions,
    infractions, time, refusals.

    ## Episode End
    Terminates when the destination, the last subgoal, is reached (the car stands within 2 m of its waypoint), or when
    the participant gives up because the car has made no progress for `patience` seconds. Truncates after
    `max_seconds`. At the end `info["is_success"]` reports whether every subgoal was reached and nothing was hit, and
    `info["reason"]` is "arrived", "gave up" or "out of time".

    ## Arguments
    - `town`: name of a town, path of an `.xodr` or `.yaml` file, or a `Town`. `"generated:SEED"` is a generated town;
      `"generated"` is another one for each seed of a session.
    - `storyboard`: name of a template, path of a `.json` file, or a `StoryboardTemplate`; None draws one each reset.
    - `guidance`: "turns" (before each junction) or "goals" (by name, where the place is on the Co-Wizard's map).
    - `traffic`: "none", "light", "medium" or "heavy".
    - `exceptions`: average number of exceptions in a session, 0 to 4.
    - `reward`: "dense", "careful" (a collision counts three times as much), "sparse" or `NavigationWeights`.
    - `max_seconds`, `patience`: see above [s].
    - `observation`: "vector" or "camera".
    - `camera`: `CameraConfig` of the pictures that are observed; None for 84 x 84 pixels.
    - `render_mode`: None, `"rgb_array"` or `"human"`.
    - `view`: picture of `render()`: `"role"` (what the Co-Wizard observes, and the instructions) or `"session"`
      (the whole session).
    - `render_view`: `"map"`, `"camera"` (the windscreen) or `"both"`, side by side.

    `reset(seed=...)` plays the scenario of `DuoWizardEnv` for this seed; `reset(options={"scenario": Scenario})`
    plays a given one.

    ## Version History
    - v0: first version.
    """

    metadata = metadata_at(DECISION_FREQUENCY)

    def __init__(
        self,
        town: str | Path | Town = DEFAULT_TOWN,
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
        render_view: str = "map",
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
        super().__init__(town, storyboard, config, render_mode, view, render_view, pedals=False)
        self.action_space = spaces.Discrete(len(ACTIONS))
        self.observation_space = driver_space(config, navigation_space())

    def reset(
        self, *, seed: int | None = None, options: ResetOptions | None = None
    ) -> tuple[DriverObservation, StepInfo]:
        """Begins a session.

        Args:
            seed: seed of the session; None draws one.
            options: `scenario` plays a given `Scenario`; other options cause a warning.
        """
        return self._begin(seed, options)

    def step(self, action: np.int64 | int) -> tuple[DriverObservation, float, bool, bool, StepInfo]:
        """Plays one decision.

        Raises:
            ValueError: the action is not a `NavigationAction`.
            gymnasium.error.ResetNeeded: no session has begun, or it has ended.
        """
        self._check_begun()
        return self._play(whole_number("action", action, 0, len(ACTIONS) - 1))

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns which actions are feasible now (18,); called by the algorithms of sb3-contrib."""
        mask: NDArray[np.bool_] = np.zeros(len(ACTIONS), dtype=np.bool_)
        if self.batch.has_begun:
            mask[:] = self.batch.masks[0]
        return mask

    def _info(self) -> StepInfo:
        return {"action_mask": self.batch.masks[0].copy(), **super()._info()}
