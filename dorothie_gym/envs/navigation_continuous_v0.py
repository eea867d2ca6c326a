"""`Navigation-continuous-v0`: driving with throttle, steering and brake, for reinforcement learning."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.action_values import real_numbers
from dorothie_gym.engine.scenario import ResetOptions
from dorothie_gym.envs.driving_session import DrivingEnv, DrivingSession
from dorothie_gym.envs.navigation_config import NavigationConfig, NavigationWeights, weights_of
from dorothie_gym.envs.pedals import (
    AHEAD,
    CONTINUOUS_FIELD_SPECS,
    CONTINUOUS_FIELDS,
    END,
    LOST,
    OBSERVED_OBJECTS,
    OFFSET_UNIT,
    PATH_UNIT,
    PREPARED_UNTIL,
)
from dorothie_gym.envs.session_view import metadata_at
from dorothie_gym.maps import Town
from dorothie_gym.ontology import ActionValue, ObjectClass, PhysicalAction, Role, WeatherParameter
from dorothie_gym.policies.navigation.actions import LEFT, RIGHT
from dorothie_gym.policies.navigation.instructor import NavigationInstruction
from dorothie_gym.policies.navigation.junction_exits import SECTORS
from dorothie_gym.policies.navigation.observation_vector import (
    CLOSE_UNIT,
    DISTANCE_UNIT,
    KINDS,
    SPEED_UNIT,
    HeardInstruction,
    Vector,
)
from dorothie_gym.sim.ego.limits import VehicleControl
from dorothie_gym.sim.state.records import plain
from dorothie_gym.sim.world import World
from dorothie_gym.spaces import CoWizardAction, ObjectColumn, Observation, Physical, StepInfo
from dorothie_gym.spaces.fields import signal
from dorothie_gym.tasks import StoryboardTemplate

_WET = tuple(WeatherParameter).index(WeatherParameter.WETNESS)


def observe_continuous(world: World, seen: Observation, heard: HeardInstruction, max_seconds: float) -> Vector:
    """Encodes the observation of a driver.

    Args:
        world: the car and its path.
        seen: observation of the Co-Wizard.
        heard: last instruction.
        max_seconds: time limit [s].

    Returns:
        Vector (n,) in [-1, 1], see `CONTINUOUS_FIELDS`.
    """
    car, planner = world.car, world.planner
    control = car.control
    course = float(car.heading) - planner.path.heading_at(planner.s)
    waits = planner.waits_at_end
    values = [
        float(car.speed) / SPEED_UNIT,
        control.throttle,
        control.steer,
        control.brake,
        planner.offset / OFFSET_UNIT,
        math.sin(course),
        math.cos(course),
        *_path(world),
        *(world.ego.speed_at(min(planner.s + ahead, planner.path.length)) / SPEED_UNIT for ahead in (0.0, *AHEAD)),
        min(planner.room / DISTANCE_UNIT, 1.0) if waits else 1.0,
        *_obstacle(world),
        *_stop(heard),
        *_objects(seen),
        float(seen["weather"][_WET]) / 100.0,
        float(seen["time"][0]) / max_seconds,
    ]
    observation = np.array(values, dtype=np.float32)
    return np.minimum(np.maximum(observation, -1.0, out=observation), 1.0, out=observation)


def _path(world: World) -> list[float]:
    planner = world.planner
    x, y = (float(value) for value in world.car.position)
    sine, cosine = math.sin(world.car.heading), math.cos(world.car.heading)
    values = []
    for ahead in AHEAD:
        px, py = planner.path.position_at(min(planner.s + ahead, planner.path.length))
        dx, dy = px - x, py - y
        values += [(dx * cosine + dy * sine) / PATH_UNIT, (dy * cosine - dx * sine) / PATH_UNIT]
    return values


def _obstacle(world: World) -> list[float]:
    record = plain(world.actors.arrays.car)[0]
    if not record["kind"]:
        return [0.0] * 4
    return [1.0, float(record["gap"]) / DISTANCE_UNIT, float(record["ahead_speed"]) / SPEED_UNIT, float(record["line"])]


def _stop(heard: HeardInstruction) -> list[float]:
    given = heard.instruction
    if given is None or given.action is not ActionValue.STOP:
        return [0.0] * 3
    left = given.distance - heard.driven
    return [1.0, left / DISTANCE_UNIT, left / CLOSE_UNIT]


def _objects(seen: Observation) -> list[float]:
    values: list[float] = []
    for row in seen["objects"][:OBSERVED_OBJECTS].tolist():
        if not row[ObjectColumn.KIND]:
            break
        kind, bearing = ObjectClass(int(row[ObjectColumn.KIND])), row[ObjectColumn.BEARING]
        values += (row[ObjectColumn.DISTANCE] / 50.0, math.sin(bearing), math.cos(bearing))
        values += (row[ObjectColumn.SPEED] / SPEED_UNIT, *(float(kind is known) for known in KINDS))
    return values + [0.0] * (CONTINUOUS_FIELDS["objects"] - len(values))


# --- environment ------------------------------------------------------------------------------------------------------
__all__ = [
    "CONTINUOUS_FIELDS", "CONTINUOUS_FIELD_SPECS", "CONTROL_SPECS", "NavigationContinuousEnv", "control_space",
    "controls_of", "observe_continuous", "path_space",
]  # fmt: skip

CONTROL_SPECS = (
    signal("throttle", 1, meaning="share of full throttle; negative values count as 0"),
    signal("steer", 1, meaning="share of the greatest steering angle, positive right"),
    signal("brake", 1, meaning="share of full braking; negative values count as 0"),
)
"""Fields of the action, in order."""


def control_space() -> spaces.Space[NDArray[np.float32]]:
    """Returns the action space: throttle, steer and brake."""
    return spaces.Box(-1.0, 1.0, (len(CONTROL_SPECS),), dtype=np.float32)


def path_space() -> spaces.Space[Vector]:
    """Returns the observation space: a vector of all `CONTINUOUS_FIELDS`."""
    return spaces.Box(-1.0, 1.0, (sum(CONTINUOUS_FIELDS.values()),), dtype=np.float32)


def controls_of(name: str, action: object, shape: tuple[int, ...], meaning: str) -> NDArray[np.float64]:
    """Returns throttle, steer and brake of actions (..., 3), negative throttle and brake as 0.

    Args:
        name: name of the argument.
        action: the actions.
        shape: of all of them.
        meaning: their meaning, for messages.

    Raises:
        ValueError: they are not finite numbers of this shape.
    """
    return np.clip(real_numbers(name, action, shape, meaning), (0.0, -1.0, 0.0), 1.0)


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
    `Box(-1, 1, (n,), float32)`, see `dorothie_gym.envs.navigation_continuous_v0.CONTINUOUS_FIELDS`.

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

    metadata = metadata_at(10.0)

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
        view: str = "role",
    ) -> None:
        config = NavigationConfig(
            traffic=traffic, exceptions=exceptions, weights=weights_of(reward), max_seconds=max_seconds,
            patience=patience, decision_frequency=decision_frequency,
        )  # fmt: skip
        super().__init__(town, storyboard, config, render_mode, view)
        self.action_space, self.observation_space = control_space(), path_space()

    def reset(self, *, seed: int | None = None, options: ResetOptions | None = None) -> tuple[Vector, StepInfo]:
        """Begins a session; see `NavigationEnv.reset`."""
        drive = self.begin(seed, options)
        drive.session.world.ego.manual = VehicleControl(throttle=0.0, steer=0.0, brake=0.0)
        return self._observe(drive), drive.info()

    def step(self, action: NDArray[np.float32]) -> tuple[Vector, float, bool, bool, StepInfo]:
        """Plays one decision.

        Raises:
            ValueError: the action does not consist of three finite numbers.
            gymnasium.error.ResetNeeded: no session is in progress, or it is over.
        """
        values = controls_of("action", action, (3,), "three finite numbers: throttle, steer, brake")
        throttle, steer, brake = values.tolist()
        drive = self.drive
        drive.session.world.ego.manual = VehicleControl(throttle=throttle, steer=steer, brake=brake)
        drive.play(CoWizardAction(physical=self._prepare(drive)))
        drive.observe_roles()  # on the path that was driven
        self._keep_path(drive)
        self.show()
        return self._observe(drive), drive.reward, drive.terminated, drive.truncated, drive.info()

    def _observe(self, drive: DrivingSession) -> Vector:
        return observe_continuous(drive.session.world, drive.seen[Role.CO_WIZARD], drive.heard, self.config.max_seconds)

    def _prepare(self, drive: DrivingSession) -> Physical | None:
        """Returns the manoeuvre of the last instruction, if it is not part of the path yet."""
        given, planner = drive.heard.instruction, drive.session.world.planner
        if given is None or given.action not in _MANOEUVRES or planner.in_manoeuvre:
            return None
        action = _MANOEUVRES[given.action]
        left = given.distance - drive.heard.driven
        if left < -PREPARED_UNTIL or planner.manoeuvre[0] is action is not PhysicalAction.J_TURN:
            return None
        if action is PhysicalAction.U_TURN:
            may = planner.may_turn_round(float(drive.session.world.car.speed))
            return Physical(action=action) if may else None
        angle = _angle(given, drive)
        if angle is None or (action is PhysicalAction.J_TURN and planner.turn_ahead == angle):
            return None
        return Physical(action=action, angle=angle)

    def _keep_path(self, drive: DrivingSession) -> None:
        """Plans a new path for a car that has left its path or reached its end."""
        planner = drive.session.world.planner
        if abs(planner.offset) > LOST or (planner.room < END and not planner.waits_at_end):
            drive.session.world.find_path()


def _angle(given: NavigationInstruction, drive: DrivingSession) -> int | None:
    """Returns the angle of the instructed turn or lane switch [degrees, positive left], or None."""
    if given.sector is None:
        return None
    if given.action is ActionValue.LANE_SWITCH:
        return LEFT if SECTORS[given.sector] > 0 else RIGHT
    lane, _ = drive.session.world.planner.choice
    way = drive.exits.by_sector(lane)[given.sector] if lane >= 0 else None
    return None if way is None else way.angle
