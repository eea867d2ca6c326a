"""Map of a town as a picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array, Lane, SignalKind
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.floating_names import SUPERSAMPLING, draw_name
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.icons import lamp_colour, pin_icon, sign_icon, stamp
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.markings import ARROW_LENGTH, one_way_arrow, one_way_places, stop_bar
from dorothie_gym.pictures.maps.medians import BACK_TO_BACK, pocket_places
from dorothie_gym.pictures.maps.shapes import Shape
from dorothie_gym.pictures.maps.street_names import Label, LabelPlacer, covering
from dorothie_gym.pictures.text import words
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

GROUND = 14.0
"""Margin of country around the outermost roads [m]."""

_TILE = 1024  # [px] painted at once, so that large maps need little memory
BAR_LENGTHS = (10, 20, 50, 100, 200, 500, 1000, 2000)
_SIGN = (4.2, 54)  # height of signs [m], and upper limit [px]
_PIN = (2.9, 34)  # radius of pins [m], and upper limit [px]


class MapPainter:
    """Map of a town, painted once on first use; `surface()` returns copies.

    Attributes:
        town: the town.
        size: width and height of the picture [px].
        scale: [px/m].
        origin: world position (2,) of the picture's upper left corner [m].
        street_names: names by street index.
        labels: placed street names.
        missing: names without room on or beside their streets.
        plan: layers of the map.
    """

    def __init__(
        self,
        town: Town,
        *,
        size: tuple[int, int],
        street_names: Sequence[str] | None = None,
        margin: int | tuple[int, int, int, int] = 24,
        type_sizes: tuple[int, int] = (20, 11),
        label_spacing: float = 380.0,
        label_distance: float = 375.0,
        border: float | None = None,
        numbered: bool = False,
        smallest_sign: int = 12,
        names_on_top: bool = False,
    ) -> None:
        """Fits a town into a picture.

        Args:
            town: town to paint.
            size: width and height [px].
            street_names: names by street index; the town's own if omitted.
            margin: margin without roads [px], for all sides or as (left, top, right, bottom).
            type_sizes: largest and smallest font size of street names [px].
            label_spacing: smallest distance between two labels with the same name [px].
            label_distance: distance beyond which a name is repeated even across arrows [m].
            border: width of the country with trees around the roads [m]; by default up to the edge of the picture.
            numbered: whether landmark sites have numbered pins, and names stay inside the margin, as on a sheet.
            smallest_sign: smallest height of lights and signs at any scale [px].
            names_on_top: whether the map is painted without names, which are drawn later (`FloatingNames`).

        Raises:
            ValueError: `size` leaves no room inside `margin`, or there are too few names.
        """
        left, top, right, bottom = (margin,) * 4 if isinstance(margin, int) else margin
        room = np.array([size[0] - left - right, size[1] - top - bottom], dtype=float)
        if (room <= 0).any():
            raise ValueError(f"size: {size} leaves no room inside margin {margin}")
        names = [street.name for street in town.streets] if street_names is None else list(street_names)
        if len(names) < len(town.streets):
            raise ValueError(f"street_names: {len(names)} names for {len(town.streets)} streets of {town.name}")
        self.town, self.size, self.street_names = town, size, tuple(names)
        x0, y0, x1, y1 = town_bounds(town, GROUND)
        extent = np.array([x1 - x0, y1 - y0])
        self.scale = float((room / extent).min())
        self.origin: Array = (
            np.array([x0, y0]) - (np.array([left, top]) + (room - extent * self.scale) / 2.0) / self.scale
        )
        border = float(max(size)) / self.scale / 3.0 if border is None else border
        self.plan = MapLayers(town, scale=self.scale, border=border)
        self._names_on_top = names_on_top
        self._pins = _sized(_PIN, self.scale, 0.7 * smallest_sign) if numbered else 0
        self._signs = _sized(_SIGN, self.scale, smallest_sign)
        placer = LabelPlacer(
            names=names[: len(town.streets)],
            scale=self.scale,
            origin=self.origin,
            frame=(left, top, size[0] - right, size[1] - bottom) if numbered else (0, 0, *size),
            sizes=type_sizes,
            spacing=label_spacing,
            farthest=label_distance * self.scale,
        )
        self.labels: tuple[Label, ...] = tuple(placer.place(self.plan, self._fixed()))
        self.missing: tuple[str, ...] = tuple(placer.missing)

    @classmethod
    def at_scale(
        cls,
        town: Town,
        scale: float,
        *,
        street_names: Sequence[str] | None = None,
        margin: int | tuple[int, int, int, int] = 24,
        type_sizes: tuple[int, int] = (20, 11),
        label_spacing: float = 380.0,
        names_on_top: bool = False,
    ) -> MapPainter:
        """Returns a painter with a picture of sufficient size at a scale [px/m]; other arguments as in the class."""
        left, top, right, bottom = (margin,) * 4 if isinstance(margin, int) else margin
        x0, y0, x1, y1 = town_bounds(town, GROUND)
        size = (round((x1 - x0) * scale) + left + right, round((y1 - y0) * scale) + top + bottom)
        return cls(
            town,
            size=size,
            street_names=street_names,
            margin=margin,
            type_sizes=type_sizes,
            label_spacing=label_spacing,
            border=GROUND + min(left, top, right, bottom) / scale,
            names_on_top=names_on_top,
        )

    def surface(self, time: float | None = None) -> pygame.Surface:
        """Returns a copy of the base map to draw on; if a time [s] is given, the lights show their colours then."""
        copy = self._surface.copy()
        if time is not None:
            self.draw_lights(copy, time)
        return copy

    def window(self, centre: ArrayLike, size: tuple[int, int], time: float | None = None) -> pygame.Surface:
        """Returns the part of the base map around a world position (2,) [m], as a new surface of a size [px].

        Lights show their colours at a time [s] if one is given.
        """
        view = pygame.Surface(size)
        view.fill(palette.COUNTRY)
        corner = np.round(self.to_pixel(centre) - np.array(size) / 2.0).astype(int)
        view.blit(self._surface, (0, 0), (int(corner[0]), int(corner[1]), *size))
        if time is not None:
            self.draw_lights(view, time, corner)
        return view

    def draw_lights(self, picture: pygame.Surface, time: float, corner: ArrayLike = (0.0, 0.0)) -> None:
        """Draws lamps and stop lines in the colours at a time [s]; lights without a programme are not changed.

        Args:
            picture: surface with this map or a part of it.
            time: simulated time [s].
            corner: pixel of the map at the upper left corner of the picture.
        """
        shift = np.asarray(corner, dtype=float)
        reach = np.array(picture.get_size()) + 2.0 * self._signs
        for lane, kind in self.plan.ruled.items():
            shown = self.town.light(lane, time) if kind is SignalKind.TRAFFIC_LIGHT else None
            if shown is None:
                continue
            bar = stop_bar(self.town.lanes[lane], self.plan.stops.get(lane, 0.0), self.plan.detail.pen)
            points = self.to_pixel(bar) - shift
            if (points > -2.0 * self._signs).all() and (points < reach).all():
                pygame.draw.polygon(picture, lamp_colour(shown), points.tolist())
                pygame.draw.aalines(picture, lamp_colour(shown), True, points.tolist())
        for post in self.plan.posts:
            at = self.to_pixel(post.at) - shift
            if post.kind is not SignalKind.TRAFFIC_LIGHT or (at < -self._signs).any() or (at > reach).any():
                continue
            colours = [self.town.light(lane, time) for lane in post.lanes]
            if colours and colours[0] is not None:
                stamp(picture, sign_icon(post.kind, self._signs, colours[0]), at)

    def to_pixel(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Converts world positions (..., 2) [m] to pixels (..., 2)."""
        return (np.asarray(xy, dtype=float) - self.origin) * self.scale

    def draw_scale_bar(self, surface: pygame.Surface, corner: tuple[int, int], longest: int = 180) -> None:
        """Draws a scale bar at most `longest` px long, with its lower left corner at a pixel, and a north arrow."""
        draw_scale_bar(surface, self.scale, corner, longest)

    def _fixed(self) -> Array:
        """Returns circles (n, 3) [px] around signs and pins, which labels avoid."""
        rows = [(*self.to_pixel(post.at).tolist(), 0.5 * self._signs) for post in self.plan.posts]
        if self._pins:
            rows += [(*self.to_pixel(site.position).tolist(), 1.3 * self._pins) for site in self.town.sites]
        return np.array(rows, dtype=float).reshape(-1, 3)

    def _uncovered(self) -> Iterator[Shape]:
        """Yields the shapes of the map without the arrows, hatchings and dashes that a label would cover partly."""
        lanes, plan = self.town.lanes, self.plan
        if self._names_on_top:
            yield from plan.shapes
            return
        along = np.array([0.0, 0.5, 1.0]) * ARROW_LENGTH
        arrows = [[lanes[a.lane].position(a.station + s) for s in along] for a in plan.arrows]
        places = {
            palette.ARROW: np.array(arrows).reshape(-1, 3, 2),
            palette.HATCHING: pocket_places(self.town, plan.pockets),
        }
        covered = {colour: self._covered(at) for colour, at in places.items()}
        # two turn lanes back to back share one island
        islands = places[palette.HATCHING][:, 1]
        away = pn.hypot(*(islands[:, None] - islands).transpose(2, 0, 1))
        covered[palette.HATCHING] = ((away < BACK_TO_BACK) & covered[palette.HATCHING]).any(axis=1)
        trees = {colour: cKDTree(at.mean(axis=1)) for colour, at in places.items() if len(at)}
        dashes = [shape for shape in plan.shapes if shape.colour == palette.LANE_LINE]
        ends = [[shape.points.min(axis=0), shape.points.max(axis=0)] for shape in dashes]
        hidden = self._covered(np.array(ends).reshape(-1, 2, 2))
        gone = {id(shape) for shape, under in zip(dashes, hidden.tolist(), strict=True) if under}
        for shape in plan.shapes:
            if shape.colour in trees and covered[shape.colour][trees[shape.colour].query(shape.points.mean(axis=0))[1]]:
                continue
            if id(shape) not in gone:
                yield shape

    def _covered(self, places: Array) -> NDArray[np.bool_]:
        """Returns which objects a label touches (n,), given positions on each object (n, k, 2) [m]."""
        pixels = self.to_pixel(places).reshape(-1, 2)
        found = np.zeros(len(places), dtype=bool)
        for label in self.labels:
            near = np.asarray(cKDTree(label.path).query(pixels)[0])
            found |= (near.reshape(places.shape[:2]) < label.half).any(axis=1)
        return found

    def _one_way_arrows(self) -> Iterator[Shape]:
        """Yields arrows along one-way streets where no label or turn arrow obstructs them."""
        if not self.plan.detail.arrows:
            return
        taken = np.array([*covering(self.labels), *self._turn_arrows()]).reshape(-1, 3)
        for number, middle in one_way_places(self.town, self.plan.borders):
            lane = self.town.lanes[number]
            for station in (middle, middle - 9.0, middle + 9.0):
                if 5.0 < station < lane.length - 5.0 and self._free(lane, station, taken):
                    for outline in one_way_arrow(lane.position(station), lane.heading_at(station)):
                        yield Shape(outline, palette.ONE_WAY)
                    break

    def _free(self, lane: Lane, station: float, taken: Array) -> bool:
        """Returns whether an arrow on a lane is clear of the circles (n, 3) [px], of bridges and of tunnels."""
        at = lane.position(station)
        gap = pn.hypot(*(taken[:, :2] - self.to_pixel(at)).T) - taken[:, 2]
        place = np.array([[*at, lane.height_at(station)]])
        raised = self.plan.raised
        return bool((gap > 4.0 * self.scale).all()) and not bool(raised.hold(place)[0] or raised.cross(place, 9.0)[0])

    def _turn_arrows(self) -> Iterator[tuple[float, float, float]]:
        for arrow in self.plan.arrows:
            x, y = self.to_pixel(self.town.lanes[arrow.lane].position(arrow.station + 3.0)).tolist()
            yield x, y, 3.5 * self.scale

    @cached_property
    def _surface(self) -> pygame.Surface:
        shapes = [*self._uncovered(), *self._one_way_arrows()]
        bounds = np.array([shape.bounds for shape in shapes])
        picture = pygame.Surface(self.size)
        for left in range(0, self.size[0], _TILE):
            for top in range(0, self.size[1], _TILE):
                size = (min(_TILE, self.size[0] - left), min(_TILE, self.size[1] - top))
                picture.blit(self._paint_tile(shapes, bounds, left, top, size), (left, top))
        for post in self.plan.posts:
            stamp(picture, sign_icon(post.kind, self._signs), self.to_pixel(post.at))
        for site in self.town.sites if self._pins else ():
            away = np.array(site.waypoint) - np.array(site.position)
            bearing = round(float(np.degrees(pn.arctan2(away[1], away[0]))))
            stamp(picture, pin_icon(str(site.id + 1), self._pins, bearing), self.to_pixel(site.position))
        return picture

    def _paint_tile(
        self, shapes: Sequence[Shape], bounds: Array, left: int, top: int, size: tuple[int, int]
    ) -> pygame.Surface:
        factor = SUPERSAMPLING
        tile = pygame.Surface((size[0] * factor, size[1] * factor))
        tile.fill(palette.COUNTRY)
        corner = np.array([left, top], dtype=float)
        low = self.origin + corner / self.scale
        high = low + np.array(size) / self.scale
        seen = (bounds[:, 2:] >= low).all(axis=1) & (bounds[:, :2] <= high).all(axis=1)
        for k in np.flatnonzero(seen).tolist():
            points = (shapes[k].points - low) * (self.scale * factor)
            pygame.draw.polygon(tile, shapes[k].colour, points.tolist())
        for label in () if self._names_on_top else self.labels:
            path = label.path - corner
            beyond = (path < -3.0 * label.size) | (path > np.array(size) + 3.0 * label.size)
            if beyond.all(axis=0).any():
                continue
            draw_name(tile, label, corner)
        return pygame.transform.smoothscale(tile, size)


def _sized(rule: tuple[float, int], scale: float, smallest: float) -> int:
    metres, largest = rule
    return int(np.clip(round(metres * scale), smallest, largest))


def draw_scale_bar(surface: pygame.Surface, scale: float, corner: tuple[int, int], longest: int) -> None:
    """Draws a scale bar for a `scale` [px/m] with its lower left corner at a pixel, and a north arrow."""
    metres = max((n for n in BAR_LENGTHS if n * scale <= longest), default=BAR_LENGTHS[0])
    length = round(metres * scale)
    x, y = corner
    text = words(f"{metres} m" if metres < 1000 else f"{metres // 1000} km", 13, palette.INK)
    frame = pygame.Rect(x, y - 34, length + 52, 34)
    back = pygame.Surface(frame.size, pygame.SRCALPHA, 32)
    pygame.draw.rect(back, (255, 255, 255, 215), back.get_rect(), border_radius=8)
    surface.blit(back, frame)
    for k in range(4):
        part = pygame.Rect(x + 12 + k * length // 4, y - 12, (k + 1) * length // 4 - k * length // 4, 4)
        pygame.draw.rect(surface, palette.INK if k % 2 == 0 else palette.PAPER, part)
    pygame.draw.rect(surface, palette.INK, (x + 12, y - 12, length, 4), 1)
    surface.blit(text, (x + 12, y - 31))
    tip = np.array([x + length + 32, y - 29])
    arrow = np.array([[0, 0], [6, 13], [0, 10], [-6, 13]])
    pygame.draw.polygon(surface, palette.INK, (tip + arrow).tolist())
    north = words("N", 11, palette.INK, True)
    surface.blit(north, north.get_rect(midtop=(int(tip[0]), y - 16)))
