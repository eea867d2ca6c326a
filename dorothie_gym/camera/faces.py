"""Colours of solid surfaces: walls, vehicles, people, trees, signs and lamps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.labels import plane_of
from dorothie_gym.camera.lighting import WARM, LampMap, head_light, lamp_light, through_air
from dorothie_gym.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.camera.optics import Optics, ray
from dorothie_gym.camera.pose import View
from dorothie_gym.camera.shadows import REACH, TEXEL, ShadowMaps, faded, sunlit
from dorothie_gym.camera.texturing import Textures, sample_texture
from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.maps.model import Array

_EMISSIVE, _GLASS, _LEAF = int(Surface.EMISSIVE), int(Surface.GLASS), int(Surface.LEAF)
_GLOW = (0.8, 0.69, 0.5)  # factors of the light of lit windows


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
        sun: (2,) share of direct light, height by which casters must be higher [m].
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
def read_face(view: View, optics: Optics, mesh: Mesh, row: int, textures: Textures, face: Face) -> None:
    """Reads a triangle."""
    plane, normal = face.plane, face.normal
    plane[0], plane[1], plane[2], plane[3] = plane_of(view, mesh, row)
    for k in range(3):
        normal[k], face.colour[k] = mesh.normals[row, k], mesh.colours[row, k]
    face.kind[0], face.kind[1] = mesh.textures[row], mesh.surfaces[row]
    cosine = normal[0] * optics.sun_x + normal[1] * optics.sun_y + normal[2] * optics.sun_z
    face.sun[0] = 0.35 + 0.5 * cosine if face.kind[1] & _LEAF else cosine
    # the surface itself rises from square to square of the map
    rise = math.sqrt(normal[0] * normal[0] + normal[1] * normal[1]) * optics.sun_z
    face.sun[1] = 0.06 + min(1.2 * TEXEL * rise / max(cosine, 0.05), 1.5)
    if face.kind[0] != PLAIN:
        _read_axis(view, mesh.u_axes[row], mesh.corners[row, 0], face.u)
        _read_axis(view, mesh.v_axes[row], mesh.corners[row, 0], face.v)
        _read_footprint(view, mesh, row, textures, face)


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
def _read_footprint(view: View, mesh: Mesh, row: int, textures: Textures, face: Face) -> None:
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
    width, height = textures.table[face.kind[0], 1], textures.table[face.kind[0], 2]
    across, down = (u[0] * bx + u[1] * by + u[2] * bz) * width, (v[0] * bx + v[1] * by + v[2] * bz) * height
    face.along[2] = math.sqrt(across * across + down * down)


@inlined
def solid_colour(
    optics: Optics, face: Face, right: float, up: float, textures: Textures, lamps: LampMap, shadows: ShadowMaps
) -> tuple[float, float, float]:
    """Returns the colour of the present triangle in a direction (right, up, 1)."""
    plane = face.plane
    toward = min(plane[1] * right + plane[2] * up + plane[3], -1e-9)
    depth = plane[0] / toward
    red, green, blue, own = face.colour[0], face.colour[1], face.colour[2], 0.0
    if face.kind[0] != PLAIN:
        r, g, b, own = _textured(face, right, up, depth, max(-toward, 0.02), optics.pixel * depth, textures)
        red, green, blue = red * r * (1.0 / 255.0), green * g * (1.0 / 255.0), blue * b * (1.0 / 255.0)
    if not face.kind[1] & _EMISSIVE:
        red, green, blue = _lit(optics, face, right, up, depth, toward, lamps, shadows, red, green, blue, own)
    return through_air(optics, red, green, blue, depth, right, up)


@inlined
def _textured(
    face: Face, right: float, up: float, depth: float, slant: float, pixel: float, textures: Textures
) -> tuple[float, float, float, float]:
    u, v, long = face.u, face.v, pixel / slant
    return sample_texture(
        textures, face.kind[0], u[0] + depth * (u[1] * right + u[2] * up + u[3]),
        v[0] + depth * (v[1] * right + v[2] * up + v[3]), face.along[0] * long, face.along[1] * long,
        face.along[2] * pixel,
    )  # fmt: skip


@inlined
def _lit(
    optics: Optics, face: Face, right: float, up: float, depth: float, toward: float, lamps: LampMap,
    shadows: ShadowMaps, red: float, green: float, blue: float, own: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Returns a colour in the light that falls on the present triangle, with its own light."""
    dx, dy, dz = ray(optics, right, up)
    dx, dy, dz = depth * dx, depth * dy, depth * dz
    lit = face.sun[0]
    if lit > 0.0 and optics.shadows and depth < REACH:
        z = optics.z + dz
        u, v = optics.x + dx - optics.slope_x * z, optics.y + dy - optics.slope_y * z
        shade = sunlit(
            shadows.town, shadows.bodies, optics.town_x, optics.town_y, optics.bodies_x, optics.bodies_y, u, v,
            z + face.sun[1],
        )  # fmt: skip
        lit *= faded(shade, depth)
    lit, lamp = max(lit, 0.0), 0.0
    if optics.head_lights > 0.0:
        lamp = head_light(optics, dx, dy, dz, -toward / math.sqrt(1.0 + right * right + up * up))
    if optics.lamps > 0.0:
        lamp += lamp_light(lamps, optics.x + dx, optics.y + dy) * optics.lamps * 0.6
    ambient = 0.78 + 0.22 * face.normal[2]
    glow = own * optics.lamps
    r = red * (optics.sky_r * ambient + optics.sun_r * lit + lamp * WARM[0]) + glow * _GLOW[0]
    g = green * (optics.sky_g * ambient + optics.sun_g * lit + lamp * WARM[1]) + glow * _GLOW[1]
    b = blue * (optics.sky_b * ambient + optics.sun_b * lit + lamp * WARM[2]) + glow * _GLOW[2]
    if face.kind[1] & _GLASS:
        slant = -toward / math.sqrt(1.0 + right * right + up * up)
        share, sky, street = _mirror(face.normal[2], dz, slant, depth)
        r += (optics.horizon_r * sky + optics.sky_r * street - r) * share
        g += (optics.horizon_g * sky + optics.sky_g * street - g) * share
        b += (optics.horizon_b * sky + optics.sky_b * street - b) * share
    return r, g, b


@inlined
def _mirror(rise: float, dz: float, slant: float, depth: float) -> tuple[float, float, float]:
    """Returns the share of what glass mirrors, and how much of it is the sky, and the street in 0..255."""
    rest = 1.0 - slant
    upward = min(1.0, max(0.0, 0.5 + 2.0 * (dz / max(depth, 1e-6) + 2.0 * slant * rise)))
    return 0.12 + 0.6 * rest * rest * rest, upward, 70.0 * (1.0 - upward)
