"""Traffic lights, stop and yield signs at the posts of the map, and further lights on the far sides of junctions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, Surface, joined
from dorothie_gym.pictures.camera.scenery.far_lights import Eye, FarSides, eye_at, is_read_from
from dorothie_gym.pictures.camera.scenery.lenses import LENS_OFF, Lenses
from dorothie_gym.pictures.camera.scenery.placing import Heights, foot_beside_road, stamped
from dorothie_gym.pictures.maps.shapes import disc
from dorothie_gym.sim.state.codes import Colour
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.scenery.clearance import Clearance
    from dorothie_gym.pictures.maps.map_layers import MapLayers, Post

_HEAD = 3.4  # [m] height of the centre of a traffic light
_LENS, _BETWEEN = 0.2, 0.46  # [m] radius of a lens, distance of two
_SIGN = 2.4  # [m] height of the centre of a sign
_METAL, _BACK = (100, 104, 104), (150, 152, 154)
_STRAIGHT = 45  # [degrees] largest turn of an exit that counts as straight on
_FAR, _FAR_ASIDE = 1.5, 1.3  # [m] from the start and from the edge of the exit to a repeated light
_HEADS_APART = 1.5  # [m] between lights


class _Head(NamedTuple):
    """A light or sign at a place: its kind, direction in which it is read [rad], height of its foot, and signal."""

    kind: SignalKind
    at: tuple[float, float]
    look: float
    foot: float
    signal: int


def build_signals(layers: MapLayers, clearance: Clearance, ground: Heights) -> tuple[Mesh, Lenses]:
    """Returns lights and signs at all posts of a map, and the lenses among their triangles.

    Lights are repeated on the far sides of junctions, so that the first car in a queue, which stands beside the post,
    also sees the light of its lane.
    """
    light, parts = _traffic_light()
    templates = {SignalKind.TRAFFIC_LIGHT: light, SignalKind.STOP: _stop_sign(), SignalKind.YIELD: _yield_sign()}
    heads = [_head(layers, post, ground) for post in layers.posts]
    heads += _repeaters(layers, clearance, ground, heads)
    heads += _further_heads(layers, clearance, ground, heads)
    meshes: list[Mesh] = []
    ranges, signals, colours = [], [], []
    first = 0
    for kind, template in templates.items():
        chosen = [head for head in heads if head.kind is kind]
        if not chosen:
            continue
        feet = np.array([(*head.at, head.foot) for head in chosen])
        meshes.append(stamped(template, feet, np.array([head.look for head in chosen])))
        for k, head in enumerate(chosen if kind is SignalKind.TRAFFIC_LIGHT else ()):
            start = first + k * template.size
            ranges += [(start + low, start + high) for low, high in parts.values()]
            signals += [head.signal] * len(parts)
            colours += [int(colour) for colour in parts]
        first += meshes[-1].size
    lenses = Lenses(
        np.array(ranges, dtype=np.int32).reshape(-1, 2),
        np.array(signals, dtype=np.int32),
        np.array(colours, dtype=np.int32),
    )
    return joined(meshes), lenses


def _head(layers: MapLayers, post: Post, ground: Heights) -> _Head:
    look, height = _pose(layers.town, layers, post)
    return _Head(
        post.kind, post.at, look, foot_beside_road(layers, ground, post.at, height), _signal_of(layers.town, post)
    )


def _repeaters(layers: MapLayers, clearance: Clearance, ground: Heights, heads: list[_Head]) -> list[_Head]:
    """Returns the lights on the far sides of junctions: at the kerb of the exit that leads straight on."""
    town = layers.town
    found: list[_Head] = []
    for post, head in zip(layers.posts, heads, strict=True):
        if post.kind is not SignalKind.TRAFFIC_LIGHT:
            continue
        exits = [e for lane in post.lanes for e in town.exits(lane) if e.junction_id >= 0 and abs(e.angle) < _STRAIGHT]
        if not exits:
            continue
        target = town.lanes[layers.borders.outermost(min(exits, key=lambda e: abs(e.angle)).lane)]
        aside = town.traffic.sign * (target.width_at(0.0) / 2.0 + _FAR_ASIDE)
        x, y = target.position(_FAR, aside).tolist()
        others = [row.at for row in (*heads, *found)]
        room = clearance.has_room(x, y, 0.3)
        if room and all(pm.dist((x, y), other) > _HEADS_APART for other in others):
            foot = foot_beside_road(layers, ground, (x, y), target.height_at(0.0))
            found.append(_Head(post.kind, (x, y), head.look, foot, head.signal))
    return found


def _further_heads(layers: MapLayers, clearance: Clearance, ground: Heights, heads: list[_Head]) -> list[_Head]:
    """Returns a light for each lane that sees none of its own from its stop line."""
    town, sides = layers.town, FarSides(layers, clearance)
    found: list[_Head] = []
    for post in layers.posts:
        if post.kind is not SignalKind.TRAFFIC_LIGHT:
            continue
        signal = _signal_of(town, post)
        for lane in (town.lanes[k] for k in post.lanes if not town.lanes[k].in_junction):
            eye = eye_at(lane, layers.stops.get(lane.id, lane.length))
            others = [*heads, *found]
            seen = [head for head in others if head.signal == signal and _is_seen(sides, eye, head, others)]
            if seen:
                sides.keep_view(eye, seen[0].at)
                continue
            road = lane.height_at(lane.length)
            places = sides.places(eye, lane.points[-1, :2].tolist(), town.traffic.sign, [row.at for row in others])
            for at in places:
                look = pm.atan2(at[1] - eye.y, at[0] - eye.x)
                head = _Head(post.kind, at, look, foot_beside_road(layers, ground, at, road), signal)
                if _is_framed(eye, head):
                    found.append(head)
                    sides.keep_view(eye, at)
                    break
    return found


def _is_seen(sides: FarSides, eye: Eye, head: _Head, others: list[_Head]) -> bool:
    """Returns whether a driver sees a light, past all others."""
    if not _is_framed(eye, head) or not is_read_from(eye, head.at, head.look):
        return False
    return bool(sides.sees(eye, np.array([head.at]), [other.at for other in others if other is not head])[0])


def _is_framed(eye: Eye, head: _Head) -> bool:
    (ahead,), (aside,) = eye.ahead_and_aside(np.array([head.at]))
    height = head.foot + _HEAD - eye.z
    return eye.frames(ahead, aside, height + _BETWEEN) and eye.frames(ahead, aside, height - _BETWEEN)


def _pose(town: Town, layers: MapLayers, post: Post) -> tuple[float, float]:
    """Returns the direction of the traffic that reads a post [rad], and the height of its road [m]."""
    lanes = [town.lanes[k] for k in post.lanes if not town.lanes[k].in_junction]
    if not lanes:
        signal = next(s for s in town.signals if s.kind is post.kind and s.position[:2] == post.at)
        return signal.heading + math.pi, _nearest_height(town, post.at)
    lane = min(lanes, key=lambda row: float(pn.hypot(*(row.points[-1, :2] - post.at))))
    station = layers.stops.get(lane.id, lane.length)
    return lane.heading_at(station), lane.height_at(station)


def _nearest_height(town: Town, at: tuple[float, float]) -> float:
    """Returns the height of the closest point of all lanes [m]."""
    points = np.concatenate([lane.points for lane in town.lanes])
    return float(points[int(np.argmin(pn.hypot(*(points[:, :2] - at).T))), 2])


def _signal_of(town: Town, post: Post) -> int:
    """Returns the id of the signal that a post shows: the one of a programme where several have the same lanes."""
    same = [s.id for s in town.signals if s.kind is post.kind and s.lanes == post.lanes]
    ruled = {number for programme in town.programmes for number in programme.signals}
    return next((number for number in same if number in ruled), same[0])


def _traffic_light() -> tuple[Mesh, dict[Colour, tuple[int, int]]]:
    """Returns a light for a viewer who looks along x, and the triangles of its lenses."""
    builder, kind = MeshBuilder(), ObjectClass.TRAFFIC_LIGHT
    top = _HEAD + 1.5 * _BETWEEN + 0.06
    builder.prism(disc((0.0, 0.0), 0.075, 6), -0.1, top, colour=_METAL, kind=ObjectClass.POLE)
    builder.box(
        (-0.2, 0.0), 0.0, 0.24, 0.46, _HEAD - 1.5 * _BETWEEN, _HEAD + 1.5 * _BETWEEN, colour=(30, 32, 34), kind=kind,
        closed=(True, True),
    )  # fmt: skip
    builder.panel((-0.12, 0.0, _HEAD), 0.0, 0.74, 3.0 * _BETWEEN + 0.3, colour=(22, 24, 26), kind=kind, two_sided=True)
    parts = {}
    for colour, up in ((Colour.RED, _BETWEEN), (Colour.YELLOW, 0.0), (Colour.GREEN, -_BETWEEN)):
        start = len(builder)
        ring = _round(-0.335, _HEAD + up, _LENS, 8, math.pi / 8.0)
        _polygon(builder, ring, LENS_OFF[colour], kind, surface=Surface.EMISSIVE)
        parts[colour] = start, len(builder)
        hood = _round(-0.335, _HEAD + up, _LENS + 0.025, 8, math.pi / 8.0)
        for k in (0, 1, 2, 3):  # the upper half: seen from below and from the side
            a, b = hood[k], hood[k + 1]
            out = np.array([-0.2, 0.0, 0.0])
            builder.quad([b, b + out, a + out, a], colour=(24, 26, 28), kind=kind, two_sided=True)
    return builder.build(), parts


def _round(x: float, z: float, radius: float, corners: int, turn: float = 0.0) -> Array:
    """Returns corners (n, 3) of an upright polygon, from the right side upwards, for a viewer who looks along x."""
    angles = turn + np.arange(corners) * (2.0 * math.pi / corners)
    return np.column_stack((np.full(corners, x), radius * pn.cos(angles), z + radius * pn.sin(angles)))


def _polygon(
    builder: MeshBuilder,
    corners: Array,
    colour: tuple[int, int, int],
    kind: ObjectClass,
    *,
    texture: Texture = Texture.PLAIN,
    surface: Surface = Surface.NONE,
    backwards: bool = False,
) -> None:
    """Adds a convex polygon (n, 3), anticlockwise for a viewer who looks along x, with one repeat of a texture."""
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    size = float(np.ptp(corners[:, 1:], axis=0).max())
    places = (corners[:, 1:] - middle[1:]) / size + 0.5
    order = (0, 1, 2) if backwards else (0, 2, 1)
    fan = np.array([[(0, k, k + 1)[i] for i in order] for k in range(1, len(corners) - 1)])
    builder.triangles(corners[fan], coordinates=places[fan], colour=colour, kind=kind, texture=texture, surface=surface)


def _stop_sign() -> Mesh:
    builder, kind = MeshBuilder(), ObjectClass.TRAFFIC_SIGN
    builder.prism(disc((0.0, 0.0), 0.04, 5), -0.1, _SIGN + 0.35, colour=_METAL, kind=ObjectClass.POLE)
    for x, radius, colour, texture in (
        (-0.05, 0.47, (245, 245, 245), Texture.PLAIN),
        (-0.06, 0.44, (255, 255, 255), Texture.STOP),
    ):
        _polygon(builder, _round(x, _SIGN, radius, 8, math.pi / 8.0), colour, kind, texture=texture)
    _polygon(builder, _round(-0.04, _SIGN, 0.47, 8, math.pi / 8.0), _BACK, kind, backwards=True)
    return builder.build()


def _yield_sign() -> Mesh:
    builder, kind = MeshBuilder(), ObjectClass.TRAFFIC_SIGN
    builder.prism(disc((0.0, 0.0), 0.04, 5), -0.1, _SIGN + 0.2, colour=_METAL, kind=ObjectClass.POLE)
    down = -math.pi / 2.0
    _polygon(builder, _round(-0.05, _SIGN, 0.62, 3, down), (200, 26, 34), kind)
    _polygon(builder, _round(-0.06, _SIGN, 0.42, 3, down), (252, 252, 250), kind)
    builder.panel((-0.07, 0.0, _SIGN + 0.06), 0.0, 0.5, 0.5, colour=(255, 255, 255), kind=kind, texture=Texture.YIELD)
    _polygon(builder, _round(-0.04, _SIGN, 0.62, 3, down), _BACK, kind, backwards=True)
    return builder.build()
