"""Top views of cars, people and objects, landmark pins, and the canvas for them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.maps.floating_names import SUPERSAMPLING
from dorothie_gym.pictures.maps.shapes import disc, place, stroke
from dorothie_gym.pictures.text import words
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.palette import Colour

_STROKE = 6  # segments


class Canvas:
    """Supersampled layer on top of a picture.

    The layer holds premultiplied colours, so that partly covered pixels mix correctly after scaling down.

    Attributes:
        size: size of the picture below [px].
        scale: scale of that picture [px/m].
        origin: world position (2,) of its upper left corner [m].
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self.scale = 1.0
        self.origin: Array = np.zeros(2)
        self._layer = pygame.Surface((size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING), pygame.SRCALPHA, 32)

    def begin(self, scale: float, origin: Array) -> None:
        """Clears the layer and sets its scale and origin."""
        self.scale, self.origin = scale, origin
        self._layer.fill((0, 0, 0, 0))

    def blit_on(self, picture: pygame.Surface) -> None:
        """Draws the layer onto the picture."""
        smooth = pygame.transform.smoothscale(self._layer, self.size)
        picture.blit(smooth, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)

    def pixel(self, xy: ArrayLike) -> Array:
        """Converts world positions (..., 2) [m] to pixels (..., 2) of the picture."""
        return np.asarray((np.asarray(xy, dtype=float) - self.origin) * self.scale)

    def shows(self, xy: ArrayLike, border: float = 0.0) -> bool:
        """Returns whether a world position (2,) is on the picture, at least `border` [px] from its edge."""
        x, y = self.pixel(xy)
        return bool(border <= x <= self.size[0] - border and border <= y <= self.size[1] - border)

    def polygon(self, points: ArrayLike, colour: Colour, alpha: float = 1.0) -> None:
        """Fills a polygon (n, 2) [m]."""
        self.pixel_polygon(self.pixel(points), colour, alpha)

    def pixel_polygon(self, points: Array, colour: Colour, alpha: float = 1.0) -> None:
        """Fills a polygon (n, 2) [px]; a translucent one replaces earlier drawings on this layer."""
        ink = (*(round(c * alpha) for c in colour), round(255 * alpha))
        pygame.draw.polygon(self._layer, ink, (points * SUPERSAMPLING).tolist())

    def dot(self, centre: Array, radius: float, colour: Colour) -> None:
        """Fills a circle, all in pixels."""
        pygame.draw.circle(self._layer, colour, (centre * SUPERSAMPLING).tolist(), radius * SUPERSAMPLING)

    def ring(self, centre: Array, radius: float, width: float, colour: Colour) -> None:
        """Draws a circle, all in pixels."""
        pen = max(1, round(width * SUPERSAMPLING))
        pygame.draw.circle(self._layer, colour, (centre * SUPERSAMPLING).tolist(), radius * SUPERSAMPLING, pen)

    def line(self, points: Array, width: float, colour: Colour) -> None:
        """Draws a line (n, 2) with round joints, all in pixels."""
        fine = points * SUPERSAMPLING
        pen = width * SUPERSAMPLING - 1.0  # a polygon's border adds half a pixel on either side
        # in short strokes: a polygon that crosses itself would have holes
        for k in range(0, len(fine) - 1, _STROKE):
            piece = fine[k : k + _STROKE + 1]
            pygame.draw.polygon(self._layer, colour, stroke(piece, pen).tolist())
            for end in (piece[0], piece[-1]):
                pygame.draw.circle(self._layer, colour, end.tolist(), pen / 2.0)

    def box(self, rect: tuple[float, float, float, float], colour: Colour, border: Colour, radius: float = 5) -> None:
        """Draws a filled rounded box (x, y, width, height) with a thin border, all in pixels."""
        fine = pygame.Rect([round(v * SUPERSAMPLING) for v in rect])
        pygame.draw.rect(self._layer, colour, fine, border_radius=round(radius * SUPERSAMPLING))
        pygame.draw.rect(self._layer, border, fine, SUPERSAMPLING, border_radius=round(radius * SUPERSAMPLING))

    def text(self, text: str, left: float, middle: float, size: int, colour: Colour, bold: bool = False) -> None:
        """Writes a line of text, all in pixels."""
        piece = words(text, size * SUPERSAMPLING, colour, bold)
        corner = (round(left * SUPERSAMPLING), round(middle * SUPERSAMPLING - piece.get_height() / 2))
        self._layer.blit(piece.premul_alpha(), corner, special_flags=pygame.BLEND_PREMULTIPLIED)


# --- Figures ---------------------------------------------------------------------------------------------------------

_BODY = np.array(
    [[-0.5, -0.42], [-0.44, -0.5], [0.2, -0.5], [0.5, -0.12], [0.5, 0.12], [0.2, 0.5], [-0.44, 0.5], [-0.5, 0.42]]
)
_GLASS = np.array([[-0.02, -0.36], [0.16, -0.36], [0.34, -0.1], [0.34, 0.1], [0.16, 0.36], [-0.02, 0.36]])
_BOX = np.array(
    [[-0.5, -0.4], [-0.42, -0.5], [0.42, -0.5], [0.5, -0.38], [0.5, 0.38], [0.42, 0.5], [-0.42, 0.5], [-0.5, 0.4]]
)
_WINDSCREEN = np.array([[0.08, -0.38], [0.26, -0.32], [0.26, 0.32], [0.08, 0.38]])
_BEAM_LENGTH = 19.0  # [m]
_BEAM_HALF_ANGLE = 0.24  # [rad]
_SMALLEST_CAR = 24.0  # [px] smallest length at any scale
_SMALLEST_ACTOR = 6.0  # [px]


def draw_headlights(canvas: Canvas, at: Array, heading: float, length: float, width: float) -> None:
    """Draws a translucent beam that fades with distance; draw it first, because it replaces earlier drawings."""
    zoom = max(1.0, _SMALLEST_CAR / (length * canvas.scale))
    angles = np.linspace(-_BEAM_HALF_ANGLE, _BEAM_HALF_ANGLE, 9)
    front, half = 0.4 * length * zoom, 0.38 * width * zoom
    for share in np.linspace(1.0, 0.1, 14):
        arc = share * _BEAM_LENGTH * zoom * np.stack((pn.cos(angles), pn.sin(angles)), axis=-1)
        arc += np.stack((np.full(9, front), np.linspace(-half, half, 9)), axis=-1)
        cone = np.concatenate(([[front, -half]], arc, [[front, half]]))
        canvas.polygon(place(cone, at, heading), palette.HEADLIGHT, float(0.06 + 0.6 * (1.0 - share)))


def draw_car(canvas: Canvas, at: Array, heading: float, length: float, width: float) -> None:
    """Draws the car: a blue body with a white rim, pointed in its direction, with a minimum size."""
    shape = np.array([length, width]) * max(1.0, _SMALLEST_CAR / (length * canvas.scale))
    rim = 1.8 / canvas.scale
    canvas.polygon(place(_BODY * (shape + 2.0 * rim), at, heading), palette.PAPER)
    canvas.polygon(place(_BODY * shape, at, heading), palette.CAR)
    canvas.polygon(place(_GLASS * shape, at, heading), palette.CAR_GLASS)


def draw_actor(canvas: Canvas, kind: str, at: Array, heading: float, length: float, width: float) -> None:
    """Draws a "vehicle", "cyclist", "pedestrian" or "prop", with a minimum size."""
    zoom = max(1.0, _SMALLEST_ACTOR / (max(length, width) * canvas.scale))
    shape = np.array([length, width]) * zoom
    rim = 1.0 / canvas.scale
    if kind == "pedestrian":
        radius = max(0.5 * max(length, width) * zoom, 2.8 / canvas.scale)
        canvas.polygon(disc(at, radius + rim), palette.PAPER)
        canvas.polygon(disc(at, radius), palette.PEDESTRIAN)
        return
    colour = {"vehicle": palette.VEHICLE, "cyclist": palette.CYCLIST, "prop": palette.PROP}[kind]
    outline = _BOX if kind != "prop" else np.sign(_BOX) * 0.5
    canvas.polygon(place(outline * (shape + 2.0 * rim), at, heading), palette.PAPER)
    canvas.polygon(place(outline * shape, at, heading), colour)
    if kind == "vehicle":
        canvas.polygon(place(_WINDSCREEN * shape, at, heading), palette.CAR_GLASS)


def draw_trail(canvas: Canvas, trail: Array) -> None:
    """Draws the driven path (n, 2) [m], thinned to visible detail."""
    points = canvas.pixel(trail.reshape(-1, 2))
    if len(points) < 2:
        return
    travelled = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points, axis=0).T))))
    keep = np.flatnonzero(np.diff(np.floor(travelled / 3.0)) > 0) + 1
    points = points[np.unique(np.concatenate(([0], keep, [len(points) - 1])))]
    seen = ((points > -20.0) & (points < np.array(canvas.size) + 20.0)).all(axis=1)
    width = max(3.0, 0.8 * canvas.scale)
    for run in np.split(np.arange(len(points)), np.flatnonzero(np.diff(seen.astype(int)) != 0) + 1):
        if seen[run[0]] and len(run) > 1:
            canvas.line(points[run], width, palette.TRAIL)


_REGION = math.sqrt(-2.0 * pm.log(0.05))  # Mahalanobis radius of the region of 95 % of a plane normal distribution


def draw_estimate(canvas: Canvas, centre: Array, covariance: tuple[float, float, float], colour: Colour) -> None:
    """Draws the region around an estimate (2,) [m] that holds 95 %; `covariance` is (xx, xy, yy) [m^2]."""
    xx, xy, yy = covariance
    spread, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    angles = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.stack((pn.cos(angles), pn.sin(angles)), axis=-1)
    region = centre + _REGION * (circle * np.sqrt(np.maximum(spread, 0.0))) @ axes.T
    canvas.line(canvas.pixel(region), 1.6, colour)


def draw_waypoints(canvas: Canvas, waypoints: Array) -> None:
    """Draws the planned path (n, 2) [m] as dots, at least eight pixels apart."""
    last = np.full(2, -np.inf)
    for point in canvas.pixel(waypoints.reshape(-1, 2)):
        if pn.hypot(*(point - last)) < 8.0:
            continue
        last = point
        canvas.dot(point, 2.4, palette.WAYPOINT)


PIN_LENGTH = 19.0
"""Distance between the tip of a pin and the centre of its head [px]."""

PIN_RADIUS = 10.0
"""Radius of the head [px]."""


def pin_direction(at: Array, waypoint: Array) -> Array:
    """Returns the unit vector (2,) from the tip of a pin to its head: away from the road, so that it covers no name."""
    away = at - waypoint
    length = float(pn.hypot(*away))
    return np.asarray(away / length) if length > 0.5 else np.array([0.0, -1.0])


def draw_pin(canvas: Canvas, at: Array, waypoint: Array, colour: Colour, hollow: bool, done: bool) -> None:
    """Draws a pin with its tip on a landmark (2,) [m]: hollow and dashed if hidden, with a tick once reached."""
    tip = canvas.pixel(at)
    stop = canvas.pixel(waypoint)
    canvas.line(np.stack((tip, stop)), 1.2, colour)
    canvas.ring(stop, 4.0, 1.5, colour)
    ahead = pin_direction(at, waypoint)
    side = np.array([-ahead[1], ahead[0]])
    head = tip + PIN_LENGTH * ahead
    radius = PIN_RADIUS
    for grow, ink in ((2.0, palette.PAPER), (0.0, colour)):
        wide, back = 0.82 * (radius + grow) * side, -0.55 * (radius + grow) * ahead
        canvas.pixel_polygon(np.array([head + back - wide, head + back + wide, tip - 1.5 * grow * ahead]), ink)
        canvas.dot(head, radius + grow, ink)
    if hollow:
        canvas.dot(head, radius - 2.2, palette.PAPER)
        for angle in np.arange(0.3, 2.0 * np.pi, np.pi / 3.0):
            gap = head + (radius - 1.0) * np.array([pn.cos(angle), pn.sin(angle)])
            canvas.dot(gap, 1.7, palette.PAPER)
        canvas.dot(head, 2.6, colour)
    elif done:
        tick = head + np.array([[-4.4, 0.4], [-1.2, 3.6], [4.6, -3.2]])
        canvas.line(tick, 2.4, palette.PAPER)
    else:
        canvas.dot(head, 3.8, palette.PAPER)


_CHEVRON = np.array([[-3.4, -3.6], [2.6, 0.0], [-3.4, 3.6]])  # [px]
_CHEVRON_SPACING = 70.0  # [px]


def draw_direction(canvas: Canvas, trail: Array) -> None:
    """Draws chevrons along the driven path (n, 2) [m] that point in the direction of the drive."""
    points = canvas.pixel(trail.reshape(-1, 2))
    if len(points) < 2:
        return
    lengths = pn.hypot(*np.diff(points, axis=0).T)
    stations = np.concatenate(([0.0], np.cumsum(lengths)))
    for station in np.arange(0.5 * _CHEVRON_SPACING, stations[-1], _CHEVRON_SPACING):
        before, after = (
            np.array([np.interp(station + d, stations, points[:, k]) for k in (0, 1)]) for d in (-3.0, 3.0)
        )
        step = after - before
        if float(pn.hypot(*step)) < 1.0:
            continue
        angle = float(pn.arctan2(step[1], step[0]))
        turn = np.array([[pn.cos(angle), -pn.sin(angle)], [pn.sin(angle), pn.cos(angle)]])
        canvas.line((before + after) / 2.0 + _CHEVRON @ turn.T, 1.8, palette.DIRECTION)


def draw_start(canvas: Canvas, at: Array) -> None:
    """Draws a ring with a dot where a drive (2,) [m] began."""
    centre = canvas.pixel(at)
    canvas.dot(centre, 8.0, palette.PAPER)
    canvas.ring(centre, 7.0, 2.4, palette.DIRECTION)
    canvas.dot(centre, 2.6, palette.DIRECTION)


def draw_exception(canvas: Canvas, at: Array, number: int) -> None:
    """Draws a numbered diamond where the car (2,) [m] was at an exception."""
    centre = canvas.pixel(at)
    for radius, ink in ((11.0, palette.PAPER), (9.5, palette.EXCEPTION)):
        canvas.pixel_polygon(centre + radius * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]), ink)
    text = str(number)
    wide = words(text, 10 * SUPERSAMPLING, palette.PAPER, True).get_width() / SUPERSAMPLING
    canvas.text(text, float(centre[0]) - wide / 2.0, float(centre[1]), 10, palette.PAPER, bold=True)
