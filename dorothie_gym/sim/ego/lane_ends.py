"""Lanes that end, as the ego leaves and enters them (compiled)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.sim.ego.limits import LEAD, MIN_SWITCH, SWITCH_TIME
from dorothie_gym.sim.ego.path_builder import position_on, project_on
from dorothie_gym.support.compilation import compiled

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays


@compiled
def may_merge(town: TownArrays, number: int, station: float) -> bool:
    """Returns whether a lane ends and can be left for the one beside it, from a station [m] on.

    Close to its end, the lane beside must lead on without a choice: else there is no way to lay before a turn is
    chosen.
    """
    beside = int(town.ways[number].merge)
    if beside < 0:
        return False
    if town.lanes[number].length - station >= MIN_SWITCH + LEAD:
        return True
    rest = town.lanes[beside].length - opposite_end(town, number, beside)
    return bool(rest >= MIN_SWITCH + LEAD or town.ways[beside].onward >= 0 or town.ways[beside].merge >= 0)


@compiled
def may_enter(town: TownArrays, number: int, target: int, station: float, speed: float) -> bool:
    """Returns whether a switch from a station of a lane at a speed leads to a lane with room to leave it again."""
    if town.ways[target].merge < 0:
        return True
    x, y = position_on(town.points, town.lanes[number], station)
    there, _ = project_on(town, target, x, y)
    return bool(there + 2.0 * LEAD + max(MIN_SWITCH, SWITCH_TIME * speed) + MIN_SWITCH <= town.ways[target].end)


@compiled
def opposite_end(town: TownArrays, number: int, beside: int) -> float:
    """Returns the station of a lane beside the end of another one [m]."""
    x, y = position_on(town.points, town.lanes[number], town.lanes[number].length)
    station, _ = project_on(town, beside, x, y)
    return station
