"""Street names: blades at the corners of junctions, and boards at the roadside before and after junctions.

A board before a junction announces the streets that cross there, early enough to decide. A board after a junction
names the street that the driver is on. Boards face the traffic that they are for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from dorothie_gym.maps.model import NO_STREET, Array, Lane
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import STREET_NAMES
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, Surface, oriented
from dorothie_gym.pictures.camera.scenery.clearance import Clearance, free_of
from dorothie_gym.pictures.camera.scenery.placing import Heights, foot_beside_road
from dorothie_gym.pictures.maps.shapes import disc
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.maps.map_layers import MapLayers

_METAL, _BACK = (100, 104, 104), (150, 152, 154)
_BLADE = 2.2, 0.55  # [m] width and height of a street name
_BLADE_HEIGHT = 4.3  # [m] of the lower blade: above the lights at the same corner
_CORNER = (3.0, 1.9, 1.2)  # [m] from the edge of the road to the post with names; the first that has room
_CORNERS_APART = 6.0  # [m]
_BOARD = 4.0, 1.0  # [m] width and height of a name on a board: legible at 20 m in a picture of 480 pixels
_BOARD_HEIGHT = 2.4  # [m] of its lower edge: above people
_OVERHEAD = 5.0  # [m] of a board above the road: above lorries
_ARM_BEHIND = 0.2  # [m] from such a board to its post and arm
_POST_APART = 0.8  # [m] from the post of such a board to others
_BOARD_APART = 3.0  # [m] from a board to posts and other boards
# distances [m] before a stop line and after a junction, the best first; the others only where none of them has room
_BEFORE = ((33.0, 31.0, 35.0, 29.0, 37.0, 27.0, 40.0), (24.0, 20.0, 16.0))
_AFTER = ((38.0, 36.0, 40.0, 34.0, 42.0), (46.0, 50.0, 54.0), (31.0, 28.0, 25.0, 22.0, 18.0))
_ROADSIDE = (0.7, 1.2, 1.8, 2.6, 3.6)  # [m] from the edge of the road to the near edge of a board
# [m] between two boards for the same drivers: at the roadside, and above the road, where the farther one looks lower
_SAME_DRIVERS, _SAME_DRIVERS_OVERHEAD = 16.0, 10.0
_ABREAST = 8.0  # [m] between the middles of lanes side by side
_READ_FROM = 18.0  # [m] before a board, from where nothing may hide it
_SHORTEST = 24.0  # [m] lanes with boards
_MOST_NAMES = 2  # on a board


class Blade(NamedTuple):
    """Posts with the names of the streets that meet at a corner: (street, direction in which it is read [rad])."""

    at: tuple[float, float]
    height: float
    names: tuple[tuple[int, float], ...]


def plan_blades(layers: MapLayers, clearance: Clearance) -> list[Blade]:
    """Returns the corners with street names: at the kerb of each approach to a junction, where there is room."""
    town = layers.town
    found: list[Blade] = []
    for lane in town.lanes:
        if lane.in_junction or lane.street == NO_STREET or lane.id in layers.borders.outer_neighbour:
            continue
        exits = [e for e in town.exits(lane.id) if e.junction_id >= 0]
        others = {town.lanes[e.lane].street: None for e in exits}
        cross = [street for street in others if street not in (lane.street, NO_STREET)]
        if not exits:
            continue
        at = _corner(lane, town.traffic.sign, clearance, found)
        if at is None:
            continue
        heading = lane.heading_at(lane.length)
        names = [(lane.street, heading + math.pi / 2.0), *((street, heading) for street in cross[:2])]
        found.append(Blade(at, lane.height_at(lane.length), tuple(names)))
    return found


def _corner(lane: Lane, sign: int, clearance: Clearance, others: list[Blade]) -> tuple[float, float] | None:
    for aside in _CORNER:
        x, y = lane.position(lane.length - 0.5, sign * (lane.width_at(lane.length) / 2.0 + aside)).tolist()
        apart = all(pm.hypot(x - blade.at[0], y - blade.at[1]) > _CORNERS_APART for blade in others)
        if apart and clearance.has_room(x, y, 0.15):
            return x, y
    return None


def build_blades(layers: MapLayers, blades: list[Blade], ground: Heights) -> Mesh:
    """Returns posts with lit street names; the textures are those of the streets, `STREET_NAMES` and following."""
    builder = MeshBuilder()
    for blade in blades:
        base = foot_beside_road(layers, ground, blade.at, blade.height)
        top = base + _BLADE_HEIGHT + len(blade.names) * (_BLADE[1] + 0.06)
        builder.prism(disc(blade.at, 0.05, 5), base - 0.1, top, colour=_METAL, kind=ObjectClass.POLE)
        for k, (street, look) in enumerate(blade.names):
            z = base + _BLADE_HEIGHT + k * (_BLADE[1] + 0.06) + _BLADE[1] / 2.0
            for turned in (look, look + math.pi):
                c, s = pm.cos(turned), pm.sin(turned)
                builder.panel(
                    (blade.at[0] - 0.06 * c, blade.at[1] - 0.06 * s, z),
                    turned,
                    *_BLADE,
                    colour=(235, 235, 235),
                    kind=ObjectClass.TRAFFIC_SIGN,
                    texture=STREET_NAMES + street,
                    surface=Surface.EMISSIVE,
                )
    return builder.build()


# --- Boards -----------------------------------------------------------------------------------------------------------


class Board(NamedTuple):
    """Board with street names at the roadside.

    Attributes:
        at: centre (x, y) [m].
        look: direction in which it is read [rad].
        height: height of the road beside it [m].
        streets: ids of the streets, from the top.
        post: foot of the post that carries it above the road (x, y) [m], None for a board at the roadside.
    """

    at: tuple[float, float]
    look: float
    height: float
    streets: tuple[int, ...]
    post: tuple[float, float] | None


def plan_boards(layers: MapLayers, clearance: Clearance, taken: Array) -> list[Board]:
    """Returns the boards before and after junctions, where there is room and nothing hides them.

    Args:
        layers: layers of the town's map.
        clearance: room for scenery.
        taken: feet of lights, signs, lamps and blades (n, 2) [m].
    """
    town = layers.town
    found: list[Board] = []
    kept = np.asarray(taken, dtype=np.float64).reshape(-1, 2)
    for lane in town.lanes:
        if lane.in_junction or lane.street == NO_STREET:
            continue
        for spots, streets in (
            (_before_junction(layers, lane), _crossing_streets(layers, lane)),
            (_after_junction(layers, lane), (lane.street,)),
        ):
            board = _first_apart(_boards(layers, clearance, spots, streets, kept), found) if streets else None
            if board is not None:
                found.append(board)
                clearance.keep_views([_view_of(board)])
                kept = np.concatenate((kept, np.array([board.post or board.at])))
    return found


def _first_apart(boards: Iterator[Board], others: list[Board]) -> Board | None:
    """Returns the first board that neither hides another one for the same drivers nor is hidden by it.

    If there is none, the board that is farthest from the others.
    """
    best, farthest = None, _BOARD_APART
    for board in boards:
        wanted = _SAME_DRIVERS if board.post is None else _SAME_DRIVERS_OVERHEAD
        away = min((_apart(board, other) for other in others), default=wanted)
        if away >= wanted:
            return board
        if away > farthest:
            best, farthest = board, away
    return best


def _apart(board: Board, other: Board) -> float:
    """Returns the distance of two boards at the same height for the same drivers [m]; far apart, infinity."""
    away = pm.dist(board.at, other.at)
    if away > _SAME_DRIVERS or (board.post is None) != (other.post is None):
        return math.inf
    return away if pm.cos(board.look - other.look) > 0.5 else math.inf


def _view_of(board: Board) -> shapely.Polygon:
    """Returns the ground between a board and the drivers who read it."""
    half = _BOARD[0] / 2.0 + 0.3
    corners = [(0.5, -half), (0.5, half), (-_READ_FROM, half), (-_READ_FROM, -half)]
    return shapely.Polygon(oriented(corners, board.at, board.look))


def _crossing_streets(layers: MapLayers, lane: Lane) -> tuple[int, ...]:
    """Returns the streets other than its own that an approach leads to over a junction, left ones first."""
    town, inner = layers.town, layers.borders.inner_neighbour
    approach = [lane]
    while (beside := inner.get(approach[-1].id)) is not None:
        if not _abreast(approach[-1], town.lanes[beside], -_BEFORE[0][0]):
            break
        approach.append(town.lanes[beside])
    exits = [e for each in approach for e in town.exits(each.id) if e.junction_id >= 0]
    others = dict.fromkeys(town.lanes[e.lane].street for e in sorted(exits, key=lambda e: e.angle, reverse=True))
    return tuple(street for street in others if street not in (lane.street, NO_STREET))[:_MOST_NAMES]


def _at_kerb(layers: MapLayers, lane: Lane, from_start: float) -> bool:
    """Returns whether no lane in the same direction lies between a place on a lane and the kerb, see `_abreast`."""
    beside = layers.borders.outer_neighbour.get(lane.id)
    return beside is None or not _abreast(lane, layers.town.lanes[beside], from_start)


def _abreast(lane: Lane, other: Lane, from_start: float) -> bool:
    """Returns whether two lanes are side by side at a distance from their starts, from their ends if it is negative."""
    one, two = (
        each.position(min(from_start, each.length) if from_start >= 0.0 else max(0.0, each.length + from_start))
        for each in (lane, other)
    )
    return pm.dist(one.tolist(), two.tolist()) < _ABREAST


def _before_junction(layers: MapLayers, lane: Lane) -> list[list[tuple[Lane, float]]]:
    """Returns places on the way to a stop line, which may be on the lanes before."""
    stop = layers.stops.get(lane.id)
    if stop is None or not _at_kerb(layers, lane, -_BEFORE[0][0]):
        return []
    places = [[_back(layers.town, lane, stop, distance) for distance in group] for group in _BEFORE]
    return [[place for place in group if place is not None] for group in places]


def _back(town: Town, lane: Lane, station: float, distance: float) -> tuple[Lane, float] | None:
    """Returns the lane and station at a distance before a station, None if it is beyond a junction or a fork."""
    seen = {lane.id}
    while station < distance:
        before = [k for k in town.predecessors(lane.id) if k not in seen]
        if len(before) != 1 or town.lanes[before[0]].in_junction:
            return None
        distance -= station
        lane = town.lanes[before[0]]
        station = lane.length
        seen.add(lane.id)
    return lane, station - distance


def _after_junction(layers: MapLayers, lane: Lane) -> list[list[tuple[Lane, float]]]:
    """Returns places on a lane that begins at a junction."""
    town = layers.town
    begins = any(town.lanes[k].in_junction for k in town.predecessors(lane.id))
    if not begins or lane.length < _SHORTEST or not _at_kerb(layers, lane, _AFTER[0][0]):
        return []
    return [[(lane, station) for station in group if station < lane.length - 2.0] for group in _AFTER]


def _boards(
    layers: MapLayers,
    clearance: Clearance,
    spots: list[list[tuple[Lane, float]]],
    streets: tuple[int, ...],
    taken: Array,
) -> Iterator[Board]:
    """Yields boards for which there is room, group by group of places: at the roadside, then above the lane."""
    sign = layers.town.traffic.sign
    for group, overhead in product(spots, (False, True)):
        for lane, station in group:
            height = lane.height_at(station)
            if layers.raised.hold(np.array([(*lane.position(station).tolist(), height)]))[0]:
                continue
            # parallel to the windscreen of a driver who reads it: in a curve the road itself has turned away by then
            eye = max(0.0, station - _READ_FROM)
            heading, (x, y) = lane.heading_at(eye), lane.position(eye).tolist()
            edge = lane.width_at(station) / 2.0
            for aside in _ROADSIDE:
                post = lane.position(station, sign * (edge + aside))
                at = lane.position(station, 0.0 if overhead else sign * (edge + aside + _BOARD[0] / 2.0))
                if _is_free(clearance, at, post if overhead else None, heading, (x, y), taken):
                    foot = (float(post[0]), float(post[1])) if overhead else None
                    yield Board((float(at[0]), float(at[1])), heading, height, streets, foot)


def _is_free(
    clearance: Clearance, at: Array, post: Array | None, heading: float, eye: tuple[float, float], taken: Array
) -> bool:
    """Returns whether there is room for a board, and nothing between it and the eye of a driver.

    `post` is the foot of the post of a board above the lane, None for one at the roadside.
    """
    foot = at if post is None else post
    if len(taken) and pn.hypot(*(taken - foot).T).min() < (_BOARD_APART if post is None else _POST_APART):
        return False
    half = _BOARD[0] / 2.0
    ends = oriented([(0.0, -half), (0.0, half)], at, heading)
    view = np.array([shapely.Polygon([eye, *ends.tolist()])], dtype=np.object_)
    if not free_of(view, clearance.trees)[0]:
        return False
    if post is not None:
        spot = np.array([shapely.Point(*post.tolist()).buffer(0.3)], dtype=np.object_)
        free = bool(free_of(spot, clearance.lots_with_fronts)[0])
        return free and clearance.has_room(float(post[0]), float(post[1]), 0.2)
    ground = np.array([shapely.LineString(ends).buffer(0.15)], dtype=np.object_)
    if not all(free_of(ground, tree)[0] for tree in (clearance.lanes, clearance.trees, clearance.reserved)):
        return False
    if clearance.on_asphalt(oriented([(0.0, -half), (0.0, 0.0), (0.0, half)], at, heading)).any():
        return False
    return not (len(taken) and shapely.contains_xy(view[0], taken[:, 0], taken[:, 1]).any())


def build_boards(layers: MapLayers, boards: list[Board], ground: Heights) -> Mesh:
    """Returns boards on posts; the textures are those of the streets."""
    builder = MeshBuilder()
    width, height = _BOARD
    for board in boards:
        tall = len(board.streets) * height
        if board.post is None:
            low = foot_beside_road(layers, ground, board.at, board.height) + _BOARD_HEIGHT
            for across in (-0.3 * width, 0.3 * width):
                foot = oriented([(0.06, across)], board.at, board.look)[0]
                builder.prism(
                    disc(foot, 0.05, 3),
                    low - _BOARD_HEIGHT - 0.3,
                    low + tall,
                    colour=_METAL,
                    kind=ObjectClass.POLE,
                    closed=(False, False),
                )
        else:
            low = board.height + _OVERHEAD
            _add_arm(builder, board, board.post, foot_beside_road(layers, ground, board.post, board.height), low, tall)
        for k, street in enumerate(reversed(board.streets)):
            builder.panel(
                (*board.at, low + (k + 0.5) * height),
                board.look,
                width,
                height,
                colour=(235, 235, 235),
                kind=ObjectClass.TRAFFIC_SIGN,
                texture=STREET_NAMES + street,
                surface=Surface.EMISSIVE,
            )
        back = (*oriented([(0.02, 0.0)], board.at, board.look)[0].tolist(), low + tall / 2.0)
        builder.panel(back, board.look + math.pi, width, tall, colour=_BACK, kind=ObjectClass.TRAFFIC_SIGN)
    return builder.build()


def _add_arm(
    builder: MeshBuilder, board: Board, post: tuple[float, float], base: float, low: float, tall: float
) -> None:
    """Adds the post of a board above the road, and its arm behind the board."""
    top, kind = low + tall, ObjectClass.POLE
    foot, behind = (oriented([(_ARM_BEHIND, 0.0)], place, board.look)[0] for place in (post, board.at))
    builder.prism(disc(foot, 0.11, 4), base - 0.3, top, colour=_METAL, kind=kind)
    way = foot - behind
    out = way / max(float(pn.hypot(*way)), 1e-9) * (_BOARD[0] / 2.0)
    middle, length = (behind - out + foot) / 2.0, float(pn.hypot(*(way + out)))
    builder.box(
        middle, pm.atan2(way[1], way[0]), length, 0.12, top - 0.35, top - 0.2, colour=_METAL, kind=kind,
        closed=(True, True),
    )  # fmt: skip
