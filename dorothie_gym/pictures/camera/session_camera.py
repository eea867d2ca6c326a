"""Camera on the car of a session: pictures of its world as it is now."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.town import LightColour, LightPhase
from dorothie_gym.pictures.camera.body_placing import Bodies, BodyPlacer
from dorothie_gym.pictures.camera.body_snapshots import snapshot_of
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame, EarlierView, FirstPersonCamera
from dorothie_gym.pictures.camera.pose import CameraPose, pose_on_car
from dorothie_gym.pictures.camera.road_slopes import rise_at
from dorothie_gym.pictures.camera.scenery.lenses import LENS_OFF, LENS_ON, lens_rows, lit_lenses
from dorothie_gym.session.config import CameraOutput
from dorothie_gym.sim.state.codes import Colour
from dorothie_gym.sim.state.world_arrays import CAR_KEY
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.ontology.world_exceptions import Sensor
    from dorothie_gym.pictures.camera.models.model_bank import PlacementRecord
    from dorothie_gym.pictures.camera.town_scene import SessionScene
    from dorothie_gym.session.config import CameraConfig
    from dorothie_gym.sim.weather import Weather
    from dorothie_gym.sim.world import World

_COLOURS = {LightColour.GREEN: Colour.GREEN, LightColour.YELLOW: Colour.YELLOW, LightColour.RED: Colour.RED}
_PAINTS = np.zeros((2, max(Colour) + 1, 3), np.uint8)  # of lenses that are off and on, by `Colour`
for _colour in Colour:
    _PAINTS[0, _colour], _PAINTS[1, _colour] = LENS_OFF[_colour], LENS_ON[_colour]


class EarlierWorld(NamedTuple):
    """A world at an earlier time.

    Attributes:
        x: x coordinate of the car [m].
        y: y coordinate of the car [m].
        height: z coordinate of the road below it [m].
        heading: heading of the car [rad].
        bodies: copy of the bodies.
    """

    x: float
    y: float
    height: float
    heading: float
    bodies: Bodies

    @classmethod
    def of(cls, world: World) -> EarlierWorld:
        """Returns the present moment of a world."""
        car = world.car
        x, y = car.position.tolist()
        return cls(x, y, float(car.height), float(car.heading), snapshot_of(world.actors.arrays))


class SessionCamera:
    """Camera on the car of a session.

    Attributes:
        scene: scene of the session.
        config: settings.
        camera: the camera itself.
    """

    def __init__(self, scene: SessionScene, config: CameraConfig) -> None:
        self.scene, self.config = scene, config
        self.camera = FirstPersonCamera(scene.camera_scene, config, scene.overlay)
        self._placer, self._placer_before = BodyPlacer(scene.town), BodyPlacer(scene.town)
        self._halos = lit_lenses(scene.town.lenses, scene.town.signals)
        self.camera.glow(self._halos)
        self._shown: NDArray[np.int64] | None = None
        self._phases: list[LightPhase] | None = None  # that the lenses show, if those of the programmes
        self._steady = 0.0, 0.0  # [s] from when until when they stay

    def pose_on(self, x: float, y: float, z: float, heading: float) -> CameraPose:
        """Returns the pose of the camera on a car, which stands tilted on slopes.

        Args:
            x: x coordinate of the car [m].
            y: y coordinate of the car [m].
            z: z coordinate of the road below it [m].
            heading: heading of the car [rad].
        """
        rise = rise_at(self.scene.town.slopes, x, y, z, pm.cos(heading), pm.sin(heading))
        return pose_on_car(self.config.mount, x, y, z, heading, rise)

    def render(self, world: World, before: EarlierWorld | None = None) -> CameraFrame:
        """Returns the picture that the camera takes of a world; optical flow is measured from `before`."""
        car = world.car
        x, y = car.position.tolist()
        pose = self.pose_on(x, y, float(car.height), float(car.heading))
        return self.render_from(
            pose,
            world.actors.arrays,
            world.weather,
            time=world.time,
            head_lights=world.ego.lights,
            faults=world.faults,
            before=before,
        )

    def render_from(
        self,
        pose: CameraPose,
        bodies: Bodies,
        weather: Weather,
        *,
        time: float,
        head_lights: bool = False,
        faults: Collection[Sensor] = (),
        own: int = CAR_KEY,
        traffic_lights: Mapping[int, LightColour] | None = None,
        before: EarlierWorld | None = None,
    ) -> CameraFrame:
        """Returns the picture from a pose.

        Args:
            pose: pose of the camera.
            bodies: bodies of a world.
            weather: weather and light.
            time: simulated time [s].
            head_lights: whether the lights of the car are on.
            faults: faulty sensors.
            own: key of the vehicle that carries the camera, which it does not see.
            traffic_lights: their states by signal, dark where missing; by default those of their programmes.
            before: moment from which optical flow is measured; None for none.
        """
        if traffic_lights is None:
            self._show_programmes(time)
        else:
            self._show_lights(traffic_lights)
        placed = self.placed(pose, bodies, weather, own=own)
        earlier = None
        if before is not None and CameraOutput.OPTICAL_FLOW in self.config.outputs:
            earlier = EarlierView(
                self.pose_on(before.x, before.y, before.height, before.heading),
                self._placer_before.place(self.camera.view_of(pose), before.bodies, weather, own=own),
            )
        return self.camera.render(
            pose, weather, bodies=placed, time=time, head_lights=head_lights, faults=frozenset(faults), earlier=earlier
        )

    def placed(
        self, pose: CameraPose, bodies: Bodies, weather: Weather, *, own: int = CAR_KEY
    ) -> RecordArray[PlacementRecord]:
        """Returns the models of the bodies that may be seen from a pose, or whose shadows may be.

        They are overwritten by the next call. Arguments are those of `render_from`.
        """
        return self._placer.place(self.camera.view_of(pose), bodies, weather, own=own)

    def _show_programmes(self, time: float) -> None:
        """Paints the lenses in the colours that the programmes of the lights have at a time."""
        if self._phases is not None and self._steady[0] <= time < self._steady[1]:
            return
        phases = [programme.phase_at(time) for programme in self.scene.town.programmes]
        if phases != self._phases:
            self._show_lights(
                {
                    signal: phase.colour(signal)
                    for programme, phase in zip(self.scene.town.programmes, phases, strict=True)
                    for signal in programme.signals
                }
            )
            self._phases = phases
        changes = [programme.change_after(time) for programme in self.scene.town.programmes]
        self._steady = time, min(changes, default=math.inf)

    def _show_lights(self, states: Mapping[int, LightColour]) -> None:
        """Paints the lenses in the colours of the traffic lights, if one has changed."""
        lenses, self._phases = self.scene.town.lenses, None
        if not len(lenses.signals):
            return
        colours = {signal: int(_COLOURS[state]) for signal, state in states.items()}
        shown = np.array([colours.get(signal, -1) for signal in lenses.signals.tolist()], dtype=np.int64)
        if self._shown is not None and np.array_equal(shown, self._shown):
            return
        before, self._shown = self._shown, shown
        lit = shown == lenses.colours
        self._halos.lit[:] = lit
        changed = np.full(len(lit), True) if before is None else lit != (before == lenses.colours)
        rows = lens_rows(lenses, changed)
        counts = np.diff(lenses.ranges[changed], axis=1)[:, 0]
        self.camera.paint(rows, np.repeat(_PAINTS[lit[changed].astype(int), lenses.colours[changed]], counts, axis=0))
