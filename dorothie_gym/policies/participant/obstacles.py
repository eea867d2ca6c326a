"""Obstacles that the participant sees on the way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.observation_parser import place_on_lanes

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.observation_parser import SeenObject
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.route_progress import RouteProgress

NEXT_LANES: Final = 6
"""Number of lanes of the route on which obstacles are looked for."""


def obstacle_on_route(
    town: Town, view: ParticipantView, progress: RouteProgress, reach: float
) -> tuple[Place, SeenObject] | None:
    """Returns the first obstacle in sight on the next lanes of a route, and its place; None if there is none.

    Args:
        town: the map.
        view: observation.
        progress: the route.
        reach: distance at which an obstacle is noticed [m].
    """
    lanes = [leg.lane for leg in progress.legs[:NEXT_LANES]]
    for thing in view.objects:
        if thing.kind is ObjectClass.STATIC and thing.distance < reach:
            found = place_on_lanes(town, lanes, thing.x, thing.y)
            behind = found is not None and found[0] == view.lane and found[1] < view.station
            if found is not None and not behind:
                return found, thing
    return None
