"""Gardens in front of houses: hedges, fences and flowers, of few triangles, and shrubs for lawns."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, oriented
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on
from dorothie_gym.pictures.camera.scenery.trees import add_clump
from dorothie_gym.pictures.maps.shapes import disc
from dorothie_gym.tasks.landmark_designs import Garden

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.models.solids import Rgb

SHRUBS: Final = 4
"""Number of forms of shrubs; every second one blooms."""

_GATE: Final = 1.1  # [m] half the gap in front of the door
_UNDER: Final = 0.25  # [m] by which plants and posts go into the ground
_HEDGE: Final = 0.6, 1.0  # [m] depth and height
_BED: Final = 0.9, 0.22  # [m] depth and height of a flower bed
_RAILS: Final = (0.30, 0.42), (0.74, 0.88)  # [m] lower and upper edges
_POST: Final = 0.14, 1.0  # [m] width and height
_LEAVES: Final[tuple[Rgb, ...]] = ((66, 104, 48), (82, 112, 44), (58, 92, 56))
_BLOOMS: Final[tuple[Rgb, ...]] = ((214, 48, 56), (246, 206, 60), (236, 132, 176), (244, 242, 236), (146, 92, 190))
_SOIL: Final[Rgb] = (92, 74, 54)
_WHITE: Final[Rgb] = (240, 240, 234)
_BARK: Final[Rgb] = (104, 86, 68)


class Plot(NamedTuple):
    """Ground in front of a house.

    Attributes:
        front: centre of its edge towards the street (x, y) [m].
        heading: viewing direction of a person who looks at the house from the street [rad].
        half: half its length along the street [m].
        depth: from its edge to the house [m].
        tone: number that chooses shades and blooms.
    """

    front: tuple[float, float]
    heading: float
    half: float
    depth: float
    tone: int


def add_garden(builder: MeshBuilder, garden: Garden, plot: Plot, ground: Heights, *, fine: bool) -> None:
    """Adds plants and objects in front of a house; a tree adds nothing, because it stands beside the house.

    Args:
        builder: receives the triangles.
        garden: kind of the garden.
        plot: ground in front of the house.
        ground: heights of the ground.
        fine: whether the garden has more details, for landmarks.
    """
    sides = [(sign * _GATE, sign * plot.half) for sign in (-1.0, 1.0) if plot.half > _GATE + 0.3]
    for near, far in sides or [(-plot.half, plot.half)]:
        run = _Run(builder, plot, ground, (min(near, far), max(near, far)))
        match garden:
            case Garden.HEDGE:
                run.box((0.0, min(_HEDGE[0], plot.depth)), _HEDGE[1], _LEAVES[plot.tone % len(_LEAVES)])
            case Garden.FENCE:
                run.fence(0.4 if fine else 2.2)
            case Garden.FLOWERS:
                run.flowers(0.55 if fine else 1.4)


class _Run:
    """A straight part of a garden, between two places to the right of the door [m]."""

    def __init__(self, builder: MeshBuilder, plot: Plot, ground: Heights, right: tuple[float, float]) -> None:
        self._builder, self._plot, self._right = builder, plot, right
        feet = feet_on(ground, self._corners((0.0, 0.5)))
        self._low, self._high = float(feet.min()) - _UNDER, float(feet.max())

    def _corners(self, deep: tuple[float, float], right: tuple[float, float] | None = None) -> Array:
        low, high = self._right if right is None else right
        corners = [(deep[1], low), (deep[1], high), (deep[0], high), (deep[0], low)]
        return oriented(corners, self._plot.front, self._plot.heading)

    def box(self, deep: tuple[float, float], height: float, colour: Rgb) -> None:
        """Adds a box of leaves."""
        self._builder.prism(
            self._corners(deep),
            self._low,
            self._high + height,
            colour=colour,
            kind=ObjectClass.VEGETATION,
            top_colour=np.array(colour) * 1.12,
            texture=Texture.LEAVES,
            repeat=(1.6, 1.6),
        )

    def fence(self, distance: float) -> None:
        """Adds two rails, and posts or pickets at a distance [m] from each other, visible from both sides."""
        low, high = self._right
        for bottom, top in _RAILS:
            self._board((low, high), bottom, top)
        count = max(2, round((high - low) / distance) + 1)
        for k in range(count):
            middle = low + _POST[0] / 2.0 + (high - low - _POST[0]) * k / (count - 1)
            self._board((middle - _POST[0] / 2.0, middle + _POST[0] / 2.0), -_UNDER, _POST[1], deep=0.03)

    def _board(self, right: tuple[float, float], bottom: float, top: float, deep: float = 0.05) -> None:
        left, end = oriented([(deep, right[0]), (deep, right[1])], self._plot.front, self._plot.heading).tolist()
        low, high = self._high + bottom, self._high + top
        corners = [(*left, low), (*left, high), (*end, high), (*end, low)]
        self._builder.quad(corners, colour=_WHITE, kind=ObjectClass.FENCE, two_sided=True)

    def flowers(self, distance: float) -> None:
        """Adds a bed with blooms at a distance [m] from each other."""
        deep = min(_BED[0], self._plot.depth)
        self._builder.prism(
            self._corners((0.0, deep)),
            self._low,
            self._high + _BED[1],
            colour=_SOIL,
            kind=ObjectClass.VEGETATION,
            top_colour=_LEAVES[self._plot.tone % len(_LEAVES)],
        )
        low, high = self._right
        count = max(1, int((high - low) / distance))
        for k in range(count):
            middle = low + (k + 0.5) * (high - low) / count
            bloom = _BLOOMS[(self._plot.tone + k) % len(_BLOOMS)]
            half = min(0.42 * distance, 0.3)
            feet = self._corners((0.1 * deep, 0.9 * deep), (middle - half, middle + half))
            ring = np.column_stack((feet, np.full(4, self._high + _BED[1])))
            tip = np.array([*feet.mean(axis=0), self._high + _BED[1] + 0.4])
            sides = [[ring[(side + 1) % 4], tip, ring[side]] for side in range(4)]
            self._builder.triangles(sides, colour=bloom, kind=ObjectClass.VEGETATION)


@lru_cache(maxsize=SHRUBS)
def shrub_form(form: int) -> Mesh:
    """Returns a shrub with a radius of 1 m around the origin."""
    rng = np.random.default_rng(100 + form)
    builder = MeshBuilder()
    leaves = np.array(_LEAVES[form % len(_LEAVES)], dtype=np.float64)
    add_clump(builder, (0.0, 0.0, 0.35), (1.0, 0.9), leaves, rng, sides=5, open_below=True)
    if form % 2:
        bloom = np.array(_BLOOMS[form // 2 % len(_BLOOMS)], dtype=np.float64)
        add_clump(builder, (0.15, 0.1, 0.95), (0.6, 0.42), bloom, rng, sides=3, open_below=True)
    return builder.build()


@lru_cache(maxsize=1)
def small_tree() -> Mesh:
    """Returns a garden tree of few triangles, whose crown has a radius of 1 m."""
    rng = np.random.default_rng(110)
    builder = MeshBuilder()
    builder.prism(
        disc((0.0, 0.0), 0.09, 4),
        -0.2,
        1.4,
        colour=_BARK,
        kind=ObjectClass.VEGETATION,
        texture=Texture.BARK,
        closed=(False, False),
    )
    add_clump(builder, (0.0, 0.0, 2.0), (1.0, 1.05), np.array(_LEAVES[1], dtype=np.float64), rng, sides=6)
    return builder.build()
