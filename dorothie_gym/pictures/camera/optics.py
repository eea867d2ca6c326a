"""Projection and light of a picture as plain numbers, which compiled loops keep in registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import inlined
from dorothie_gym.support.compilation.records import by_reference

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.daylight import Daylight
    from dorothie_gym.pictures.camera.pose import CameraPose, View
    from dorothie_gym.pictures.camera.shadows import ShadowMaps


@by_reference
class Optics(NamedTuple):
    """Numbers of `View`, `Daylight` and `ShadowMaps`.

    Attributes:
        x, y, z: position of the camera [m].
        right_x, right_y, right_z: unit vector to the right.
        up_x, up_y, up_z: unit vector upwards in the picture.
        ahead_x, ahead_y, ahead_z: unit vector forward.
        pixel: width of a pixel at a depth of 1 m [m].
        sun_x, sun_y, sun_z: unit vector towards the sun.
        sun_r, sun_g, sun_b: factors of direct light.
        sky_r, sky_g, sky_b: factors of the light of the sky.
        horizon_r, horizon_g, horizon_b: colour.
        air_r, air_g, air_b: colour.
        fog, fog_start, rain, wetness, lamps, head_lights, beams: see `Daylight`.
        rise: rise of the car per metre ahead.
        car_x, car_y: direction of the car.
        shadows: whether the sun casts shadows.
        slope_x, slope_y: see `ShadowMaps.slope`.
        town_x, town_y, bodies_x, bodies_y: first squares of the maps of shadows.
    """

    x: float
    y: float
    z: float
    right_x: float
    right_y: float
    right_z: float
    up_x: float
    up_y: float
    up_z: float
    ahead_x: float
    ahead_y: float
    ahead_z: float
    pixel: float
    sun_x: float
    sun_y: float
    sun_z: float
    sun_r: float
    sun_g: float
    sun_b: float
    sky_r: float
    sky_g: float
    sky_b: float
    horizon_r: float
    horizon_g: float
    horizon_b: float
    air_r: float
    air_g: float
    air_b: float
    fog: float
    fog_start: float
    rain: float
    wetness: float
    lamps: float
    head_lights: float
    beams: float
    rise: float
    car_x: float
    car_y: float
    shadows: bool
    slope_x: float
    slope_y: float
    town_x: int
    town_y: int
    bodies_x: int
    bodies_y: int


def light_numbers(light: Daylight) -> tuple[float, ...]:
    """Returns the numbers of `Optics` that do not change as long as the light does not, from `sun_x` to `beams`."""
    colours = (light.sun, light.sunshine, light.ambient, light.horizon, light.air)
    return (
        *(value for colour in colours for value in colour.tolist()),
        light.fog,
        light.fog_start,
        light.rain,
        light.wetness,
        light.lamps,
        light.head_lights,
        light.beams,
    )


def optics_of(view: View, light: tuple[float, ...], maps: ShadowMaps, pose: CameraPose) -> Optics:
    """Returns the numbers of a picture whose shadows have been drawn.

    Args:
        view: projection.
        light: see `light_numbers`.
        maps: maps of shadows.
        pose: pose of the camera on the car, whose headlights shine.
    """
    heading = pose.heading - pose.yaw
    numbers = (
        *view.origin.tolist(), *view.axes.ravel().tolist(), 1.0 / view.focal, *light, pm.tan(pose.tilt),
        pm.cos(heading), pm.sin(heading), bool(maps.strength[0] > 0.0), *maps.slope.tolist(), *maps.window.tolist(),
    )  # fmt: skip
    return Optics._make(numbers)  # in the order of the fields


@inlined
def ray(optics: Optics, right: float, up: float) -> tuple[float, float, float]:
    """Returns the direction through a place in the picture, of length 1 along the axis."""
    return (
        optics.ahead_x + right * optics.right_x + up * optics.up_x,
        optics.ahead_y + right * optics.right_y + up * optics.up_y,
        optics.ahead_z + right * optics.right_z + up * optics.up_z,
    )
