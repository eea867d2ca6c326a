"""Camera on the car of a session: pictures of its world as it is now."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.config import CameraConfig
from dorothie_gym.camera.first_person_camera import CameraFrame, FirstPersonCamera
from dorothie_gym.camera.ground.lookup import GroundArrays, material_at
from dorothie_gym.camera.ground.materials import KERB_HEIGHT, LOOKS, Material, Relief
from dorothie_gym.camera.ground.sheets import GROUND_SHEET
from dorothie_gym.camera.models.model_bank import FIRST_PERSON, FIRST_PROP, PlacementRecord, place_bodies
from dorothie_gym.camera.pose import CameraPose
from dorothie_gym.camera.scenery.signals import LENS_OFF, LENS_ON
from dorothie_gym.camera.town_scene import SessionScene, lens_rows
from dorothie_gym.compilation import compiled
from dorothie_gym.compilation.records import RecordArray, argument, empty_records
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import Sensor, WeatherParameter
from dorothie_gym.sim.state.codes import Colour
from dorothie_gym.sim.state.world_arrays import CAR_KEY, WorldArrays
from dorothie_gym.sim.weather import Weather
from dorothie_gym.sim.world import World

REACH = 250.0
"""Distance up to which bodies are drawn [m]: a car is then two pixels high in a picture of 480 x 320."""

LIGHTS_BELOW = 6.0
"""Altitude of the sun below which cars drive with their lights on [degrees]; in rain and fog they do so, too."""

_LIGHTS_IN_RAIN, _LIGHTS_IN_FOG = 25.0, 25.0  # precipitation and density of fog from which on [%]
_COLOURS = {LightColour.GREEN: Colour.GREEN, LightColour.YELLOW: Colour.YELLOW, LightColour.RED: Colour.RED}
_RAISED = np.array([LOOKS[material].relief in (Relief.RAISED, Relief.SLOPE) for material in Material])
_FIRST_LIFTED, _FIRST_LEFT, _NOTHING = FIRST_PERSON, FIRST_PROP, int(Material.NOTHING)


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
        self._placed = empty_records(PlacementRecord, 256)
        self._shown: NDArray[np.int64] | None = None

    def render(self, world: World) -> CameraFrame:
        """Returns the picture that the camera takes of a world."""
        car = world.car
        x, y = car.position.tolist()
        pose = self.config.pose_on(x, y, float(car.height), float(car.heading))
        return self.render_from(
            pose, world.actors.arrays, world.weather, time=world.time, head_lights=world.ego.lights, faults=world.faults
        )

    def render_from(
        self,
        pose: CameraPose,
        arrays: WorldArrays,
        weather: Weather,
        *,
        time: float,
        head_lights: bool = False,
        faults: Collection[Sensor] = (),
        own: int = CAR_KEY,
    ) -> CameraFrame:
        """Returns the picture from a pose.

        Args:
            pose: of the camera.
            arrays: bodies of a world.
            weather: weather and light.
            time: simulated time, of which the traffic lights are a function [s].
            head_lights: whether the lights of the car are on.
            faults: faulty sensors.
            own: key of the vehicle that carries the camera, which it does not see.
        """
        self._show_lights(time)
        bodies = self._bodies(pose, arrays, own, drives_with_lights(weather))
        return self.camera.render(
            pose, weather, bodies=bodies, time=time, head_lights=head_lights, faults=frozenset(faults)
        )

    def _bodies(self, pose: CameraPose, arrays: WorldArrays, own: int, lights: bool) -> RecordArray[PlacementRecord]:
        room = len(arrays.vehicles) + len(arrays.pedestrians) + len(arrays.props)
        if room > len(self._placed):
            self._placed = empty_records(PlacementRecord, room)
        placed = argument(self._placed)
        count = place_bodies(
            argument(arrays.vehicles), argument(arrays.pedestrians), argument(arrays.props),
            np.array([pose.x, pose.y]), REACH, own, lights, placed,
        )  # fmt: skip
        _lift(self.scene.town.ground.arrays, placed, count)
        return self._placed[:count]

    def _show_lights(self, time: float) -> None:
        """Paints the lenses in the colours of the traffic lights, if one has changed."""
        town, lenses = self.scene.town, self.scene.town.lenses
        if not len(lenses.signals):
            return
        colours = {
            signal: _COLOURS[programme.colour(signal, time)]
            for programme in town.programmes
            for signal in programme.signals
        }
        shown = np.array([colours.get(signal, -1) for signal in lenses.signals.tolist()], dtype=np.int64)
        if self._shown is not None and np.array_equal(shown, self._shown):
            return
        self._shown = shown
        for colour in Colour:
            for lit, paint in ((True, LENS_ON[colour]), (False, LENS_OFF[colour])):
                rows = lens_rows(lenses, (lenses.colours == int(colour)) & ((shown == int(colour)) == lit))
                self.camera.paint(rows, np.tile(np.array(paint, dtype=np.uint8), (len(rows), 1)))


def drives_with_lights(weather: Weather) -> bool:
    """Returns whether other cars have their lights on: in the dark, in rain and in fog."""
    values = weather.values
    return (
        values[WeatherParameter.SUN_ALTITUDE_ANGLE] < LIGHTS_BELOW
        or values[WeatherParameter.PRECIPITATION] >= _LIGHTS_IN_RAIN
        or values[WeatherParameter.FOG_DENSITY] >= _LIGHTS_IN_FOG
    )


@compiled
def _lift(ground: GroundArrays, placed: RecordArray[PlacementRecord], count: int) -> None:
    """Puts people on pavements and lawns on top of the kerb; the simulation has the height of the road for them."""
    for k in range(count):
        body = placed[k]
        if _FIRST_LIFTED <= body.model < _FIRST_LEFT and _RAISED[material_at(ground, GROUND_SHEET, body.x, body.y)]:
            covered = False  # by a bridge, on which there are no kerbs
            for sheet in range(1, len(ground.outside)):
                covered |= material_at(ground, sheet, body.x, body.y) != _NOTHING
            if not covered:
                body.z += KERB_HEIGHT
