"""Ego controller: applies physical actions, and holds cruise speed, lights and goals of the ego."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dorothie_gym.ontology.actions import SPEED_STEP, PhysicalAction
from dorothie_gym.sim.ego.feasibility import may_change_cruise
from dorothie_gym.sim.ego.limits import MAX_CRUISE, MIN_CRUISE
from dorothie_gym.sim.ego.planner import LocalPlanner
from dorothie_gym.sim.ego.vehicle import Car
from dorothie_gym.sim.state.ego_records import GoalRecord
from dorothie_gym.sim.state.record_views import ArrayHolder
from dorothie_gym.support.compilation.records import filled_records, plain
from dorothie_gym.support.copying import shared

CRUISE_REFUSAL = f"the cruise speed stays within {MIN_CRUISE:.0f} and {MAX_CRUISE:.0f} km/h"
"""Reason of the refusal of a cruise speed."""


@shared
@dataclass(frozen=True, kw_only=True)
class GoalAhead:
    """Place where the ego is expected to stop: lane and distance along it [m]."""

    lane: int
    station: float


def set_goals(holder: ArrayHolder, goals: Sequence[GoalAhead]) -> None:
    """Sets the places where the ego of a world is expected to stop."""
    rows = filled_records(GoalRecord, [(goal.station, goal.lane) for goal in goals])
    if len(goals) > len(holder.arrays.goals):
        holder.arrays = holder.arrays._replace(goals=rows)
    plain(holder.arrays.goals)[: len(goals)] = plain(rows)[: len(goals)]
    plan = plain(holder.arrays.plan)[0]
    plan["goals"], plan["written"] = len(goals), 0


class EgoController:
    """Control of the ego car between the Co-Wizard's physical actions and the compiled world.

    `apply` takes a physical action. All state lies in the arrays of the world (`PlanRecord`).
    """

    def __init__(self, planner: LocalPlanner, car: Car, holder: ArrayHolder) -> None:
        """Shows the control of an ego.

        Args:
            planner: local planner of the ego.
            car: the ego.
            holder: owner of the arrays of the world.
        """
        self.planner = planner
        self._car, self._holder = car, holder

    @property
    def cruise(self) -> float:
        """Desired speed [km/h]."""
        return float(self.planner.plan["cruise"])

    @cruise.setter
    def cruise(self, speed: float) -> None:
        self.planner.plan["cruise"] = speed

    @property
    def lights(self) -> bool:
        """Whether the head lights are on."""
        return bool(self.planner.plan["lights"])

    @lights.setter
    def lights(self, on: bool) -> None:
        self.planner.plan["lights"] = on

    def apply(self, action: PhysicalAction, *, angle: int = 0, up: bool = True) -> str | None:
        """Applies a physical action.

        Args:
            action: the action.
            angle: degrees, positive left; for JTurn and LaneSwitch.
            up: direction of SpeedChange, state of LightChange.

        Returns:
            None, or the reason of the refusal; then nothing has changed.
        """
        if action is PhysicalAction.SPEED_CHANGE:
            return self.change_cruise(up)
        if action is PhysicalAction.LIGHT_CHANGE:
            if self.lights == up:
                return f"the lights are {'on' if up else 'off'} already"
            self.lights = up
            return None
        return self.planner.command(action, angle, float(self._car.speed))

    def change_cruise(self, up: bool) -> str | None:
        """Changes the cruise speed by one step; returns the reason of a refusal."""
        if not may_change_cruise(self.cruise, up):
            return CRUISE_REFUSAL
        self.cruise += SPEED_STEP if up else -SPEED_STEP
        return None

    @property
    def goals(self) -> tuple[GoalAhead, ...]:
        """Places where the ego is expected to stop; it approaches them slowly."""
        goals = self._holder.arrays.goals[: int(self.planner.plan["goals"])]
        return tuple(GoalAhead(lane=lane, station=station) for station, lane in goals.tolist())

    def set_goals(self, goals: Sequence[GoalAhead]) -> None:
        """Sets the places where the ego is expected to stop."""
        set_goals(self._holder, goals)
