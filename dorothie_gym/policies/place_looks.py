"""Looks of landmarks: of houses and people as they stand in this town, by the designs that the camera draws."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.looks import Appearance, distinguishing
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks.landmark_designs import colour_name, house_design, person_design, site_key

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.observation_parser import SeenLandmark

_AT_SITE = 2.0
"""Largest distance of a landmark from its site [m]: positions are rounded in observations and recordings."""


@lru_cache(maxsize=512)
def look_at(town: Town, name: LandmarkName, x: float, y: float) -> Appearance | None:
    """Returns the look of a house or person at a position [m]; None for other landmarks, or if no site is there."""
    if name not in (LandmarkName.HOUSE, LandmarkName.PERSON) or not town.sites:
        return None
    distance, site = min((pm.hypot(each.position[0] - x, each.position[1] - y), each.id) for each in town.sites)
    if distance > _AT_SITE:
        return None
    if name is LandmarkName.PERSON:
        clothes = person_design(site_key(town.name, site))
        return Appearance(coat=colour_name(clothes.coat), trousers=colour_name(clothes.trousers))
    house = house_design(site_key(town.name, site))
    return Appearance(
        facade=colour_name(house.wall),
        storeys=house.storeys,
        roof=colour_name(house.roof),
        garden=str(house.garden),
        frames=colour_name(house.trim),
    )


def look_of(town: Town, mark: SeenLandmark) -> Appearance | None:
    """Returns the look of a landmark on the map, as `look_at`."""
    return look_at(town, mark.name, mark.x, mark.y)


def distinguishing_look(town: Town, mark: SeenLandmark, marks: Iterable[SeenLandmark]) -> Appearance | None:
    """Returns the attributes that distinguish a house or person from the others of its kind on the map."""
    look = look_of(town, mark)
    if look is None:
        return None
    others = (look_of(town, other) for other in marks if other.name is mark.name and other.row != mark.row)
    return distinguishing(look, [other for other in others if other is not None])
