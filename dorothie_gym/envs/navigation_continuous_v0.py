"""`Navigation-continuous-v0`: driving with throttle, steering and brake, for reinforcement learning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.envs.continuous_observation import CONTINUOUS_FIELDS, observe_continuous
from dorothie_gym.envs.driving_session import DrivingEnv, DrivingSession, Info, NavigationMask
from dorothie_gym.envs.navigation_config import NavigationConfig, NavigationWeights, weights_of
from dorothie_gym.maps import Town
from dorothie_gym.ontology import ActionValue, PhysicalAction, Role
from dorothie_gym.policies.navigation.actions import LEFT, RIGHT
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import SECTORS
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.sim.ego.limits import VehicleControl
from dorothie_gym.spaces import CoWizardAction, Physical
from dorothie_gym.spaces.fields import signal
from dorothie_gym.tasks import StoryboardTemplate

LOST = 4.0
"""Distance from the path beyond which a new path from the present lane is planned [m]."""

END = 2.0
"""Distance to the end of the path within which a new one is planned [m]."""

LATE = 5.0
"""Distance behind its planned place from which on a manoeuvre is no longer prepared [m]."""

CONTROL_SPECS = (
    signal("throttle", 1, meaning="share of full throttle; negative values count as 0"),
    signal("steer", 1, meaning="share of the greatest steering angle, positive right"),
    signal("brake", 1, meaning="share of full braking; negative values count as 0"),
)
"""Fields of the action, in order."""

_MANOEUVRES = {
    ActionValue.J_TURN: PhysicalAction.J_TURN,
    ActionValue.LANE_SWITCH: PhysicalAction.LANE_SWITCH,
    ActionValue.U_TURN: PhysicalAction.U_TURN,
}


class NavigationContinuousEnv(DrivingEnv[NDArray[np.float32]]):
    """Driving with throttle, steering and brake.

    ## Description
    As `NavigationEnv`, guided turn by turn, but the agent controls the car itself: it follows the path, keeps to the
    limits, and stops for lights, people and vehicles, and at the goals. Instructions become the path ahead: turns, lane
    switches and U-turns are planned for the driver.

    ## Observation Space
    `Box(-1, 1, (n,), float32)`, see `dorothie_gym.envs.continuous_observation.CONTINUOUS_FIELDS`.

    ## Action Space
    `Box(-1, 1, (3,), float32)`: throttle, steer (positive right) and brake; negative throttle and brake count as 0.

    ## Rewards
    As `NavigationEnv`.

    ## Episode End
    As `NavigationEnv`; it also terminates when the car is 15 m off the road (`info["reason"]` is "left the road").

    ## Arguments
    As `NavigationEnv` without `guidance`, and `decision_frequency` [Hz], which divides 30.

    ## Version History
    - v0: first version.
    """

    def __init__(
        self,
        town: str | Path | Town = "brookside",
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        traffic: str = "light",
        exceptions: float = 0.0,
        reward: str | NavigationWeights = "dense",
        max_seconds: float = 600.0,
        patience: float = 60.0,
        decision_frequency: float = 10.0,
        render_mode: str | None = None,
    ) -> None:
        config = NavigationConfig(
            traffic=traffic, exceptions=exceptions, weights=weights_of(reward), max_seconds=max_seconds,
            patience=patience, decision_frequency=decision_frequency,
        )  # fmt: skip
        super().__init__(town, storyboard, config, render_mode)
        self.action_space = spaces.Box(-1.0, 1.0, (len(CONTROL_SPECS),), dtype=np.float32)
        self.observation_space = spaces.Box(-1.0, 1.0, (sum(CONTINUOUS_FIELDS.values()),), dtype=np.float32)
        self._controls: NavigationMask | None = None

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Vector, Info]:
        """Begins a session; see `NavigationEnv.reset`."""
        drive = self.begin(seed, options)
        self._controls = NavigationMask(drive.session.world, drive.exits)
        drive.session.world.ego.manual = VehicleControl(throttle=0.0, steer=0.0, brake=0.0)
        return self._observe(drive), drive.info()

    def step(self, action: NDArray[np.float32]) -> tuple[Vector, float, bool, bool, Info]:
        """Plays one decision.

        Raises:
            ValueError: the action does not consist of three finite numbers.
            gymnasium.error.ResetNeeded: no session is in progress, or it is over.
        """
        values = np.asarray(action, dtype=np.float64)
        if values.shape != (3,) or not np.isfinite(values).all():
            raise ValueError(f"action is {action}; it must be three numbers: throttle, steer, brake")
        throttle, steer, brake = np.clip(values, (0.0, -1.0, 0.0), 1.0).tolist()
        drive = self.drive
        drive.session.world.ego.manual = VehicleControl(throttle=throttle, steer=steer, brake=brake)
        drive.play(CoWizardAction(physical=self._prepare(drive)))
        self._keep_path(drive)
        if self.render_mode == "human":
            self.render()
        return self._observe(drive), drive.reward, drive.terminated, drive.truncated, drive.info()

    def _observe(self, drive: DrivingSession) -> Vector:
        return observe_continuous(drive.session.world, drive.seen[Role.CO_WIZARD], drive.heard, self.config.max_seconds)

    def _prepare(self, drive: DrivingSession) -> Physical | None:
        """Returns the manoeuvre of the last instruction, if it is not part of the path yet."""
        told, planner = drive.heard.instruction, drive.session.world.planner
        if told is None or told.action not in _MANOEUVRES or planner.in_manoeuvre:
            return None
        action = _MANOEUVRES[told.action]
        left = told.distance - drive.heard.driven
        if left < -LATE or planner.manoeuvre[0] is action is not PhysicalAction.J_TURN:
            return None
        if action is PhysicalAction.U_TURN:
            may = planner.may_turn_round(float(drive.session.world.car.speed))
            return Physical(action=action) if may else None
        angle = self._angle(told)
        if angle is None or (action is PhysicalAction.J_TURN and planner.turn_ahead == angle):
            return None
        return Physical(action=action, angle=angle)

    def _angle(self, told: NavigationInstruction) -> int | None:
        """Returns the angle of the instructed turn or lane switch [degrees, positive left], or None."""
        assert self._controls is not None
        if told.sector is None:
            return None
        if told.action is ActionValue.LANE_SWITCH:
            return LEFT if SECTORS[told.sector] > 0 else RIGHT
        choice = self._controls.choice
        way = self._controls.exits.by_sector(choice[0])[told.sector] if choice is not None else None
        return None if way is None else way.angle

    def _keep_path(self, drive: DrivingSession) -> None:
        """Plans a new path for a car that has left its path or reached its end."""
        planner = drive.session.world.planner
        if abs(planner.offset) > LOST or (planner.room < END and not planner.waits_at_end):
            drive.session.world.find_path()
