"""Expected travel time along a route, as the scripted Co-Wizard states it."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING, Final, NamedTuple

from dorothie_gym.maps.routing import LaneEntry, Leg
from dorothie_gym.maps.town import LightColour, Town
from dorothie_gym.policies.scripted_agent_limits import FASTEST, STANDING_SPEED, USUAL_SPEED

if TYPE_CHECKING:
    from dorothie_gym.policies.route_progress import RouteProgress

# Fitted to 3,600 lanes that cars of 183 scripted sessions have passed without standing, delays and pulling up by hand.
# Of 408 times in 20 of these sessions, 83 % are right within a factor of 1.5, with a median ratio of 0.96.
_PACE: Final = 10.3  # speed between junctions [m/s]
_APPROACH: Final = 1.2  # time lost before a junction [s]
_CROSSING, _CROSSING_PACE = 2.3, 20.6  # constant time in a junction [s], and speed for its length [m/s]
_TURNING_ROUND: Final = 8.0  # time lost in a U-turn [s]
_DELAYS: Final = (0.8, 0.9, 1.0, 1.1, 1.2)  # factors on the time of driving, equally probable
_SETTING_OFF: Final = 2.0  # from a standstill, also before a light that turns green [s]
_PULLING_UP: Final = 5.0  # at the goal [s]
_LONGEST_RED: Final = 120.0  # [s]
_SLOWEST: Final = 10.0  # cruise speed below which cars are not set [km/h]


class CruiseSpeed(NamedTuple):
    """Cruise speed that a car is set to.

    Attributes:
        now: present speed [km/h].
        later: speed from a time on [km/h].
        until: that time [s].
        by_limit: whether the speed from that time on, and the present one if it is the same, follow the speed limits.
    """

    now: float = USUAL_SPEED
    later: float = USUAL_SPEED
    until: float = math.inf
    by_limit: bool = False

    def pace(self, time: float, town: Town, lane: int) -> float:
        """Returns the speed between junctions on a lane at a time [m/s, s]."""
        speed = self.now if time < self.until else self.later
        if town.cruise is not None:
            return _PACE * min(max(speed, _SLOWEST) / USUAL_SPEED, 1.0)
        limit = 3.6 * min(town.lanes[lane].speed_limit, FASTEST)
        free = self.by_limit and speed >= self.later
        return _PACE * max(limit if free else min(speed, limit), _SLOWEST) / USUAL_SPEED


def travel_time(
    town: Town,
    progress: RouteProgress,
    station: float,
    now: float,
    speed: float,
    cruise: CruiseSpeed | None = None,
) -> float:
    """Returns the expected time until the car stops at the goal of a route [s]; infinity without a route.

    The car waits at the lights that are red when it reaches them: navigation systems know their programmes. As
    it may just miss a green light, or just catch it, the time is the mean of those of quicker and slower drives.

    Args:
        town: the map.
        progress: route and progress on it.
        station: distance of the car along its lane [m].
        now: time [s].
        speed: current speed [m/s].
        cruise: cruise speed of the car; None for the usual one. A faster one saves no time in a town with slow traffic.
    """
    if not progress.legs:
        return math.inf
    begun = now + (_SETTING_OFF if speed < STANDING_SPEED else 0.0)
    driven = CruiseSpeed(by_limit=True) if cruise is None else cruise
    return statistics.fmean(_arrival(town, progress, station, begun, driven, delay) for delay in _DELAYS) - now


def _arrival(
    town: Town, progress: RouteProgress, station: float, begun: float, cruise: CruiseSpeed, delay: float
) -> float:
    """Returns the time at which a car that sets off at a time stops at the goal, with a factor on driving."""
    time, start = begun, station
    for leg, following in zip(progress.legs, (*progress.legs[1:], None), strict=True):
        time += delay * _seconds_on(town, leg, start, cruise.pace(time, town, leg.lane))
        start = -math.inf
        if following is not None:
            if town.lanes[following.lane].in_junction:
                time += delay * _APPROACH
            time = _after_red(town, leg.lane, time)
    return time + _PULLING_UP


def _seconds_on(town: Town, leg: Leg, start: float, pace: float) -> float:
    """Returns the time for a leg after a place [s]; for minus infinity, of the whole leg with the U-turn into it."""
    length = max(leg.end - max(leg.start, start), 0.0)
    if town.lanes[leg.lane].in_junction:
        return max(_CROSSING + length / _CROSSING_PACE, length / pace)
    return length / pace + (_TURNING_ROUND if leg.entry is LaneEntry.U_TURN and start == -math.inf else 0.0)


def _after_red(town: Town, lane: int, time: float) -> float:
    """Returns the time at which a car that reaches the end of a lane at a time [s] drives on."""
    if town.light(lane, time) is not LightColour.RED:  # none, or the car crosses: there is no room to stop for yellow
        return time
    until = time
    while town.light(lane, until) is not LightColour.GREEN and until < time + _LONGEST_RED:
        until += 1.0
    return until + _SETTING_OFF
