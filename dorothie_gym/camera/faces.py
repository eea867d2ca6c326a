"""Colours of solid surfaces: walls, vehicles, people, trees, signs and lamps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.atlas import AtlasArrays
from dorothie_gym.camera.daylight import Daylight
from dorothie_gym.camera.labels import plane_of
from dorothie_gym.camera.lighting import WARM, LampMap, air_colour, head_light, lamp_light
from dorothie_gym.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.camera.pose import View
from dorothie_gym.camera.shadows import REACH, TEXEL, ShadowMaps, sunlit
from dorothie_gym.camera.texturing import sample_texture
from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.maps.model import Array

_EMISSIVE, _GLASS, _LEAF = int(Surface.EMISSIVE), int(Surface.GLASS), int(Surface.LEAF)
_GLOW = (1.0, 0.86, 0.62)  # colour of lit windows


@by_reference
class Face(NamedTuple):
    """The present triangle relative to the camera, scratch space of the shading.

    Attributes:
        plane: (4,) see `plane_of`.
        normal: (3,) unit vector.
        colour: (3,) 0..255.
        u: (4,) texture coordinate: first + depth * (second right + third up + fourth).
        v: (4,) the other one.
        along: (3,) change of u and v per metre along the longer side of footprints, texels per metre along the shorter.
        sun: (2,) cosine to the sun, height by which casters must be higher [m].
        kind: (2,) texture, surface.
    """

    plane: Array
    normal: Array
    colour: Array
    u: Array
    v: Array
    along: Array
    sun: Array
    kind: NDArray[np.int64]


def new_face() -> Face:
    """Returns scratch space."""
    return Face(
        np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(4), np.zeros(4), np.zeros(3), np.zeros(2), np.zeros(2, np.int64)
    )


@compiled
def read_face(view: View, mesh: Mesh, row: int, atlas: AtlasArrays, light: Daylight, face: Face) -> None:
    """Reads a triangle."""
    plane, normal = face.plane, face.normal
    plane[0], plane[1], plane[2], plane[3] = plane_of(view, mesh, row)
    for k in range(3):
        normal[k], face.colour[k] = mesh.normals[row, k], mesh.colours[row, k]
    face.kind[0], face.kind[1] = mesh.textures[row], mesh.surfaces[row]
    cosine = normal[0] * light.sun[0] + normal[1] * light.sun[1] + normal[2] * light.sun[2]
    face.sun[0] = cosine
    # the surface itself rises from square to square of the map
    rise = math.sqrt(normal[0] * normal[0] + normal[1] * normal[1]) * light.sun[2]
    face.sun[1] = 0.06 + min(1.2 * TEXEL * rise / max(cosine, 0.05), 1.5)
    if face.kind[0] != PLAIN:
        _read_axis(view, mesh.u_axes[row], mesh.corners[row, 0], face.u)
        _read_axis(view, mesh.v_axes[row], mesh.corners[row, 0], face.v)
        _read_footprint(view, mesh, row, atlas, face)


@inlined
def _read_axis(view: View, axis: NDArray[np.float32], corner: NDArray[np.float32], out: Array) -> None:
    origin, axes = view.origin, view.axes
    out[0] = float(axis[3])
    out[1] = out[2] = out[3] = 0.0
    for k in range(3):
        out[0] += axis[k] * (origin[k] - corner[k])
        out[1] += axis[k] * axes[0, k]
        out[2] += axis[k] * axes[1, k]
        out[3] += axis[k] * axes[2, k]


@inlined
def _read_footprint(view: View, mesh: Mesh, row: int, atlas: AtlasArrays, face: Face) -> None:
    """Writes the directions of the longer and the shorter side of footprints: away from the camera and across."""
    forward, normal = view.axes[2], face.normal
    inward = forward[0] * normal[0] + forward[1] * normal[1] + forward[2] * normal[2]
    ax, ay, az = forward[0] - inward * normal[0], forward[1] - inward * normal[1], forward[2] - inward * normal[2]
    scale = 1.0 / max(math.sqrt(ax * ax + ay * ay + az * az), 1e-6)
    ax, ay, az = ax * scale, ay * scale, az * scale
    bx, by, bz = normal[1] * az - normal[2] * ay, normal[2] * ax - normal[0] * az, normal[0] * ay - normal[1] * ax
    u, v = mesh.u_axes[row], mesh.v_axes[row]
    face.along[0] = u[0] * ax + u[1] * ay + u[2] * az
    face.along[1] = v[0] * ax + v[1] * ay + v[2] * az
    width, height = atlas.table[face.kind[0], 1], atlas.table[face.kind[0], 2]
    across, down = (u[0] * bx + u[1] * by + u[2] * bz) * width, (v[0] * bx + v[1] * by + v[2] * bz) * height
    face.along[2] = math.sqrt(across * across + down * down)


@inlined
def solid_colour(
    view: View, face: Face, right: float, up: float, atlas: AtlasArrays, light: Daylight, lamps: LampMap,
    shadows: ShadowMaps, colour: Array,
) -> None:  # fmt: skip
    """Writes the colour (4,) of the present triangle in a direction (right, up, 1)."""
    plane = face.plane
    toward = plane[1] * right + plane[2] * up + plane[3]
    depth = plane[0] / min(toward, -1e-9)
    length = math.sqrt(1.0 + right * right + up * up)
    slant = -toward / length
    colour[3] = 0.0
    if face.kind[0] == PLAIN:
        colour[0], colour[1], colour[2] = face.colour[0], face.colour[1], face.colour[2]
    else:
        _textured(view, face, right, up, depth, max(slant, 0.02), atlas, colour)
    if not face.kind[1] & _EMISSIVE:
        _lit(view, face, right, up, depth, slant, light, lamps, shadows, colour)
    air_colour(light, depth * length, colour)


@inlined
def _textured(
    view: View, face: Face, right: float, up: float, depth: float, slant: float, atlas: AtlasArrays, colour: Array
) -> None:
    u, v, pixel = face.u, face.v, depth / view.focal
    sample_texture(
        atlas, face.kind[0], u[0] + depth * (u[1] * right + u[2] * up + u[3]),
        v[0] + depth * (v[1] * right + v[2] * up + v[3]), face.along[0] * pixel / slant, face.along[1] * pixel / slant,
        face.along[2] * pixel, colour,
    )  # fmt: skip
    for k in range(3):
        colour[k] *= face.colour[k] * (1.0 / 255.0)


@inlined
def _lit(
    view: View, face: Face, right: float, up: float, depth: float, slant: float, light: Daylight, lamps: LampMap,
    shadows: ShadowMaps, colour: Array,
) -> None:  # fmt: skip
    """Multiplies the colour with the light that falls on the present triangle."""
    axes, origin, normal = view.axes, view.origin, face.normal
    dx = depth * (axes[2, 0] + right * axes[0, 0] + up * axes[1, 0])
    dy = depth * (axes[2, 1] + right * axes[0, 1] + up * axes[1, 1])
    dz = depth * (axes[2, 2] + right * axes[0, 2] + up * axes[1, 2])
    lit = face.sun[0]
    if face.kind[1] & _LEAF:
        lit = 0.35 + 0.5 * lit
    lit = max(lit, 0.0)
    if lit > 0.0 and shadows.strength[0] > 0.0 and depth < REACH:
        shade = sunlit(shadows, origin[0] + dx, origin[1] + dy, origin[2] + dz, face.sun[1])
        lit *= shade + (1.0 - shade) * min(1.0, max(0.0, (depth / REACH - 0.75) * 4.0))
    lamp = 0.0
    if light.lamps > 0.0:
        lamp = lamp_light(lamps, origin[0] + dx, origin[1] + dy) * light.lamps * 0.6
    lamp += head_light(view, light, dx, dy, dz, slant)
    own = colour[3] * light.lamps
    for k in range(3):
        factor = light.ambient[k] * (0.78 + 0.22 * normal[2]) + light.sunshine[k] * lit + lamp * WARM[k]
        colour[k] = colour[k] * factor + own * _GLOW[k] * 0.8
    if face.kind[1] & _GLASS:
        _mirror(light, normal, dz, slant, depth, colour)


@inlined
def _mirror(light: Daylight, normal: Array, dz: float, slant: float, depth: float, colour: Array) -> None:
    """Mixes what glass mirrors into its colour: the sky above, dark streets below."""
    rest = 1.0 - slant
    share = 0.12 + 0.6 * rest * rest * rest
    upward = min(1.0, max(0.0, 0.5 + 2.0 * (dz / max(depth, 1e-6) + 2.0 * slant * normal[2])))
    for k in range(3):
        mirrored = light.horizon[k] * upward + 70.0 * light.ambient[k] * (1.0 - upward)
        colour[k] += (mirrored - colour[k]) * share
