"""`Navigation-continuous-v0`: driving with throttle, steering and brake, for reinforcement learning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.cameras import DriverObservation, driver_space
from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.continuous_control import CONTINUOUS_FIELD_SPECS, CONTINUOUS_FIELDS
from dorothie_gym.envs.navigation.env import DrivingEnv
from dorothie_gym.envs.session_view import metadata_at
from dorothie_gym.errors import short_repr
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.session.rewards import NavigationWeights, weights_of
from dorothie_gym.session.spaces.fields import FieldSpec, signal
from dorothie_gym.support.action_values import real_numbers

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.observation_fields import Vector
    from dorothie_gym.session.config import CameraConfig
    from dorothie_gym.session.scenario import ResetOptions
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

__all__ = [
    "ACCELERATION_SPECS", "CONTINUOUS_FIELDS", "CONTINUOUS_FIELD_SPECS", "CONTROLS", "CONTROL_SPECS",
    "NavigationContinuousEnv", "control_space", "controls_of", "path_space",
]  # fmt: skip

CONTROL_SPECS = (
    signal("throttle", 1, meaning="share of full throttle; negative values count as 0"),
    signal("steer", 1, meaning="share of the greatest steering angle, positive right"),
    signal("brake", 1, meaning="share of full braking; negative values count as 0"),
)
"""Fields of the action, in order."""

ACCELERATION_SPECS = (
    signal("acceleration", 1, meaning="share of full throttle; negative: of full braking"),
    CONTROL_SPECS[1],
)
"""Fields of the action with `control="acceleration"`, in order."""

CONTROLS: Mapping[str, tuple[FieldSpec, ...]] = {"pedals": CONTROL_SPECS, "acceleration": ACCELERATION_SPECS}
"""Fields of the action by the name of the control."""


def control_space(control: str) -> spaces.Space[NDArray[np.float32]]:
    """Returns the action space of one of `CONTROLS`; raises `ValueError` for another name."""
    if control not in CONTROLS:
        raise ValueError(f"control is {short_repr(control)}; it must be one of {', '.join(CONTROLS)}")
    return spaces.Box(-1.0, 1.0, (len(CONTROLS[control]),), dtype=np.float32)


def path_space() -> spaces.Space[Vector]:
    """Returns the observation space: a vector of all `CONTINUOUS_FIELDS`."""
    return spaces.Box(-1.0, 1.0, (sum(CONTINUOUS_FIELDS.values()),), dtype=np.float32)


def controls_of(name: str, action: object, control: str, count: tuple[int, ...] = ()) -> NDArray[np.float64]:
    """Returns throttle, steer and brake of actions (*count, 3), negative throttle and brake as 0.

    Args:
        name: name of the argument.
        action: the actions.
        control: one of `CONTROLS`.
        count: shape of the batch.

    Raises:
        ValueError: they are not finite numbers of the right shape.
    """
    fields = [field.name for field in CONTROLS[control]]
    shape = (*count, len(fields))
    values = real_numbers(name, action, shape, f"finite numbers {shape}: {', '.join(fields)}")
    if control == "acceleration":
        values = np.stack((values[..., 0], values[..., 1], -values[..., 0]), axis=-1)
    return np.clip(values, (0.0, -1.0, 0.0), 1.0)


class NavigationContinuousEnv(DrivingEnv[NDArray[np.float32]]):
    """Driving with throttle, steering and brake.

    ## Description
    Like `NavigationEnv`, guided turn by turn, but the agent controls the car itself: it follows the path, keeps to the
    limits, and stops for lights, people and vehicles, and at the goals. Instructions become the path ahead: turns, lane
    switches and U-turns are planned for the driver.

    ## Observation Space
    `Box(-1, 1, (n,), float32)`, see `dorothie_gym.envs.navigation_continuous_v0.CONTINUOUS_FIELDS`.

    With `observation="camera"`, `Box(0, 255, (84, 84, 3), uint8)` as in `NavigationEnv`. The dashboard shows
    the instruction, the speed that the path allows instead of the cruise speed, and the steering wheel instead of the
    lamps.

    ## Action Space
    `Box(-1, 1, (3,), float32)`: throttle, steer (positive right) and brake; negative throttle and brake count as 0.
    With `control="acceleration"`, `Box(-1, 1, (2,), float32)`: acceleration and steer; negative acceleration is
    braking.

    ## Rewards
    Like `NavigationEnv`.

    ## Episode End
    Like `NavigationEnv`; it also terminates when the car is 15 m off the road (`info["reason"]` is "left the road").

    ## Arguments
    Like `NavigationEnv` without `guidance`, and:

    - `decision_frequency` [Hz], which divides 30.
    - `control`: "pedals" or "acceleration", with which random actions explore more: a car whose throttle and brake
      are drawn independently hardly moves.

    ## Version History
    - v0: first version.
    """

    metadata = metadata_at(10.0)

    def __init__(
        self,
        town: str | Path | Town = DEFAULT_TOWN,
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
        render_view: str = "map",
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
        super().__init__(town, storyboard, config, render_mode, view, render_view, pedals=True)
        self.action_space, self.observation_space = control_space(control), driver_space(config, path_space())
        self.control = control

    def reset(
        self, *, seed: int | None = None, options: ResetOptions | None = None
    ) -> tuple[DriverObservation, StepInfo]:
        """Begins a session; see `NavigationEnv.reset`."""
        return self._begin(seed, options)

    def step(self, action: NDArray[np.float32]) -> tuple[DriverObservation, float, bool, bool, StepInfo]:
        """Plays one decision.

        Raises:
            ValueError: the action does not consist of as many finite numbers as the action space.
            gymnasium.error.ResetNeeded: no session has begun, or it has ended.
        """
        values = controls_of("action", action, self.control)
        self._check_begun()
        return self._play(values)
