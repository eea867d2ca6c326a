"""Colours of solid surfaces: walls, vehicles, people, trees, signs and lamps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.camera.labels import plane_of
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh, Surface
from dorothie_gym.pictures.camera.samples import (
    AMBIENT,
    BIAS,
    BLUE,
    BRIGHT,
    DEPTH,
    FIVE,
    FOUR,
    GREEN,
    LAMP,
    ONE,
    OWN,
    RED,
    RIGHT,
    SIX,
    SLANT,
    SUN,
    THREE,
    TWO,
    UP,
    Samples,
    whole_vectors,
)
from dorothie_gym.pictures.camera.shadows import TEXEL
from dorothie_gym.pictures.camera.texturing import Textures, sample_texture
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import by_reference, gives_row

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.optics import Optics
    from dorothie_gym.pictures.camera.pose import View

FACES: Final = 64
"""Number of triangles whose faces are kept; a power of two."""

_EMISSIVE, _GROUND, _LEAF = int(Surface.EMISSIVE), int(Surface.GROUND), int(Surface.LEAF)
_BIAS = 0.05  # minimum height of a body above the ground for a shadow on it [m]


@by_reference
class Face(NamedTuple):
    """A triangle relative to the camera, scratch space of the shading; or several, with one more axis in front.

    Attributes:
        plane: (4,) see `plane_of`.
        colour: (3,) 0..255.
        u: (4,) texture coordinate: first + depth * (second right + third up + fourth).
        v: (4,) the other one.
        along: (4,) change of u and v per metre along the longer side of footprints, texels per metre along both sides.
        light: (4,) cosine to the sun, height by which casters must be higher [m], share of the light of the sky,
            vertical part of the normal.
        kind: (3,) number of the triangle, texture, surface.
    """

    plane: Array
    colour: Array
    u: Array
    v: Array
    along: Array
    light: Array
    kind: NDArray[np.int64]


def new_faces() -> Face:
    """Returns scratch space for the triangles that were seen last, each at its number modulo `FACES`."""
    return Face(
        np.zeros((FACES, 4)),
        np.zeros((FACES, 3)),
        np.zeros((FACES, 4)),
        np.zeros((FACES, 4)),
        np.zeros((FACES, 4)),
        np.zeros((FACES, 4)),
        np.zeros((FACES, 3), np.int64),
    )


@gives_row
def face_of(faces: Face, number: int) -> Face:
    """Returns one of several faces."""
    return Face(*(array[number] for array in faces))


@compiled
def read_face(view: View, optics: Optics, mesh: Mesh, row: int, textures: Textures, face: Face) -> None:
    """Reads a triangle; `face.kind[0]` is left to the caller."""
    plane, light = face.plane, face.light
    plane[0], plane[1], plane[2], plane[3] = plane_of(view, mesh, row)
    x, y, z = float(mesh.normals[row, 0]), float(mesh.normals[row, 1]), float(mesh.normals[row, 2])
    texture, surface = int(mesh.textures[row]), int(mesh.surfaces[row])
    face.kind[1], face.kind[2] = texture, surface
    cosine = x * optics.sun_x + y * optics.sun_y + z * optics.sun_z
    light[0], light[1], light[2], light[3] = cosine, _BIAS, 0.8 + 0.2 * z, z
    if surface & _GROUND:
        return
    for k in range(3):
        face.colour[k] = float(mesh.colours[row, k])
    if surface & _LEAF:
        light[0] = 0.35 + 0.5 * cosine
    # the surface itself rises from square to square of the map
    rise = math.sqrt(x * x + y * y) * optics.sun_z
    light[1], light[2] = 0.06 + min(1.2 * TEXEL * rise / max(cosine, 0.05), 1.5), 0.78 + 0.22 * z
    if texture != PLAIN:
        _read_texture_axis(view, mesh.u_axes[row], mesh.corners[row, 0], face.u)
        _read_texture_axis(view, mesh.v_axes[row], mesh.corners[row, 0], face.v)
        _read_footprint(view, mesh, row, textures, face)


@inlined
def _read_texture_axis(view: View, axis: NDArray[np.float32], corner: NDArray[np.float32], out: Array) -> None:
    origin, axes = view.origin, view.axes
    out[0] = float(axis[3])
    out[1] = out[2] = out[3] = 0.0
    for k in range(3):
        out[0] += float(axis[k]) * (origin[k] - float(corner[k]))
        out[1] += float(axis[k]) * axes[0, k]
        out[2] += float(axis[k]) * axes[1, k]
        out[3] += float(axis[k]) * axes[2, k]


@inlined
def _read_footprint(view: View, mesh: Mesh, row: int, textures: Textures, face: Face) -> None:
    """Writes the directions of the longer and the shorter side of footprints: away from the camera and across."""
    forward, plane = view.axes[2], face.plane
    x, y, z = float(mesh.normals[row, 0]), float(mesh.normals[row, 1]), float(mesh.normals[row, 2])
    inward = plane[3]
    ax, ay, az = forward[0] - inward * x, forward[1] - inward * y, forward[2] - inward * z
    scale = 1.0 / max(math.sqrt(ax * ax + ay * ay + az * az), 1e-6)
    ax, ay, az = ax * scale, ay * scale, az * scale
    bx, by, bz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    u, v = mesh.u_axes[row], mesh.v_axes[row]
    ux, uy, uz = float(u[0]), float(u[1]), float(u[2])
    vx, vy, vz = float(v[0]), float(v[1]), float(v[2])
    width, height = textures.table[face.kind[1], 1], textures.table[face.kind[1], 2]
    along = face.along
    along[0], along[1] = ux * ax + uy * ay + uz * az, vx * ax + vy * ay + vz * az
    wide, high = along[0] * width, along[1] * height
    along[2] = math.sqrt(wide * wide + high * high)
    wide, high = (ux * bx + uy * by + uz * bz) * width, (vx * bx + vy * by + vz * bz) * height
    along[3] = math.sqrt(wide * wide + high * high)


@compiled
def add_face(optics: Optics, textures: Textures, samples: Samples, face: Face, first: int, count: int) -> None:
    """Writes colours and surfaces of samples from `first` on that see a triangle."""
    values, plane = samples.values[first:], face.plane
    offset, across, upward, inward = plane[0], plane[1], plane[2], plane[3]
    red, green, blue = face.colour[0], face.colour[1], face.colour[2]
    sun, bias, ambient = face.light[0], face.light[1], face.light[2]
    bright, lamp = 0.0, 0.6
    if face.kind[2] & _EMISSIVE:
        sun, ambient, bright, lamp = 0.0, 0.0, 1.0, 0.0
    for k in range(whole_vectors(count)):
        toward = min(across * values[RIGHT + k] + upward * values[UP + k] + inward, -1e-9)
        values[DEPTH + k], values[SLANT + k] = offset / toward, -toward
        values[RED + k], values[GREEN + k], values[BLUE + k] = red, green, blue
        values[OWN + k], values[BRIGHT + k], values[LAMP + k] = 0.0, bright, lamp
        values[SUN + k], values[BIAS + k], values[AMBIENT + k] = sun, bias, ambient
    samples.surfaces[first : first + count] = face.kind[2]
    if face.kind[1] != PLAIN:
        _place_texture(optics, values, face, count)
        table, number = textures.table, face.kind[1]
        start, width, height, levels = (
            int(table[number, 0]),
            int(table[number, 1]),
            int(table[number, 2]),
            int(table[number, 3]),
        )
        for k in range(count):
            r, g, b, own = sample_texture(
                textures.texels, start, width, height, levels - 1, values[ONE + k], values[TWO + k], values[THREE + k],
                values[FOUR + k], values[FIVE + k], values[SIX + k],
            )  # fmt: skip
            values[RED + k], values[GREEN + k], values[BLUE + k] = red * r, green * g, blue * b
            values[OWN + k] = own * (1.0 - bright)


@inlined
def _place_texture(optics: Optics, values: Array, face: Face, count: int) -> None:
    """Writes texture coordinates, their change along the longer side of the footprint, and squares of both sides."""
    u, v, along, pixel = face.u, face.v, face.along, optics.pixel
    u0, u1, u2, u3, v0, v1, v2, v3 = u[0], u[1], u[2], u[3], v[0], v[1], v[2], v[3]
    du, dv, long, short = along[0], along[1], along[2], along[3]
    for k in range(whole_vectors(count)):
        right, up, depth = values[RIGHT + k], values[UP + k], values[DEPTH + k]
        width = pixel * depth
        length = width / max(values[SLANT + k], 0.02)
        values[ONE + k] = u0 + depth * (u1 * right + u2 * up + u3)
        values[TWO + k] = v0 + depth * (v1 * right + v2 * up + v3)
        values[THREE + k], values[FOUR + k] = du * length, dv * length
        values[FIVE + k], values[SIX + k] = long * length * (long * length), short * width * (short * width)
