"""Cyclists with turning pedals, which fill the outline that the simulation gives them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.models.solids import ModelBuilder, Palette, Part, Rgb, dressed
from dorothie_gym.sim.traffic.parameters import CYCLIST_LENGTH, CYCLIST_WIDTH
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.mesh import Mesh

PEDAL_PHASES = 8
"""Phases of one turn of the pedals."""

PEDAL_CYCLE = 4.3
"""Distance covered in one turn of the pedals [m]: a wheel of 28 inches and two turns of it."""

_WHEEL = 0.34  # [m]
_AXLE = CYCLIST_LENGTH / 2.0 - _WHEEL
_GRIP = CYCLIST_WIDTH / 2.0 - 0.02
_CRANK, _BRACKET = 0.165, 0.29  # [m] length of the cranks, height of their axle
_SADDLE = np.array([-0.18, 0.0, 0.95])
_SPOKES = 8
_LIMB = 0.43  # [m] length of thighs and shanks


@dataclass(frozen=True)
class Rider:
    """Colours of a cyclist."""

    frame: Rgb
    top: Rgb
    helmet: Rgb
    skin: Rgb

    @property
    def palette(self) -> Palette:
        """Colours of the parts."""
        return {
            Part.PAINT: self.frame,
            Part.TOP: self.top,
            Part.EXTRA: self.helmet,
            Part.SKIN: self.skin,
            Part.TROUSERS: (46, 50, 64),
            Part.SHOES: (36, 36, 38),
            Part.TYRE: (28, 28, 30),
            Part.TRIM: (40, 40, 42),
        }


RIDERS = (
    Rider((160, 30, 34), (62, 98, 162), (226, 224, 70), (226, 184, 154)),
    Rider((30, 60, 120), (226, 96, 40), (236, 236, 236), (142, 98, 72)),
    Rider((30, 34, 38), (72, 150, 86), (40, 44, 50), (198, 148, 114)),
    Rider((200, 200, 204), (222, 220, 60), (180, 40, 50), (226, 184, 154)),
    Rider((40, 110, 100), (210, 122, 150), (60, 130, 190), (98, 68, 50)),
    Rider((190, 120, 40), (96, 100, 108), (230, 150, 50), (198, 148, 114)),
    Rider((92, 150, 60), (236, 236, 232), (30, 32, 36), (142, 98, 72)),
    Rider((120, 60, 130), (44, 50, 70), (216, 60, 60), (226, 184, 154)),
    Rider((60, 140, 190), (190, 56, 60), (240, 240, 240), (98, 68, 50)),
    Rider((70, 74, 80), (100, 160, 200), (90, 170, 80), (198, 148, 114)),
)
"""Cyclists to choose from."""


def cyclist_form(phase: int) -> Mesh:
    """Returns a cyclist without colours, in a phase of pedalling."""
    model = ModelBuilder(ObjectClass.VEHICLES)
    for x in (_AXLE, -_AXLE):
        _wheel(model, x)
    rear, front = np.array([-_AXLE, 0.0, _WHEEL]), np.array([_AXLE, 0.0, _WHEEL])
    bracket, head, seat = np.array([-0.04, 0.0, _BRACKET]), np.array([0.40, 0.0, 0.80]), _SADDLE - (0.0, 0.0, 0.05)
    stays, crown = seat + (0.03, 0.0, -0.14), head + (-0.04, 0.0, 0.16)
    tubes = [
        (bracket, head),
        (bracket, seat),
        (head - (0.0, 0.0, 0.06), stays),
        (rear, stays),
        (rear, bracket),
        (front, crown),
    ]
    for start, end in tubes:
        model.limb(start, end, (0.022, 0.022), Part.PAINT, sides=3)
    grips = np.array([0.36, _GRIP, 0.98])
    model.limb(grips * (1, -1, 1), grips, (0.02, 0.02), Part.TRIM, sides=3)
    model.box(_SADDLE - (0.13, 0.07, 0.05), _SADDLE + (0.12, 0.07, 0.0), Part.TRIM)
    _rider(model, 2.0 * math.pi * phase / PEDAL_PHASES)
    return model.build()


def dressed_cyclist(form: Mesh, rider: Rider) -> Mesh:
    """Returns a cyclist with the colours of a rider."""
    return dressed(form, rider.palette)


def _wheel(model: ModelBuilder, x: float) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, _SPOKES, endpoint=False)
    circle = np.column_stack((pn.cos(angles), np.zeros(_SPOKES), pn.sin(angles)))
    centre = np.array([x, 0.0, _WHEEL])
    for k in range(_SPOKES):
        a, b = circle[k], circle[(k + 1) % _SPOKES]
        corners = centre + np.stack((0.82 * a, a, b, 0.82 * b)) * _WHEEL
        for side in (1.0, -1.0):
            model.face(corners + (0.0, side * 0.015, 0.0), Part.TYRE, centre)


def _rider(model: ModelBuilder, turn: float) -> None:
    for side, angle in ((1.0, turn), (-1.0, turn + math.pi)):
        # turning forwards: from above to the front
        pedal = np.array([-0.04 + _CRANK * pm.sin(angle), side * 0.11, _BRACKET + _CRANK * pm.cos(angle)])
        hip, ankle = _SADDLE + (0.0, side * 0.09, 0.02), pedal + (-0.05, 0.0, 0.09)
        knee = _joint(hip, ankle)
        model.limb(hip, knee, (0.09, 0.07), Part.TROUSERS)
        model.limb(knee, ankle, (0.065, 0.045), Part.TROUSERS, shade=0.92)
        model.box(pedal - (0.11, 0.045, 0.0), pedal + (0.15, 0.045, 0.08), Part.SHOES)
        shoulder, hand = np.array([0.12, side * 0.19, 1.43]), np.array([0.35, side * 0.28, 1.0])
        model.limb(shoulder, hand, (0.055, 0.038), Part.TOP)
    model.limb(_SADDLE, (0.13, 0.0, 1.46), (0.155, 0.19), Part.TOP, sides=6, flat=0.7, closed=True)
    model.limb((0.13, 0.0, 1.44), (0.2, 0.0, 1.56), (0.055, 0.055), Part.SKIN)
    model.ball((0.22, 0.0, 1.61), (0.1, 0.088, 0.12), Part.SKIN)
    model.ball((0.20, 0.0, 1.64), (0.125, 0.1, 0.12), Part.EXTRA, rings=1, part=(0.0, 0.55))


def _joint(hip: Array, ankle: Array) -> Array:
    """Returns the knee between hip and ankle, bent to the front."""
    way = ankle - hip
    reach = min(math.sqrt(float(pn.dot(way, way))), 2.0 * _LIMB - 0.01)
    bend = math.sqrt(_LIMB * _LIMB - reach * reach / 4.0)
    forward = np.array([-way[2], 0.0, way[0]])
    return (hip + ankle) / 2.0 + forward * (bend / math.sqrt(float(pn.dot(forward, forward))))
