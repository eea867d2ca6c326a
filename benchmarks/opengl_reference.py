"""OpenGL as a reference of speed, where the package moderngl and a driver with EGL are installed.

It draws the triangles of the town, signals and landmarks in plain colours with four samples a pixel: without textures,
light, shadows, sky and bodies, and without semantic classes.
"""

from __future__ import annotations

import os
import warnings
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import one_line
from dorothie_gym.pictures.camera.mesh import Mesh
from dorothie_gym.pictures.camera.pose import CameraPose, view_from
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig

SAMPLES: Final = 4
"""Samples in a pixel."""

NEAR, FAR = 0.1, 1500.0
"""Distances between which triangles are drawn [m]."""

_VERTICES = """
#version 330
uniform mat4 projection;
in vec3 place;
in vec3 colour;
out vec3 paint;
void main() { gl_Position = projection * vec4(place, 1.0); paint = colour; }
"""
_FRAGMENTS = """
#version 330
in vec3 paint;
out vec3 result;
void main() { result = paint; }
"""


class OpenGLReference:
    """Scene of a session in the memory of OpenGL, and a picture to draw it into.

    Attributes:
        renderer: name of the driver.
    """

    def __init__(self, scene: SessionScene, width: int, height: int) -> None:
        """Copies the triangles.

        Raises:
            Exception: there is no driver with EGL; moderngl raises exceptions of several types.
        """
        moderngl: Any = import_module("moderngl")
        os.environ.setdefault("LP_NUM_THREADS", "1")  # of Mesa's driver without a GPU: one core as we have
        self._context = moderngl.create_standalone_context(backend="egl")
        self.renderer = str(self._context.info["GL_RENDERER"])
        self._context.enable(moderngl.DEPTH_TEST)
        program = self._context.program(vertex_shader=_VERTICES, fragment_shader=_FRAGMENTS)
        self._projection = program["projection"]
        data = np.concatenate([_vertices(mesh) for mesh in (scene.town.mesh, scene.overlay)])
        buffer = self._context.buffer(data.tobytes())
        self._triangles = self._context.vertex_array(program, [(buffer, "3f 3f", "place", "colour")])
        size = width, height
        self._sampled, self._picture = (
            self._context.framebuffer(
                self._context.renderbuffer(size, 3, samples=samples),
                self._context.depth_renderbuffer(size, samples=samples),
            )
            for samples in (SAMPLES, 0)
        )
        self._size = size

    def draw(self, pose: CameraPose) -> NDArray[np.uint8]:
        """Returns the picture (h, w, 3) from a pose, read from OpenGL's memory."""
        width, height = self._size
        self._projection.write(_projection(pose, width, height).T.tobytes())
        self._sampled.use()
        self._context.clear(0.5, 0.7, 0.9)
        self._triangles.render()
        self._context.copy_framebuffer(self._picture, self._sampled)
        data = self._picture.read(components=3, alignment=1)
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]

    def close(self) -> None:
        """Frees the memory."""
        self._context.release()


def opengl_reference(scene: SessionScene, width: int, height: int) -> OpenGLReference | None:
    """Returns the reference; None if moderngl is not installed, or no driver with EGL is."""
    if find_spec("moderngl") is None:
        return None
    try:
        return OpenGLReference(scene, width, height)
    except Exception as error:  # of any type: moderngl raises what the driver's libraries do
        warnings.warn(f"OpenGL is not measured: {one_line(error)}", stacklevel=2)
        return None


def _vertices(mesh: Mesh) -> NDArray[np.float32]:
    """Returns place and colour of the corners of all triangles (3 n, 6)."""
    colours = np.repeat(mesh.colours[:, None, :3].astype(np.float32) / 255.0, 3, axis=1)
    return np.concatenate((mesh.corners, colours), axis=2).astype(np.float32).reshape(-1, 6)


def _projection(pose: CameraPose, width: int, height: int) -> NDArray[np.float32]:
    """Returns the matrix (4, 4) from world to clip coordinates, with the field of view of `CameraConfig`."""
    view = view_from(pose, width, height, CameraConfig().field_of_view)
    right, up, forward = view.axes
    scale = (FAR + NEAR) / (FAR - NEAR)
    matrix = np.zeros((4, 4))
    matrix[:, :3] = 2.0 * view.focal / width * right, 2.0 * view.focal / height * up, scale * forward, forward
    matrix[:, 3] = -matrix[:, :3] @ view.origin
    matrix[2, 3] -= 2.0 * FAR * NEAR / (FAR - NEAR)
    return matrix.astype(np.float32)
