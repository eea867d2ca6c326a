"""Settings of the car's sensors other than cameras: lidar, radar, inertial unit, GNSS, lane invasion, collisions.

Frames and units are those of CARLA's sensors: x forward, y to the right, z up in the frame of a sensor; angles are
clockwise as seen from above.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

from dorothie_gym.support.copying import shared

Output = TypeVar("Output", bound=enum.StrEnum)

Bound: TypeAlias = tuple[str, float, float, str]
"""Name of a field, its smallest and largest value, and its unit."""


def check_bounds(settings: object, bounds: Iterable[Bound]) -> None:
    """Raises `ValueError` for the first field that is no number within its bounds; names it."""
    for name, low, high, unit in bounds:
        value = getattr(settings, name)
        if isinstance(value, bool) or not (isinstance(value, float | int) and low <= value <= high):
            raise ValueError(f"{type(settings).__name__}.{name} is {value!r}; it must be in {low:g}..{high:g} {unit}")


def check_whole(settings: object, bounds: Iterable[Bound]) -> None:
    """Raises `ValueError` for the first field that is no whole number within its bounds; names it."""
    for name, low, high, unit in bounds:
        value = getattr(settings, name)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise ValueError(
                f"{type(settings).__name__}.{name} is {value!r}; it must be a whole number in {low:g}..{high:g} {unit}"
            )


def check_type(settings: object, name: str, kind: type, *, optional: bool = False) -> None:
    """Raises `ValueError` unless a field is of a class, or None where that is allowed; names it."""
    value = getattr(settings, name)
    if not (isinstance(value, kind) or (optional and value is None)):
        wanted = f"{kind.__name__} or None" if optional else kind.__name__
        raise ValueError(f"{type(settings).__name__}.{name} is a {type(value).__name__}; it must be a {wanted}")


def check_flags(settings: object, names: Iterable[str]) -> None:
    """Raises `ValueError` for the first field that is neither True nor False; names it."""
    for name in names:
        value = getattr(settings, name)
        if not isinstance(value, bool):
            raise ValueError(f"{type(settings).__name__}.{name} is {value!r}; it must be True or False")


def checked_outputs(settings: object, outputs: object, kind: type[Output]) -> tuple[Output, ...]:
    """Returns outputs, given as members of an enumeration or as their values, as members.

    Raises:
        ValueError: they are no tuple, or empty, or one of them is unknown or named twice; names the field.
    """
    name = f"{type(settings).__name__}.outputs"
    if not isinstance(outputs, tuple):
        raise ValueError(f"{name} is a {type(outputs).__name__}; it must be a tuple of {kind.__name__}")
    known = [output.value for output in kind]
    for output in outputs:
        if output not in known:
            raise ValueError(f"{name} contains {output!r}; it must be of {', '.join(known)}")
    if not outputs or len(set(outputs)) < len(outputs):
        raise ValueError(f"{name} is {outputs}; it must name at least one output, each once")
    return tuple(kind(output) for output in outputs)


@shared
@dataclass(frozen=True, kw_only=True)
class SensorMount:
    """Place and direction of a sensor on the car.

    The axes of the sensor are those of the car, turned first by the roll, then by the pitch, then by the yaw.

    Attributes:
        forward: distance in front of the centre of the car [m].
        right: distance to the right of it [m].
        up: above the road [m].
        pitch: upwards [degrees].
        yaw: clockwise from straight ahead [degrees]: 90 looks to the right, 180 backwards.
        roll: clockwise as seen from behind the sensor [degrees].

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    forward: float = 0.0
    right: float = 0.0
    up: float = 1.8
    pitch: float = 0.0
    yaw: float = 0.0
    roll: float = 0.0

    def __post_init__(self) -> None:
        check_bounds(
            self,
            (
                ("forward", -5.0, 5.0, "m"),
                ("right", -2.0, 2.0, "m"),
                ("up", 0.2, 10.0, "m"),
                ("pitch", -60.0, 60.0, "degrees"),
                ("yaw", -180.0, 180.0, "degrees"),
                ("roll", -180.0, 180.0, "degrees"),
            ),
        )


class LidarOutput(enum.StrEnum):
    """Part of a turn of the lidar. All but POINTS are ground truth, which no lidar gives: privileged."""

    POINTS = "points"
    """x, y, z [m] in the frame of the lidar, and intensity in 0..1 (channels, columns, 4) float32."""
    SEMANTIC = "semantic"
    """Class of the ontology, `ObjectClass` (channels, columns) uint8; 0 without a return."""
    INSTANCE = "instance"
    """Key of the body (channels, columns) int32; 0 for none, negative for landmarks."""


@shared
@dataclass(frozen=True, kw_only=True)
class LidarConfig:
    """Settings of a rotating lidar.

    Attributes:
        channels: number of lasers, from the lowest to the highest.
        columns: number of directions of a whole turn, clockwise from straight ahead. With 32 channels, the default
            has 23,040 rays in a turn.
        range: largest distance of a return [m].
        upper_fov: elevation of the highest laser [degrees].
        lower_fov: elevation of the lowest laser [degrees].
        rate: turns per second [Hz]. An observation has the last turn or, where decisions are more frequent than turns,
            the sector that was swept since the last decision.
        mount: place on the car.
        outputs: parts of a turn; all but `LidarOutput.POINTS` are privileged.

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    channels: int = 32
    columns: int = 720
    range: float = 100.0
    upper_fov: float = 10.0
    lower_fov: float = -30.0
    rate: float = 10.0
    mount: SensorMount = SensorMount()
    outputs: tuple[LidarOutput, ...] = (LidarOutput.POINTS,)

    def __post_init__(self) -> None:
        check_whole(self, (("channels", 1, 256, "lasers"), ("columns", 8, 4096, "directions")))
        check_bounds(
            self,
            (
                ("range", 1.0, 250.0, "m"),
                ("upper_fov", -80.0, 80.0, "degrees"),
                ("lower_fov", -80.0, 80.0, "degrees"),
                ("rate", 0.1, 100.0, "Hz"),
            ),
        )
        if self.channels > 1 and not self.lower_fov < self.upper_fov:
            raise ValueError(
                f"LidarConfig.lower_fov is {self.lower_fov}; it must be below upper_fov, which is {self.upper_fov}"
            )
        check_type(self, "mount", SensorMount)
        object.__setattr__(self, "outputs", checked_outputs(self, self.outputs, LidarOutput))


@shared
@dataclass(frozen=True, kw_only=True)
class RadarConfig:
    """Settings of a radar: a grid of directions, each with the nearest surface and its relative speed.

    Attributes:
        rows: number of altitudes.
        columns: number of azimuths.
        range: largest distance of a return [m].
        horizontal_fov: [degrees].
        vertical_fov: [degrees].
        mount: place on the car.

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    rows: int = 8
    columns: int = 64
    range: float = 100.0
    horizontal_fov: float = 30.0
    vertical_fov: float = 10.0
    mount: SensorMount = SensorMount(forward=2.4, up=0.7)

    def __post_init__(self) -> None:
        check_whole(self, (("rows", 1, 128, "altitudes"), ("columns", 1, 1024, "azimuths")))
        check_bounds(
            self,
            (
                ("range", 1.0, 250.0, "m"),
                ("horizontal_fov", 1.0, 180.0, "degrees"),
                ("vertical_fov", 0.0, 120.0, "degrees"),
            ),
        )
        check_type(self, "mount", SensorMount)


@shared
@dataclass(frozen=True, kw_only=True)
class SensorConfig:
    """Sensors of the car, observed by the Co-Wizard. They have no other effect on a session; all are off by default.

    Attributes:
        lidar: rotating lidar, or None.
        radar: radar, or None.
        imu: accelerometer, gyroscope and compass.
        gnss: last position fix of the receiver that the car localizes itself with.
        lane_invasion: lines of the road that the wheels have crossed.
        collision: collisions of the car.

    Raises:
        ValueError: a value is of the wrong type; names the field.
    """

    lidar: LidarConfig | None = None
    radar: RadarConfig | None = None
    imu: bool = False
    gnss: bool = False
    lane_invasion: bool = False
    collision: bool = False

    def __post_init__(self) -> None:
        check_type(self, "lidar", LidarConfig, optional=True)
        check_type(self, "radar", RadarConfig, optional=True)
        check_flags(self, ("imu", "gnss", "lane_invasion", "collision"))

    @property
    def scans(self) -> bool:
        """Whether there is a sensor that scans the scene of the session."""
        return self.lidar is not None or self.radar is not None

    @property
    def measures(self) -> bool:
        """Whether there is a sensor that needs no scene."""
        return self.imu or self.gnss or self.lane_invasion or self.collision
