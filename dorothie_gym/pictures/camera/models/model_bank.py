"""All models of bodies in one mesh, and the choice of a model for each body of the simulation.

A body's key chooses its type, colours and clothing, so that it looks the same in every frame, process and replay.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.world_exceptions import PropKind
from dorothie_gym.pictures.camera.atlas import PLATES
from dorothie_gym.pictures.camera.mesh import Mesh, joined
from dorothie_gym.pictures.camera.models.cyclists import (
    PEDAL_CYCLE,
    PEDAL_PHASES,
    RIDERS,
    cyclist_form,
    dressed_cyclist,
)
from dorothie_gym.pictures.camera.models.people import (
    ADULTS,
    CHILD_SIZE,
    CYCLE,
    LOOKS,
    PHASES,
    POSES,
    STANDING,
    dressed_person,
    person_form,
)
from dorothie_gym.pictures.camera.models.props import prop_model
from dorothie_gym.pictures.camera.models.vehicles import PAINTS, Lamps, VehicleType, painted_vehicle, vehicle_form
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.support.compilation import compiled, concurrent
from dorothie_gym.support.compilation.records import Float, Int32, RecordArray
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord

LAMP_STATES = 4
"""Number of combinations of `Lamps`; the state of a vehicle is the rest of its model's index."""

COARSE_FROM = 40.0
"""Distance beyond which people have few triangles [m]."""

BRAKING = -0.6
"""Acceleration below which brake lamps are on [m/s^2]: weaker deceleration is engine drag."""

_STAND = 0.1  # [m/s] below which a car stands, with the brakes on, and a person does not walk
_COARSE_STEP = 2  # of the phases of walking, every second one has a coarse version
_COARSE_POSES = PHASES // _COARSE_STEP + 1

# which type a car has: out of sixteen
_TYPES = np.array([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5], dtype=np.int64)

FIRST_CYCLIST = len(VehicleType) * len(PAINTS) * LAMP_STATES
FIRST_PERSON = FIRST_CYCLIST + len(RIDERS) * PEDAL_PHASES
FIRST_COARSE = FIRST_PERSON + len(LOOKS) * POSES
FIRST_PROP = FIRST_COARSE + len(LOOKS) * _COARSE_POSES
MODELS = FIRST_PROP + len(PropKind)
"""Number of models."""

_ADULTS, _CHILD_CYCLE = ADULTS, CYCLE * CHILD_SIZE
_CYCLIST, _EMPTY, _NOBODY = int(Kind.CYCLIST), int(Kind.EMPTY), int(Walk.EMPTY)
_PAINTS, _LOOKS, _RIDERS, _PROPS = len(PAINTS), len(LOOKS), len(RIDERS), len(PropKind)
_PROP_SIZES = np.array([(kind.length, kind.width) for kind in PropKind])


@shared
@dataclass(frozen=True, eq=False)
class ModelBank:
    """Models of all bodies.

    Attributes:
        mesh: triangles of all models in their own frames: x forward, y to the right, origin on the ground; without
            components.
        ranges: first triangle of each model and the one after its last, (n, 2) int32.
        boxes: smallest and largest x, y, z of each model (n, 2, 3) float32 [m].
    """

    mesh: Mesh
    ranges: NDArray[np.int32]
    boxes: NDArray[np.float32]


@lru_cache(maxsize=1)
def model_bank() -> ModelBank:
    """Returns the models of all bodies."""
    models: list[Mesh] = []
    for kind in VehicleType:
        form = vehicle_form(kind)
        for number, paint in enumerate(PAINTS):
            plate = (5 * number + 7 * kind) % PLATES
            models += [painted_vehicle(form, paint, Lamps(state), plate) for state in range(LAMP_STATES)]
    riding = [cyclist_form(phase) for phase in range(PEDAL_PHASES)]
    models += [dressed_cyclist(form, rider) for rider in RIDERS for form in riding]
    models += _people(range(POSES), coarse=False)
    models += _people([*range(0, PHASES, _COARSE_STEP), STANDING], coarse=True)
    models += [prop_model(kind) for kind in PropKind]
    ends = np.cumsum([0, *(model.size for model in models)])
    boxes = np.array([(m.corners.min(axis=(0, 1)), m.corners.max(axis=(0, 1))) for m in models], dtype=np.float32)
    mesh = joined(models)._replace(components=np.zeros((12, 0), np.float32))  # only copies at their places are drawn
    return ModelBank(mesh, np.column_stack((ends[:-1], ends[1:])).astype(np.int32), boxes)


def _people(poses: Iterable[int], *, coarse: bool) -> list[Mesh]:
    """Returns all persons in the given poses."""
    kinds = dict.fromkeys((look.outfit, look.child) for look in LOOKS)
    forms = {
        (outfit, child): [person_form(outfit, pose, coarse=coarse, child=child) for pose in poses]
        for outfit, child in kinds
    }
    return [dressed_person(form, look) for look in LOOKS for form in forms[look.outfit, look.child]]


class PlacementRecord:
    """A model at a place."""

    x: Float  # [m]
    y: Float
    z: Float
    cos: Float  # of the heading
    sin: Float
    model: Int32  # index of the model
    key: Int32  # of the body
    rise: Float  # of the body per metre forward: on a slope


@compiled
def mixed(key: int, stream: int) -> int:
    """Returns a number from 0 to 2**31 - 1 that looks random, from the key of a body."""
    number = (int(key) * 0x9E3779B1 + int(stream) * 0x85EBCA77 + 0x27D4EB2F) & 0xFFFFFFFF
    number = ((number ^ (number >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    number = ((number ^ (number >> 12)) * 0x297A2D39) & 0xFFFFFFFF
    return (number ^ (number >> 15)) >> 1


@compiled
def vehicle_model(vehicle: VehicleRecord, lights: bool) -> int:
    """Returns the model of a car or cyclist.

    Args:
        vehicle: the body.
        lights: whether cars drive with their lights on.
    """
    key = vehicle.key
    if vehicle.kind == _CYCLIST:
        turned = vehicle.odometer / PEDAL_CYCLE
        phase = int((turned - np.floor(turned)) * PEDAL_PHASES) % PEDAL_PHASES
        return FIRST_CYCLIST + mixed(key, 1) % _RIDERS * PEDAL_PHASES + phase
    form = _TYPES[mixed(key, 2) % 16]
    lamps = 2 if lights else 0
    if vehicle.acceleration < BRAKING or abs(vehicle.speed) < _STAND:
        lamps += 1
    return int((form * _PAINTS + mixed(key, 3) % _PAINTS) * LAMP_STATES + lamps)


@compiled
def pedestrian_model(walker: PedestrianRecord, distance: float) -> int:
    """Returns the model of a pedestrian at a distance [m] from the camera."""
    look = mixed(walker.key, 4) % _LOOKS
    standing = abs(walker.speed) < _STAND
    cycles = walker.odometer / (CYCLE if look < _ADULTS else _CHILD_CYCLE)
    phase = int((cycles - np.floor(cycles)) * PHASES) % PHASES
    if distance < COARSE_FROM:
        return FIRST_PERSON + look * POSES + (STANDING if standing else phase)
    return FIRST_COARSE + look * _COARSE_POSES + (_COARSE_POSES - 1 if standing else phase // _COARSE_STEP)


@compiled
def prop_model_index(prop: PropRecord) -> int:
    """Returns the model of a prop, which is determined by its size."""
    for k in range(_PROPS):
        if _PROP_SIZES[k, 0] == prop.length and _PROP_SIZES[k, 1] == prop.width:
            return FIRST_PROP + k
    return FIRST_PROP


@concurrent
def place_bodies(
    vehicles: RecordArray[VehicleRecord],
    pedestrians: RecordArray[PedestrianRecord],
    props: RecordArray[PropRecord],
    eye: NDArray[np.float64],
    reach: float,
    own: int,
    lights: bool,
    placed: RecordArray[PlacementRecord],
) -> int:
    """Lists the models of all bodies near a camera.

    Args:
        vehicles: vehicles of a world; empty rows are left out, here and below.
        pedestrians: pedestrians of the world.
        props: props of the world.
        eye: x and y of the camera [m].
        reach: distance up to which bodies are listed [m].
        own: key of the vehicle that carries the camera, which is left out; -1 for none.
        lights: whether cars drive with their lights on.
        placed: receives as many models as it has room for; z is the height of the road, also for pedestrians.

    Returns:
        The number of models.
    """
    count = 0
    for i in range(len(vehicles)):
        vehicle = vehicles[i]
        if vehicle.kind != _EMPTY and vehicle.key != own and count < len(placed):
            if (vehicle.x - eye[0]) ** 2 + (vehicle.y - eye[1]) ** 2 <= reach * reach:
                _place(placed[count], vehicle, vehicle_model(vehicle, lights))
                count += 1
    for i in range(len(pedestrians)):
        walker = pedestrians[i]
        if walker.state != _NOBODY and count < len(placed):
            distance = np.sqrt((walker.x - eye[0]) ** 2 + (walker.y - eye[1]) ** 2)
            if distance <= reach:
                _place(placed[count], walker, pedestrian_model(walker, distance))
                count += 1
    for i in range(len(props)):
        prop = props[i]
        if prop.present and count < len(placed):
            if (prop.x - eye[0]) ** 2 + (prop.y - eye[1]) ** 2 <= reach * reach:
                _place(placed[count], prop, prop_model_index(prop))
                count += 1
    return count


@compiled
def _place(placed: PlacementRecord, body: VehicleRecord | PedestrianRecord | PropRecord, model: int) -> None:
    placed.x, placed.y, placed.z = body.x, body.y, body.height
    placed.cos, placed.sin = body.cos, body.sin
    placed.model, placed.key, placed.rise = model, body.key, 0.0
