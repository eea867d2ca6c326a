"""Numbers shared by the scripted agents: speeds in bad weather, and distances and times of spoken guidance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.ontology.actions import SPEED_STEP
from dorothie_gym.sim.ego.limits import cruise_by_limit

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

STANDING_SPEED = 0.3
"""Speed below which the agents regard the car as standing [m/s]; the engine's own limit for arrivals is stricter."""

FOG_LIMIT = 35.0
"""Fog density above which the agents call the view poor [%]."""

RAIN_LIMIT = 55.0
"""Precipitation above which the agents call the rain heavy [%]."""

FASTEST = 21.0
"""Speed at which a car can stop within its view on a clear day [m/s]: none drives faster, whatever the limit."""

USUAL_SPEED = 40
"""Default cruise speed on open road [km/h], which route costs assume."""


CALM_SPEED = 30
"""Speed at which a guided car finds a place beside a fast road [km/h]: that of the traffic in the shipped towns."""


def usual_cruise(town: Town, lane: int, pace: int = USUAL_SPEED) -> int:
    """Returns the cruise speed on a lane where nobody has asked for another [km/h].

    Args:
        town: the map; without a cruise speed of its own, cars follow the speed limits.
        lane: lane of the car.
        pace: cruise speed that a driver would choose in a town with the default one [km/h].
    """
    if town.cruise is not None:
        return int(SPEED_STEP) * round(town.cruise * pace / USUAL_SPEED / int(SPEED_STEP))
    return round(cruise_by_limit(town.lanes[lane].speed_limit * min(pace / USUAL_SPEED, 1.0)))


def reach_at(distance: float, speed: float, town: Town) -> float:
    """Returns a distance of guidance, which is meant for the usual speed, at the speed of the car [m].

    Args:
        distance: distance at the usual speed [m].
        speed: speed of the car [m/s].
        town: the map; in one with slow traffic the distance stays as it is.
    """
    return distance if town.cruise is not None else distance * max(3.6 * speed / USUAL_SPEED, 1.0)


NUDGE_DISTANCE = 3.0
"""Distance meant by "a bit further" [m], of which a car stops half a metre short.

Two of them lead to a goal from `participant.final_approach.FURTHER` before it. One does not lead past the stretch
around the goal that counts as arrived.
"""


@dataclass(frozen=True, kw_only=True)
class GuidanceConfig:
    """Distances and times of turn-by-turn guidance, for agents that give it or expect it.

    Attributes:
        turn_distance: distance to a junction at which a turn is announced [m]; about 10 s at the usual speed.
        stop_distance: distance to the goal at which stopping is announced [m].
        repeat_after: time after which an instruction without effect is repeated [s].
        roadblock_sight: distance at which a roadblock on the route is noticed [m].
        arrived_within: distance to the goal within which a standing car has arrived [m]; the engine accepts 2 m.
    """

    turn_distance: float = 110.0
    stop_distance: float = 95.0
    repeat_after: float = 9.0
    roadblock_sight: float = 80.0
    arrived_within: float = 1.9
