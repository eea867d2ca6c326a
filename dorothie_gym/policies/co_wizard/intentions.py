"""Driving goals of the scripted Co-Wizard: requested turns and manoeuvres, halts, speed and lights."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.travel_time import CruiseSpeed


class Wish(enum.Enum):
    """Manoeuvre that the participant requested and that has not begun yet."""

    U_TURN = "u_turn"
    SWITCH_LEFT = "switch_left"
    SWITCH_RIGHT = "switch_right"

    @classmethod
    def switch(cls, direction: Direction | None, traffic: DrivingSide) -> Wish:
        """Returns the lane change to a side; without one, to the faster lane, towards the middle of the road."""
        if direction is Direction.RIGHT or (direction is not Direction.LEFT and traffic is DrivingSide.LEFT):
            return cls.SWITCH_RIGHT
        return cls.SWITCH_LEFT


@dataclass(frozen=True, kw_only=True)
class Directive:
    """Turn that the participant requested.

    Attributes:
        direction: direction of the turn; None if only a street was named.
        street: the street named, UNKNOWN if none was.
        skip: junctions to pass before the turn is taken.
        junction: the next junction with a choice when the directive was heard, -1 if there was none.
    """

    direction: Direction | None
    street: StreetName = StreetName.UNKNOWN
    skip: int = 0
    junction: int = -1


@dataclass(frozen=True, kw_only=True)
class Intentions:
    """Driving goals of the next seconds.

    Attributes:
        directive: requested turn.
        wish: requested manoeuvre.
        wish_until: time at which the manoeuvre is given up [s].
        wish_sent: whether it was commanded.
        halted: whether the car must stand.
        nudge: place a little further on where the car must stop again.
        creeping: whether the goal is close and its guessed place is carried along ahead of the car.
        arrived: whether the car has stopped at its goal and waits for the next task.
        sent_on: whether the stop ends a short advance on request, at a place that may be the goal.
        pausing: whether the car stops before the junction ahead until the way is known.
        speed: target cruise speed [km/h].
        slow_until: time at which a temporary speed ends [s].
        usual: cruise speed on open road [km/h].
        asked: whether that was asked for, so that the speed limit has no effect on it.
        lights: target state of the headlights; None if nothing was said about them.
    """

    directive: Directive | None = None
    wish: Wish | None = None
    wish_until: float = 0.0
    wish_sent: bool = False
    halted: bool = False
    nudge: Place | None = None
    creeping: bool = False
    arrived: bool = False
    sent_on: bool = False
    pausing: bool = False
    speed: int
    slow_until: float = math.inf
    usual: int
    asked: bool = False
    lights: bool | None = None

    def resumed(self) -> Intentions:
        """Ends a halt."""
        return replace(self, halted=False)

    def started(self) -> Intentions:
        """Ends a halt and a stay at the goal."""
        return replace(self, halted=False, arrived=False)

    def halting(self) -> Intentions:
        """Lets the car stand; other intentions stay."""
        return replace(self, halted=True)

    def stopped(self) -> Intentions:
        """Carries out an instruction to stop: halts the car and drops nudge and manoeuvre."""
        return replace(self, halted=True, nudge=None, wish=None)

    def stopped_at_place(self, *, arrived: bool, sent_on: bool) -> Intentions:
        """Halts the car at a place; `arrived` is true at a goal, `sent_on` at the end of a nudge."""
        return replace(self, halted=True, nudge=None, arrived=arrived, sent_on=sent_on)

    def blocked(self) -> Intentions:
        """Drops directive and nudge and halts the car before an obstacle."""
        return replace(self, directive=None, nudge=None, halted=True)

    def turning(self, directive: Directive) -> Intentions:
        """Carries out an instruction to turn."""
        return replace(self, directive=directive, wish=None, halted=False, nudge=None, creeping=False, arrived=False)

    def directed(self, directive: Directive | None) -> Intentions:
        """Sets the directive, or drops it (None); other intentions stay."""
        return replace(self, directive=directive)

    def turning_round(self, until: float, *, creeping: bool) -> Intentions:
        """Carries out an instruction to turn round, given up after `until` [s]."""
        return replace(
            self,
            wish=Wish.U_TURN,
            wish_until=until,
            creeping=creeping,
            directive=None,
            halted=False,
            nudge=None,
            arrived=False,
        )

    def switching(self, wish: Wish, until: float) -> Intentions:
        """Carries out an instruction to switch lanes, given up after `until` [s]."""
        return replace(self, wish=wish, wish_until=until, wish_sent=False, halted=False)

    def with_wish_sent(self) -> Intentions:
        """Records that the manoeuvre was commanded; there may be no room for it yet."""
        return self if self.wish_sent else replace(self, wish_sent=True)

    def wishing_until(self, until: float) -> Intentions:
        """Extends the time for the manoeuvre to `until` at least [s]."""
        return replace(self, wish_until=max(self.wish_until, until))

    def without_wish(self) -> Intentions:
        """Drops the manoeuvre."""
        return replace(self, wish=None)

    def without_nudge(self) -> Intentions:
        """Drops the nudge."""
        return replace(self, nudge=None)

    def without_manoeuvres(self) -> Intentions:
        """Drops directive and manoeuvre."""
        return replace(self, directive=None, wish=None)

    def nudged(self, place: Place) -> Intentions:
        """Goes on to a place close ahead, to stop there again."""
        return replace(self, nudge=place, halted=False)

    def proceeding(self) -> Intentions:
        """Carries out an instruction to continue along the lane."""
        return replace(self, halted=False, arrived=False, creeping=False, wish=None)

    def creeping_up(self) -> Intentions:
        """Comes up slowly to a place close ahead whose exact position is unknown."""
        return replace(self, creeping=True, halted=False, arrived=False, directive=None)

    def for_new_goal(self) -> Intentions:
        """Drops intentions for another goal and ends a halt."""
        return replace(self, directive=None, wish=None, nudge=None, halted=False, arrived=False, creeping=False)

    def for_unknown_goal(self) -> Intentions:
        """Ends the approach to the previous goal."""
        return replace(self, creeping=False, arrived=False)

    def without_goal(self) -> Intentions:
        """Drops all intentions for the goal, except a halt."""
        return replace(self, directive=None, nudge=None, wish=None, creeping=False, arrived=False)

    def departed(self) -> Intentions:
        """Ends the stay at the goal; a halt stays."""
        return replace(self, arrived=False)

    def with_pause(self, pausing: bool) -> Intentions:
        """Sets whether to stop before the junction ahead."""
        return replace(self, pausing=pausing)

    @property
    def cruise(self) -> CruiseSpeed:
        """Cruise speed that is meant now, and after a temporary one."""
        until = self.slow_until if self.speed < self.usual else math.inf
        return CruiseSpeed(self.speed, self.usual, until, by_limit=not self.asked)

    def with_speed(self, speed: int) -> Intentions:
        """Sets the target cruise speed [km/h] until further notice; the usual speed stays unchanged."""
        return replace(self, speed=speed, slow_until=math.inf)

    def slow_longer(self, seconds: float) -> Intentions:
        """Extends a temporary speed, by the time that the car stands [s]."""
        return replace(self, slow_until=self.slow_until + seconds)

    def with_asked_speed(self, speed: int, open_road: int, until: float) -> Intentions:
        """Sets the requested cruise speed [km/h].

        Args:
            speed: requested speed [km/h].
            open_road: lower speeds are temporary [km/h].
            until: end of a temporary speed [s].
        """
        if speed < open_road:
            return replace(self, speed=speed, slow_until=until)
        return replace(self, speed=speed, usual=speed, slow_until=until, asked=True)

    def calmed(self, most: int) -> Intentions:
        """Limits the speed after a temporary one to `most` [km/h], until the end of the trip."""
        return replace(self, usual=min(self.usual, most), asked=True)

    def unhurried(self) -> Intentions:
        """Forgets that a speed was asked for, at the end of a trip."""
        return replace(self, asked=False) if self.asked else self

    def on_lane(self, usual: int) -> Intentions:
        """Sets the cruise speed of a lane [km/h], unless another one was asked for; a temporary one stays."""
        if self.asked or usual == self.usual:
            return self
        return replace(self, speed=usual if self.speed == self.usual else self.speed, usual=usual)

    def with_lights(self, on: bool) -> Intentions:
        """Sets the target state of the headlights."""
        return replace(self, lights=on)
