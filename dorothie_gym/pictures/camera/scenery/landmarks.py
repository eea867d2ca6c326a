"""Landmarks of a session as recognisable buildings: brands by colours, form and totem, others by a pictogram."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.ontology.labelled_enums import check_complete
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass
from dorothie_gym.pictures.camera import atlas
from dorothie_gym.pictures.camera.atlas import BRAND_SIGNS, Texture
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh, MeshBuilder, Surface, joined, oriented
from dorothie_gym.pictures.camera.models.people import HAIRS, SKINS, STANDING, Look, Outfit, person_form
from dorothie_gym.pictures.camera.models.solids import ModelBuilder, Part, Rgb, dressed
from dorothie_gym.pictures.camera.scenery.gardens import Plot, add_garden
from dorothie_gym.pictures.camera.scenery.houses import Roof, add_roof
from dorothie_gym.pictures.camera.scenery.placing import Heights, feet_on, stamped
from dorothie_gym.pictures.camera.scenery.trees import tree_form
from dorothie_gym.pictures.maps.shapes import disc
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks import landmark_designs
from dorothie_gym.tasks.landmark_designs import (
    MIDDLE_STRIPE,
    STORES,
    Garden,
    StoreDesign,
    Top,
    house_design,
    person_design,
)

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.scenery.lots import Lot
    from dorothie_gym.tasks.storyboard import Landmark

TOTEM = 6.4, 1.6
"""Width and height of the sign on the totem of a brand [m]: 38 by 10 pixels at 40 m in the standard picture."""

PICTOGRAM = 3.2
"""Width and height of the pictograms of houses and persons [m]: 19 pixels at 40 m in the standard picture."""

_WALL = 3.4  # [m] height of the glazed storey of a store
_HOUSE_STOREY = 3.0  # [m] height of a storey of a house
_TREE = 1.1, 0.9  # [m] radius of the tree beside a house, and distance of its trunk from the wall
_HOUSE_DEPTH = 8.2  # [m] largest depth of a house
_NEAREST, _FRONT_GARDEN = 0.8, 3.0  # [m] least and largest depth of its front garden
_SLOPES = {1: 0.45, 2: 0.65, 3: 1.0}  # of the roof by storeys: visible above the eaves, and smaller than the walls
_HIPPED = 2  # neighbours in a row with the same form of roof
_METAL: Rgb = (178, 180, 182)
_ROOF: Rgb = (128, 126, 124)


check_complete(BRAND_SIGNS, STORES, "BRAND_SIGNS", atlas.__name__)

_LIT_SIGNS = {*(texture for texture, *_ in BRAND_SIGNS.values()), Texture.HOUSE_SIGN, Texture.PERSON_SIGN}


def landmark_key(index: int) -> int:
    """Returns the instance of a landmark by its index in the storyboard: -1, -2, ..., no key of a body."""
    return -1 - index


def build_landmarks(landmarks: Iterable[Landmark], lots: Sequence[Lot], ground: Heights) -> Mesh:
    """Returns the landmarks of a session; the triangles of each have its `landmark_key` as instance.

    Args:
        landmarks: landmarks of the session.
        lots: lots of the sites of the town, by their ids.
        ground: heights of the ground.
    """
    parts = []
    for landmark in landmarks:
        part = landmark_form(landmark.name, lots[landmark.site], ground)
        parts.append(part._replace(instances=np.full(part.size, landmark_key(landmark.index), dtype=np.int32)))
    return joined(parts)


@lru_cache(maxsize=64)  # sessions of a town repeat them
def landmark_form(name: LandmarkName, lot: Lot, ground: Heights) -> Mesh:
    """Returns the triangles of a landmark on a lot; a plain building for a name without a design."""
    works = _Works(lot, ground)
    if name in STORES:
        _store(works, STORES[name], BRAND_SIGNS[name][0])
    elif name is LandmarkName.HOUSE:
        _house(works)
    elif name is LandmarkName.PERSON:
        return joined([_waiting_person(lot, ground), _person_sign(works)])
    else:
        _warn_of_plain_building(name)
        _plain_building(works)
    return works.build()


@cache
def _warn_of_plain_building(name: LandmarkName) -> None:
    path = f"{landmark_designs.__name__.replace('.', '/')}.py"
    warnings.warn(
        f"landmark {name.label}: drawn as a plain building; its design belongs in STORES of {path}", stacklevel=2
    )


def _plain_building(works: _Works) -> None:
    """Adds a building without a name."""
    length, depth = min(works.lot.length, 11.0), min(works.lot.depth, 9.0)
    works.foundation((0.0, depth), (-length / 2.0, length / 2.0))
    works.box((0.0, depth), (-length / 2.0, length / 2.0), (0.0, _WALL), _METAL, top=_ROOF)


class _Works:
    """Builder on a lot, in its own frame: metres behind the front, to the right of the centre, and above the ground."""

    def __init__(self, lot: Lot, ground: Heights) -> None:
        self.lot = lot
        self.builder = MeshBuilder()
        self._ground, self._trees = ground, list[Mesh]()
        x, y = lot.depth, lot.length / 2.0
        corners = oriented([(0.0, -y), (0.0, y), (x, y), (x, -y)], lot.front, lot.heading)
        heights = feet_on(ground, corners)
        self.low, self.base = float(heights.min()), float(heights.max())

    def build(self) -> Mesh:
        """Returns the triangles."""
        return joined([self.builder.build(), *self._trees]) if self._trees else self.builder.build()

    def tree(self, deep: float, right: float, radius: float) -> None:
        """Adds a tree with a crown of a radius [m]."""
        place = np.array([self.lot.at(deep, right)])
        foot = np.column_stack((place, feet_on(self._ground, place)))
        tree = stamped(tree_form(0), foot, np.array([self.lot.heading]), np.array([radius]))
        self._trees.append(tree)

    def garden(self, garden: Garden, half: float, depth: float) -> None:
        """Adds a garden in front of a house, of half a length along the street and a depth [m]."""
        plot = Plot(self.lot.at(0.05, 0.0), self.lot.heading, half, depth - 0.1, self.lot.key)
        add_garden(self.builder, garden, plot, self._ground, fine=True)

    def rectangle(self, deep: tuple[float, float], right: tuple[float, float]) -> Array:
        """Returns corners (4, 2) [m] of a rectangle between two depths and two places to the right."""
        corners = [(deep[1], right[0]), (deep[1], right[1]), (deep[0], right[1]), (deep[0], right[0])]
        return oriented(corners, self.lot.front, self.lot.heading)

    def box(
        self, deep: tuple[float, float], right: tuple[float, float], up: tuple[float, float], colour: Rgb, *,
        top: Rgb | None = None, kind: ObjectClass = ObjectClass.BUILDING, bottom: bool = False,
        shrunk: float = 0.0,
    ) -> None:  # fmt: skip
        """Adds a box between two heights above the ground; its upper edges are moved inwards by `shrunk` [m]."""
        ring = self.rectangle(deep, right)
        inner = self.rectangle((deep[0] + shrunk, deep[1] - shrunk), (right[0] + shrunk, right[1] - shrunk))
        self.builder.prism(
            ring,
            self.base + up[0],
            self.base + up[1],
            top=inner,
            colour=colour,
            top_colour=top,
            kind=kind,
            closed=(bottom, True),
        )

    def foundation(self, deep: tuple[float, float], right: tuple[float, float]) -> None:
        """Fills the ground below a building on a slope."""
        if self.base - self.low > 0.05:
            ring = self.rectangle(deep, right)
            self.builder.prism(
                ring, self.low - 0.4, self.base, colour=(150, 148, 144), kind=ObjectClass.BUILDING, closed=(False, True)
            )

    def panel(
        self, deep: float, right: float, up: float, width: float, height: float, *, texture: int = PLAIN,
        colour: Rgb = (255, 255, 255), turned: float = 0.0, kind: ObjectClass = ObjectClass.BUILDING,
        surface: Surface = Surface.NONE,
    ) -> None:  # fmt: skip
        """Adds an upright panel around a place, read from the street, or by a viewer turned from there [rad].

        Panels with names and pictograms are lit signs.
        """
        if texture in _LIT_SIGNS:
            surface = Surface.EMISSIVE
        x, y = self.lot.at(deep, right)
        self.builder.panel(
            (x, y, self.base + up),
            self.lot.heading + turned,
            width,
            height,
            colour=colour,
            kind=kind,
            texture=texture,
            surface=surface,
        )

    def pole(self, deep: float, right: float, high: float, radius: float = 0.16, colour: Rgb = _METAL) -> None:
        """Adds a pole from the ground to a height."""
        self.builder.prism(
            disc(self.lot.at(deep, right), radius, 6),
            self.low - 0.2,
            self.base + high,
            colour=colour,
            kind=ObjectClass.POLE,
        )

    def sign(
        self, right: float, up: float, size: tuple[float, float], texture: Texture, colour: Rgb, deep: float = 0.6
    ) -> None:
        """Adds a sign on a pole, which is read along the street from both sides."""
        width, height = size
        self.pole(deep, right, up)
        self.box(
            (deep - width / 2.0 - 0.06, deep + width / 2.0 + 0.06),
            (right - 0.2, right + 0.2),
            (up, up + height + 0.12),
            colour,
            kind=ObjectClass.STATIC,
            bottom=True,
        )
        for side in (1.0, -1.0):
            self.panel(
                deep,
                right + side * 0.22,
                up + 0.06 + height / 2.0,
                width,
                height,
                texture=texture,
                turned=-side * math.pi / 2.0,
                kind=ObjectClass.STATIC,
            )


def _store(works: _Works, design: StoreDesign, texture: Texture) -> None:
    length, depth = min(works.lot.length, design.most[0]), min(works.lot.depth, design.most[1])
    side = length / 2.0
    totem = 9.4 if design.top is Top.HALL else 5.6
    works.sign(side + 0.9, totem, TOTEM, texture, design.fascia)
    match design.top:
        case Top.CANOPY:
            _petrol_station(works, design, texture, length, depth)
            return
        case Top.HALL:
            _hall(works, design, texture, length, depth)
            return
    _walls(works, (0.0, depth), side, design.wall)
    top = _fascia(works, design, texture, length, depth)
    match design.top:
        case Top.MANSARD:
            works.box(
                (0.5, depth - 0.5), (0.5 - side, side - 0.5), (top, top + 1.8), design.fascia, shrunk=1.6, top=_ROOF
            )
        case Top.GABLE:
            _gable(works, (0.0, depth), side, top, design.fascia, design.wall)
        case Top.TOWER:
            # red and white stripes on the walls, and a tower higher than the roof
            for k in np.linspace(-side + 0.8, side - 5.2, 5).tolist():
                works.panel(-0.03, k, _WALL / 2.0, 0.5, _WALL, colour=design.accent)
            works.box((0.0 - 0.25, 3.4), (side - 4.0, side - 0.3), (0.0, top + 2.4), design.accent, top=_ROOF)
            works.panel(-0.28, side - 2.15, top + 1.1, 3.5, 0.875, texture=texture)
        case Top.STEPPED:
            works.box((-0.3, 2.0), (-0.3 * side, 0.3 * side), (top, top + 1.5), design.fascia, top=_ROOF)
            works.box((-0.32, 0.0), (-0.32 * side, 0.32 * side), (top + 1.5, top + 1.75), design.accent)
        case Top.STRIPED:
            for k, colour in enumerate((design.accent, MIDDLE_STRIPE, design.fascia)):
                low = top - 1.5 + 0.5 * k
                works.box(
                    (-0.34, depth + 0.34), (-side - 0.34, side + 0.34), (low, low + 0.5), colour, top=_ROOF, bottom=True
                )
        case _:
            # an awning over the whole front
            works.box((-1.6, 0.0), (-side, side), (2.6, 3.0), design.accent, bottom=True)


def _walls(works: _Works, deep: tuple[float, float], side: float, colour: Rgb) -> None:
    """Adds the walls of a store, glazed towards the street."""
    works.foundation(deep, (-side, side))
    works.box(deep, (-side, side), (0.0, _WALL), colour)
    width = 2.0 * side - 1.0
    panes = max(1, round(width / 3.0))
    x, y = works.lot.at(deep[0] - 0.02, 0.0)
    right = np.array([-pm.sin(works.lot.heading), pm.cos(works.lot.heading)]) * (width / 2.0)
    (a, b), low, high = (np.array([x, y]) - right, np.array([x, y]) + right), works.base + 0.15, works.base + 2.95
    works.builder.quad(
        [(*a, low), (*a, high), (*b, high), (*b, low)],
        colour=(255, 255, 255),
        kind=ObjectClass.BUILDING,
        texture=Texture.GLASS_FRONT,
        repeats=(panes / 4.0, 1.0),
    )


def _fascia(works: _Works, design: StoreDesign, texture: Texture, length: float, depth: float) -> float:
    """Adds the band with the name above the walls; returns its height above the ground."""
    side, height = length / 2.0, 2.2
    works.box(
        (-0.25, depth + 0.25),
        (-side - 0.25, side + 0.25),
        (_WALL - 0.3, _WALL - 0.3 + height),
        design.fascia,
        top=_ROOF,
        bottom=True,
    )
    middle = _WALL - 0.3 + height / 2.0
    shown = 1.9 if design.top is not Top.STRIPED else 1.5
    offset = -0.36 if design.top is Top.STRIPED else -0.27
    works.panel(offset, -1.8 if design.top is Top.TOWER else 0.0, middle, 4.0 * shown, shown, texture=texture)
    return _WALL - 0.3 + height


def _gable(works: _Works, deep: tuple[float, float], side: float, low: float, colour: Rgb, wall: Rgb) -> None:
    """Adds a roof whose ridge runs away from the street, so that its gable is seen from there."""
    half, rise, base = side + 0.4, 0.42 * side, works.base + low
    feet = oriented(
        [(deep[0] - 0.5, -half), (deep[0] - 0.5, half), (deep[1] + 0.4, half), (deep[1] + 0.4, -half)],
        works.lot.front,
        works.lot.heading,
    )
    ridge = oriented([(deep[0] - 0.5, 0.0), (deep[1] + 0.4, 0.0)], works.lot.front, works.lot.heading)
    a, b, c, d = (np.array([*foot, base]) for foot in feet.tolist())
    front, back = (np.array([*end, base + rise]) for end in ridge.tolist())
    kind, repeats = ObjectClass.BUILDING, ((deep[1] - deep[0]) / 3.2, side / 3.2)
    works.builder.quad([b, front, back, c], colour=colour, kind=kind, texture=Texture.ROOF_TILES, repeats=repeats)
    works.builder.quad([d, back, front, a], colour=colour, kind=kind, texture=Texture.ROOF_TILES, repeats=repeats)
    works.builder.triangles([[a, front, b], [c, back, d]], colour=wall, kind=kind)
    works.builder.quad([a, b, c, d], colour=np.array(wall) * 0.7, kind=kind)


def _hall(works: _Works, design: StoreDesign, texture: Texture, length: float, depth: float) -> None:
    side, height = length / 2.0, 8.4
    works.foundation((0.0, depth), (-side, side))
    works.box((0.0, depth), (-side, side), (0.0, height), design.wall, top=_ROOF)
    works.box((-0.12, depth + 0.12), (-side - 0.12, side + 0.12), (0.0, 0.9), design.accent)
    works.box((-1.4, 0.0), (-0.3 * side, 0.3 * side), (0.0, 4.0), design.accent)
    works.panel(-1.42, 0.0, 1.6, 0.5 * side, 2.8, texture=Texture.GLASS_FRONT)
    width = min(12.0, 0.8 * length)
    works.panel(-0.05, 0.0, 6.2, width, width / 4.0, texture=texture)


def _petrol_station(works: _Works, design: StoreDesign, texture: Texture, length: float, depth: float) -> None:
    side = length / 2.0
    shop = depth > 9.0  # a small lot has the canopy only
    reach = 6.4 if shop else max(2.0, depth - 0.5)
    if shop:
        works.foundation((reach + 0.8, depth), (-side, side))
        _walls(works, (reach + 0.8, depth), 0.8 * side, design.wall)
        works.box(
            (reach + 0.6, depth + 0.2), (-0.82 * side, 0.82 * side), (3.1, 4.0), design.accent, top=_ROOF, bottom=True
        )
    middle = reach / 2.0
    for right in (-0.62 * side, 0.62 * side):
        works.pole(middle, right, 4.7, 0.2, (232, 232, 230))
        pump = (middle - 1.6, middle - 0.7), (right - 0.35, right + 0.35)
        works.box(*pump, (0.0, 1.7), design.fascia, kind=ObjectClass.STATIC)
    works.box((0.0, reach), (-side, side), (4.7, 5.9), design.fascia, top=_ROOF, bottom=True)
    works.box((-0.02, reach + 0.02), (-side - 0.02, side + 0.02), (4.7, 4.95), design.accent)
    works.panel(-0.05, 0.0, 5.42, 3.8, 0.95, texture=texture)


def _house(works: _Works) -> None:
    lot, design = works.lot, house_design(works.lot.key)
    length, behind = min(lot.length, 11.0), min(max(lot.depth - _HOUSE_DEPTH, _NEAREST), _FRONT_GARDEN)
    side, walls = length / 2.0, 0.3 + _HOUSE_STOREY * design.storeys
    deep = (behind, max(min(lot.depth, behind + _HOUSE_DEPTH), behind + 1.2))
    works.foundation(deep, (-side, side))
    works.box(deep, (-side, side), (0.0, walls), design.wall)
    add_roof(
        works.builder,
        Roof.HIPPED if lot.key // _HIPPED % 2 else Roof.ALONG,
        lot.at((deep[0] + deep[1]) / 2.0, 0.0),
        lot.heading,
        (deep[1] - deep[0], length),
        works.base + walls,
        tiles=design.roof,
        gable=np.array(design.wall, dtype=np.float64),
        slope=_SLOPES[design.storeys],
    )
    works.panel(deep[0] - 0.03, 0.0, 1.1, 1.2, 2.2, texture=Texture.DOOR)
    for storey in range(design.storeys):
        for right in (-0.6 * side, 0.6 * side) if storey == 0 else (-0.6 * side, 0.0, 0.6 * side):
            _window(works, deep[0], right, 1.7 + _HOUSE_STOREY * storey, design.trim)
    if design.garden is Garden.TREE:
        works.tree(deep[0] + _TREE[0], -side - _TREE[1], _TREE[0])
    works.garden(design.garden, side, behind)
    works.sign(side + 0.9, 2.5, (PICTOGRAM, PICTOGRAM), Texture.HOUSE_SIGN, (24, 74, 168), deep=0.2)


def _window(works: _Works, deep: float, right: float, up: float, frame: Rgb) -> None:
    works.panel(deep - 0.02, right, up, 1.7, 1.5, colour=frame)
    works.panel(deep - 0.04, right, up, 1.4, 1.2, colour=(74, 96, 116), surface=Surface.GLASS)


def _person_sign(works: _Works) -> Mesh:
    works.sign(1.2, 2.5, (PICTOGRAM, PICTOGRAM), Texture.PERSON_SIGN, (176, 28, 120), deep=0.2)
    return works.builder.build()


def _waiting_person(lot: Lot, ground: Heights) -> Mesh:
    """Returns a person who waves to the street, at the place of the site."""
    design = person_design(lot.key)
    skin, hair = SKINS[lot.key % len(SKINS)], HAIRS[lot.key // len(SKINS) % len(HAIRS)]
    look = Look(Outfit.COAT, design.coat, design.trousers, skin, hair, design.coat)
    arm = ModelBuilder(ObjectClass.PEDESTRIAN)
    arm.limb((0.0, 0.22, 1.42), (0.08, 0.42, 1.68), (0.055, 0.05), Part.TOP)
    arm.limb((0.08, 0.42, 1.68), (0.06, 0.40, 2.0), (0.048, 0.04), Part.SKIN, closed=True)
    body = joined([dressed(part, look.palette) for part in (person_form(look.outfit, STANDING), arm.build())])
    place = np.array([lot.place])
    foot = np.column_stack((place, feet_on(ground, place)))
    return stamped(body, foot, np.array([lot.heading + math.pi]))
