"""Time allowed for a session: that of its configuration or, where the errands are far apart, more."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from dorothie_gym.maps.routing import LaneEntry, router
from dorothie_gym.session.config import EnvConfig

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Route
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.scenario import Scenario

_SLACK: Final = 3.0  # time allowed as a multiple of that of the reference route; set by hand

_FASTEST: Final = 20.0  # speed that the view allows on a clear day, where the limit is higher [m/s]
_JUNCTION: Final = 6.0  # time lost at a junction, waiting included [s]
_U_TURN: Final = 10.0  # [s]
_STOP: Final = 30.0  # time lost at the place of an errand, with the talk about the next one [s]


def time_allowed(town: Town, scenario: Scenario, config: EnvConfig) -> float:
    """Returns the time after which a session is truncated [s].

    It is `EnvConfig.max_seconds`. The default is a minimum in towns where cars drive as fast as the lanes allow: there
    the time is three times that of the reference route, if that is longer. With `EnvConfig.time_factor` it is a
    multiple of the reference time of the scenario, in all towns: that of `Scenario.reference`, else the expected one.

    Args:
        town: the map.
        scenario: the scenario.
        config: settings of the session.
    """
    if config.time_factor is not None:
        measured = scenario.reference
        reference = reference_seconds(town, scenario) if measured is None else measured.seconds
        return min(config.max_seconds, float(round(config.time_factor * reference)))
    if town.cruise is not None or config.max_seconds != EnvConfig.max_seconds:
        return config.max_seconds
    return max(config.max_seconds, float(round(_SLACK * reference_seconds(town, scenario))))


def time_extended(seconds: float, planned: int, live: int, config: EnvConfig) -> float:
    """Returns the time allowed [s] after subgoals were added: with `EnvConfig.time_factor`, more in proportion.

    Args:
        seconds: time allowed at the start [s].
        planned: number of live subgoals at the start.
        live: number of live subgoals now; with fewer than at the start the time stays.
        config: settings of the session.
    """
    if config.time_factor is None or live <= planned or not planned:
        return seconds
    return min(config.max_seconds, seconds * live / planned)


def reference_seconds(town: Town, scenario: Scenario) -> float:
    """Returns the expected time of the cheapest routes from errand to errand in the order of the story [s].

    Errands without a route to them are left out.
    """
    goals = [scenario.storyboard.landmarks[subgoal.landmark] for subgoal in scenario.storyboard.subgoals]
    places = [scenario.departure, *((goal.lane, goal.station) for goal in goals)]
    routes = (router(town).route(start, goal) for start, goal in pairwise(places))
    return sum(_seconds(town, route) + _STOP for route in routes if route is not None)


def _seconds(town: Town, route: Route) -> float:
    """Returns the expected time of a route [s]."""
    time = _JUNCTION * len(route.junctions(town))
    for leg in route.legs:
        time += max(leg.end - leg.start, 0.0) / min(town.lanes[leg.lane].speed_limit, _FASTEST)
        time += _U_TURN if leg.entry is LaneEntry.U_TURN else 0.0
    return time
