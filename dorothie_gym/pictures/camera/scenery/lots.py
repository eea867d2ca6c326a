"""Lots: ground reserved for the landmarks of the sites."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.pictures.camera.mesh import oriented
from dorothie_gym.support.copying import shared


@shared
@dataclass(frozen=True)
class Lot:
    """Ground reserved for the landmark of a site.

    Attributes:
        site: id of the site.
        place: position of the site (x, y) [m].
        heading: viewing direction of a person who looks at it from its street [rad].
        front: centre of its front edge (x, y) [m].
        length: along the street [m].
        depth: away from the street [m].
        key: number that determines the design of a house or person there (`site_key`).
    """

    site: int
    place: tuple[float, float]
    heading: float
    front: tuple[float, float]
    length: float
    depth: float
    key: int

    def at(self, deep: float, right: float) -> tuple[float, float]:
        """Returns the world position (x, y) [m] of a place in the lot: behind its front, to the right of the centre."""
        ((x, y),) = oriented([(deep, right)], self.front, self.heading).tolist()
        return x, y

    @property
    def middle(self) -> tuple[float, float]:
        """Centre of the lot (x, y) [m]."""
        return self.at(self.depth / 2.0, 0.0)
