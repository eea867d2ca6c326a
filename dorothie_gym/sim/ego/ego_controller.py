"""Ego controller: physical actions, cruise speed, lights and goals; and the ego as a vehicle of highway-env."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array, Exit, LinkType
from dorothie_gym.ontology.actions import SPEED_STEP, PhysicalAction
from dorothie_gym.sim.ego.limits import MAX_CRUISE, MIN_CRUISE, FeasibleManoeuvres, VehicleControl, may_change_cruise
from dorothie_gym.sim.ego.manoeuvres import find_feasible, request
from dorothie_gym.sim.ego.path import Path
from dorothie_gym.sim.state.codes import CARRIED_OUT, NO_SPACE, Feasible, Refusal
from dorothie_gym.sim.state.records import GoalRecord
from dorothie_gym.sim.state.world_arrays import WorldArrays, lengthened
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import direct
from dorothie_gym.support.compilation.records import fields, filled_records, plain
from dorothie_gym.support.copying import CachedViews, shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.sim.road import TownRoad
    from dorothie_gym.sim.state.record_views import ArrayHolder
    from dorothie_gym.sim.state.town_arrays import TownArrays

# --- The car as a vehicle of highway-env ------------------------------------------------------------------------------
# The ego car as a highway-env vehicle: a view on the arrays of its world.


class Car(CachedViews, Vehicle):
    """The ego, vehicle number 0 of a world (`Kind.DRIVEN`), in the state of the last step of the world.

    Setting its position, heading or speed moves it.
    """

    MAX_SPEED = 40.0
    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_state_of", "_own_state")

    _state_of: WorldArrays | None = None

    def __init__(self, road: TownRoad, holder: ArrayHolder) -> None:
        """Shows the first vehicle of `holder.arrays`, which may be replaced by others with more room."""
        self._holder = holder
        self._heading: float
        self._speed: float
        self._height: float
        self.refresh()
        super().__init__(road, self.position, self.heading, self.speed)

    def refresh(self) -> None:
        """Reads place, heading, speed and height from the arrays."""
        x, y, self._heading, self._speed, self._height = self._state.item()
        self._position = np.array((x, y))

    @property
    def _state(self) -> NDArray[np.void]:
        """Place, heading, speed and height in the arrays, see `fields`."""
        arrays: WorldArrays = self._holder.arrays
        if arrays is not self._state_of:
            self._state_of, self._own_state = arrays, fields(arrays.vehicles, "x", "y", "heading", "speed", "height")
        return self._own_state

    @property
    def _row(self) -> np.void:
        row: np.void = plain(self._holder.arrays.vehicles)[0]
        return row

    @property
    def position(self) -> Array:
        """Position of its centre (2,) [m]."""
        return self._position

    @position.setter
    def position(self, place: Array) -> None:
        self._row["x"], self._row["y"] = place
        self.refresh()

    @property
    def heading(self) -> float:
        """Heading [rad]."""
        return self._heading

    @heading.setter
    def heading(self, heading: float) -> None:
        row = self._row
        row["heading"], row["cos"], row["sin"] = heading, pm.cos(heading), pm.sin(heading)
        self.refresh()

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._row["speed"] = speed
        self.refresh()

    @property
    def height(self) -> float:
        """Height of the road under it [m]."""
        return self._height

    @property
    def control(self) -> VehicleControl:
        """Last input of the actuators."""
        car = plain(self._holder.arrays.car)[0]
        return VehicleControl(throttle=float(car["throttle"]), steer=float(car["steer"]), brake=float(car["brake"]))

    def on_state_update(self) -> None:
        """Matches the car to the closest lane of its height."""
        network = self.road.network
        self.lane_index = network.get_closest_lane_index(self.position, self.heading, height=self.height)
        self.lane = network.get_lane(self.lane_index)


# --- Fields of the ego's record ---------------------------------------------------------------------------------------


class CarRecord:
    """Groups of fields of the ego's record; ``.item()`` reads one as a tuple, ``[()] = numbers`` writes one (`fields`).

    Attributes:
        hazard: hazard and hazard_gap: the cause of a hazard stop.
        outcome: numbers of events, infractions and collisions.
        props: number of props that it sees.
        lights: whether its headlights are on.
        air: friction, wind, wind_heading and wind_phase: effects of the weather.
    """

    def __init__(self, arrays: WorldArrays) -> None:
        """Shows the record in the arrays of a world."""
        self.hazard = fields(arrays.car, "hazard", "hazard_gap")
        self.outcome = fields(arrays.car, "events", "breaches", "collisions")
        self.props = fields(arrays.plan, "props")
        self.lights = fields(arrays.plan, "lights")
        self.air = fields(arrays.car, "friction", "wind", "wind_heading", "wind_phase")


# --- Physical actions -------------------------------------------------------------------------------------------------

CRUISE_REFUSAL = f"the cruise speed stays within {MIN_CRUISE:.0f} and {MAX_CRUISE:.0f} km/h"
"""Reason of the refusal of a cruise speed."""

REASONS: Final[Mapping[int, str]] = MappingProxyType(
    {
        Refusal.STOPPED: "the car is stopped already",
        Refusal.NOT_STOPPED: "the car is not stopped",
        Refusal.IN_MANOEUVRE: "the car is in the middle of a manoeuvre",
        Refusal.FOLLOWING: "the car follows its lane already",
        Refusal.COMMITTED: "the car cannot stop before the junction any more",
        Refusal.NO_SIDE: "a lane switch needs a side: a positive angle is left, a negative one right",
        Refusal.NO_LANE_LEFT: "there is no lane to the left",
        Refusal.NO_LANE_RIGHT: "there is no lane to the right",
        Refusal.NO_ROOM_LEFT: "there is no room left to switch to the left",
        Refusal.NO_ROOM_RIGHT: "there is no room left to switch to the right",
        Refusal.PROP_LEFT: "a roadblock is too close on the lane to the left",
        Refusal.PROP_RIGHT: "a roadblock is too close on the lane to the right",
        Refusal.NOT_LEFTMOST: "a U-turn begins on the leftmost lane",
        Refusal.NOT_RIGHTMOST: "a U-turn begins on the rightmost lane",
        Refusal.NO_ONCOMING: "there is no oncoming lane beside this one",
        Refusal.PROP_AHEAD: "the car is too fast to turn round before the roadblock",
        Refusal.NO_ROOM_TO_TURN: "there is no room left to turn round",
        Refusal.PROP_ONCOMING: "a roadblock is too close on the oncoming lane",
        Refusal.NO_CHOICE: "there is no junction with a choice ahead",
        Refusal.SAME_TURN: "the car is about to take that turn already",
        Refusal.TURN_TOO_CLOSE: "the car is too close to the junction to take another turn",
    }
)
"""Reasons of refusals."""

_FLAGS: Final = tuple(int(flag) for flag in Feasible)

_find_feasible, _request = direct(find_feasible), direct(request)


def request_path(
    town: TownArrays, holder: ArrayHolder, action: int, *, angle: int = 0, speed: float = 0.0, lane: int = 0,
    station: float = 0.0, offset: float = 0.0,
) -> int:  # fmt: skip
    """Calls `manoeuvres.request`, again with longer arrays if they have no room for the path; returns its answer."""
    while True:
        answer = _request(
            town, holder.arrays, action, int(angle), float(speed), int(lane), float(station), float(offset)
        )
        if answer != NO_SPACE:
            return answer
        holder.arrays = lengthened(holder.arrays)


class LocalPlanner(CachedViews):
    """Path of the ego, changed by navigation actions: a view on the plan in the arrays of its world."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_shown", "_row", "_car", "_course", "_laid", "_path")

    _shown: WorldArrays | None = None
    _laid = 0

    def __init__(self, town: Town, arrays: TownArrays, holder: ArrayHolder) -> None:
        """Shows the plan of a world that has started.

        Args:
            town: the map.
            arrays: its arrays.
            holder: owner of the arrays of the world; they are replaced where a path needs more room.
        """
        self._town, self._arrays, self._holder = town, arrays, holder

    def _look_up(self) -> np.void:
        """Returns the plan in the current arrays."""
        arrays = self._holder.arrays
        if arrays is not self._shown:
            self._shown, self._row, self._car = arrays, plain(arrays.plan)[0], plain(arrays.car)[0]
            self._course = plain(arrays.course)
        row: np.void = self._row
        return row

    @property
    def plan(self) -> np.void:
        """Fields of the plan, see `PlanRecord`."""
        return self._look_up()

    @property
    def state(self) -> tuple[object, ...]:
        """Values, besides the speed, on which the feasibility of navigation actions depends, for comparison."""
        plan = self._look_up()
        props = self._holder.arrays.seen_props[: int(plan["props"])].tobytes()
        return (
            *(plan[name].item() for name in ("version", "held", "action", "connector")),
            self.s,
            self.roadblock,
            props,
        )

    # --- Place on the path ------------------------------------------------------------------------------------------

    @property
    def path(self) -> Path:
        """The current path, the same object until a manoeuvre replaces it."""
        plan = self._look_up()
        if plan["version"] != self._laid:
            self._laid = int(plan["version"])
            self._path = Path(self._course[: plan["points"]])
        return self._path

    @property
    def s(self) -> float:
        """Place of the ego along the path [m]."""
        self._look_up()
        return float(self._car["s"])

    @property
    def offset(self) -> float:
        """Distance of the ego from the path, positive right [m]."""
        self._look_up()
        return float(self._car["offset"])

    @property
    def roadblock(self) -> float:
        """Distance from the ego's centre to a roadblock on the path [m], or inf."""
        self._look_up()
        return float(self._car["roadblock"])

    @property
    def lane(self) -> int:
        """Lane to which the ego is assigned."""
        return int(self._look_up()["lane"])

    @property
    def station(self) -> float:
        """Distance along that lane [m]."""
        return float(self._look_up()["station"])

    @property
    def height(self) -> float:
        """Height of the road under the ego [m]."""
        return float(self._look_up()["height"])

    @property
    def held(self) -> bool:
        """Whether the ego stands because of the action Stop."""
        return bool(self._look_up()["held"])

    @property
    def waits_at_end(self) -> bool:
        """Whether the path ends where a turn must be chosen, or at the end of the map."""
        return bool(self._look_up()["open_end"])

    @property
    def room(self) -> float:
        """Length of the path ahead of the ego's centre [m]."""
        return float(self._look_up()["length"]) - self.s

    @property
    def manoeuvre(self) -> tuple[PhysicalAction | None, int]:
        """Planned or current manoeuvre, and its angle [degrees]."""
        plan = self._look_up()
        action = int(plan["action"])
        return (PhysicalAction(action) if action else None), int(plan["angle"])

    @property
    def in_manoeuvre(self) -> bool:
        """Whether the ego is off the centre lines, in a lane switch or U-turn."""
        return bool(self._look_up()["off_line"])

    @property
    def lanes_ahead(self) -> list[int]:
        """Lanes of the path ahead, in order."""
        lanes = self.path.lanes[int(self._look_up()["at"]) :]
        change = np.concatenate(([True], lanes[1:] != lanes[:-1]))
        return [int(lane) for lane in lanes[change]]

    @property
    def turn_ahead(self) -> int | None:
        """Angle of the turn that is planned and has not begun [degrees], or None."""
        plan = self._look_up()
        return int(plan["angle"]) if plan["turning"] else None

    @property
    def choice(self) -> tuple[int, float]:
        """Lane before the next junction with a choice, -1 if the path reaches none, and the distance to it [m]."""
        plan = self._look_up()
        lane = int(plan["choice"])
        return lane, float(plan["choice_at"]) - self.s if lane >= 0 else 0.0

    def exits(self) -> tuple[tuple[Exit, ...], float]:
        """Returns the turn options at the next junction with a choice, and the distance to it along the path [m].

        While a turn at that junction is planned, options and distance remain those of that junction until the ego
        enters it.
        """
        lane, distance = self.choice
        return (self._town.exits(lane) if lane >= 0 else ()), distance

    # --- Navigation actions -----------------------------------------------------------------------------------------

    def command(self, action: PhysicalAction, angle: int, speed: float) -> str | None:
        """Applies a navigation action.

        Args:
            action: one of the six navigation actions.
            angle: degrees, positive left; for JTurn and LaneSwitch.
            speed: of the ego [m/s].

        Returns:
            None, or the reason of the refusal; then nothing has changed.
        """
        answer = request_path(self._arrays, self._holder, int(action), angle=angle, speed=speed)
        if answer == CARRIED_OUT:
            return None
        return REASONS.get(answer, f"{action.label} is no navigation action")

    def feasible(self, speed: float) -> FeasibleManoeuvres:
        """Returns the navigation actions that would be carried out at a speed [m/s]."""
        found = _find_feasible(self._arrays, self._holder.arrays, float(speed))
        return FeasibleManoeuvres(*[bool(found & flag) for flag in _FLAGS])

    def may_switch(self, side: LinkType, speed: float = 0.0) -> bool:
        """Returns whether a lane switch would be carried out at a speed [m/s]; `side` is a lane-change type."""
        feasible = self.feasible(speed)
        return feasible.switch_left if side is LinkType.LANE_CHANGE_LEFT else feasible.switch_right

    def may_turn_round(self, speed: float) -> bool:
        """Returns whether a U-turn would be carried out at this speed [m/s]."""
        return self.feasible(speed).u_turn


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
        self.planner.plan["cruise"], self.planner.plan["follows"] = speed, False

    @property
    def lights(self) -> bool:
        """Whether the headlights are on."""
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
