"""Lidar and radar on the car of a session: the nearest surfaces of its scene along their rays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.body_placing import Bodies, BodyPlacer
from dorothie_gym.pictures.camera.cells import sorted_by_cell
from dorothie_gym.pictures.camera.mesh import TOWN, empty_mesh
from dorothie_gym.pictures.camera.pose import pose_on_car, view_from
from dorothie_gym.pictures.camera.range_scan import RayGrid, new_scan, ray_grid, read_scan, scan_scene
from dorothie_gym.pictures.camera.road_slopes import rise_at
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.world_arrays import CAR_KEY
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import fixed
from dorothie_gym.support.compilation.records import argument, plain

if TYPE_CHECKING:
    from collections.abc import Collection

    from dorothie_gym.maps.model import Array
    from dorothie_gym.ontology.world_exceptions import Sensor
    from dorothie_gym.pictures.camera.town_scene import SessionScene
    from dorothie_gym.session.sensor_config import LidarConfig, RadarConfig, SensorMount
    from dorothie_gym.sim.weather import Weather

_ROOM = 4096  # triangles of bodies, at first
_WIDTH, _HEIGHT, _FIELD = 64, 64, 90.0  # of the view of a sensor, of which only place and axes are used
_scan_scene, _read_scan = fixed(scan_scene), fixed(read_scan)


class CarState(NamedTuple):
    """State of the car that a sensor needs.

    Attributes:
        x: x coordinate of its centre [m].
        y: y coordinate [m].
        height: z coordinate of the road below it [m].
        heading: [rad].
        speed: [m/s].
    """

    x: float
    y: float
    height: float
    heading: float
    speed: float


class Returns(NamedTuple):
    """Nearest surfaces along the rays of a sensor.

    Attributes:
        points: (rows, columns, 4) float32: position ahead, to the right and up, and distance [m]; 0 without a return.
        semantic: (rows, columns) uint8 `ObjectClass`, 0 without a return.
        instance: (rows, columns) int32 key of the body, 0 for none, negative for landmarks.
    """

    points: NDArray[np.float32]
    semantic: NDArray[np.uint8]
    instance: NDArray[np.int32]


class RangeSensor:
    """Sensor that measures along a grid of rays; a scan depends on its arguments only."""

    def __init__(self, scene: SessionScene, mount: SensorMount, grid: RayGrid) -> None:
        """Allocates the buffers.

        Args:
            scene: scene of the session.
            mount: place on the car.
            grid: rays.
        """
        self.mount, self.grid = mount, grid
        self._scene, self._town = scene.camera_scene, scene.town
        self._overlay, self._overlay_cells, _ = sorted_by_cell(scene.overlay)
        self._scan = new_scan(len(grid.cosines), len(grid.slopes))
        self._placer, self._bodies, self._box = BodyPlacer(scene.town), empty_mesh(_ROOM), np.zeros((2, 3))

    def scan(self, car: CarState, bodies: Bodies, weather: Weather, *, own: int = CAR_KEY) -> Returns:
        """Returns the nearest surfaces in an exact measurement.

        Args:
            car: place of the car.
            bodies: bodies of a world.
            weather: weather, which decides on the lights of cars only.
            own: key of the car itself, which its sensors do not see.
        """
        rise = rise_at(self._town.slopes, car.x, car.y, car.height, pm.cos(car.heading), pm.sin(car.heading))
        pose = pose_on_car(self.mount, car.x, car.y, car.height, car.heading, rise)
        view = view_from(pose, _WIDTH, _HEIGHT, _FIELD)
        placed = argument(self._placer.place(view, bodies, weather, own=own, around=float(self.grid.range[0]) + 12.0))
        scene, bank = self._scene, self._scene.bank
        while True:
            count = _scan_scene(
                view, self.grid, self._scan, scene.town, scene.cells, self._overlay, self._overlay_cells,
                bank.mesh, bank.ranges, bank.boxes, placed, self._box, self._bodies,
            )  # fmt: skip
            if count <= self._bodies.size:
                break
            self._bodies = empty_mesh(2 * count)
        shape = len(self.grid.slopes), len(self.grid.cosines)
        found = Returns(np.empty((*shape, 4), np.float32), np.empty(shape, np.uint8), np.empty(shape, np.int32))
        _read_scan(view, self.grid, self._scan, scene.town, self._overlay, self._bodies, scene.ground, *found)
        return found


# --- Lidar ------------------------------------------------------------------------------------------------------------


class Lidar(RangeSensor):
    """Rotating lidar on the car of a session.

    A return is detected while clarity * T(d)^2 * (range / d)^2 >= 1 at its distance d: T is the share of light that the
    air leaves over d, twice for both ways, and clarity the share that dirt on the optics leaves, as for the camera
    (`sim.sensing.visibility`). In clear air these are all returns up to the range. The intensity is clarity * T(d)^2.
    """

    def __init__(self, scene: SessionScene, config: LidarConfig) -> None:
        self.config = config
        azimuths = np.asarray(np.arange(config.columns) * (2.0 * math.pi / config.columns), dtype=np.float64)
        altitudes: Array = np.radians(
            np.linspace(config.lower_fov, config.upper_fov, config.channels), dtype=np.float64
        )
        super().__init__(scene, config.mount, ray_grid(azimuths, altitudes, config.range, whole=True))

    def turn(
        self,
        car: CarState,
        bodies: Bodies,
        weather: Weather,
        *,
        faults: Collection[Sensor] = (),
        sector: tuple[float, float] = (0.0, 1.0),
        own: int = CAR_KEY,
    ) -> Returns:
        """Returns the returns of a turn; the last column of `points` is the intensity in 0..1, 0 without a return.

        Args:
            car: place of the car.
            bodies: bodies of a world.
            weather: weather and light.
            faults: faulty sensors.
            sector: begin and end of the swept part [turns]; the rest has no returns.
            own: key of the car itself.
        """
        found = self.scan(car, bodies, weather, own=own)
        distance = found.points[..., 3]
        lost = distance == 0.0
        clarity = min((CLARITY[sensor] for sensor in faults), default=1.0)
        air = weather.visibility(lights=False)
        if clarity < 1.0 or air.fog > 0.0 or air.rain > 0.0:
            away = distance.astype(np.float64)
            depth = air.fog * np.maximum(away - air.fog_start, 0.0) + air.rain * away
            intensity = clarity * pn.exp(-2.0 * depth)
            lost |= intensity * self.config.range**2 < away * away
            found.points[..., 3] = intensity
        else:
            found.points[..., 3] = 1.0
        begin, end = sector
        if end - begin < 1.0:
            swept = np.arange(math.ceil(begin * self.config.columns), math.ceil(end * self.config.columns))
            outside = np.full(self.config.columns, True)
            outside[swept % self.config.columns] = False
            lost |= outside
        for part in found:
            part[lost] = 0
        return found


# --- Radar ------------------------------------------------------------------------------------------------------------


class Radar(RangeSensor):
    """Radar on the car of a session; neither weather nor darkness nor the faults of the view affect it."""

    def __init__(self, scene: SessionScene, config: RadarConfig) -> None:
        self.config = config
        azimuths, altitudes = (
            np.radians(_centred(field, count))
            for field, count in ((config.horizontal_fov, config.columns), (config.vertical_fov, config.rows))
        )
        self._angles = np.stack(np.broadcast_arrays(azimuths, altitudes[:, None]), axis=-1)
        super().__init__(scene, config.mount, ray_grid(azimuths, altitudes, config.range, whole=False))

    def detections(self, car: CarState, bodies: Bodies, weather: Weather, *, own: int = CAR_KEY) -> NDArray[np.float32]:
        """Returns the detections (rows * columns, 4): distance [m], azimuth and altitude [rad], velocity [m/s].

        The velocity is that of the surface relative to the radar along the ray, positive away from it. Detections come
        row by row from the lowest; the rows of the table after the last one are 0.
        """
        found = self.scan(car, bodies, weather, own=own)
        hit = found.points[..., 3] > 0.0
        points = found.points[hit].astype(np.float64)
        rays = points[:, :3] / points[:, 3:]
        pose = pose_on_car(self.mount, 0.0, 0.0, 0.0, 0.0)
        axes = view_from(pose, _WIDTH, _HEIGHT, _FIELD).axes[[2, 0, 1], :2]  # ahead, right and up, along car and road
        along, across = _velocities(found.instance[hit], bodies, car.heading)
        velocity = ((along - car.speed) * pn.matmul(rays, axes[:, :1])[:, 0]) + across * pn.matmul(rays, axes[:, 1:])[
            :, 0
        ]
        table = np.zeros((hit.size, 4), np.float32)
        table[: len(points)] = np.column_stack((points[:, 3], self._angles[hit], velocity))
        return table


def _centred(field: float, count: int) -> Array:
    """Returns the centres of equal parts of a field of view around 0."""
    return np.asarray((np.arange(count) + 0.5) * (field / count) - 0.5 * field, dtype=np.float64)


def _velocities(keys: NDArray[np.int32], bodies: Bodies, heading: float) -> tuple[Array, Array]:
    """Returns the velocities of bodies by key along a heading and to the right of it (n,) [m/s]; 0 for other keys."""
    vehicles, walkers = plain(bodies.vehicles), plain(bodies.pedestrians)
    present = vehicles["kind"] != int(Kind.EMPTY), walkers["state"] != int(Walk.EMPTY)
    moving = [rows[there] for rows, there in zip((vehicles, walkers), present, strict=True)]
    known = np.concatenate([rows["key"] for rows in moving])
    order = np.argsort(known, kind="stable")
    known = known[order]
    speed, cos, sin = (np.concatenate([rows[name] for rows in moving])[order] for name in ("speed", "cos", "sin"))
    c, s = pm.cos(heading), pm.sin(heading)
    if not len(known):
        return np.zeros(len(keys)), np.zeros(len(keys))
    at = np.minimum(np.searchsorted(known, keys), len(known) - 1)
    speed = np.where((known[at] == keys) & (keys != TOWN), speed[at], 0.0)  # the car itself may have that key
    return speed * (cos[at] * c + sin[at] * s), speed * (sin[at] * c - cos[at] * s)
