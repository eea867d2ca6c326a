"""Pins of a map: names that distinguish landmarks of one kind, and the places where a stop counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.tasks.catalogue import catalogue, map_label

if TYPE_CHECKING:
    from dorothie_gym.lab.console.lane_lookup import LaneLookup


class Pin(NamedTuple):
    """Landmark on the map of a role.

    Attributes:
        name: landmark of the ontology.
        position: (x, y) [m].
        lane: id of the lane that gives access.
        station: distance of the stopping place along the lane [m].
        street: index of the street; -1 for none.
    """

    name: LandmarkName
    position: tuple[float, float]
    lane: int
    station: float
    street: int


def drawn_names(streets: Iterable[StreetName]) -> list[str]:
    """Returns the names of streets in a session as maps draw them; empty for streets without one."""
    return ["" if name is StreetName.UNKNOWN else name.label for name in streets]


def pin_rows(
    pins: Sequence[Pin], streets: Sequence[str], places: LaneLookup
) -> list[tuple[str, float, float, str, float, float, int]]:
    """Returns the pins in JSON types.

    The columns are landmark, x, y [m], name on the map, x and y of the stopping place [m], and index of the street.

    Args:
        pins: landmarks that the role knows; the names depend only on them, so they reveal no other landmarks.
        streets: name of each street on the map; empty where it has none.
        places: lanes of the town.
    """
    rows = []
    for pin, name in zip(pins, _names(pins, streets), strict=True):
        x, y = places.position(pin.lane, pin.station)
        position = (_metres(pin.position[0]), _metres(pin.position[1]))
        rows.append((pin.name.label, *position, name, _metres(x), _metres(y), pin.street))
    return rows


def _names(pins: Sequence[Pin], streets: Sequence[str]) -> list[str]:
    """Returns the names on the map: of houses and people with their street, and with a number if that is not enough."""
    named = [
        f"{map_label(pin.name)}, {street}" if (street := _street(pin, streets)) else map_label(pin.name) for pin in pins
    ]
    return list(_numbered(named))


def _numbered(names: Sequence[str]) -> Iterable[str]:
    total, seen = Counter(names), Counter[str]()
    for name in names:
        seen[name] += 1
        kind, comma, street = name.partition(",")
        yield name if total[name] == 1 else f"{kind} {seen[name]}{comma}{street}"


def _street(pin: Pin, streets: Sequence[str]) -> str:
    """Returns the street of a landmark that may occur several times in a town; "" for others and unnamed streets."""
    if not catalogue()[pin.name].repeatable:
        return ""
    return streets[pin.street] if 0 <= pin.street < len(streets) else ""


def _metres(value: float) -> float:
    return round(float(value), 1)
