"""The local planner: turns physical actions into a path (paper, section 3.1).

By default the car follows its lane and goes on where there is one way only. Where a lane ends at a junction with a
choice, and no turn was asked for, the path ends there and the car waits.
"""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.maps.lane_neighbours import Oncoming, oncoming_lanes
from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.manoeuvre_lanes import HORIZON, LEAD, MIN_SWITCH, Lanes, Step
from dorothie_gym.sim.ego.obstacles import BRAKING, HALF_LENGTH, LANDING, landing_is_blocked, switch_is_blocked
from dorothie_gym.sim.ego.path import TURNING_RADIUS, U_TURN_REACH, Path, Piece, follow, u_turn

BEGUN = 1.0
"""A manoeuvre from a stand has begun after this way [m]."""

SWEEP_STEP = 4
"""Of the points of a U-turn, which are half a metre apart, others are told every so many."""

U_TURN_SPEED = 3.5
"""Speed of a U-turn [m/s]."""

HARD_STOP = 5.0
"""Deceleration with which the car still stops before a junction when its plan is changed [m/s^2]."""


class LocalPlanner:
    """Keeps the path of the car, and changes it by physical actions.

    Attributes:
        path: the present path; it is laid anew by every manoeuvre, `s` is always measured on the present one.
        s: how far along the path the car is [m].
        offset: its distance from the path, positive right [m].
        held: whether the car stands by the action Stop.
        roadblock: how far ahead of the car's middle a roadblock is seen [m], or inf.
        props: where all props are that the car sees (x, y, height) [m].
    """

    def __init__(self, town: Town, lane: int, station: float) -> None:
        self._town = town
        self._lanes = Lanes(town)
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
        pieces, self._open_end = self._lanes.lay([Step(lane)], station, 0.0)
        self.path = Path(pieces or [follow(self._town.lanes[lane], self._town.lanes[lane].length - 0.5)])
        self.s, self.offset = (0.0 if pieces else self.path.length), offset

    # --- where the car is -------------------------------------------------------------------------------------------

    @property
    def lane(self) -> int:
        """Lane that the car counts as being on."""
        return int(self.path.lanes[self.path.index_at(self.s)])

    @property
    def station(self) -> float:
        """Distance along that lane [m]."""
        k = self.path.index_at(self.s)
        ahead = self.s - float(self.path.s[k]) if not self.path.manoeuvre[k] else 0.0
        return float(min(self.path.stations[k] + ahead, self._town.lanes[self.lane].length))

    @property
    def height(self) -> float:
        """Height of the road under the car [m]."""
        return float(self.path.heights[self.path.index_at(self.s)])

    @property
    def waits_at_end(self) -> bool:
        """Whether the path ends where a turn has to be chosen (or the map ends)."""
        return self._open_end

    @property
    def room(self) -> float:
        """Path left ahead of the car's middle [m]."""
        return self.path.length - self.s

    @property
    def manoeuvre(self) -> tuple[PhysicalAction | None, int]:
        """Manoeuvre being prepared or driven, and its angle [degrees]."""
        return self._manoeuvre, self._manoeuvre_angle

    @property
    def lanes_ahead(self) -> list[int]:
        """Lanes of the path from here on, each once, in order."""
        lanes = self.path.lanes[self.path.index_at(self.s) :]
        change = np.concatenate(([True], lanes[1:] != lanes[:-1]))
        return [int(lane) for lane in lanes[change]]

    @property
    def in_manoeuvre(self) -> bool:
        """Whether the car is off the centre lines: switching or turning round."""
        return bool(self.path.manoeuvre[self.path.index_at(self.s)])

    @property
    def manoeuvre_end(self) -> float:
        """Where along the path the manoeuvre is over [m]."""
        return self._manoeuvre_end

    def note(self, s: float, offset: float, roadblock: float) -> None:
        """Takes note of where the car is along the path, how far to the right of it, and where a roadblock is [m]."""
        self.s, self.offset, self.roadblock = s, offset, roadblock
        if self._manoeuvre is not None and s >= self._manoeuvre_end:
            self._manoeuvre, self._manoeuvre_angle = None, 0

    def extend(self, speed: float) -> None:
        """Lengthens the path ahead where the way is clear; to be called once a decision, with the speed [m/s]."""
        if self.room < HORIZON and not self._open_end:
            self._lay_from_here(self._lanes.steps_along(self.lanes_ahead), speed)

    def restart(self, lane: int, station: float, offset: float) -> None:
        """Lays the path anew for a car that has left it, and forgets what was planned.

        Args:
            lane: where the car is: the lane,
            station: the distance along it [m],
            offset: and from it, positive right [m].
        """
        self._clear()
        self._begin(lane, station, offset)

    def beside(self, lane: int, station: float) -> list[tuple[int, float]]:
        """A place, and those beside it on the other lanes of its direction: lane and distance along it [m]."""
        position = self._town.lanes[lane].position(station)
        return [
            (other, station if other == lane else self._town.lanes[other].project(position)[0])
            for other in self._lanes.side_by_side(lane)
        ]

    # --- turn options -----------------------------------------------------------------------------------------------

    def exits(self) -> tuple[tuple[Exit, ...], float]:
        """Turn options at the next junction with a choice, and the distance to it along the path [m].

        While the turn for that junction is already in the plan, the options and distance are still those of that
        junction, until the car enters it.
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

    # --- actions ----------------------------------------------------------------------------------------------------

    def command(self, action: PhysicalAction, angle: int, speed: float) -> str | None:
        """Carries out a navigation action.

        Args:
            action: one of the six navigation actions.
            angle: degrees, positive left; for JTurn and LaneSwitch.
            speed: of the car [m/s].

        Returns:
            None, or the reason why nothing was changed.
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
        self._lay([Step(self.lane)], self.station)
        return None

    def _switch_lane(self, angle: int, speed: float) -> str | None:
        if angle == 0:
            return "a lane switch needs a side: a positive angle is left, a negative one right"
        target = self._plan_switch(LinkType.LANE_CHANGE_LEFT if angle > 0 else LinkType.LANE_CHANGE_RIGHT, speed)
        if isinstance(target, str):
            return target
        self._clear()
        self._manoeuvre, self._manoeuvre_angle = PhysicalAction.LANE_SWITCH, 90 if angle > 0 else -90
        self._lay([Step(self.lane), Step(target, change=True)], self.station, speed)
        return None

    def may_switch(self, side: LinkType, speed: float = 0.0) -> bool:
        """Whether a lane switch would be carried out at a speed [m/s]; `side` is one of the two lane-change types."""
        return not isinstance(self._plan_switch(side, speed), str)

    def _plan_switch(self, side: LinkType, speed: float) -> int | str:
        """The lane to switch to, or why there can be no switch."""
        name = "left" if side is LinkType.LANE_CHANGE_LEFT else "right"
        if self.in_manoeuvre or self._town.lanes[self.lane].in_junction:
            return "the car is in the middle of a manoeuvre"
        target = self._town.neighbour(self.lane, side)
        if target is None:
            return f"there is no lane to the {name}"
        if self._town.lanes[self.lane].length - self.station < MIN_SWITCH + LEAD:
            return f"there is no room left to switch to the {name}"
        lane = self._town.lanes[target]
        beside = lane.project(self._town.lanes[self.lane].position(self.station))[0]
        if switch_is_blocked(self.props, lane, beside, speed):
            return f"a roadblock is too close on the lane to the {name}"
        return target

    @property
    def turn_ahead(self) -> int | None:
        """Angle of the turn that is planned and not yet begun [degrees], or None."""
        if self._manoeuvre is not PhysicalAction.J_TURN:
            return None
        lane, connector = self._town.lanes[self.lane], self._town.lanes[self._chosen[0]]
        begun = lane.in_junction and lane.junction_id == connector.junction_id
        return None if begun else self._manoeuvre_angle

    def is_committed(self, speed: float) -> bool:
        """Whether the car cannot stop any more before the junction at which it is to turn, at this speed [m/s]."""
        if self.turn_ahead is None:
            return False
        k = self.path.index_at(self.s)
        turn = np.flatnonzero(self.path.lanes[k:] == self._chosen[0])
        if not len(turn):
            return False
        room = float(self.path.s[k + int(turn[0])]) - self.s - HALF_LENGTH
        return speed > 0.5 and speed**2 / (2 * HARD_STOP) > room

    def may_turn_round(self, speed: float) -> bool:
        """Whether a U-turn would be carried out at this speed [m/s]."""
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
        """Where a U-turn would lead and the station where it would begin, or why there can be none."""
        lane, station = self._town.lanes[self.lane], self.station
        if self.in_manoeuvre or lane.in_junction:
            return "the car is in the middle of a manoeuvre"
        begin = station + LEAD * (speed > 0.5) + max(0.0, speed**2 - U_TURN_SPEED**2) / (2 * BRAKING)
        oncoming = self._oncoming.at(lane.id, min(begin, lane.length))
        if oncoming is not None:
            # just behind a junction: go on a little, so that the turn ends before the oncoming lane does
            short = LANDING - (self._town.lanes[oncoming.lane].length - oncoming.station)
            if short > 0.0:
                begin += short
                oncoming = self._oncoming.at(lane.id, min(begin, lane.length))
        if oncoming is None:
            if self._town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT) is not None:
                return "a U-turn begins on the leftmost lane"
            return "there is no oncoming lane beside this one"
        if speed > 0.5 and begin - station + U_TURN_REACH > self.roadblock:
            return "the car is too fast to turn round before the roadblock"
        if begin > lane.length + 0.5:
            return "there is no room left to turn round"
        if landing_is_blocked(self.props, self._town.lanes[oncoming.lane], oncoming.station):
            return "a roadblock is too close on the oncoming lane"
        return oncoming, min(begin, lane.length)

    def _turn(self, angle: int, speed: float) -> str | None:
        _, free = self._under_way()  # lanes can be changed again from where a manoeuvre under way ends
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

    # --- laying the path --------------------------------------------------------------------------------------------

    def _lay(self, steps: list[Step], station: float, speed: float = 0.0, head: list[Piece] | None = None) -> None:
        """Lays the path anew: `steps[0]` from `station` on, behind the pieces of `head`."""
        pieces, self._open_end = self._lanes.lay(steps, station, speed)
        self._set_path([*(head or []), *pieces])

    def _lay_from_here(self, steps: list[Step], speed: float = 0.0) -> None:
        """Lays the path anew from the car's place, keeping the rest of a lane switch or U-turn under way."""
        head, station = self._under_way()
        self._lay(steps, station, speed, head)

    def _under_way(self) -> tuple[list[Piece], float]:
        k = self.path.index_at(self.s)
        if not self.path.manoeuvre[k]:
            return [], self.station
        end = k + int(np.argmin(self.path.manoeuvre[k:])) if not self.path.manoeuvre[k:].all() else len(self.path.s)
        cut = slice(k, end)
        piece = Piece(
            lane=self.lane,
            points=self.path.points[cut],
            heights=self.path.heights[cut],
            stations=self.path.stations[cut],
            limit=float(self.path.limits[k]),
            manoeuvre=True,
        )
        if len(piece.points) < 2:
            return [], self.station
        # the lane goes on where it did before: a little behind the end of a U-turn, lest the path turn back on itself
        landing = end if end < len(self.path.s) and int(self.path.lanes[end]) == self.lane else end - 1
        return [piece], float(self.path.stations[landing])

    def _lay_u_turn(self, oncoming: Oncoming, begin: float) -> None:
        lane, target = self._town.lanes[self.lane], self._town.lanes[oncoming.lane]
        head: list[Piece] = []
        if begin > self.station + 1e-3:
            head.append(follow(lane, self.station, begin))
        head.append(u_turn(lane, target, begin, TURNING_RADIUS))
        landing = min(oncoming.station + 0.5, target.length)
        self._lay([Step(target.id)], landing, head=head)

    def _set_path(self, pieces: list[Piece]) -> None:
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
