"""Models of the bodies of a world around a camera or another sensor, standing on the ground of the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.pictures.camera.cells import is_in_view
from dorothie_gym.pictures.camera.ground.lookup import GROUND_SHEET, GroundArrays, material_at
from dorothie_gym.pictures.camera.ground.materials import KERB_HEIGHT, LOOKS, Material, Relief
from dorothie_gym.pictures.camera.models.model_bank import FIRST_PERSON, FIRST_PROP, PlacementRecord, place_bodies
from dorothie_gym.pictures.camera.road_slopes import RoadSlopes, rise_at
from dorothie_gym.sim.state.world_arrays import CAR_KEY
from dorothie_gym.support.compilation import concurrent, fixed, inlined
from dorothie_gym.support.compilation.records import RecordArray, argument, empty_records

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.pose import View
    from dorothie_gym.pictures.camera.town_scene import TownScene
    from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
    from dorothie_gym.sim.weather import Weather

REACH = 250.0
"""Distance up to which bodies are drawn [m]: a car is then two pixels high in a picture of 480 x 320."""

SHADED = 120.0
"""Distance up to which bodies out of view are listed, for their shadows and headlights [m]."""

LIGHTS_BELOW = 6.0
"""Altitude of the sun below which cars drive with their lights on [degrees]; also in rain and fog."""

_LIGHTS_IN_RAIN, _LIGHTS_IN_FOG = 25.0, 25.0  # minimum precipitation and density of fog for this [%]
_RAISED = np.array([LOOKS[material].relief in (Relief.RAISED, Relief.SLOPE) for material in Material])
_AROUND, _HIGH = 12.0, 6.0  # [m] sizes that no body has, beside and above its place
_BELOW = -1.0  # [m] height of the people in tunnels
_FIRST_LIFTED, _FIRST_LEFT, _NOTHING = FIRST_PERSON, FIRST_PROP, int(Material.NOTHING)


class Bodies(Protocol):
    """Bodies of a world, such as its arrays."""

    @property
    def vehicles(self) -> RecordArray[VehicleRecord]:
        """Cars and cyclists; rows of the kind `Kind.EMPTY` are free."""
        ...

    @property
    def pedestrians(self) -> RecordArray[PedestrianRecord]:
        """People on foot; rows of the state `Walk.EMPTY` are free."""
        ...

    @property
    def props(self) -> RecordArray[PropRecord]:
        """Bodies on the road; rows that are not present are free."""
        ...


class BodyPlacer:
    """Lists of the models of bodies, made in memory of its own."""

    def __init__(self, town: TownScene) -> None:
        self._town = town
        self._placed = empty_records(PlacementRecord, 256)
        self._box = np.zeros((2, 3))

    def place(
        self, view: View, bodies: Bodies, weather: Weather, *, own: int = CAR_KEY, around: float = SHADED
    ) -> RecordArray[PlacementRecord]:
        """Returns the models of the bodies in view, and of those near it; they are overwritten by the next call.

        Args:
            view: place and view of the camera or sensor.
            bodies: bodies of a world.
            weather: weather and light.
            own: key of the vehicle that carries the camera, which is left out.
            around: distance up to which bodies out of view are listed [m], at most `REACH`.
        """
        room = len(bodies.vehicles) + len(bodies.pedestrians) + len(bodies.props)
        if room > len(self._placed):
            self._placed = empty_records(PlacementRecord, room)
        placed, town = argument(self._placed), self._town
        count = _place_and_lift(
            argument(bodies.vehicles), argument(bodies.pedestrians), argument(bodies.props), view, own, around,
            drives_with_lights(weather), town.ground.arrays, town.slopes, placed, self._box,
        )  # fmt: skip
        return placed[:count]


def drives_with_lights(weather: Weather) -> bool:
    """Returns whether other cars have their lights on: in the dark, in rain and in fog."""
    values = weather.values
    return (
        values[WeatherParameter.SUN_ALTITUDE_ANGLE] < LIGHTS_BELOW
        or values[WeatherParameter.PRECIPITATION] >= _LIGHTS_IN_RAIN
        or values[WeatherParameter.FOG_DENSITY] >= _LIGHTS_IN_FOG
    )


@concurrent
def _place(
    vehicles: RecordArray[VehicleRecord], pedestrians: RecordArray[PedestrianRecord], props: RecordArray[PropRecord],
    view: View, own: int, around: float, lights: bool, ground: GroundArrays, slopes: RoadSlopes,
    placed: RecordArray[PlacementRecord], box: Array,
) -> int:  # fmt: skip
    """Lists bodies as `place_bodies` does, with people on top of kerbs, and vehicles with all wheels on the road.

    The simulation has the height of the road for people. Distant bodies out of view are left out. Returns the number
    of bodies.
    """
    count = place_bodies(vehicles, pedestrians, props, view.origin, REACH, own, lights, placed)
    kept = 0
    for k in range(count):
        if not _is_near_or_in_view(view, around, placed[k], box):
            continue
        if kept < k:
            _copy_placement(placed[k], placed[kept])
        body = placed[kept]
        kept += 1
        if body.model < _FIRST_LIFTED:
            body.rise = rise_at(slopes, body.x, body.y, body.z, body.cos, body.sin)
        if _FIRST_LIFTED <= body.model < _FIRST_LEFT:
            raised = _RAISED[material_at(ground, GROUND_SHEET, body.x, body.y)]
            for sheet in range(1, len(ground.outside)):
                material = material_at(ground, sheet, body.x, body.y)
                if ground.outside[sheet] == _NOTHING:  # a bridge, on which there are no kerbs
                    raised &= material == _NOTHING
                else:  # a tunnel, with kerbs below the structures above it
                    raised |= _RAISED[material] and body.z < _BELOW
            if raised:
                body.z += KERB_HEIGHT
    return kept


@inlined
def _is_near_or_in_view(view: View, around: float, body: PlacementRecord, box: Array) -> bool:
    x, y = body.x - view.origin[0], body.y - view.origin[1]
    if x * x + y * y <= around * around:
        return True
    box[0, 0], box[0, 1], box[0, 2] = body.x - _AROUND, body.y - _AROUND, body.z - _HIGH
    box[1, 0], box[1, 1], box[1, 2] = body.x + _AROUND, body.y + _AROUND, body.z + _HIGH
    return is_in_view(view, box[0], box[1])


@inlined
def _copy_placement(body: PlacementRecord, target: PlacementRecord) -> None:
    target.x, target.y, target.z, target.cos, target.sin = body.x, body.y, body.z, body.cos, body.sin
    target.model, target.key, target.rise = body.model, body.key, body.rise


_place_and_lift = fixed(_place)
