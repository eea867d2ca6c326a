"""Shadows of the sun, from height maps of the objects that cast them.

Points are moved along the sun's rays to height 0. A map holds, for each square of that plane, how high the highest
surface is whose light falls there; a point lies in shadow if a surface with the same place on the plane is higher. The
map of the town consists of tiles around the camera, which are drawn when they are in view and kept as long as the sun
stands still; the map of bodies is drawn for every picture, without those whose shadows are out of view. Both depend on
the picture alone, not on earlier ones.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.bodies import surround
from dorothie_gym.pictures.camera.cells import CellTable, is_in_view
from dorothie_gym.pictures.camera.mesh import TOWN, Mesh, Surface
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, concurrent, inlined
from dorothie_gym.support.compilation.records import RecordArray, by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.pose import View

TEXEL = 0.2
"""Width of a square of the plane [m]."""

REACH = 70.0
"""Distance from the camera up to which shadows are drawn [m]; the last quarter fades."""

STEPS = 50.0
"""Heights in maps per metre."""

LOWEST_SUN = 4.0
"""Altitude of the sun below which nothing casts shadows [degrees]."""

_TILE = 128  # width of a tile [squares]
_TILES = 8  # tiles along each side of the map; a power of two
_SIDE = _TILE * _TILES
_WRAP = _SIDE - 1
_BODIES = 512  # width of the map of bodies [squares]
_PARTS = 64  # used parts of the map of bodies that are cleared singly; if there are more, the whole map is cleared
_NOTHING = -32768
_LINE_BELOW = 10.0  # [1/50 m] by which the line of a narrow triangle lies below it: it lights the triangle itself
_BESIDE = 3.0 * TEXEL  # [m] around a shadow that squares of the map and their mixture darken at most
_GROUND = int(Surface.GROUND)


@by_reference
class ShadowMaps(NamedTuple):
    """Heights of the objects that cast shadows.

    Attributes:
        town: (n, n) int16 heights [1/50 m], tiles side by side, each at its place modulo their number.
        held: (t, t, 2) int32 place of the tile that is held.
        bodies: (m, m) int16 heights.
        drawn: (k, 4) int64 used parts of the map of bodies: columns and rows, first and one past the last.
        parts: (1,) int64 number of those parts.
        slope: (2,) shift towards the sun per metre of height [1].
        window: (4,) int64: first square in x and y of the map of the town, and of that of bodies.
        strength: (1,) 1 with shadows, 0 without.
        corners: (3, 3) scratch: corners of a triangle in squares, and their heights.
    """

    town: NDArray[np.int16]
    held: NDArray[np.int32]
    bodies: NDArray[np.int16]
    drawn: NDArray[np.int64]
    parts: NDArray[np.int64]
    slope: Array
    window: NDArray[np.int64]
    strength: Array
    corners: Array


def new_shadow_maps(*, enabled: bool = True) -> ShadowMaps:
    """Returns empty maps; without `enabled` they are of one square."""
    side, bodies = (_SIDE, _BODIES) if enabled else (1, 1)
    return ShadowMaps(
        np.full((side, side), _NOTHING, np.int16),
        np.full((_TILES, _TILES, 2), np.iinfo(np.int32).min, np.int32),
        np.full((bodies, bodies), _NOTHING, np.int16),
        np.zeros((_PARTS, 4), np.int64),
        np.zeros(1, np.int64),
        np.zeros(2),
        np.zeros(4, np.int64),
        np.zeros(1),
        np.zeros((3, 3)),
    )


def turn_sun(maps: ShadowMaps, sun: Array, strength: float) -> bool:
    """Prepares maps for a direction (3,) towards the sun; returns whether it casts shadows."""
    casts = maps.town.shape[0] > 1 and strength > 0.03 and sun[2] >= pm.sin(math.radians(LOWEST_SUN))
    maps.strength[0] = 1.0 if casts else 0.0
    if casts:
        slope = sun[:2] / sun[2]
        if (slope != maps.slope).any():
            maps.slope[:] = slope
            maps.held[:] = np.iinfo(np.int32).min
    return bool(casts)


@concurrent
def draw_shadows(
    view: View,
    maps: ShadowMaps,
    town: Mesh,
    town_cells: CellTable,
    overlay: Mesh,
    overlay_cells: CellTable,
    bank: Mesh,
    ranges: NDArray[np.int32],
    boxes: NDArray[np.float32],
    bodies: RecordArray[PlacementRecord],
) -> None:
    """Draws the tiles in view that the map does not hold, and the map of bodies whose shadows may be seen.

    Args:
        view: projection of the picture.
        maps: maps to draw to.
        town: objects of every session, sorted by cell.
        town_cells: its cells.
        overlay: static objects of this session only, sorted by cell.
        overlay_cells: its cells.
        bank: triangles of all models.
        ranges: ranges of `ModelBank`.
        boxes: boxes of `ModelBank`.
        bodies: models and places.
    """
    lowest = min(_lowest(town_cells), _lowest(overlay_cells))
    highest = max(_highest(town_cells), _highest(overlay_cells))
    for k in range(len(bodies)):
        surround(bodies[k], boxes[bodies[k].model], maps.corners)
        lowest, highest = min(lowest, maps.corners[0, 2]), max(highest, maps.corners[1, 2])
    _draw_tiles(view, maps, town, town_cells, overlay, overlay_cells, lowest, highest)
    _draw_bodies(view, maps, bank, ranges, boxes, bodies, lowest)


@inlined
def _lowest(cells: CellTable) -> float:
    """Returns the smallest height in any cell [m]."""
    lowest = np.inf
    for cell in range(len(cells.ranges)):
        lowest = min(lowest, cells.low[cell, 2])
    return lowest


@inlined
def _highest(cells: CellTable) -> float:
    """Returns the largest height in any cell [m]."""
    highest = -np.inf
    for cell in range(len(cells.ranges)):
        highest = max(highest, cells.high[cell, 2])
    return highest


@compiled
def _draw_tiles(
    view: View, maps: ShadowMaps, town: Mesh, town_cells: CellTable, overlay: Mesh, overlay_cells: CellTable,
    lowest: float, highest: float,
) -> None:  # fmt: skip
    """Draws the tiles around the camera where surfaces between two heights [m] may be seen, if they are not held."""
    width = _TILE * TEXEL
    for axis in range(2):
        centre = view.origin[axis] - maps.slope[axis] * view.origin[2]
        maps.window[axis] = (math.floor(centre / width + 0.5) - _TILES // 2) * _TILE
        maps.window[2 + axis] = math.floor(centre / TEXEL) - _BODIES // 2
    for row in range(maps.window[1] // _TILE, maps.window[1] // _TILE + _TILES):
        for column in range(maps.window[0] // _TILE, maps.window[0] // _TILE + _TILES):
            held = maps.held[row % _TILES, column % _TILES]
            if (held[0] != column or held[1] != row) and _is_tile_in_view(view, maps, column, row, lowest, highest):
                held[0], held[1] = column, row
                left, top = (column % _TILES) * _TILE, (row % _TILES) * _TILE
                for j in range(top, top + _TILE):
                    _empty(maps.town[j, left : left + _TILE])
                tile = maps.town[top : top + _TILE, left : left + _TILE]
                _draw_tile(maps, tile, town, town_cells, column, row)
                _draw_tile(maps, tile, overlay, overlay_cells, column, row)


@inlined
def _is_tile_in_view(view: View, maps: ShadowMaps, column: int, row: int, lowest: float, highest: float) -> bool:
    """Returns whether the picture may show surfaces between two heights [m] whose light crosses a tile."""
    box = maps.corners
    for axis in range(2):
        first = (column if axis == 0 else row) * _TILE * TEXEL
        low, high = maps.slope[axis] * lowest, maps.slope[axis] * highest
        box[0, axis] = first + min(low, high) - _BESIDE
        box[1, axis] = first + _TILE * TEXEL + max(low, high) + _BESIDE
    box[0, 2], box[1, 2] = lowest - _BESIDE, highest + _BESIDE
    depth = 0.0
    for k in range(3):
        ahead = view.axes[2, k]
        depth += ahead * ((box[0, k] if ahead > 0.0 else box[1, k]) - view.origin[k])
    return depth < REACH and is_in_view(view, box[0], box[1])


@inlined
def _empty(row: NDArray[np.int16]) -> None:
    """Empties a row of a map, whose squares are contiguous, so that the compiler vectorises it."""
    for k in range(len(row)):
        row[k] = _NOTHING


@compiled
def _draw_tile(maps: ShadowMaps, tile: NDArray[np.int16], mesh: Mesh, cells: CellTable, column: int, row: int) -> None:
    for cell in range(len(cells.ranges)):
        if _shades(maps, cells.low[cell], cells.high[cell], column, row):
            for k in range(cells.ranges[cell, 0], cells.ranges[cell, 1]):
                if mesh.instances[k] == TOWN:  # the shadow of a landmark would reveal one that is out of view
                    _cast(maps, tile, mesh, k, column * _TILE, row * _TILE, 0.0, 0.0, 0.0, 1.0, 0.0)


@inlined
def _shades(maps: ShadowMaps, low: Array, high: Array, column: int, row: int) -> bool:
    """Returns whether the shadow of a box may touch a tile."""
    for axis in range(2):
        first = (column if axis == 0 else row) * _TILE * TEXEL
        shift_low, shift_high = maps.slope[axis] * low[2], maps.slope[axis] * high[2]
        if high[axis] - min(shift_low, shift_high) < first:
            return False
        if low[axis] - max(shift_low, shift_high) > first + _TILE * TEXEL:
            return False
    return True


@compiled
def _draw_bodies(
    view: View,
    maps: ShadowMaps,
    bank: Mesh,
    ranges: NDArray[np.int32],
    boxes: NDArray[np.float32],
    bodies: RecordArray[PlacementRecord],
    lowest: float,
) -> None:
    """Draws the map of bodies, those near its centre whose shadows may be seen on surfaces above a height [m]."""
    squares = maps.bodies[0:_BODIES, 0:_BODIES]  # a part, as tiles are: `_cast` is compiled once
    first, reach, box = maps.window, 0.5 * _BODIES * TEXEL, maps.corners
    _empty_bodies(maps)
    for k in range(len(bodies)):
        body = bodies[k]
        across = abs(body.x - maps.slope[0] * body.z - first[2] * TEXEL - reach)
        down = abs(body.y - maps.slope[1] * body.z - first[3] * TEXEL - reach)
        if max(across, down) < reach and _is_shadow_in_view(view, maps, body, boxes[body.model], lowest):
            surround(body, boxes[body.model], box)
            _note_part(maps, box)
            for j in range(ranges[body.model, 0], ranges[body.model, 1]):
                _cast(maps, squares, bank, j, first[2], first[3], body.x, body.y, body.z, body.cos, body.sin)


@inlined
def _empty_bodies(maps: ShadowMaps) -> None:
    """Clears the used parts of the map of bodies, most of which is empty."""
    if maps.parts[0] > _PARTS:
        for y in range(_BODIES):
            _empty(maps.bodies[y])
    else:
        for k in range(maps.parts[0]):
            left, right, top, bottom = maps.drawn[k, 0], maps.drawn[k, 1], maps.drawn[k, 2], maps.drawn[k, 3]
            for y in range(top, bottom):
                _empty(maps.bodies[y, left:right])
    maps.parts[0] = 0


@inlined
def _note_part(maps: ShadowMaps, box: Array) -> None:
    """Records the part of the map of bodies where the shadow of a box (2, 3) [m] falls, with a margin."""
    if maps.parts[0] < _PARTS:
        for axis in range(2):
            low, high = maps.slope[axis] * box[0, 2], maps.slope[axis] * box[1, 2]
            first = (box[0, axis] - max(low, high)) / TEXEL - maps.window[2 + axis] - 2.0
            last = (box[1, axis] - min(low, high)) / TEXEL - maps.window[2 + axis] + 2.0
            maps.drawn[maps.parts[0], 2 * axis] = int(min(max(first, 0.0), float(_BODIES)))
            maps.drawn[maps.parts[0], 2 * axis + 1] = int(min(max(last, 0.0), float(_BODIES)))
    maps.parts[0] += 1


@inlined
def _is_shadow_in_view(
    view: View, maps: ShadowMaps, body: PlacementRecord, model: NDArray[np.float32], lowest: float
) -> bool:
    """Returns whether a body, or its shadow down to a height [m], touches the picture."""
    box = maps.corners
    surround(body, model, box)
    for axis in range(2):
        shift = maps.slope[axis] * (box[1, 2] - lowest)
        box[0, axis] -= max(shift, 0.0) + _BESIDE
        box[1, axis] -= min(shift, 0.0) - _BESIDE
    box[0, 2] = lowest - _BESIDE
    return is_in_view(view, box[0], box[1])


@compiled
def _cast(
    maps: ShadowMaps, target: NDArray[np.int16], mesh: Mesh, k: int, left: int, top: int, x: float, y: float, z: float,
    c: float, s: float,
) -> None:  # fmt: skip
    """Draws a rotated and translated triangle, if it faces the sun, to the part of a map that starts at a square."""
    slope, corners = maps.slope, maps.corners
    nx, ny = mesh.normals[k, 0] * c - mesh.normals[k, 1] * s, mesh.normals[k, 0] * s + mesh.normals[k, 1] * c
    rise = nx * slope[0] + ny * slope[1] + mesh.normals[k, 2]  # of the height, seen from the sun
    if rise < 1e-3 or (mesh.surfaces[k] & _GROUND and mesh.textures[k] == 0):
        return  # seen from behind, or the ground itself; bridges cast shadows
    for j in range(3):
        px, py = mesh.corners[k, j, 0], mesh.corners[k, j, 1]
        height = z + mesh.corners[k, j, 2]
        corners[j, 0] = (x + px * c - py * s - slope[0] * height) / TEXEL - left
        corners[j, 1] = (y + px * s + py * c - slope[1] * height) / TEXEL - top
        corners[j, 2] = height * STEPS
    _fill_heights(target, corners, -nx / rise * TEXEL * STEPS, -ny / rise * TEXEL * STEPS)


@inlined
def _fill_heights(target: NDArray[np.int16], corners: Array, right: float, down: float) -> None:
    """Raises the squares whose centres lie in a triangle to its height there, which is affine."""
    size = float(target.shape[0])
    low = min(corners[0, 1], corners[1, 1], corners[2, 1])
    high = max(corners[0, 1], corners[1, 1], corners[2, 1])
    if high < 0.0 or low >= size or max(corners[0, 0], corners[1, 0], corners[2, 0]) < 0.0:
        return  # beside the map, as most triangles of a cell are
    if min(corners[0, 0], corners[1, 0], corners[2, 0]) >= size:
        return
    _fill_line(target, corners)
    base = corners[0, 2] - right * corners[0, 0] - down * corners[0, 1]
    for y in range(math.ceil(min(max(low - 0.5, 0.0), size)), math.ceil(min(max(high - 0.5, 0.0), size))):
        middle, left, end = y + 0.5, np.inf, -np.inf
        for j in range(3):
            i = j + 1 if j < 2 else 0
            if (corners[j, 1] > middle) != (corners[i, 1] > middle):
                share = (middle - corners[j, 1]) / (corners[i, 1] - corners[j, 1])
                at = corners[j, 0] + share * (corners[i, 0] - corners[j, 0])
                left, end = min(left, at), max(end, at)
        for x in range(math.ceil(min(max(left - 0.5, 0.0), size)), math.ceil(min(max(end - 0.5, 0.0), size))):
            value = min(max(base + right * (x + 0.5) + down * middle, -32767.0), 32767.0)
            target[y, x] = max(target[y, x], np.int16(value))


@inlined
def _fill_line(target: NDArray[np.int16], corners: Array) -> None:
    """Raises the squares along the longest edge of a triangle that is narrower than a square, such as one of a pole."""
    longest, first = 0.0, 0
    for j in range(3):
        i = j + 1 if j < 2 else 0
        across, down = abs(corners[i, 0] - corners[j, 0]), abs(corners[i, 1] - corners[j, 1])
        if max(across, down) > longest:
            longest, first = max(across, down), j
    second, third = (first + 1) % 3, (first + 2) % 3
    right, below = corners[second, 0] - corners[first, 0], corners[second, 1] - corners[first, 1]
    aside = right * (corners[third, 1] - corners[first, 1]) - below * (corners[third, 0] - corners[first, 0])
    if longest < 1.0 or abs(aside) >= math.sqrt(right * right + below * below):
        return
    size, steps = float(target.shape[0]), int(longest) + 1
    for k in range(steps + 1):
        share = k / steps
        x, y = corners[first, 0] + share * right, corners[first, 1] + share * below
        if 0.0 <= x < size and 0.0 <= y < size:
            value = corners[first, 2] + share * (corners[second, 2] - corners[first, 2]) - _LINE_BELOW
            target[int(y), int(x)] = max(target[int(y), int(x)], np.int16(min(max(value, -32767.0), 32767.0)))


@inlined
def sunlit(
    town: NDArray[np.int16], bodies: NDArray[np.int16], town_x: int, town_y: int, bodies_x: int, bodies_y: int,
    column: int, row: int, a: float, b: float, level: float,
) -> float:  # fmt: skip
    """Returns the share of the sun's light at a place on the plane, 0 to 1, with soft edges.

    Args:
        town: map of the town.
        bodies: map of bodies.
        town_x: first column of the map of the town [squares].
        town_y: first row.
        bodies_x: first column of the map of bodies.
        bodies_y: first row.
        column: square whose centre is left of the place.
        row: square whose centre is above the place.
        a: distance from there to the right [squares].
        b: distance from there downwards [squares].
        level: height above which surfaces cast a shadow on the place [1/50 m].
    """
    lit, i, j = 1.0, column - town_x, row - town_y
    if 0 <= i < _SIDE - 1 and 0 <= j < _SIDE - 1:
        left, right, top, below = column & _WRAP, (column + 1) & _WRAP, row & _WRAP, (row + 1) & _WRAP
        lit = _mixed(town[top, left], town[top, right], town[below, left], town[below, right], level, a, b)
    i, j = column - bodies_x, row - bodies_y
    if 0 <= i < _BODIES - 1 and 0 <= j < _BODIES - 1 and lit > 0.0:
        lit = min(lit, _mixed(bodies[j, i], bodies[j, i + 1], bodies[j + 1, i], bodies[j + 1, i + 1], level, a, b))
    return lit


@inlined
def _mixed(one: int, two: int, three: int, four: int, level: float, a: float, b: float) -> float:
    """Returns the share of the light that four squares let through."""
    if max(max(one, two), max(three, four)) <= level:
        return 1.0
    upper = (1.0 - a if one <= level else 0.0) + (a if two <= level else 0.0)
    lower = (1.0 - a if three <= level else 0.0) + (a if four <= level else 0.0)
    return upper * (1.0 - b) + lower * b
