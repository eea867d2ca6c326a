"""Walking and standing adults and children in several clothings, each also in a coarse version for the distance."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.mesh import new_mesh
from dorothie_gym.pictures.camera.models.solids import ModelBuilder, Palette, Part, Rgb, dressed
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.mesh import Mesh

PHASES = 8
"""Phases of a walking cycle of two steps."""

STANDING = PHASES
"""Pose of a standing person, after the phases."""

POSES = PHASES + 1

CYCLE = 1.4
"""Distance that a person walks in one cycle [m] (two steps of 0.7 m, Knoblauch et al. 1996)."""

CHILD_SIZE = 0.68
"""Height of a child relative to an adult: 1.2 m, seven years old (WHO growth reference 2007). Its steps are shorter."""

_CHILD_HEAD = 1.32  # size of a child's head relative to its body, compared with an adult's
_THIGH, _SHANK, _SOLE = 0.43, 0.42, 0.07  # [m]
_SWING, _ARM_SWING = 0.42, 0.42  # [rad] largest angles of thighs and arms
_KNEE = 0.8  # [rad] largest bend of the knee of the leg that swings forward


class Outfit(enum.IntEnum):
    """Cut of the clothes."""

    TROUSERS = 0
    SKIRT = 1
    COAT = 2
    BACKPACK = 3


@dataclass(frozen=True)
class Look:
    """Clothing and colours of a person, an adult or a child."""

    outfit: Outfit
    top: Rgb
    trousers: Rgb
    skin: Rgb
    hair: Rgb
    extra: Rgb
    child: bool = False

    @property
    def palette(self) -> Palette:
        """Colours of the parts."""
        return {
            Part.TOP: self.top,
            Part.TROUSERS: self.trousers,
            Part.SKIN: self.skin,
            Part.HAIR: self.hair,
            Part.EXTRA: self.extra,
            Part.SHOES: (42, 38, 36),
        }


SKINS: tuple[Rgb, ...] = ((226, 184, 154), (198, 148, 114), (142, 98, 72), (98, 68, 50))
HAIRS: tuple[Rgb, ...] = ((52, 40, 32), (26, 22, 20), (152, 112, 62), (128, 124, 120), (104, 56, 34))
_TOPS: tuple[Rgb, ...] = (
    (184, 62, 62),
    (62, 98, 162),
    (226, 220, 208),
    (72, 122, 86),
    (232, 178, 62),
    (98, 74, 122),
    (54, 58, 64),
    (210, 122, 150),
    (66, 142, 150),
    (150, 106, 72),
    (236, 236, 236),
    (120, 36, 52),
    (150, 176, 204),
    (168, 178, 120),
    (96, 100, 108),
    (226, 120, 76),
)
_TROUSERS: tuple[Rgb, ...] = (
    (46, 52, 74), (74, 68, 60), (34, 36, 40), (110, 104, 92), (58, 76, 104), (160, 150, 128),
)  # fmt: skip
_EXTRAS: tuple[Rgb, ...] = ((160, 60, 40), (40, 70, 100), (60, 80, 50))

ADULTS = 24
"""Number of adults to choose from."""

_CHILDREN = 6
_CHILD_OUTFITS = Outfit.TROUSERS, Outfit.SKIRT, Outfit.BACKPACK


def _look(k: int) -> Look:
    child = k >= ADULTS
    return Look(
        _CHILD_OUTFITS[k % len(_CHILD_OUTFITS)] if child else Outfit(k % len(Outfit)),
        _TOPS[7 * k % len(_TOPS)],
        _TROUSERS[(k + k // 5) % len(_TROUSERS)],
        SKINS[(k * 3 + k // 4) % len(SKINS)],
        HAIRS[(k + k // 3) % len(HAIRS)],
        _EXTRAS[k % len(_EXTRAS)],
        child,
    )


LOOKS = tuple(map(_look, range(ADULTS + _CHILDREN)))
"""Persons to choose from: the adults, then the children, which are a fifth of all."""


def person_form(outfit: Outfit, pose: int, *, coarse: bool = False, child: bool = False) -> Mesh:
    """Returns a person without colours, in a phase of walking or standing."""
    model = ModelBuilder(ObjectClass.PEDESTRIAN)
    swing = 0.0 if pose == STANDING else pm.sin(2.0 * math.pi * pose / PHASES)
    forward = 0.0 if pose == STANDING else pm.cos(2.0 * math.pi * pose / PHASES)
    legs = [_leg(swing, forward), _leg(-swing, -forward)]
    hip = _SOLE - min(float(leg[2, 2]) for leg in legs)  # the lower foot is on the ground
    sides = 3 if coarse else 4
    bare = outfit is Outfit.SKIRT
    for leg, side, front in zip(legs, (1.0, -1.0), (swing, -swing), strict=True):
        top, knee, foot = leg + (0.0, side * 0.09, hip)
        slot = Part.SKIN if bare else Part.TROUSERS
        if coarse:
            model.limb(top, foot - (0.0, 0.0, _SOLE), (0.09, 0.06), slot, sides=3)
        else:
            model.limb(top, knee, (0.095, 0.07), slot, sides=sides)
            model.limb(knee, foot, (0.07, 0.05), slot, sides=sides, shade=0.94)
            x, y, z = foot.tolist()
            model.box((x - 0.08, y - 0.045, z - _SOLE), (x + 0.17, y + 0.045, z + 0.02), Part.SHOES)
        _arm(model, side, -front, hip, sleeves=outfit is not Outfit.TROUSERS, coarse=coarse, standing=pose == STANDING)
    _torso(model, outfit, hip, coarse=coarse, head=_CHILD_HEAD if child else 1.0)
    form = model.build()
    return new_mesh(form.corners * np.float32(CHILD_SIZE), *form[1:-1]) if child else form


def dressed_person(form: Mesh, look: Look) -> Mesh:
    """Returns a person with the colours of a look."""
    return dressed(form, look.palette)


def _leg(swing: float, forward: float) -> Array:
    """Returns hip, knee and ankle (3, 3) below the centre of the hip, from the angle and the motion of the thigh."""
    thigh = _SWING * swing + 0.14 * max(0.0, forward)
    knee = _KNEE * max(0.0, forward) + 0.06 * abs(swing)
    joint = np.array([_THIGH * pm.sin(thigh), 0.0, -_THIGH * pm.cos(thigh)])
    shank = thigh - knee
    return np.stack((np.zeros(3), joint, joint + (_SHANK * pm.sin(shank), 0.0, -_SHANK * pm.cos(shank))))


def _arm(
    model: ModelBuilder, side: float, swing: float, hip: float, *, sleeves: bool, coarse: bool, standing: bool
) -> None:
    angle = _ARM_SWING * swing
    bend = 0.12 if standing else 0.4
    shoulder = np.array([0.0, side * 0.215, hip + 0.52])
    elbow = shoulder + (0.27 * pm.sin(angle), side * 0.02, -0.27 * pm.cos(angle))
    hand = elbow + (0.25 * pm.sin(angle + bend), -side * 0.01, -0.25 * pm.cos(angle + bend))
    if coarse:
        model.limb(shoulder, hand, (0.05, 0.035), Part.TOP, sides=3)
        return
    model.limb(shoulder, elbow, (0.055, 0.048), Part.TOP)
    model.limb(elbow, hand, (0.045, 0.036), Part.TOP if sleeves else Part.SKIN, shade=0.95)


def _torso(model: ModelBuilder, outfit: Outfit, hip: float, *, coarse: bool, head: float) -> None:
    sides = 4 if coarse else 6
    waist, shoulders, neck = hip + 0.18, hip + 0.56, hip + 0.66
    lower = {Outfit.SKIRT: (hip - 0.34, 0.22), Outfit.COAT: (hip - 0.30, 0.20)}.get(outfit, (hip - 0.05, 0.165))
    slot = Part.TROUSERS if outfit in (Outfit.SKIRT, Outfit.TROUSERS) else Part.TOP
    middle = (0.0, 0.0, waist)
    model.limb((0.0, 0.0, lower[0]), middle, (lower[1], 0.15), slot, sides=sides, flat=0.72, shade=0.93)
    model.limb(middle, (0.0, 0.0, shoulders), (0.15, 0.215), Part.TOP, sides=sides, flat=0.6)
    face = (0.01, 0.0, hip + 0.635 + 0.125 * head)
    if coarse:
        model.ball(face, _sized(head, 0.10, 0.095, 0.14), Part.SKIN, sides=4, rings=1)
        crown = (-0.02, 0.0, face[2] + 0.05)
        model.ball(crown, _sized(head, 0.10, 0.10, 0.11), Part.HAIR, sides=4, rings=0, part=(0.0, 0.5))
        return
    model.limb((0.0, 0.0, shoulders), (0.0, 0.0, neck - 0.04), (0.21, 0.07), Part.TOP, sides=sides, flat=0.6)
    model.limb((0.0, 0.0, neck - 0.06), (0.0, 0.0, neck + 0.03), (0.055, 0.055), Part.SKIN)
    model.ball(face, _sized(head, 0.105, 0.09, 0.125), Part.SKIN)
    crown = (-0.018, 0.0, face[2] + 0.035)
    model.ball(crown, _sized(head, 0.108, 0.102, 0.115), Part.HAIR, rings=1, part=(0.0, 0.62))
    if outfit is Outfit.BACKPACK:
        model.box((-0.30, -0.14, hip + 0.14), (-0.11, 0.14, hip + 0.54), Part.EXTRA, bottom=True)
    elif outfit is Outfit.SKIRT:
        model.box((-0.09, 0.23, hip - 0.06), (0.13, 0.31, hip + 0.14), Part.EXTRA, bottom=True)


def _sized(factor: float, *radii: float) -> list[float]:
    return [factor * radius for radius in radii]
