"""The props that the Ad-Wizard puts on the road."""

from __future__ import annotations

from enum import StrEnum
from typing import Self


class PropKind(StrEnum):
    """A kind of prop, with the size of its bounding box; values are the last part of CARLA's blueprint names.

    Attributes:
        length: size along the prop's own heading [m].
        width: size across its heading [m].
        height: size upwards [m].
    """

    length: float
    width: float
    height: float

    # A young street tree with its crown.
    TREE = "tree", 2.5, 2.5, 6.0
    # The 36-inch cone of American highway works.
    CONSTRUCTION_CONE = "constructioncone", 0.40, 0.40, 0.91
    # A container of 4 cubic yards: 4.5 x 6 x 4 feet.
    DUMPSTER = "dumpster", 1.37, 1.83, 1.22
    # A type 3 barricade (MUTCD 2009, 6F.68) of 8 feet. It faces along its heading, so it blocks with its width.
    STREET_BARRIER = "streetbarrier", 0.60, 2.44, 1.52
    # The 28-inch cone of city streets.
    TRAFFIC_CONE = "trafficcone", 0.36, 0.36, 0.71
    # A 30-inch sign whose lower edge is 7 feet above the ground (MUTCD 2009, 2A.18).
    TRAFFIC_SIGN = "trafficsign", 0.10, 0.76, 2.89

    # The defaults are never used by a member: they let type checkers accept the look-up by name, `Enum("tree")`.
    def __new__(cls, value: str, length: float = 0.0, width: float = 0.0, height: float = 0.0) -> Self:
        """Makes a member from its name and its size."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.length = length
        member.width = width
        member.height = height
        return member

    @property
    def blueprint(self) -> str:
        """The name that CARLA's blueprint library would have for the prop."""
        return f"static.prop.{self.value}"
