"""Mirror images of towns: right-hand traffic becomes left-hand traffic, and back."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from dorothie_gym.maps.driving_side import OPPOSITES
from dorothie_gym.maps.town import Town

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Junction, Lane, Signal, Site


def mirrored(town: Town) -> Town:
    """Returns the mirror image of a town, with y and headings negated and traffic on the other side.

    All ids stay, and the mirror image of the mirror image is the town, bit by bit.
    """
    return Town(
        name=town.name,
        lanes=[_lane(lane) for lane in town.lanes],
        links=[replace(link, type=OPPOSITES.get(link.type, link.type)) for link in town.links],
        junctions=[_junction(junction) for junction in town.junctions],
        streets=town.streets,
        sites=[_site(site) for site in town.sites],
        signals=[_signal(signal) for signal in town.signals],
        crosswalks=[replace(crossing, outline=_line(crossing.outline)) for crossing in town.crosswalks],
        sidewalks=[replace(walk, points=_line(walk.points)) for walk in town.sidewalks],
        programmes=town.programmes,
        traffic=town.traffic.opposite,
        cruise=town.cruise,
        titled=town.titled,
    )


def _line(points: Array) -> Array:
    """Returns the mirror image of points (n, 2) or (n, 3) [m]."""
    image = points.copy()
    image[:, 1] = -points[:, 1]
    return image


def _place(position: tuple[float, float]) -> tuple[float, float]:
    return position[0], -position[1]


def _lane(lane: Lane) -> Lane:
    return replace(lane, points=_line(lane.points))


def _junction(junction: Junction) -> Junction:
    return replace(junction, position=_place(junction.position))


def _site(site: Site) -> Site:
    return replace(site, position=_place(site.position), waypoint=_place(site.waypoint))


def _signal(signal: Signal) -> Signal:
    x, y, z = signal.position
    return replace(signal, position=(x, -y, z), heading=-signal.heading)
