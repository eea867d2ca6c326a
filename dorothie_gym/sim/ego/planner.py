"""Local planner of the ego: turns navigation actions into a path (paper, section 3.1).

By default the ego follows its lane, and continues where only one exit leads on. Where a lane ends at a junction with
several exits and no turn is planned, the path ends and the ego waits.
"""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.maps.lane_neighbours import Oncoming, oncoming_lanes
from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.feasibility import (
    FeasibleManoeuvres,
    has_room_to_switch,
    is_past_stopping,
    landing_is_blocked,
    switch_is_blocked,
    u_turn_start,
)
from dorothie_gym.sim.ego.limits import EGO_MOVING, HALF_LENGTH, LANDING, U_TURN_REACH
from dorothie_gym.sim.ego.manoeuvre_lanes import LEAST_PATH, LaneChooser, LaneStep
from dorothie_gym.sim.ego.path import TURNING_RADIUS, Path, PathPiece, follow, u_turn


class LocalPlanner:
    """Path of the ego, changed by navigation actions.

    Attributes:
        path: the present path; every manoeuvre replaces it, and `s` is measured along the present one.
        s: place of the ego along the path [m].
        offset: its distance from the path, positive right [m].
        held: whether the ego stands by the action Stop.
        roadblock: distance from the ego's middle to a roadblock on the path [m], or inf.
        props: places of all props that the ego sees (x, y, height) [m].
    """

    def __init__(self, town: Town, lane: int, station: float) -> None:
        self._town = town
        self._lanes = LaneChooser(town)
        self._oncoming = oncoming_lanes(town)
        self.held = False
        self.roadblock = math.inf
        self.props: tuple[tuple[float, float, float], ...] = ()
        self._manoeuvre: PhysicalAction | None = None
        self._manoeuvre_angle = 0
        self._manoeuvre_end = 0.0
        self._chosen = (-1, -1)  # connector and lane of the turn that is planned
        self._begin(lane, station, 0.0)

    def _begin(self, lane: int, station: float, offset: float) -> None:
        pieces, self._open_end = self._lanes.lay([LaneStep(lane)], station, 0.0)
        self.path = Path(pieces or [follow(self._town.lanes[lane], self._town.lanes[lane].length - 0.5)])
        self.s, self.offset = (0.0 if pieces else self.path.length), offset

    # --- Place on the path ------------------------------------------------------------------------------------------

    @property
    def lane(self) -> int:
        """Lane that the ego counts as being on."""
        return int(self.path.lanes[self.path.index_at(self.s)])

    @property
    def station(self) -> float:
        """Distance along that lane [m]."""
        path = self.path
        k = path.index_at(self.s)
        ahead = self.s - float(path.s[k]) if not path.manoeuvre[k] else 0.0
        return min(float(path.stations[k]) + ahead, self._town.lanes[int(path.lanes[k])].length)

    @property
    def height(self) -> float:
        """Height of the road under the ego [m]."""
        return float(self.path.heights[self.path.index_at(self.s)])

    @property
    def waits_at_end(self) -> bool:
        """Whether the path ends where a turn has to be chosen, or at the end of the map."""
        return self._open_end

    @property
    def room(self) -> float:
        """Length of the path ahead of the ego's middle [m]."""
        return self.path.length - self.s

    @property
    def manoeuvre(self) -> tuple[PhysicalAction | None, int]:
        """Planned or present manoeuvre, and its angle [degrees]."""
        return self._manoeuvre, self._manoeuvre_angle

    @property
    def lanes_ahead(self) -> list[int]:
        """Lanes of the path ahead, in order."""
        lanes = self.path.lanes[self.path.index_at(self.s) :]
        change = np.concatenate(([True], lanes[1:] != lanes[:-1]))
        return [int(lane) for lane in lanes[change]]

    @property
    def in_manoeuvre(self) -> bool:
        """Whether the ego is off the centre lines, in a lane switch or U-turn."""
        return bool(self.path.manoeuvre[self.path.index_at(self.s)])

    @property
    def manoeuvre_end(self) -> float:
        """Distance along the path at which the manoeuvre ends [m]."""
        return self._manoeuvre_end

    def note(self, s: float, offset: float, roadblock: float) -> None:
        """Updates the place along the path, the offset to its right and the distance of a roadblock [m]."""
        self.s, self.offset, self.roadblock = s, offset, roadblock
        if self._manoeuvre is not None and s >= self._manoeuvre_end:
            self._manoeuvre, self._manoeuvre_angle = None, 0

    def extend(self, speed: float) -> None:
        """Lengthens the path where only one exit leads on; called once per decision, with the speed [m/s]."""
        if self.room < LEAST_PATH and not self._open_end:
            self._lay_from_here(self._lanes.steps_along(self.lanes_ahead), speed)

    def restart(self, lane: int, station: float, offset: float) -> None:
        """Lays a new path for an ego that has left the present one, and drops the plan.

        Args:
            lane: lane of the ego.
            station: distance along it [m].
            offset: distance from it, positive right [m].
        """
        self._clear()
        self._begin(lane, station, offset)

    def beside(self, lane: int, station: float) -> list[tuple[int, float]]:
        """Returns lane and station [m] of a place, and of those beside it on the other lanes of its direction."""
        position = self._town.lanes[lane].position(station)
        return [
            (other, station if other == lane else self._town.lanes[other].project(position)[0])
            for other in self._lanes.side_by_side(lane)
        ]

    # --- Turn options -----------------------------------------------------------------------------------------------

    def exits(self) -> tuple[tuple[Exit, ...], float]:
        """Returns the turn options at the next junction with a choice, and the distance to it along the path [m].

        While a turn at that junction is planned, options and distance remain those of that junction until the ego
        enters it.
        """
        k = self.path.index_at(self.s)
        lanes = self.path.lanes
        for lane in self.lanes_ahead:
            if self._town.lanes[lane].in_junction:
                continue
            if self._lanes.is_choice(lane):
                last = k + int(np.flatnonzero(lanes[k:] == lane)[-1])
                left = self._town.lanes[lane].length - float(self.path.stations[last])
                return self._town.exits(lane), float(self.path.s[last]) + left - self.s
        return (), 0.0

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
        if action is PhysicalAction.STOP:
            if self.held:
                return "the car is stopped already"
            self.held = True
            return None
        if action is PhysicalAction.START:
            if not self.held:
                return "the car is not stopped"
            self.held = False
            return None
        handlers = {
            PhysicalAction.LANE_FOLLOW: self._follow_lane,
            PhysicalAction.LANE_SWITCH: self._switch_lane,
            PhysicalAction.U_TURN: self._turn_round,
            PhysicalAction.J_TURN: self._turn,
        }
        if action not in handlers:
            return f"{action.label} is no navigation action"
        reason = handlers[action](angle, speed)
        if reason is None:
            self.held = False
        return reason

    def _follow_lane(self, angle: int, speed: float) -> str | None:
        if self.in_manoeuvre or self._town.lanes[self.lane].in_junction:
            return None if self.held else "the car is in the middle of a manoeuvre"
        if self._manoeuvre is None and not self.held:
            return "the car follows its lane already"
        if self.is_committed(speed):
            return "the car cannot stop before the junction any more"
        self._clear()
        self._lay([LaneStep(self.lane)], self.station)
        return None

    def _switch_lane(self, angle: int, speed: float) -> str | None:
        if angle == 0:
            return "a lane switch needs a side: a positive angle is left, a negative one right"
        target = self._plan_switch(LinkType.LANE_CHANGE_LEFT if angle > 0 else LinkType.LANE_CHANGE_RIGHT, speed)
        if isinstance(target, str):
            return target
        self._clear()
        self._manoeuvre, self._manoeuvre_angle = PhysicalAction.LANE_SWITCH, 90 if angle > 0 else -90
        self._lay([LaneStep(self.lane), LaneStep(target, change=True)], self.station, speed)
        return None

    def feasible(self, speed: float) -> FeasibleManoeuvres:
        """Returns the navigation actions that would be carried out at a speed [m/s]."""
        committed = self.is_committed(speed)
        lane = self._town.lanes[self.lane]
        if self.in_manoeuvre or lane.in_junction:
            return FeasibleManoeuvres(False, False, False, False, not committed)
        on_leftmost = self._town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT) is None
        return FeasibleManoeuvres(
            not committed and (self.held or self._manoeuvre is not None),
            not on_leftmost and self.may_switch(LinkType.LANE_CHANGE_LEFT, speed),
            self.may_switch(LinkType.LANE_CHANGE_RIGHT, speed),
            on_leftmost and self.may_turn_round(speed),
            not committed,
        )

    def may_switch(self, side: LinkType, speed: float = 0.0) -> bool:
        """Returns whether a lane switch would be carried out at a speed [m/s]; `side` is a lane-change type."""
        return not isinstance(self._plan_switch(side, speed), str)

    def _plan_switch(self, side: LinkType, speed: float) -> int | str:
        """Returns the lane to switch to, or the reason of a refusal."""
        name = "left" if side is LinkType.LANE_CHANGE_LEFT else "right"
        lane = self._town.lanes[self.lane]
        if self.in_manoeuvre or lane.in_junction:
            return "the car is in the middle of a manoeuvre"
        target = self._town.neighbour(lane.id, side)
        if target is None:
            return f"there is no lane to the {name}"
        station = self.station
        if not has_room_to_switch(lane.length - station):
            return f"there is no room left to switch to the {name}"
        beside = self._town.lanes[target]
        if self.props and switch_is_blocked(self.props, beside, beside.project(lane.position(station))[0], speed):
            return f"a roadblock is too close on the lane to the {name}"
        return target

    @property
    def turn_ahead(self) -> int | None:
        """Angle of the turn that is planned and has not begun [degrees], or None."""
        if self._manoeuvre is not PhysicalAction.J_TURN:
            return None
        lane, connector = self._town.lanes[self.lane], self._town.lanes[self._chosen[0]]
        begun = lane.in_junction and lane.junction_id == connector.junction_id
        return None if begun else self._manoeuvre_angle

    def is_committed(self, speed: float) -> bool:
        """Returns whether the ego cannot stop any more before the junction of the planned turn, at a speed [m/s]."""
        if self.turn_ahead is None:
            return False
        k = self.path.index_at(self.s)
        turn = np.flatnonzero(self.path.lanes[k:] == self._chosen[0])
        if not len(turn):
            return False
        room = float(self.path.s[k + int(turn[0])]) - self.s - HALF_LENGTH
        return is_past_stopping(speed, room)

    def may_turn_round(self, speed: float) -> bool:
        """Returns whether a U-turn would be carried out at this speed [m/s]."""
        return not isinstance(self._plan_u_turn(speed), str)

    def _turn_round(self, angle: int, speed: float) -> str | None:
        plan = self._plan_u_turn(speed)
        if isinstance(plan, str):
            return plan
        self._clear()
        self._manoeuvre = PhysicalAction.U_TURN
        self._lay_u_turn(*plan)
        return None

    def _plan_u_turn(self, speed: float) -> tuple[Oncoming, float] | str:
        """Returns landing and first station of a U-turn, or the reason of a refusal."""
        lane, station = self._town.lanes[self.lane], self.station
        if self.in_manoeuvre or lane.in_junction:
            return "the car is in the middle of a manoeuvre"
        begin = u_turn_start(station, speed)
        oncoming = self._oncoming.at(lane.id, min(begin, lane.length))
        if oncoming is not None:
            # just behind a junction: begin later, so that the turn ends before the end of the oncoming lane
            short = LANDING - (self._town.lanes[oncoming.lane].length - oncoming.station)
            if short > 0.0:
                begin += short
                oncoming = self._oncoming.at(lane.id, min(begin, lane.length))
        if oncoming is None:
            if self._town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT) is not None:
                return "a U-turn begins on the leftmost lane"
            return "there is no oncoming lane beside this one"
        if speed > EGO_MOVING and begin - station + U_TURN_REACH > self.roadblock:
            return "the car is too fast to turn round before the roadblock"
        if begin > lane.length + 0.5:
            return "there is no room left to turn round"
        if landing_is_blocked(self.props, self._town.lanes[oncoming.lane], oncoming.station):
            return "a roadblock is too close on the oncoming lane"
        return oncoming, min(begin, lane.length)

    def _turn(self, angle: int, speed: float) -> str | None:
        _, free = self._under_way()  # after the end of a manoeuvre under way, lanes may be changed again
        found = self._lanes.find_turn(self._lanes.through_junction(self.lane), free, angle)
        if found is None:
            return "there is no junction with a choice ahead"
        steps, way = found
        same = self._manoeuvre is PhysicalAction.J_TURN and self._chosen == (way.connector, way.lane)
        if same and not self.held:
            return "the car is about to take that turn already"
        if self.is_committed(speed):
            return "the car is too close to the junction to take another turn"
        self._clear()
        self._manoeuvre, self._manoeuvre_angle = PhysicalAction.J_TURN, way.angle
        self._chosen = (way.connector, way.lane)
        self._lay_from_here(steps, speed)
        return None

    def _clear(self) -> None:
        self._manoeuvre, self._manoeuvre_angle, self._chosen = None, 0, (-1, -1)

    # --- Laying the path --------------------------------------------------------------------------------------------

    def _lay(
        self, steps: list[LaneStep], station: float, speed: float = 0.0, head: list[PathPiece] | None = None
    ) -> None:
        """Replaces the path: the pieces of `head`, then `steps` from a station on the first one on."""
        pieces, self._open_end = self._lanes.lay(steps, station, speed)
        self._set_path([*(head or []), *pieces])

    def _lay_from_here(self, steps: list[LaneStep], speed: float = 0.0) -> None:
        """Replaces the path from the ego's place on; the rest of a lane switch or U-turn under way is kept."""
        head, station = self._under_way()
        self._lay(steps, station, speed, head)

    def _under_way(self) -> tuple[list[PathPiece], float]:
        k = self.path.index_at(self.s)
        if not self.path.manoeuvre[k]:
            return [], self.station
        end = k + int(np.argmin(self.path.manoeuvre[k:])) if not self.path.manoeuvre[k:].all() else len(self.path.s)
        cut = slice(k, end)
        piece = PathPiece(
            lane=self.lane,
            points=self.path.points[cut],
            heights=self.path.heights[cut],
            stations=self.path.stations[cut],
            limit=float(self.path.limits[k]),
            manoeuvre=True,
        )
        if len(piece.points) < 2:
            return [], self.station
        # the lane continues where it did before, just behind the end of a U-turn; else the path would turn back
        landing = end if end < len(self.path.s) and int(self.path.lanes[end]) == self.lane else end - 1
        return [piece], float(self.path.stations[landing])

    def _lay_u_turn(self, oncoming: Oncoming, begin: float) -> None:
        lane, target = self._town.lanes[self.lane], self._town.lanes[oncoming.lane]
        head: list[PathPiece] = []
        if begin > self.station + 1e-3:
            head.append(follow(lane, self.station, begin))
        head.append(u_turn(lane, target, begin, TURNING_RADIUS))
        landing = min(oncoming.station + 0.5, target.length)
        self._lay([LaneStep(target.id)], landing, head=head)

    def _set_path(self, pieces: list[PathPiece]) -> None:
        if not pieces:  # the very end of a lane: its last half metre
            lane = self._town.lanes[self.lane]
            pieces = [follow(lane, lane.length - 0.5)]
        x, y = self._car_position()
        self.path = Path(pieces)
        self.s, self.offset = self.path.project(x, y, 0.0)
        off_line = np.flatnonzero(self.path.manoeuvre)
        if self._manoeuvre is PhysicalAction.J_TURN:
            entered = np.flatnonzero(self.path.lanes == self._chosen[1])
            self._manoeuvre_end = float(self.path.s[entered[0]]) if len(entered) else math.inf
        elif self._manoeuvre is not None and len(off_line):
            self._manoeuvre_end = float(self.path.s[off_line[-1]])

    def _car_position(self) -> tuple[float, float]:
        x, y = self.path.position_at(self.s)
        heading = self.path.heading_at(self.s)
        return x - self.offset * math.sin(heading), y + self.offset * math.cos(heading)
