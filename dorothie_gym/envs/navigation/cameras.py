"""Pictures as observations of the navigation environments: through the windscreen, with a dashboard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.continuous_control import CONTINUOUS_FIELDS
from dorothie_gym.envs.navigation.dashboard import Readings, show_dashboard
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.pictures import camera  # lazy: most environments have no camera
from dorothie_gym.policies.navigation.junction_exits import nearest_sector
from dorothie_gym.policies.navigation.observation_fields import SPEED_UNIT, Vector, layout
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.providers import FIELDS, picture_spaces
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.limits import KMH
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import plain

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.batch_arrays import DrivingFace, DrivingRows
    from dorothie_gym.envs.navigation.config import NavigationConfig
    from dorothie_gym.sim.batch.threads import ThreadPool

DriverObservation: TypeAlias = "NDArray[np.float32] | NDArray[np.uint8]"
"""Vector (n,), or picture (h, w, 3)."""

_ALLOWED: Final = layout(CONTINUOUS_FIELDS)["allowed"].start
_DIRECTED = (ActionValue.J_TURN, ActionValue.LANE_SWITCH)


def driver_space(config: NavigationConfig, vectors: spaces.Space[Vector]) -> spaces.Space[Any]:
    """Returns the space of a driver's observations: that of vectors, or of the pictures of the camera."""
    return vectors if config.camera is None else picture_spaces(config.camera)[FIELDS[CameraOutput.RGB]]


class DrivingCameras:
    """Cameras of the sessions of a batch.

    Attributes:
        config: settings of all cameras.
        pictures: (environments, h, w, 3) uint8 the last picture of each environment.
    """

    def __init__(self, config: CameraConfig, count: int) -> None:
        self.config = config
        self.pictures = np.zeros((count, config.height, config.width, 3), np.uint8)
        self._cameras: list[tuple[DrivingFace, camera.SessionCamera] | None] = [None] * count
        self._compiled = False

    @property
    def nbytes(self) -> int:
        """Memory of the cameras and their pictures [bytes]."""
        return self.pictures.nbytes + sum(known[1].camera.nbytes for known in self._cameras if known is not None)

    def draw(self, batch: DrivingRows, numbers: Sequence[int], pool: ThreadPool) -> None:
        """Draws the pictures of the given environments on the threads of a pool."""
        jobs = [(number, self._camera(batch, number)) for number in numbers]
        if not self._compiled and jobs:  # here: threads would compile one after another
            self._draw(batch, *jobs.pop())
            self._compiled = True
        shared = iter(jobs)  # `next` of a list's iterator is atomic

        def work(home: int) -> None:
            for job in shared:
                self._draw(batch, *job)

        pool.do(work, lambda home: (home,))

    def _camera(self, batch: DrivingRows, number: int) -> camera.SessionCamera:
        """Returns the camera of an environment, a new one in a new session."""
        face, known = batch.face(number), self._cameras[number]
        if known is not None and known[0] is face:
            return known[1]
        made = camera.camera_of(batch.town, face.scenario, self.config)
        self._cameras[number] = face, made
        return made

    def _draw(self, batch: DrivingRows, number: int, eye: camera.SessionCamera) -> None:
        face, arrays = batch.face(number), batch.row(number)
        car, plan = plain(arrays.vehicles)[0], plain(arrays.plan)[0]
        # the Ad-Wizard changes weather and sensors of a session with objects only
        world = None if face.live is None else face.live.world
        pose = eye.pose_on(float(car["x"]), float(car["y"]), float(car["height"]), float(car["heading"]))
        frame = eye.render_from(
            pose,
            arrays,
            Weather() if world is None else world.weather,
            time=int(plain(arrays.clock)["frame"][0]) / FRAME_RATE,
            head_lights=bool(plan["lights"]),
            faults=() if world is None else world.faults,
        )
        picture = self.pictures[number]
        picture[:] = frame.colours  # see `NavigationConfig`
        show_dashboard(picture, readings_of(batch, number))


def readings_of(batch: DrivingRows, number: int) -> Readings:
    """Returns the values that the dashboard of an environment shows; the vectors contain all of them."""
    arrays, driver = batch.row(number), batch.driver(number)
    car, plan, heard = plain(arrays.vehicles)[0], plain(arrays.plan)[0], plain(driver.heard)[0]
    view, control = plain(driver.inputs)[0], plain(arrays.car)[0]
    planned, planned_sector = _planned(int(plan["action"]), int(plan["angle"]), held=bool(plan["held"]))
    action = ActionValue(int(heard["action"])) if heard["action"] >= 0 else None
    goal = None
    if action is None and heard["goal_lane"] >= 0:
        dx, dy = float(heard["goal_x"] - view["x"]), float(heard["goal_y"] - view["y"])
        sine, cosine = pm.sin(float(view["heading"])), pm.cos(float(view["heading"]))
        goal = dx * cosine + dy * sine, dy * cosine - dx * sine
    return Readings(
        action=action,
        sector=int(heard["sector"]) if heard["sector"] >= 0 else None,
        distance=float(heard["distance"] - heard["driven"]),
        planned=planned,
        planned_sector=planned_sector,
        goal=goal,
        speed=float(car["speed"]),
        wanted=float(driver.vector[_ALLOWED]) * SPEED_UNIT if batch.pedals else float(plan["cruise"]) * KMH,
        limit=None if batch.pedals else float(view["limit"]),
        hazard=bool(control["hazard"] > 0),
        lights=bool(plan["lights"]),
        steering=float(control["steer"]) if batch.pedals else None,
        traffic=batch.town.traffic,
    )


def _planned(action: int, angle: int, *, held: bool) -> tuple[ActionValue | None, int | None]:
    """Returns the manoeuvre that a car prepares, and its sector; a stop where it is held."""
    if held:
        return ActionValue.STOP, None
    if action == 0:
        return None, None
    value = PhysicalAction(action).slot_value
    return value, nearest_sector(float(angle)) if value in _DIRECTED else None
