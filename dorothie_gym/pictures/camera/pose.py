"""Pose of a camera and its pinhole projection.

The world's x axis points east, its y axis south, z up; headings turn clockwise as seen from above. Picture coordinates
run to the right and down, in pixels; the centre of the first pixel is at (0.5, 0.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import by_reference
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.session.sensor_config import SensorMount


@shared
@dataclass(frozen=True)
class CameraPose:
    """Place and direction of a camera or another sensor.

    Attributes:
        x: [m].
        y: [m].
        z: [m].
        heading: [rad].
        pitch: upwards [rad].
        tilt: upward tilt of the car, equal to that of the road [rad].
        roll: clockwise as seen from behind [rad].
        yaw: heading relative to that of the car [rad].
    """

    x: float
    y: float
    z: float
    heading: float
    pitch: float = 0.0
    tilt: float = 0.0
    roll: float = 0.0
    yaw: float = 0.0

    def mounted(self, mount: SensorMount) -> Self:
        """Returns the pose of a sensor on a car with this pose."""
        c, s = pm.cos(self.pitch), pm.sin(self.pitch)
        ahead, rise = mount.forward * c - mount.up * s, mount.forward * s + mount.up * c
        cos, sin = pm.cos(self.heading), pm.sin(self.heading)
        x, y = self.x + ahead * cos, self.y + ahead * sin
        if mount.right:
            x, y = x - mount.right * sin, y + mount.right * cos
        if not (mount.yaw or mount.roll):
            pitch = self.pitch + math.radians(mount.pitch)
            return type(self)(x, y, self.z + rise, self.heading, pitch, self.pitch)
        heading, pitch, roll = self._turned(mount)
        return type(self)(x, y, self.z + rise, heading, pitch, self.pitch, roll, heading - self.heading)

    def _turned(self, mount: SensorMount) -> tuple[float, float, float]:
        """Returns heading, pitch and roll [rad] of a sensor that is turned relative to the car."""
        right, up, forward = axes_of(self.heading, self.pitch, self.roll)
        sides, _, ahead = axes_of(*(math.radians(angle) for angle in (mount.yaw, mount.pitch, mount.roll)))
        car = np.array([forward, right, up])  # the axes of the mount are given along these
        to_right, to_front = pn.matmul(np.array([sides, ahead]), car)
        heading = pm.atan2(float(to_front[1]), float(to_front[0]))
        pitch = pm.atan2(float(to_front[2]), pm.hypot(float(to_front[0]), float(to_front[1])))
        level_right, level_up, _ = axes_of(heading, pitch)
        roll = pm.atan2(-float((to_right * level_up).sum()), float((to_right * level_right).sum()))
        return heading, pitch, roll


def axes_of(heading: float, pitch: float, roll: float = 0.0) -> Array:
    """Returns the unit vectors to the right, up and forward (3, 3) of a pose by its angles [rad]."""
    c, s = pm.cos(heading), pm.sin(heading)
    cp, sp = pm.cos(pitch), pm.sin(pitch)
    axes = np.array([[-s, c, 0.0], [-sp * c, -sp * s, cp], [cp * c, cp * s, sp]])
    if roll:
        cr, sr = pm.cos(roll), pm.sin(roll)
        axes[:2] = [cr * axes[0] - sr * axes[1], sr * axes[0] + cr * axes[1]]
    return axes


@by_reference
class View(NamedTuple):
    """Pinhole projection from a pose: square pixels, the principal point in the centre.

    Attributes:
        origin: (3,) position [m].
        axes: (3, 3) unit vectors to the right, up and forward.
        focal: focal length [pixels].
        width: width of the picture [pixels].
        height: height of the picture [pixels].
    """

    origin: Array
    axes: Array
    focal: float
    width: int
    height: int

    def scaled(self, factor: int) -> View:
        """Returns the projection of the same picture with more pixels."""
        return self._replace(focal=self.focal * factor, width=self.width * factor, height=self.height * factor)

    def rays(self) -> Array:
        """Returns the directions (h, w, 3) through the centres of the pixels, of length 1 along the axis."""
        right = (np.arange(self.width) + 0.5 - 0.5 * self.width) / self.focal
        down = (np.arange(self.height) + 0.5 - 0.5 * self.height) / self.focal
        return np.asarray(self.axes[2] + right[None, :, None] * self.axes[0] - down[:, None, None] * self.axes[1])

    def project(self, points: Array) -> tuple[Array, Array]:
        """Returns the picture coordinates (n, 2) [pixels] of points (n, 3) [m], and their depths (n,) [m]."""
        right, up, depth = pn.matmul(points - self.origin, self.axes.T).T
        with np.errstate(divide="ignore", invalid="ignore"):
            x = 0.5 * self.width + self.focal * right / depth
            y = 0.5 * self.height - self.focal * up / depth
        return np.column_stack((x, y)), depth


def pose_on_car(mount: SensorMount, x: float, y: float, z: float, heading: float, rise: float = 0.0) -> CameraPose:
    """Returns the pose of a camera or another sensor on a car.

    Args:
        mount: place of the sensor on the car.
        x: x coordinate of the car [m].
        y: y coordinate of the car [m].
        z: z coordinate of the road below it [m].
        heading: heading of the car [rad].
        rise: rise of the road per metre ahead.
    """
    return CameraPose(x, y, z, heading, pm.atan(rise)).mounted(mount)


def view_from(pose: CameraPose, width: int, height: int, field_of_view: float) -> View:
    """Returns the projection of a picture.

    Args:
        pose: pose of the camera.
        width: [pixels].
        height: [pixels].
        field_of_view: horizontal [degrees].
    """
    axes = axes_of(pose.heading, pose.pitch, pose.roll)
    focal = 0.5 * width / pm.tan(0.5 * math.radians(field_of_view))
    return View(np.array([pose.x, pose.y, pose.z]), axes, focal, width, height)
