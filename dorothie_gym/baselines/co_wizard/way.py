"""Places and junctions on the way ahead of the car."""

from __future__ import annotations

from typing import Final

from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.route_progress import Choice, default_lane_distance, lanes_ahead
from dorothie_gym.policies.turn_lanes import next_turn_lane

SIGHT: Final = 80.0
"""Distance along the default lanes within which a place is looked for [m]; as that of the scripted Co-Wizard."""


def junction_meant(town: Town, view: CoWizardView) -> Choice | None:
    """Returns the next junction with a choice or with turn lanes."""
    turn_lane = next_turn_lane(town, view.lane, view.station)
    nearer = turn_lane is not None and (view.choice is None or turn_lane.distance < view.choice.distance)
    return turn_lane if nearer else view.choice


def ahead_of(town: Town, view: CoWizardView, place: Place) -> float | None:
    """Returns the distance to a place along the default lanes [m]; None if it is not near on them."""
    return default_lane_distance(town, view.here, place, SIGHT)


def place_ahead(town: Town, view: CoWizardView, distance: float) -> Place:
    """Returns the place some way ahead on the default lanes [m]; the end of the last lane before a junction."""
    left = view.station + distance
    lanes = lanes_ahead(town, view.lane, view.station, distance)
    for lane in lanes[:-1]:
        if left <= town.lanes[lane].length:
            return lane, left
        left -= town.lanes[lane].length
    return lanes[-1], min(left, town.lanes[lanes[-1]].length)
