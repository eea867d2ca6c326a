"""Drivers that follow instructions and read the observation only."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dorothie_gym.envs.navigation.continuous_control import AHEAD, CONTINUOUS_FIELDS
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.ontology import ActionValue
from dorothie_gym.policies.navigation import NavigationAction, layout

FIELD = layout()
BRAKING, LAG = 3.0, 0.56  # of the car's Stop [m/s^2], [s]

Driver = Callable[[Any, Any], int]


def obey(observation: Any, mask: Any) -> int:
    """Carries out the last instruction, unless its place has been passed."""

    def field(name: str) -> Any:
        return observation[FIELD[name]]

    if field("goal")[0]:
        return seek(observation, mask)
    speed, left = float(field("speed")[0]) * 25.0, float(field("said_distance")[0]) * 100.0
    wanted = NavigationAction.NOTHING
    if field("said")[0]:
        asked = ActionValue(int(field("said_action").argmax()))
        sector = int(field("said_sector").argmax())
        if asked is ActionValue.J_TURN and left > -5.0:
            wanted = NavigationAction.turn(sector)
        elif asked is ActionValue.U_TURN and left > -10.0:
            wanted = NavigationAction.U_TURN
        elif asked is ActionValue.LANE_SWITCH and left > -20.0 and not field("manoeuvre")[0]:
            wanted = NavigationAction.SWITCH_LEFT if sector == 6 else NavigationAction.SWITCH_RIGHT
        elif asked is ActionValue.START:
            wanted = NavigationAction.START
        elif asked is ActionValue.STOP and stops_in_time(speed, left):
            wanted = NavigationAction.STOP
    return int(wanted) if mask[wanted] else 0


def seek(observation: Any, mask: Any) -> int:
    """Drives to a goal on the map by the cheapest exits."""

    def field(name: str) -> Any:
        return observation[FIELD[name]]

    speed, near, detours = float(field("speed")[0]) * 25.0, field("goal_distance")[2], field("detours")
    if near < 1.0 and stops_in_time(speed, float(near) * 10.0) and mask[NavigationAction.STOP]:
        return NavigationAction.STOP
    if speed < 0.1 and mask[NavigationAction.START]:
        return NavigationAction.START
    if detours[0] < -0.05 and mask[NavigationAction.U_TURN]:
        return NavigationAction.U_TURN
    exits = field("exits").reshape(8, 3)
    if field("junction")[0] and field("junction")[1] < 0.8 and exits[:, 0].any():
        best = int(np.where(exits[:, 0] > 0, detours[3:], np.inf).argmin())
        if not exits[best, 1] and mask[NavigationAction.turn(best)]:
            return NavigationAction.turn(best)
    return NavigationAction.NOTHING


def stops_in_time(speed: float, left: float) -> bool:
    """Returns whether braking now stops the car closer to a place than braking half a second later."""
    return -2.0 < left - LAG * speed - speed**2 / (2.0 * BRAKING) <= speed / 4.0


def follow_lane(observation: Any, mask: Any) -> int:
    """Returns the action that does nothing."""
    return NavigationAction.NOTHING


def drive(env: NavigationEnv, driver: Driver, seed: int) -> dict[str, Any]:
    """Plays an episode; returns the last info, with the sum of all rewards."""
    observation, info = env.reset(seed=seed)
    total, over = 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = env.step(driver(observation, info["action_mask"]))
        total += reward
        over = terminated or truncated
    return {**info, "return": total}


PEDALS = layout(CONTINUOUS_FIELDS)
FULL_LOCK = math.pi / 3.0  # [rad]


def pursue(observation: Any) -> Any:
    """Returns throttle, steering and brake of a pure-pursuit driver that keeps to the allowed speeds."""

    def field(name: str) -> Any:
        return observation[PEDALS[name]]

    speed = float(field("speed")[0]) * 25.0
    points = field("path").reshape(-1, 2) * 50.0
    ahead, right = points[min(range(len(points)), key=lambda k: abs(AHEAD[k] - 0.8 - 0.4 * speed))]
    slip = math.atan2(right, max(ahead, 0.5))
    steer = math.atan(2.0 * math.tan(max(min(slip, 0.7), -0.7))) / FULL_LOCK
    wanted = min(11.0, *(float(value) * 25.0 + 0.15 * k for k, value in enumerate(field("allowed")[:4])))
    there, gap, other, line = field("obstacle")
    if there:
        wanted = min(wanted, math.sqrt(max(6.0 * (gap * 100.0 - (1.5 if line else 3.5)), 0.0) + (other * 25.0) ** 2))
    stop, _, close = field("stop")
    if stop and close < 1.0:
        wanted = min(wanted, math.sqrt(max(3.0 * (close * 10.0 - 0.4), 0.0)))
        if abs(close) < 0.12:
            wanted = 0.0
    pull = wanted - speed
    if wanted < 0.05:
        return np.array((-1.0, steer, 0.6), dtype=np.float32)
    return np.array((pull, steer, -pull * 0.6), dtype=np.float32).clip(-1.0, 1.0)
