"""Buildings along the streets of a town, of the kind of their quarter; fictional, chosen by the town's name."""

from __future__ import annotations

import enum
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, oriented
from dorothie_gym.pictures.camera.patterns import BAYS
from dorothie_gym.pictures.camera.scenery.clearance import Clearance, free_of, rectangles
from dorothie_gym.pictures.camera.scenery.houses import WALLS, add_roof, house_look
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on
from dorothie_gym.pictures.maps.borders import BorderKind
from dorothie_gym.pictures.maps.medians import held
from dorothie_gym.pictures.maps.shapes import polyline_stations, sample, side_line, widths_at
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.map_layers import MapLayers

STOREY = 3.2
"""Height of a storey, and width of a bay with a window [m]."""

_SHOP = 3.8  # [m] height of a storey with shops
_SHOP_BAY = 4.4  # [m] width of a shop
_SETBACKS = np.array([3.4, 4.4, 5.6, 7.2, 9.5])  # [m] from the edge of the road to the front of a building
_HOUSE_SETBACKS = np.array([6.4, 5.4, 7.6, 4.4, 3.4])  # [m] of houses, at first with a garden in front
_SMALLER = np.array([1.0, 0.75, 0.55])  # sizes that are tried, relative to the desired one
_TRY_AGAIN = 4.0  # [m] along the street
_CENTRE, _RIM = 0.45, 0.9  # radii of the centre and of the suburbs, relative to that of the town
_UNDER = 0.4  # [m] by which walls go into the ground
_SHORTEST = 8.0  # [m] length of an edge of a junction
_EVEN = 0.05  # [m] difference of height below which a building needs no plinth


class Quarter(enum.IntEnum):
    """Kind of a quarter."""

    CENTRE = 0
    HOMES = 1
    SUBURB = 2


class Style(enum.IntEnum):
    """Kind of a building."""

    BRICK = 0
    PLASTER = 1
    OFFICE = 2
    PANELS = 3
    HOUSE = 4


@dataclass(frozen=True)
class _Manner:
    """Style of the buildings of a quarter.

    Attributes:
        styles: shares of the styles.
        storeys: fewest and most.
        length, depth: smallest and largest [m].
        gap: smallest and largest distance between neighbours [m].
        built: share of the lots with a building.
        shops: share of the buildings of brick and plaster with shops.
    """

    styles: tuple[float, float, float, float, float]
    storeys: tuple[int, int]
    length: tuple[float, float]
    depth: tuple[float, float]
    gap: tuple[float, float]
    built: float
    shops: float


_MANNERS = {
    Quarter.CENTRE: _Manner((0.3, 0.26, 0.26, 0.18, 0.0), (3, 8), (14.0, 26.0), (11.0, 16.0), (0.0, 0.6), 0.97, 0.75),
    Quarter.HOMES: _Manner((0.36, 0.38, 0.04, 0.1, 0.12), (2, 5), (11.0, 22.0), (10.0, 14.0), (0.2, 4.0), 0.9, 0.35),
    Quarter.SUBURB: _Manner((0.1, 0.12, 0.0, 0.0, 0.78), (1, 2), (9.0, 14.0), (8.0, 11.0), (5.0, 16.0), 0.65, 0.05),
}
_WALLS = {
    Style.BRICK: (
        Texture.BRICK_WINDOWS,
        ((168, 98, 80), (150, 84, 68), (182, 126, 98), (134, 86, 76), (158, 112, 92), (188, 140, 116)),
    ),
    Style.PLASTER: (
        Texture.PLASTER_WINDOWS,
        ((228, 216, 192), (206, 210, 206), (218, 192, 160), (190, 200, 208), (232, 224, 212), (204, 176, 152)),
    ),
    Style.OFFICE: (Texture.OFFICE, ((244, 248, 252), (206, 224, 234), (226, 226, 214), (196, 206, 204))),
    Style.PANELS: (Texture.PANELS, ((222, 218, 208), (206, 210, 214), (214, 204, 188), (190, 180, 170))),
    Style.HOUSE: (Texture.HOUSE, WALLS),
}
_FLAT_ROOFS = ((128, 126, 122), (104, 104, 106), (142, 130, 116), (118, 124, 112))
_SHADES = 0.88, 0.03  # darkest shade of a colour, and the step between shades of neighbouring tones


@dataclass(frozen=True)
class Building:
    """Building on its ground.

    Attributes:
        centre: (x, y) [m].
        heading: viewing direction of a person who looks at its front from the street [rad].
        length: along the street [m].
        depth: away from it [m].
        storeys: number of storeys.
        style: kind of building.
        shops: whether there are shops on the ground floor.
        tone: number that chooses its colours.
    """

    centre: tuple[float, float]
    heading: float
    length: float
    depth: float
    storeys: int
    style: Style
    shops: bool
    tone: int

    @property
    def outline(self) -> Array:
        """Corners (4, 2) [m]."""
        x, y = self.depth / 2.0, self.length / 2.0
        return oriented([(x, -y), (x, y), (-x, y), (-x, -y)], self.centre, self.heading)

    def at(self, deep: float, right: float) -> tuple[float, float]:
        """Returns the position (x, y) [m] of a place behind its front, to the right of the centre."""
        ((x, y),) = oriented([(deep - self.depth / 2.0, right)], self.centre, self.heading).tolist()
        return x, y


def plan_buildings(layers: MapLayers, clearance: Clearance) -> list[Building]:
    """Returns buildings along all streets, clear of all that the map draws and of the lots of landmarks."""
    rng = np.random.default_rng(zlib.crc32(b"buildings of " + layers.town.name.encode()))
    placed = _Placed()
    quarters = _Quarters(layers.town, clearance)
    buildings: list[Building] = []
    for frontage in frontages(layers):
        buildings += _along(frontage, rng, clearance, placed, quarters)
    return buildings


class Frontage(NamedTuple):
    """Edge of a road: points (n, 2) [m], and the direction away from the road (n,) [rad]."""

    points: Array
    away: Array


def frontages(layers: MapLayers) -> Iterator[Frontage]:
    """Yields the edges of the roads, and then those of junctions: opposite to the mouth of a street, for instance."""
    for line in layers.borders.lines:
        if line.kind is BorderKind.EDGE:
            for run in held(line, layers.raised, wanted=False):
                yield Frontage(line.points[run, :2], line.heading[run] + line.sign * np.pi / 2.0)
    sign = layers.town.traffic.sign
    for lane in layers.town.lanes:
        if lane.in_junction and lane.length > _SHORTEST and not layers.raised.hold(lane.points).any():
            stations = sample(lane, 0.0, lane.length, 2.0)
            points = side_line(lane, stations, sign * widths_at(lane, stations) / 2.0)
            yield Frontage(points, np.interp(stations, lane.stations, lane.headings) + sign * np.pi / 2.0)


class _Quarters:
    """Quarters of a town: a centre, homes around it, and suburbs, which also border on the open country."""

    def __init__(self, town: Town, clearance: Clearance) -> None:
        points = np.concatenate([lane.points[:, :2] for lane in town.lanes])
        self._middle = points.mean(axis=0)
        self._radius = float(np.quantile(pn.hypot(*(points - self._middle).T), 0.95))
        self._clearance = clearance

    def at(self, place: Array) -> Quarter:
        """Returns the quarter at a place (2,) [m]."""
        away = float(pn.hypot(*(place - self._middle))) / max(self._radius, 1.0)
        if away > _RIM or not len(self._clearance.blocks.query(shapely.Point(place), predicate="intersects")):
            return Quarter.SUBURB
        return Quarter.CENTRE if away < _CENTRE else Quarter.HOMES


class _Placed:
    """Ground of the buildings so far."""

    def __init__(self) -> None:
        self._circles = np.zeros((256, 3))
        self._ground: list[shapely.Polygon] = []

    def free(self, ground: NDArray[np.object_], centres: Array, radii: Array) -> NDArray[np.bool_]:
        """Returns which rectangles (n,) with circles around them overlap none."""
        free = np.ones(len(ground), dtype=bool)
        circles = self._circles[: len(self._ground)]
        middle, reach = centres.mean(axis=0), float(radii.max() + np.ptp(centres, axis=0).max())
        near = np.flatnonzero(pn.hypot(*(circles[:, :2] - middle).T) < circles[:, 2] + reach)
        for k in near.tolist():
            free &= ~shapely.intersects(ground, self._ground[k])
        return free

    def add(self, ground: shapely.Polygon, centre: Array, radius: float) -> None:
        """Adds a building."""
        if len(self._ground) == len(self._circles):
            self._circles = np.concatenate((self._circles, np.zeros_like(self._circles)))
        self._circles[len(self._ground)] = *centre, radius
        self._ground.append(ground)


def _along(
    frontage: Frontage, rng: np.random.Generator, clearance: Clearance, placed: _Placed, quarters: _Quarters
) -> list[Building]:
    """Returns buildings beside an edge of a road, one after the other."""
    stations = polyline_stations(frontage.points)
    found: list[Building] = []
    at = 3.0
    while at < stations[-1] - 3.0:
        spot = np.array([np.interp(at, stations, column) for column in frontage.points.T])
        heading = float(np.interp(at, stations, frontage.away))
        away = np.array([pn.cos(heading), pn.sin(heading)])
        manner = _MANNERS[quarters.at(spot + 14.0 * away)]
        length, depth = rng.uniform(*manner.length), rng.uniform(*manner.depth)
        gap, empty = rng.uniform(*manner.gap), rng.random() > manner.built
        style = Style(int(rng.choice(len(Style), p=manner.styles)))
        storeys, tone = int(rng.integers(manner.storeys[0], manner.storeys[1] + 1)), int(rng.integers(0, 1 << 16))
        if style is Style.HOUSE:
            storeys = min(storeys, 2)
        shops = style in (Style.BRICK, Style.PLASTER) and storeys > 1 and rng.random() < manner.shops
        if empty:
            at += length + gap
            continue
        wanted = _HOUSE_SETBACKS if style is Style.HOUSE else _SETBACKS
        sizes = np.repeat(_SMALLER, len(wanted))
        setbacks = np.tile(wanted, len(_SMALLER))
        lengths, depths = length * sizes, depth * sizes
        middles = at + lengths / 2.0
        spots = np.stack([np.interp(middles, stations, column) for column in frontage.points.T], axis=-1)
        turns = np.interp(middles, stations, frontage.away)
        ways = np.stack((pn.cos(turns), pn.sin(turns)), axis=-1)
        centres = spots + (setbacks + depths / 2.0)[:, None] * ways
        ground = rectangles(centres, turns, depths, lengths)
        free = middles + lengths / 2.0 <= stations[-1] + 4.0
        for tree in (clearance.ways, clearance.trees, clearance.parks, clearance.reserved, clearance.views):
            if free.any():
                free[free] = free_of(ground[free], tree)
        radii = pn.hypot(lengths, depths) / 2.0
        if free.any():
            free[free] = placed.free(ground[free], centres[free], radii[free])
        if not free.any():
            at += _TRY_AGAIN
            continue
        k = int(np.argmax(free))
        placed.add(ground[k], centres[k], float(radii[k]))
        x, y = centres[k].tolist()
        size = (float(lengths[k]), float(depths[k]))
        found.append(Building((x, y), float(turns[k]), *size, storeys, style, shops, tone))
        at += size[0] + gap
    return found


def build_buildings(buildings: list[Building], ground: Heights) -> Mesh:
    """Returns the triangles of buildings that stand on the ground."""
    builder = MeshBuilder()
    if buildings:
        outlines = np.stack([building.outline for building in buildings])
        heights = feet_on(ground, outlines.reshape(-1, 2)).reshape(-1, 4)
        for building, outline, feet in zip(buildings, outlines, heights, strict=True):
            add_building(builder, building, outline, float(feet.min()), float(feet.max()))
    return builder.build()


def add_building(builder: MeshBuilder, building: Building, outline: Array, low: float, base: float) -> None:
    """Adds a building between the lowest height of the ground and its base, the highest one [m]."""
    texture, colours = _WALLS[building.style]
    shade = _SHADES[0] + _SHADES[1] * (building.tone // 512 % 8)
    colour = np.array(colours[building.tone % len(colours)], dtype=np.float64) * shade
    if base - low > _EVEN:
        builder.prism(
            outline, low - _UNDER, base, colour=colour * 0.7, kind=ObjectClass.BUILDING, closed=(False, False)
        )
    storeys, foot = building.storeys, base
    if building.shops:
        add_walls(builder, outline, foot, foot + _SHOP, colour * 0.96, Texture.SHOPS, bay=_SHOP_BAY, storeys=1, rows=1)
        foot, storeys = foot + _SHOP, storeys - 1
    top = foot + storeys * STOREY
    add_walls(builder, outline, foot, top, colour, texture, bay=STOREY, storeys=storeys)
    if building.style is Style.HOUSE:
        look = house_look(building.tone)
        add_roof(
            builder,
            look.roof,
            building.centre,
            building.heading,
            (building.depth, building.length),
            top,
            tiles=look.tiles,
            gable=colour * 0.9,
        )
        front = building.at(-0.03, 0.25 * building.length)
        builder.panel(
            (*front, base + 1.05),
            building.heading,
            1.05,
            2.1,
            colour=look.door,
            kind=ObjectClass.BUILDING,
            texture=Texture.DOOR,
        )
        return
    flat = _FLAT_ROOFS[building.tone // 64 % len(_FLAT_ROOFS)]
    builder.prism(outline, top, top + 0.6, colour=colour * 0.82, top_colour=flat, kind=ObjectClass.BUILDING)


def add_walls(
    builder: MeshBuilder, outline: Array, low: float, high: float, colour: Array, texture: Texture, *, bay: float,
    storeys: int, rows: int = BAYS,
) -> None:  # fmt: skip
    """Adds four walls with whole bays and storeys of a texture that shows `BAYS` by `rows` of them."""
    lower = np.column_stack((outline, np.full(len(outline), low)))
    upper = np.column_stack((outline, np.full(len(outline), high)))
    for k in range(len(outline)):
        after = (k + 1) % len(outline)
        bays = max(1, round(float(pn.hypot(*(outline[after] - outline[k]))) / bay))
        builder.quad(
            [lower[after], upper[after], upper[k], lower[k]],
            colour=colour,
            kind=ObjectClass.BUILDING,
            repeats=(bays / BAYS, storeys / rows),
            texture=texture,
        )
