"""Inertial measurement unit and GNSS receiver of the ego, with the errors of cheap parts.

The gyroscope is that of the localizer (`sim.sensing.localizer`): it has the same bias. The receiver gives the fixes
that the localizer is corrected with. All random values follow from the seed of the session's perception and the frame;
they depend neither on the number nor on the order of readings.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.randomness import draw_normal, seed_stream
from dorothie_gym.sim.sensing.localizer import GYRO_NOISE
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import RecordArray, UInt64, empty_records, plain
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.sim.world import World

GRAVITY: Final = 9.81
"""Standard gravity, rounded as in CARLA [m/s^2]."""

ACCELEROMETER_NOISE: Final = 0.007
"""Standard deviation of an acceleration [m/s^2]: 180 ug per root of Hz (Bosch BMI160, data sheet) over the 15 Hz that
30 samples a second cover."""

COMPASS_NOISE: Final = math.radians(1.0)
"""Standard deviation of the compass [rad]: "1 to 2 degrees heading accuracy" (Honeywell HMC5883L, data sheet)."""

EARTH_RADIUS: Final = 6378137.0
"""Equatorial radius of WGS 84 [m]."""

AXES: Final = 3
"""Axes of accelerometer and gyroscope: ahead, to the right, up."""

_DRAWS = 2 * AXES + 1
_SEEDS = 1 << 32


class NoiseRecord:
    """Stream of random numbers, see `RandomStream`."""

    state_high: UInt64
    state_low: UInt64
    step_high: UInt64
    step_low: UInt64


@compiled
def draw_normals(
    stream: RecordArray[NoiseRecord], seed: int, frame: int, pool: NDArray[np.int64], numbers: Array
) -> None:
    """Writes normal numbers (frames, n) for successive frames, of which the first is given."""
    for k in range(numbers.shape[0]):
        seed_stream(stream[0], seed, frame + k, pool)
        for j in range(numbers.shape[1]):
            numbers[k, j] = draw_normal(stream[0])


class Motion(NamedTuple):
    """Motion of the ego at a frame, from which the next acceleration follows.

    Attributes:
        x: x coordinate [m].
        y: y coordinate [m].
        heading: [rad].
        velocity_x: [m/s].
        velocity_y: [m/s].
    """

    x: float
    y: float
    heading: float
    velocity_x: float
    velocity_y: float

    @classmethod
    def of(cls, world: World) -> Motion:
        """Returns the motion of the ego of a world that is at the begin of a session."""
        car = world.car
        x, y = car.position.tolist()
        heading, speed = float(car.heading), float(car.speed)
        return cls(x, y, heading, speed * pm.cos(heading), speed * pm.sin(heading))


class InertialReadings(NamedTuple):
    """Readings of the inertial unit, one row for each frame, the last one that of the present.

    Attributes:
        accelerometer: (n, 3) specific force ahead, to the right and up [m/s^2]: at rest on a level road (0, 0, 9.81).
        gyroscope: (n, 3) rate of roll, pitch and yaw [rad/s]; yaw is positive to the right.
        compass: direction, clockwise from north in [0, 2 pi) [rad].
    """

    accelerometer: Array
    gyroscope: Array
    compass: float


def read_inertial_unit(world: World, before: Motion, frames: int) -> tuple[InertialReadings, Motion]:
    """Returns the readings of the last frames of a world, and the motion of the ego now.

    Args:
        world: world after a step; before the first step it stands.
        before: motion before its last step.
        frames: number of rows; frames before the session count as rest.
    """
    x, y, heading = (
        np.concatenate(([first], world.frames[:, column])) for column, first in enumerate(before[:3], start=1)
    )
    velocity = np.stack((np.diff(x), np.diff(y)), axis=-1) * FRAME_RATE
    velocity = np.concatenate((np.array([before[3:]]), velocity))
    change, heading = np.diff(velocity, axis=0) * FRAME_RATE, wrap_radians(heading)
    turn = np.asarray(wrap_radians(np.diff(heading))) * FRAME_RATE
    cos, sin = pn.cos(heading[1:]), pn.sin(heading[1:])
    slope = pm.atan(_rise(world))
    force = np.zeros((frames, AXES))
    force[:, 0], force[:, 2] = GRAVITY * pm.sin(slope), GRAVITY * pm.cos(slope)
    rates = np.zeros((frames, AXES))
    count = min(frames, len(turn))
    if count:
        force[-count:, 0] += (change[:, 0] * cos + change[:, 1] * sin)[-count:]
        force[-count:, 1] += (change[:, 1] * cos - change[:, 0] * sin)[-count:]
        rates[-count:, 2] += turn[-count:]
    noise = _noise(world, frames)
    localizer = plain(world.actors.arrays.localizer)[0]
    force += ACCELEROMETER_NOISE * noise[:, :AXES]
    rates += GYRO_NOISE * math.sqrt(FRAME_RATE) * noise[:, AXES : 2 * AXES]
    rates[:, 2] += float(localizer["truth"][1])
    north = float(heading[-1]) + 0.5 * math.pi + COMPASS_NOISE * float(noise[-1, -1])
    compass = north - 2.0 * math.pi * math.floor(north / (2.0 * math.pi))
    motion = Motion(float(x[-1]), float(y[-1]), float(heading[-1]), *velocity[-1].tolist())
    return InertialReadings(force, rates, compass), motion


def _noise(world: World, frames: int) -> Array:
    """Returns normal numbers (frames, _DRAWS) of the last frames."""
    numbers = np.empty((frames, _DRAWS))
    seed = int(plain(world.actors.arrays.eye)[0]["seed"]) % _SEEDS
    first = world.frame - frames + 1 + (1 << 30)  # other numbers than those of further streams of the seed
    draw_normals(empty_records(NoiseRecord, 1), seed, first, np.zeros(4, np.int64), numbers)
    return numbers


def _rise(world: World) -> float:
    """Returns the rise of the lane under the ego per metre ahead."""
    plan = plain(world.actors.arrays.plan)[0]
    lane = world.town.lanes[int(plan["lane"])]
    station = min(max(float(plan["station"]), 0.0), lane.length)
    low, high = max(station - 1.0, 0.0), min(station + 1.0, lane.length)
    return (lane.height_at(high) - lane.height_at(low)) / max(high - low, 1e-6)


def read_receiver(world: World) -> tuple[float, float, float]:
    """Returns latitude and longitude [degrees] of the last fix of the ego, and the time since that fix [s].

    The origin of the map lies at 0 degrees north and east; its x axis points east, its y axis south.
    """
    record = plain(world.actors.arrays.localizer)[0]
    x, y = record["fix"].tolist()
    degrees = math.degrees(1.0 / EARTH_RADIUS)
    return -y * degrees, x * degrees, (world.frame - int(record["fixed_at"])) / FRAME_RATE
