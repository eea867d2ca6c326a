"""Props: cones, barrier, dumpster, sign and tree, each as large as the box that the simulation gives it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.ontology.world_exceptions import PropKind
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.models.solids import ModelBuilder, Palette, Part, dressed
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.mesh import Mesh

_PALETTE: Palette = {
    Part.ORANGE: (240, 98, 24),
    Part.WHITE: (255, 255, 255),
    Part.METAL: (122, 126, 128),
    Part.TRIM: (44, 46, 48),
    Part.PAINT: (44, 98, 66),
    Part.EXTRA: (36, 40, 42),
    Part.TROUSERS: (94, 76, 58),
    Part.TOP: (84, 118, 52),
}


def _cone(model: ModelBuilder, kind: PropKind) -> None:
    half, height = kind.length / 2.0, kind.height
    works = kind is PropKind.CONSTRUCTION_CONE
    model.box((-half, -half, 0.0), (half, half, 0.05), Part.TRIM if works else Part.ORANGE)
    # the large cone has two white bands, the small one a single broad one
    rings = (0.05, 0.36, 0.52, 0.66, 0.80, 1.0) if works else (0.05, 0.42, 0.74, 1.0)
    radii = [0.82 * half * (1.0 - share) + 0.03 for share in rings]
    for k, (low, high) in enumerate(pairwise(rings)):
        model.limb(
            (0.0, 0.0, max(0.05, low * height)),
            (0.0, 0.0, high * height),
            (radii[k], radii[k + 1]),
            Part.WHITE if k % 2 else Part.ORANGE,
            sides=8,
            closed=k == len(rings) - 2,
        )


def _barrier(model: ModelBuilder, kind: PropKind) -> None:
    half, side, height = kind.length / 2.0, kind.width / 2.0, kind.height
    for low in (0.36, 0.80, height - 0.30):
        top = low + 0.30
        for x in (0.03, -0.03):
            left = math.copysign(side, x)  # of the face, seen from outside
            corners = [(x, left, low), (x, left, top), (x, -left, top), (x, -left, low)]
            model.panel(corners, Part.WHITE, texture=Texture.STRIPES, repeats=(4.0, 0.5))
        edge = [(0.03, -side, top), (0.03, side, top), (-0.03, side, top), (-0.03, -side, top)]
        model.face(edge, Part.WHITE, (0.0, 0.0, 0.0), shade=0.9)
    for y in (-0.8 * side, 0.8 * side):
        model.box((-0.04, y - 0.04, 0.0), (0.04, y + 0.04, height - 0.02), Part.METAL)
        model.box((-half, y - 0.05, 0.0), (half, y + 0.05, 0.08), Part.METAL, shade=0.9)


def _dumpster(model: ModelBuilder, kind: PropKind) -> None:
    half, side, height = kind.length / 2.0, kind.width / 2.0, kind.height
    for x in (-0.7 * half, 0.7 * half):
        for y in (-0.8 * side, 0.8 * side):
            model.box((x - 0.06, y - 0.04, 0.0), (x + 0.06, y + 0.04, 0.14), Part.TRIM)
    top = np.array([(half, side), (-half, side), (-half, -side), (half, -side)])
    bottom = top * (0.9, 0.97)
    low, rim = 0.14, height - 0.16
    inside = (0.0, 0.0, height / 2.0)
    for k in range(4):
        after = (k + 1) % 4
        corners = [(*bottom[k], low), (*bottom[after], low), (*top[after], rim), (*top[k], rim)]
        model.face(corners, Part.PAINT, inside, shade=0.9 if k % 2 else 1.0)
    ridge = [(0.3 * half, side, height), (0.3 * half, -side, height)]
    back = [(-half, side, height - 0.02), (-half, -side, height - 0.02)]
    model.face([(half, side, rim), ridge[0], ridge[1], (half, -side, rim)], Part.EXTRA, inside, shade=1.2)
    model.face([ridge[0], back[0], back[1], ridge[1]], Part.EXTRA, inside, shade=1.1)
    model.face([(-half, side, rim), back[0], back[1], (-half, -side, rim)], Part.EXTRA, inside)
    for y in (side, -side):
        model.face(
            [(half, y, rim), (0.3 * half, y, height), (-half, y, height - 0.02), (-half, y, rim)], Part.EXTRA, inside
        )
    for y in (-0.5 * side, 0.5 * side):
        model.box((0.9 * half, y - 0.05, low + 0.05), (half, y + 0.05, rim - 0.05), Part.PAINT, shade=0.75)


def _sign(model: ModelBuilder, kind: PropKind) -> None:
    side, height = kind.width / 2.0, kind.height
    low = height - kind.width
    model.limb((0.0, 0.0, 0.0), (0.0, 0.0, height - 0.03), (0.035, 0.035), Part.METAL, sides=5)
    for face in (1.0, -1.0):
        x = face * kind.length / 2.0
        corners = [(x, face * side, low), (x, face * side, height), (x, -face * side, height), (x, -face * side, low)]
        model.panel(corners, Part.WHITE, texture=Texture.WORKS)


def _tree(model: ModelBuilder, kind: PropKind) -> None:
    radius, height = kind.width / 2.0, kind.height
    model.limb((0.0, 0.0, 0.0), (0.0, 0.0, 0.5 * height), (0.11, 0.07), Part.TROUSERS, sides=6)
    depth = 0.34 * height
    for heading, high, shade in ((0.0, height - depth, 1.0), (2.1, height - 1.25 * depth, 0.86)):
        scale = 1.0 if shade == 1.0 else 0.9
        centre = (0.1 * (scale < 1.0) * pn.cos(heading), 0.1 * (scale < 1.0) * pn.sin(heading), high)
        model.ball(centre, (scale * radius, scale * radius, depth), Part.TOP, sides=8, rings=3, shade=shade)


_FORMS: Final[Mapping[PropKind, Callable[[ModelBuilder, PropKind], None]]] = MappingProxyType(
    {
        PropKind.TREE: _tree,
        PropKind.CONSTRUCTION_CONE: _cone,
        PropKind.DUMPSTER: _dumpster,
        PropKind.STREET_BARRIER: _barrier,
        PropKind.TRAFFIC_CONE: _cone,
        PropKind.TRAFFIC_SIGN: _sign,
    }
)
"""Builder of each prop's model."""


def _plain_box(model: ModelBuilder, kind: PropKind) -> None:
    half, side = kind.length / 2.0, kind.width / 2.0
    model.box((-half, -side, 0.0), (half, side, kind.height), Part.METAL)


def prop_model(kind: PropKind) -> Mesh:
    """Returns the model of a prop, or a plain box; barrier and sign show their picture to both sides."""
    model = ModelBuilder(ObjectClass.STATIC)
    _FORMS.get(kind, _plain_box)(model, kind)
    return dressed(model.build(), _PALETTE)


def warn_of_plain_props() -> None:
    """Warns of each kind of prop that is drawn as a plain box because it has no model."""
    for kind in PropKind:
        if kind not in _FORMS:
            path = f"{__name__.replace('.', '/')}.py"
            warnings.warn(f"prop {kind}: drawn as a plain box; its model belongs in _FORMS of {path}", stacklevel=2)
