"""Cars of several types, which fill the outline that the simulation gives them."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import PLATES, Texture
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.camera.models.solids import ModelBuilder, Palette, Part, Rgb, dressed
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, CAR_WIDTH
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

_FRONT, _SIDE = CAR_LENGTH / 2.0, CAR_WIDTH / 2.0
_SILL, _BELT = 0.24, 0.55  # [m] heights of the lower edge and of the widest part of a body
_SKIN = 0.012  # [m] by which lamps, panes and plates stand out
_CABIN_SIDE = 0.89  # [m] half the width of a cabin at its foot
_PLATE = 0.52, 0.13  # [m] width and height of a number plate
_WHEEL_SIDES = 8


class VehicleType(enum.IntEnum):
    """Types of cars."""

    SEDAN = 0
    HATCHBACK = 1
    VAN = 2
    PICKUP = 3
    ESTATE = 4
    SUV = 5


class Lamps(enum.IntFlag):
    """Lamps of a car that are on."""

    OFF = 0
    BRAKES = 1
    LIGHTS = 2
    """Headlights and tail lights."""


PAINTS: tuple[Rgb, ...] = (
    (196, 198, 200), (34, 36, 40), (234, 235, 236), (148, 26, 30), (34, 66, 126),
    (98, 102, 106), (58, 86, 68), (172, 152, 120), (212, 120, 30), (18, 100, 116),
    (240, 200, 40), (92, 40, 66), (120, 164, 204), (70, 52, 40),
)  # fmt: skip
"""Colours of cars."""


@dataclass(frozen=True)
class _Form:
    """Outline of a car [m].

    Attributes:
        stations: stations of the body from front to back, as (x, height, half its width).
        cabin: x of the lower front and rear edge, and height of the belt line there.
        roof: x of the upper front and rear edge, and height.
        roof_side: half the width of the roof.
        panes: side windows as shares of the cabin from front to back.
        rear_pane: whether the rear is of glass.
        wheels: x of the axles, and radius.
        tail: height of the rear lamps.
    """

    stations: tuple[tuple[float, float, float], ...]
    cabin: tuple[float, float, float, float]
    roof: tuple[float, float, float]
    roof_side: float
    panes: tuple[tuple[float, float], ...]
    rear_pane: bool = True
    wheels: tuple[float, float, float] = (1.5, -1.5, 0.33)
    tail: float = 0.72


_FORMS = {
    VehicleType.SEDAN: _Form(
        ((_FRONT, 0.66, 0.84), (2.28, 0.76, 0.94), (1.05, 0.92, 0.97), (-1.65, 0.97, 0.97), (-_FRONT, 0.86, 0.88)),
        (1.05, -1.95, 0.92, 0.95), (0.25, -1.20, 1.44), 0.68, ((0.07, 0.47), (0.51, 0.92)),
    ),
    VehicleType.HATCHBACK: _Form(
        ((_FRONT, 0.70, 0.84), (2.25, 0.80, 0.94), (1.20, 0.98, 0.97), (-1.90, 1.02, 0.97), (-_FRONT, 0.98, 0.92)),
        (1.20, -2.42, 0.98, 1.0), (0.35, -1.90, 1.56), 0.72, ((0.06, 0.40), (0.44, 0.72), (0.76, 0.93)), tail=0.84,
    ),
    VehicleType.VAN: _Form(
        ((_FRONT, 0.78, 0.86), (2.34, 0.98, 0.95), (1.75, 1.16, 0.98), (-2.30, 1.18, 0.98), (-_FRONT, 1.16, 0.97)),
        (1.75, -2.46, 1.16, 1.16), (0.98, -2.42, 2.08), 0.88, ((0.03, 0.24),), rear_pane=False, tail=0.98,
    ),
    VehicleType.PICKUP: _Form(
        ((_FRONT, 0.84, 0.88), (2.32, 0.96, 0.95), (1.20, 1.08, 0.98), (-2.30, 1.06, 0.98), (-_FRONT, 1.04, 0.95)),
        (1.20, -0.95, 1.06, 1.06), (0.55, -0.75, 1.80), 0.76, ((0.08, 0.48), (0.53, 0.94)),
        wheels=(1.55, -1.5, 0.38), tail=0.86,
    ),
    VehicleType.ESTATE: _Form(
        ((_FRONT, 0.66, 0.84), (2.28, 0.76, 0.94), (1.10, 0.93, 0.97), (-2.20, 0.98, 0.97), (-_FRONT, 0.92, 0.90)),
        (1.10, -2.40, 0.93, 0.97), (0.30, -2.20, 1.50), 0.70, ((0.06, 0.32), (0.35, 0.60), (0.64, 0.92)), tail=0.80,
    ),
    VehicleType.SUV: _Form(
        ((_FRONT, 0.86, 0.88), (2.30, 0.98, 0.95), (1.30, 1.12, 0.98), (-2.10, 1.14, 0.98), (-_FRONT, 1.10, 0.95)),
        (1.30, -2.42, 1.12, 1.13), (0.55, -2.15, 1.86), 0.78, ((0.06, 0.36), (0.40, 0.66), (0.70, 0.93)),
        wheels=(1.52, -1.5, 0.38), tail=0.98,
    ),
}  # fmt: skip


def vehicle_form(kind: VehicleType) -> Mesh:
    """Returns a car without colours."""
    form, model = _FORMS[kind], ModelBuilder(ObjectClass.VEHICLES)
    _body(model, form)
    _cabin(model, form)
    if kind is VehicleType.PICKUP:
        inset = np.array([(-0.98, -0.82), (-2.36, -0.82), (-2.36, 0.82), (-0.98, 0.82)])
        model.face(np.column_stack((inset, np.full(4, 1.075))), Part.TRIM, (0.0, 0.0, 0.0), shade=0.8)
    front, rear, radius = form.wheels
    for x in (front, rear):
        for side in (1.0, -1.0):
            _wheel(model, x, side, radius)
    _lamps(model, form)
    return model.build()


def painted_vehicle(form: Mesh, paint: Rgb, lamps: Lamps, plate: int) -> Mesh:
    """Returns a car with a colour and a number plate, one of `PLATES`, and with the given lamps on."""
    brakes, lights = Lamps.BRAKES in lamps, Lamps.LIGHTS in lamps
    palette: Palette = {
        Part.PAINT: paint,
        Part.TRIM: (46, 48, 52),
        Part.GLASS: (38, 46, 54),
        Part.TYRE: (28, 28, 30),
        Part.RIM: (156, 158, 162),
        Part.PLATE: (255, 255, 255),
        Part.HEAD_LAMP: (255, 250, 232) if lights else (222, 226, 228),
        Part.BRAKE_LAMP: (255, 44, 34) if brakes else (176, 22, 22) if lights else (112, 14, 16),
    }
    on = {Part.HEAD_LAMP: lights, Part.BRAKE_LAMP: brakes or lights}
    painted = dressed(form, palette, frozenset(slot for slot, glows in on.items() if glows))
    v_axes = painted.v_axes.copy()
    plates = painted.textures == Texture.PLATE
    v_axes[plates] /= PLATES  # the texture has all plates, one above the other
    v_axes[plates, 3] += plate / PLATES
    return painted._replace(v_axes=v_axes)


def _ring(station: tuple[float, float, float], side: float) -> Array:
    """Returns sill, belt and shoulder (3, 3) of a body on one side."""
    x, height, half = station
    x = float(np.clip(x, -_FRONT + _SKIN, _FRONT - _SKIN))
    return np.array([[x, side * 0.97 * half, _SILL], [x, side * half, _BELT], [x, side * 0.93 * half, height]])


def _body(model: ModelBuilder, form: _Form) -> None:
    stations = form.stations
    for ahead, behind in pairwise(stations):
        middle = ((ahead[0] + behind[0]) / 2.0, 0.0, 0.5)
        for side in (1.0, -1.0):
            a, b = _ring(ahead, side), _ring(behind, side)
            model.face([a[0], b[0], b[1], a[1]], Part.PAINT, middle, shade=0.8)
            model.face([a[1], b[1], b[2], a[2]], Part.PAINT, middle)
        tops = [_ring(station, side)[2] for station, side in ((ahead, 1), (behind, 1), (behind, -1), (ahead, -1))]
        model.face(tops, Part.PAINT, middle, shade=1.05)
    for station in (stations[0], stations[-1]):
        right, left = _ring(station, 1.0), _ring(station, -1.0)
        model.face([left[0], right[0], right[1], left[1]], Part.TRIM, (0.0, 0.0, 0.5))
        model.face([left[1], right[1], right[2], left[2]], Part.PAINT, (0.0, 0.0, 0.5), shade=0.92)


def _cabin(model: ModelBuilder, form: _Form) -> None:
    front, rear, front_height, rear_height = form.cabin
    ahead, behind, height = form.roof
    inside = ((front + rear) / 2.0, 0.0, front_height)
    # corners: lower front, lower rear, upper rear, upper front; on the right, the left is its mirror image
    outline = np.array([(front, front_height), (rear, rear_height), (behind, height - 0.02), (ahead, height)])
    right = np.column_stack((outline[:, 0], (_CABIN_SIDE, _CABIN_SIDE, form.roof_side, form.roof_side), outline[:, 1]))
    left = right * (1.0, -1.0, 1.0)
    glass = ((0, 3), True), ((1, 2), form.rear_pane)
    for (low, high), glazed in glass:
        corners = [left[low], left[high], right[high], right[low]]
        slot, surface = (Part.GLASS, Surface.GLASS) if glazed else (Part.PAINT, Surface.NONE)
        model.face(corners, slot, inside, shade=1.0 if glazed else 0.92, surface=surface)
    model.face([left[3], left[2], right[2], right[3]], Part.PAINT, inside, shade=1.05)
    for side, wall in ((1.0, right), (-1.0, left)):
        model.face(wall, Part.PAINT, inside, shade=0.95)
        foot, head = wall[[0, 1]], wall[[3, 2]]
        for shares in form.panes:
            share = np.array(shares)[:, None]
            low, high = foot[0] + share * (foot[1] - foot[0]), head[0] + share * (head[1] - head[0])
            pane = np.concatenate((low + 0.12 * (high - low), (low + 0.9 * (high - low))[::-1]))
            model.face(pane + (0.0, side * _SKIN, 0.004), Part.GLASS, inside, surface=Surface.GLASS)
        _mirror(model, front - 0.35, side, front_height + 0.02)


def _mirror(model: ModelBuilder, x: float, side: float, z: float) -> None:
    """Adds a mirror that is seen from the front and from behind."""
    inner, outer = side * (_CABIN_SIDE - 0.03), side * _SIDE
    corners = np.array([(x, inner, z), (x, inner, z + 0.14), (x, outer, z + 0.16), (x, outer, z + 0.02)])
    for end in (1.0, -1.0):
        model.face(corners + (end * 0.01, 0.0, 0.0), Part.TRIM, (x, inner, z))


def _wheel(model: ModelBuilder, x: float, side: float, radius: float) -> None:
    """Adds a tyre with its tread at the bottom, and a rim."""
    angles = np.linspace(0.0, 2.0 * np.pi, _WHEEL_SIDES, endpoint=False) + np.pi / _WHEEL_SIDES
    circle = np.stack((pn.cos(angles), pn.sin(angles)), axis=-1) * radius / pn.cos(np.pi / _WHEEL_SIDES)
    outer = np.column_stack((x + circle[:, 0], np.full(_WHEEL_SIDES, side * (_SIDE - _SKIN)), radius + circle[:, 1]))
    hub = (x, 0.0, radius)
    model.face(outer, Part.TYRE, hub)
    rim = np.array(hub) + (outer - np.array(hub)) * (0.6, 1.0, 0.6)
    rim[:, 1] = side * _SIDE
    model.face(rim, Part.RIM, hub)
    inner = outer - (0.0, side * 0.2, 0.0)
    for k in (4, 5, 6):  # the sides of the tread that show below the body
        after = (k + 1) % _WHEEL_SIDES
        model.face([outer[k], outer[after], inner[after], inner[k]], Part.TYRE, (x, side * 0.9, radius), shade=0.9)


def _lamps(model: ModelBuilder, form: _Form) -> None:
    low, tail, inside = form.stations[0][1] - 0.15, form.tail, (0.0, 0.0, 0.5)
    head_lamp, brake_lamp = (0.48, 0.78, low, low + 0.12), (0.52, 0.84, tail - 0.12, tail + 0.08)
    for x, slot, (inner, outer, bottom, top) in (
        (_FRONT, Part.HEAD_LAMP, head_lamp),
        (-_FRONT, Part.BRAKE_LAMP, brake_lamp),
    ):
        for side in (1.0, -1.0):
            near, far = side * inner, side * outer
            model.face([(x, near, bottom), (x, near, top), (x, far, top), (x, far, bottom)], slot, inside)
    # the third brake lamp, at the top of the rear
    x, z = form.roof[1], form.roof[2]
    bar = [
        (x - 0.03, -0.16, z - 0.05),
        (x - 0.03, 0.16, z - 0.05),
        (x - 0.01, 0.16, z - 0.01),
        (x - 0.01, -0.16, z - 0.01),
    ]
    model.face(bar, Part.BRAKE_LAMP, inside)
    for x, bottom in ((_FRONT, 0.36), (-_FRONT, 0.40)):
        left, top = math.copysign(_PLATE[0] / 2.0, x), bottom + _PLATE[1]  # left for a viewer who looks at this end
        corners = [(x, left, bottom), (x, left, top), (x, -left, top), (x, -left, bottom)]
        model.panel(corners, Part.PLATE, texture=Texture.PLATE)
