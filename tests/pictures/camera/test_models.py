"""Models of bodies: as large as in the simulation, on the ground, closed to the eye, the same for the same body."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.ontology.world_exceptions import PropKind
from dorothie_gym.pictures.camera.atlas import Texture
from dorothie_gym.pictures.camera.mesh import Mesh, Surface
from dorothie_gym.pictures.camera.models.model_bank import (
    FIRST_COARSE,
    FIRST_CYCLIST,
    FIRST_PERSON,
    FIRST_PROP,
    LAMP_STATES,
    MODELS,
    ModelBank,
    PlacementRecord,
    mixed,
    model_bank,
    pedestrian_model,
    place_bodies,
    vehicle_model,
)
from dorothie_gym.pictures.camera.models.people import ADULTS, LOOKS, POSES
from dorothie_gym.pictures.camera.models.vehicles import PAINTS, VehicleType
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH, CAR_WIDTH, CYCLIST_LENGTH, CYCLIST_WIDTH
from dorothie_gym.support.compilation.records import RecordArray, argument, empty_records

CARS = range(0, FIRST_CYCLIST, len(PAINTS) * LAMP_STATES)
"""A model of each type of cars."""


def model(number: int) -> Mesh:
    bank = model_bank()
    return bank.mesh.part(slice(*bank.ranges[number].tolist()))


def cars(count: int, **values: float) -> RecordArray[VehicleRecord]:
    rows = empty_records(VehicleRecord, count)
    for name, value in {"kind": Kind.CAR, "speed": 8.0, "cos": 1.0, **values}.items():
        rows[name][:] = value
    rows["key"][:] = np.arange(1, count + 1)
    return rows


def test_the_bank_holds_all_models_one_after_the_other() -> None:
    bank = model_bank()
    assert len(bank.ranges) == len(bank.boxes) == MODELS
    np.testing.assert_array_equal(bank.ranges[1:, 0], bank.ranges[:-1, 1])
    assert bank.ranges[0, 0] == 0
    assert bank.ranges[-1, 1] == bank.mesh.size


@pytest.mark.parametrize("number", CARS)
def test_cars_fill_the_outline_of_the_simulation(number: int) -> None:
    low, high = model_bank().boxes[number]
    np.testing.assert_allclose(low[:2], (-CAR_LENGTH / 2, -CAR_WIDTH / 2), atol=0.02)
    np.testing.assert_allclose(high[:2], (CAR_LENGTH / 2, CAR_WIDTH / 2), atol=0.02)
    assert low[2] == pytest.approx(0.0, abs=0.01)
    assert 1.3 < high[2] < 2.2


def test_cyclists_fill_the_outline_of_the_simulation() -> None:
    boxes = model_bank().boxes[FIRST_CYCLIST:FIRST_PERSON]
    np.testing.assert_allclose(boxes[:, 1, 0] - boxes[:, 0, 0], CYCLIST_LENGTH, atol=0.02)
    np.testing.assert_allclose(boxes[:, 1, 1] - boxes[:, 0, 1], CYCLIST_WIDTH, atol=0.05)
    np.testing.assert_allclose(boxes[:, 0, 2], 0.0, atol=0.01)


def test_people_stand_on_the_ground_in_all_phases() -> None:
    boxes = model_bank().boxes
    assert np.abs(boxes[FIRST_PERSON:FIRST_PROP, 0, 2]).max() < 0.06
    for first, poses in ((FIRST_PERSON, POSES), (FIRST_COARSE, (FIRST_PROP - FIRST_COARSE) // len(LOOKS))):
        tops = boxes[first : first + len(LOOKS) * poses, 1, 2]
        adults, children = tops[: ADULTS * poses], tops[ADULTS * poses :]
        assert 1.6 < adults.min() < adults.max() < 1.95
        assert 1.1 < children.min() < children.max() < 1.35


@pytest.mark.parametrize("kind", PropKind)
def test_props_fill_their_boxes(kind: PropKind) -> None:
    low, high = model_bank().boxes[FIRST_PROP + list(PropKind).index(kind)]
    np.testing.assert_allclose(high - low, (kind.length, kind.width, kind.height), atol=0.02)
    np.testing.assert_allclose(low[:2], (-kind.length / 2, -kind.width / 2), atol=0.02)


def test_models_have_few_triangles() -> None:
    sizes = np.diff(model_bank().ranges, axis=1)[:, 0]
    assert sizes[:FIRST_CYCLIST].max() <= 180
    assert sizes[FIRST_PERSON:FIRST_COARSE].max() <= 190
    assert sizes[FIRST_COARSE:FIRST_PROP].max() <= 60


@pytest.mark.parametrize("number", CARS)
def test_a_car_hides_what_is_behind_it(number: int) -> None:
    """Rays through the body meet a triangle that faces them, from all around and from above."""
    mesh = model(number)
    for heading in np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False):
        for target in ((0.0, 0.0, 0.7), (1.0, 0.3, 0.7), (-1.2, -0.3, 0.7)):
            eye = np.array([12.0 * math.cos(heading), 12.0 * math.sin(heading), 2.2])
            assert meets(mesh, eye, np.array(target) - eye)


def meets(mesh: Mesh, eye: np.ndarray, way: np.ndarray) -> bool:
    """Whether a ray meets the visible side of a triangle (Moeller and Trumbore 1997)."""
    first, edge, other = (mesh.corners[:, k].astype(float) - (0 if k == 0 else mesh.corners[:, 0]) for k in range(3))
    facing = mesh.normals.astype(float) @ way < 0.0
    across = np.cross(way, other)
    size = (edge * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((eye - first) * across).sum(axis=1) / size
        q = np.cross(eye - first, edge)
        v, t = (q @ way) / size, (q * other).sum(axis=1) / size
        u, v, t = (np.nan_to_num(value, nan=-1.0, posinf=-1.0, neginf=-1.0) for value in (u, v, t))
    return bool((facing & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)).any())


def test_brake_lamps_and_head_lamps_glow_when_they_are_on() -> None:
    dark, braking, lit = (model(k) for k in (0, 1, 2))
    emissive = Surface.EMISSIVE.value
    assert not (dark.surfaces & emissive).any()
    rear, front = braking.corners[..., 0].max(axis=1) < -0.5, lit.corners[..., 0].min(axis=1) > 2.0
    assert (braking.surfaces[rear] & emissive).sum() == (braking.surfaces & emissive).astype(bool).sum() * emissive
    red = braking.colours[(braking.surfaces & emissive) > 0]
    assert (red[:, 0] > 200).all()
    assert (red[:, 1:] < 80).all()
    assert ((lit.surfaces[front] & emissive) > 0).sum() == 4
    np.testing.assert_array_equal(dark.corners, braking.corners)


def test_number_plates_are_read_from_left_to_right() -> None:
    mesh = model(0)
    plates = mesh.textures == Texture.PLATE
    for u_axis, normal in zip(mesh.u_axes[plates], mesh.normals[plates], strict=True):
        heading = math.atan2(-normal[1], -normal[0])  # of somebody who looks at the plate
        assert u_axis[:3] @ (-math.sin(heading), math.cos(heading), 0.0) > 1.0
    assert plates.sum() == 4


def test_classes_are_those_of_the_perception() -> None:
    kinds = {
        0: ObjectClass.VEHICLES,
        FIRST_CYCLIST: ObjectClass.VEHICLES,
        FIRST_PERSON: ObjectClass.PEDESTRIAN,
        FIRST_COARSE: ObjectClass.PEDESTRIAN,
        FIRST_PROP: ObjectClass.STATIC,
    }
    for number, kind in kinds.items():
        assert set(model(number).classes.tolist()) == {kind.value}


def test_a_key_chooses_the_looks_for_good() -> None:
    for key in (1, 17, 40_000, 2**31 - 1):
        assert mixed(key, 3) == mixed(int(np.int32(key)), 3)
    vehicles = cars(400)
    chosen = [vehicle_model(vehicle, False) for vehicle in vehicles]
    vehicles["x"][:], vehicles["heading"][:], vehicles["odometer"][:] = 50.0, 2.0, 99.0
    assert chosen == [vehicle_model(vehicle, False) for vehicle in vehicles]
    assert max(chosen) < FIRST_CYCLIST
    shares = np.bincount(np.array(chosen) // (len(PAINTS) * LAMP_STATES), minlength=len(VehicleType)) / len(chosen)
    assert (shares > 0.05).all()


def test_neighbouring_cars_have_different_plates_and_colours() -> None:
    chosen = [vehicle_model(vehicle, False) for vehicle in cars(60)]
    bank = model_bank()
    plates, paints = [], []
    for number in chosen:
        mesh = model(number)
        (row, *_) = np.flatnonzero(mesh.textures == Texture.PLATE)
        plates.append(float(mesh.v_axes[row, 3]))
        paints.append(number // LAMP_STATES)
        assert 0.0 <= mesh.v_axes[mesh.textures == Texture.PLATE, 3].min() < 1.0
    assert len(bank.ranges) == MODELS
    assert len(set(plates)) > 12
    assert len(set(paints)) > 35


def test_a_fifth_of_the_people_are_children() -> None:
    walkers = empty_records(PedestrianRecord, 1000)
    walkers["key"][:] = np.arange(1000)
    looks = [(pedestrian_model(walker, 10.0) - FIRST_PERSON) // POSES for walker in walkers]
    share = np.mean(np.array(looks) >= ADULTS)
    assert 0.15 < share < 0.25
    assert len(set(looks)) == len(LOOKS)


def test_lamps_follow_braking_and_light() -> None:
    (vehicle,) = cars(1)
    base = vehicle_model(vehicle, False)
    assert vehicle_model(vehicle, True) == base + 2
    vehicle.acceleration = -2.0
    assert vehicle_model(vehicle, False) == base + 1
    vehicle.acceleration, vehicle.speed = 0.0, 0.0
    assert vehicle_model(vehicle, True) == base + 3


def test_people_step_as_they_walk_and_stand_when_they_stand() -> None:
    (walker,) = empty_records(PedestrianRecord, 1)
    walker.key, walker.speed = next(key for key in range(99) if mixed(key, 4) % len(LOOKS) < ADULTS), 1.3
    poses = []
    for way in np.arange(0.0, 1.4, 0.05):
        walker.odometer = way
        poses.append((pedestrian_model(walker, 10.0) - FIRST_PERSON) % POSES)
    assert poses == sorted(poses)
    assert set(poses) == set(range(8))
    walker.speed = 0.0
    assert (pedestrian_model(walker, 10.0) - FIRST_PERSON) % POSES == 8
    assert FIRST_COARSE <= pedestrian_model(walker, 60.0) < FIRST_PROP


def test_bodies_near_the_camera_are_placed_once_without_the_own_car() -> None:
    vehicles, walkers, props = cars(6), empty_records(PedestrianRecord, 3), empty_records(PropRecord, 2)
    vehicles["x"][:] = [0.0, 20.0, 40.0, 300.0, 10.0, 15.0]
    vehicles[4].kind = Kind.EMPTY
    vehicles[5].kind = Kind.CYCLIST
    walkers["key"][:], walkers["state"][:] = [21, 22, 23], [Walk.WALKING, Walk.EMPTY, Walk.WAITING]
    props[1].present, props[1].key, props[1].height = True, 31, 2.5
    props[1].length, props[1].width = PropKind.DUMPSTER.length, PropKind.DUMPSTER.width
    placed = empty_records(PlacementRecord, 32)
    eye = np.array([0.0, 0.0])
    count = place_bodies(argument(vehicles), argument(walkers), argument(props), eye, 100.0, 1, False, argument(placed))
    assert placed["key"][:count].tolist() == [2, 3, 6, 21, 23, 31]
    assert placed[0].x == 20.0
    assert FIRST_CYCLIST <= placed[2].model < FIRST_PERSON
    assert placed[5].model == FIRST_PROP + list(PropKind).index(PropKind.DUMPSTER)
    assert placed[5].z == 2.5
    full = empty_records(PlacementRecord, 4)
    assert (
        place_bodies(argument(vehicles), argument(walkers), argument(props), eye, 100.0, 1, False, argument(full)) == 4
    )


def test_the_bank_is_made_once() -> None:
    bank: ModelBank = model_bank()
    assert bank is model_bank()
    assert sum(column.nbytes for column in bank.mesh) < 13e6
