"""First-person camera: light, weather, shadows, labels and faults, as they appear in pictures of small scenes."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.errors import PictureError
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import ObjectClass, Sensor, WeatherParameter
from dorothie_gym.pictures.camera.atlas import TextureAtlas
from dorothie_gym.pictures.camera.cells import sorted_by_cell
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame, CameraScene, FirstPersonCamera
from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.materials import Material
from dorothie_gym.pictures.camera.ground.sheets import Sheet
from dorothie_gym.pictures.camera.lighting import lamp_map
from dorothie_gym.pictures.camera.mesh import MeshBuilder, Surface, empty_mesh
from dorothie_gym.pictures.camera.models.model_bank import ModelBank, PlacementRecord
from dorothie_gym.pictures.camera.models.vehicles import Lamps
from dorothie_gym.pictures.camera.pose import CameraPose, view_from
from dorothie_gym.pictures.camera.sky import sky_noise
from dorothie_gym.pictures.maps.shapes import disc
from dorothie_gym.session.config import CameraConfig, CameraMount, CameraOutput
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.records import RecordArray, empty_records

WHITE, GREY = (255, 255, 255), (128, 128, 128)
EYE = CameraPose(0.0, 0.0, 1.5, 0.0)
CONFIG = CameraConfig(width=120, height=80, outputs=tuple(CameraOutput))
HALVES = 1
"""Texture whose left half is red and whose right half is blue."""


def bank() -> ModelBank:
    """Returns one model: a box of a car's size."""
    builder = MeshBuilder()
    builder.box((0.0, 0.0), 0.0, 4.4, 1.8, 0.0, 1.5, colour=(200, 30, 30), kind=ObjectClass.VEHICLES)
    mesh = builder.build()
    box = np.array([(mesh.corners.min(axis=(0, 1)), mesh.corners.max(axis=(0, 1)))], np.float32)
    return ModelBank(mesh, np.array([(0, mesh.size)], np.int32), box)


def scene(builder: MeshBuilder, *, ground: bool = True, lamps: Array | None = None) -> CameraScene:
    """Returns a town of what a builder holds, on a road that ends 2 km away."""
    square = np.array([[-1e3, -1e3], [1e3, -1e3], [1e3, 1e3], [-1e3, 1e3]])
    if ground:
        corners = np.column_stack((square, np.zeros(4)))
        builder.quad(corners, colour=GREY, kind=ObjectClass.ROAD, surface=Surface.GROUND)
    town, cells, _ = sorted_by_cell(builder.build())
    sheet = Sheet((Painted(square / 5.0, Material.ROAD),), Material.ROAD, square[0] / 5.0, square[2] / 5.0, 0, ())
    halves = np.zeros((8, 8, 4), np.float32)
    halves[:, :4, 0] = halves[:, 4:, 2] = 255.0
    places = np.zeros((0, 3)) if lamps is None else lamps
    atlas = TextureAtlas([halves]).arrays()
    return CameraScene(
        town=town,
        cells=cells,
        ground=ground_arrays([sheet]),
        atlas=atlas,
        lamps=lamp_map(places),
        bank=bank(),
        noise=sky_noise(),
    )


def weather(**values: float) -> Weather:
    """Returns a clear noon with other values of some parameters."""
    made = Weather()
    for name, value in values.items():
        made.set(WeatherParameter[name.upper()], value)
    return made


def placed(*places: tuple[float, float, float]) -> RecordArray[PlacementRecord]:
    """Returns cars at positions with headings, with the keys 1, 2, ..."""
    bodies = empty_records(PlacementRecord, len(places))
    for k, (x, y, heading) in enumerate(places):
        bodies[k] = (x, y, 0.0, math.cos(heading), math.sin(heading), 0, k + 1, 0.0)
    return bodies


def rgb(camera: FirstPersonCamera, sky: Weather, pose: CameraPose = EYE, *, head_lights: bool = False) -> Array:
    """Returns the colours of a picture as numbers."""
    picture = camera.render(pose, sky, head_lights=head_lights).rgb
    assert picture is not None
    return picture.astype(np.float64)


@pytest.mark.parametrize("heading", [0.0, 1.9, -2.5])
def test_a_panel_is_not_mirrored(heading: float) -> None:
    builder = MeshBuilder()
    place = (8.0 * math.cos(heading), 8.0 * math.sin(heading), 1.5)
    builder.panel(place, heading, 4.0, 2.0, colour=WHITE, kind=ObjectClass.TRAFFIC_SIGN, texture=HALVES)
    camera = FirstPersonCamera(scene(builder), CONFIG)
    picture = rgb(camera, weather(), CameraPose(0.0, 0.0, 1.5, heading))
    left, right = picture[40, 50], picture[40, 70]
    assert left[0] > 3 * left[2]
    assert right[2] > 3 * right[0]


@pytest.mark.parametrize("distance", [15.0, 40.0, 75.0])
@pytest.mark.parametrize("air", [{"fog_density": 30.0}, {"fog_density": 70.0, "fog_distance": 20.0}])
def test_contrast_falls_off_as_the_perception_of_the_simulator(distance: float, air: dict[str, float]) -> None:
    builder = MeshBuilder()
    for side, colour in ((-1, WHITE), (1, (0, 0, 0))):
        builder.panel(
            (distance, side * distance / 4, 1.5),
            0.0,
            distance / 4,
            distance / 4,
            colour=colour,
            kind=ObjectClass.TRAFFIC_SIGN,
            surface=Surface.EMISSIVE,
        )
    camera = FirstPersonCamera(scene(builder, ground=False), CONFIG)

    def contrast(sky: Weather) -> float:
        picture = rgb(camera, sky)
        return float(picture[40, 45, 1] - picture[40, 75, 1])

    assert contrast(weather()) == pytest.approx(255.0, abs=1.0)
    expected = weather(**air).visibility(lights=False).transmission(distance * math.hypot(1.0, 0.25))
    assert contrast(weather(**air)) / 255.0 == pytest.approx(expected, abs=0.02)


def test_walls_cast_shadows_on_the_ground_and_on_walls() -> None:
    builder = MeshBuilder()
    builder.box((20.0, -12.0), 0.0, 6.0, 4.0, 0.0, 6.0, colour=WHITE, kind=ObjectClass.BUILDING)
    builder.box((20.0, 6.0), 0.0, 30.0, 4.0, 0.0, 12.0, colour=WHITE, kind=ObjectClass.BUILDING)
    town = scene(builder)
    low = weather(sun_altitude_angle=25.0, sun_azimuth_angle=270.0)  # in the north: shadows point south
    with_shadows, without = (
        FirstPersonCamera(town, replace(CONFIG, shadows=shadows, antialiasing=False)) for shadows in (True, False)
    )
    frame = with_shadows.render(EYE, low)
    assert frame.semantic is not None and frame.depth is not None
    ratio = rgb(with_shadows, low)[..., 1] / np.maximum(rgb(without, low)[..., 1], 1.0)
    assert ratio.max() <= 1.01
    places = frame.view.origin + frame.view.rays() * frame.depth[..., None]
    on_ground = (frame.semantic == ObjectClass.ROAD.value) & (np.abs(places[..., 0] - 20.0) < 2.0)
    shaded = on_ground & (places[..., 1] > -9.0) & (places[..., 1] < 2.5)
    assert shaded.sum() > 20
    assert ratio[shaded].max() < 0.85
    sunny = (frame.semantic == ObjectClass.ROAD.value) & (places[..., 0] < 14.0)
    assert ratio[sunny].min() > 0.95
    facade = (frame.semantic == ObjectClass.BUILDING.value) & (np.abs(places[..., 1] - 4.0) < 0.01)
    # the shadow climbs to 6 m less 14 m along the ray
    assert ratio[facade & (np.abs(places[..., 0] - 20.0) > 4.0)].min() > 0.95


def test_the_shadow_of_a_near_wall_climbs_another_one() -> None:
    builder = MeshBuilder()
    builder.box((20.0, -4.0), 0.0, 6.0, 2.0, 0.0, 6.0, colour=WHITE, kind=ObjectClass.BUILDING)
    builder.box((20.0, 6.0), 0.0, 30.0, 4.0, 0.0, 12.0, colour=WHITE, kind=ObjectClass.BUILDING)
    town, low = scene(builder), weather(sun_altitude_angle=25.0, sun_azimuth_angle=270.0)
    config = replace(CONFIG, antialiasing=False)
    camera = FirstPersonCamera(town, config)
    frame = camera.render(EYE, low)
    assert frame.depth is not None
    ratio = rgb(camera, low)[..., 1] / rgb(FirstPersonCamera(town, replace(config, shadows=False)), low)[..., 1]
    places = frame.view.origin + frame.view.rays() * frame.depth[..., None]
    top = 6.0 - 7.0 * math.tan(math.radians(25.0))  # of the shadow on the facade
    facade = (np.abs(places[..., 1] - 4.0) < 0.01) & (np.abs(places[..., 0] - 20.0) < 2.5)
    below, above = facade & (places[..., 2] < top - 0.5), facade & (places[..., 2] > top + 0.5)
    assert below.sum() > 5 and above.sum() > 5
    assert ratio[below].max() < 0.8
    assert ratio[above].min() > 0.95


@pytest.mark.parametrize("azimuth", [100.0, 155.0, 180.0, 205.0, 250.0])
def test_the_shadow_of_a_thin_pole_has_no_gaps(azimuth: float) -> None:
    builder = MeshBuilder()
    builder.prism(disc((16.0, 0.0), 0.06, 6), 0.0, 6.0, colour=GREY, kind=ObjectClass.POLE)
    camera = FirstPersonCamera(scene(builder), replace(CONFIG, width=480, height=320, antialiasing=False))
    sky = weather(sun_altitude_angle=45.0, sun_azimuth_angle=azimuth)
    pose = CameraPose(16.0, 0.0, 12.0, 0.0, -math.pi / 2.0)
    frame, plain = (other.render(pose, sky) for other in (camera, _without_shadows(camera)))
    assert frame.rgb is not None and plain.rgb is not None and frame.depth is not None
    dark = (plain.rgb.astype(int) - frame.rgb).max(axis=-1) > 10
    places = frame.view.origin + frame.view.rays() * frame.depth[..., None]
    away = -np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
    along, aside = (places[..., :2] - (16.0, 0.0)) @ away, (places[..., :2] - (16.0, 0.0)) @ (-away[1], away[0])
    for station in np.arange(0.8, 5.4, 0.2):
        near = (np.abs(along - station) < 0.1) & (frame.semantic == ObjectClass.ROAD.value)
        assert dark[near & (np.abs(aside) < 0.15)].any(), station
        assert not dark[near & (np.abs(aside) > 0.5)].any(), station


def _without_shadows(camera: FirstPersonCamera) -> FirstPersonCamera:
    return FirstPersonCamera(camera.scene, replace(camera.config, shadows=False))


def test_a_car_casts_a_shadow() -> None:
    camera = FirstPersonCamera(scene(MeshBuilder()), CONFIG)
    sky = weather(sun_altitude_angle=30.0, sun_azimuth_angle=270.0)
    alone = rgb(camera, sky)
    frame = camera.render(EYE, sky, bodies=placed((12.0, 0.0, 0.0)))
    assert frame.rgb is not None and frame.instance is not None
    changed = np.abs(frame.rgb.astype(float) - alone).max(axis=-1) > 8
    darker = changed & (frame.instance == 0)
    rows, columns = np.nonzero(darker)
    assert len(rows) > 15
    assert columns.mean() > 62  # to the south, which is on the right


def test_a_car_behind_the_camera_casts_a_shadow_into_the_picture() -> None:
    camera = FirstPersonCamera(scene(MeshBuilder()), CONFIG)
    low = weather(sun_altitude_angle=8.0, sun_azimuth_angle=180.0)  # behind the camera
    behind, empty = (camera.render(EYE, low, bodies=placed(*places)).rgb for places in ([(-5.0, 0.0, 0.0)], []))
    assert behind is not None
    assert empty is not None
    height, width, _ = behind.shape
    assert behind[-1, width // 2, 1] < 0.9 * empty[-1, width // 2, 1]
    np.testing.assert_array_equal(behind[: height // 2], empty[: height // 2])


def test_pictures_do_not_depend_on_earlier_ones() -> None:
    rng, builder = np.random.default_rng(0), MeshBuilder()
    for _ in range(60):
        x, y = rng.uniform(-60, 60, 2)
        builder.box((x, y), 0.3, 4.0, 5.0, 0.0, 9.0, colour=GREY, kind=ObjectClass.BUILDING)
    town, sky, bodies = scene(builder), weather(precipitation=40.0), placed((10.0, 2.0, 0.4), (30.0, -3.0, 1.0))
    travelled, fresh = FirstPersonCamera(town, CONFIG), FirstPersonCamera(town, CONFIG)
    for k in range(6):
        noon = weather(sun_azimuth_angle=30.0 * k)
        crowd = placed(*((x, y, 0.3) for x in range(5, 45, 4) for y in range(-12, 13, 3)))  # 90 bodies
        travelled.render(EYE, sky, bodies=crowd)
        travelled.render(CameraPose(40.0 * k, -15.0 * k, 1.5, float(k)), noon, bodies=placed((k, 5.0, 0.0)))
    travelled.render(EYE, sky, bodies=crowd)
    one = travelled.render(EYE, sky, bodies=bodies, time=4.0)
    two = fresh.render(EYE, sky, bodies=bodies, time=4.0)
    for name in ("rgb", "depth", "semantic", "instance"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_boxes_are_those_of_the_visible_pixels_and_hidden_bodies_have_none() -> None:
    builder = MeshBuilder()
    builder.box((20.0, 6.0), 0.0, 3.0, 7.0, 0.0, 5.0, colour=GREY, kind=ObjectClass.BUILDING)
    camera = FirstPersonCamera(scene(builder), CONFIG)
    bodies = placed((12.0, -3.0, 0.2), (40.0, 12.0, 0.0), (25.0, -14.0, 1.0), (-10.0, 0.0, 0.0))
    frame = camera.render(EYE, weather(), bodies=bodies)
    assert frame.boxes is not None and frame.instance is not None
    assert frame.boxes.keys.tolist() == [1, 3]
    for key, limits, pixels in zip(frame.boxes.keys, frame.boxes.limits, frame.boxes.pixels, strict=True):
        rows, columns = np.nonzero(frame.instance == key)
        assert limits.tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert pixels == len(rows)


def test_the_labels_are_the_same_without_colours() -> None:
    builder = MeshBuilder()
    builder.box((20.0, 6.0), 0.0, 3.0, 7.0, 0.0, 5.0, colour=GREY, kind=ObjectClass.BUILDING)
    town, bodies = scene(builder), placed((12.0, -3.0, 0.2))
    outputs = tuple(output for output in CameraOutput if output != CameraOutput.RGB)
    whole = FirstPersonCamera(town, CONFIG).render(EYE, weather(), bodies=bodies)
    labels = FirstPersonCamera(town, replace(CONFIG, outputs=outputs)).render(EYE, weather(), bodies=bodies)
    assert labels.rgb is None
    for name in ("depth", "semantic", "instance"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(labels, name))


def test_street_lamps_and_head_lights_shine_at_night() -> None:
    lamps = np.array([[15.0, -4.0, 6.0]])
    camera = FirstPersonCamera(scene(MeshBuilder(), lamps=lamps), CONFIG)
    night = weather(sun_altitude_angle=-40.0)
    dark, lit = rgb(camera, night), rgb(camera, night, head_lights=True)
    noon = rgb(camera, weather())
    assert dark[60:].mean() < 0.3 * noon[60:].mean()
    frame = camera.render(EYE, night)
    assert frame.depth is not None
    places = frame.view.origin + frame.view.rays() * np.where(np.isinf(frame.depth), 0.0, frame.depth)[..., None]
    distance = np.hypot(places[..., 0] - 15.0, places[..., 1] + 4.0)
    ground = np.isfinite(frame.depth)
    assert dark[ground & (distance < 3.0)].mean() > 2.0 * dark[ground & (distance > 30.0)].mean()
    ahead = ground & (places[..., 0] > 5.0) & (places[..., 0] < 12.0) & (np.abs(places[..., 1]) < 1.5)
    assert lit[ahead].mean() > dark[ahead].mean() + 20.0


def test_head_lights_of_another_car_light_the_road_before_it_at_night() -> None:
    builder = MeshBuilder()
    builder.box((12.0, 3.0), 0.0, 0.2, 3.0, 2.0, 4.0, colour=WHITE, kind=ObjectClass.STATIC)  # a board above its beam
    town = scene(builder)
    model = town.bank
    last = model.mesh.size
    states = replace(  # by the lamps that are on
        model, ranges=np.array([(0, last)] * 4, np.int32), boxes=np.repeat(model.boxes, 4, axis=0)
    )
    camera = FirstPersonCamera(replace(town, bank=states), CONFIG)
    bodies = placed((20.0, 3.0, math.pi))

    def picture(sky: Weather, lamps: Lamps) -> Array:
        bodies[0].model = int(lamps)
        found = camera.render(EYE, sky, bodies=bodies).rgb
        assert found is not None
        return found.astype(float)

    night, noon = weather(sun_altitude_angle=-40.0), weather()
    frame = camera.render(EYE, night, bodies=bodies)
    assert frame.depth is not None and frame.semantic is not None
    places = frame.view.origin + frame.view.rays() * np.where(np.isinf(frame.depth), 0.0, frame.depth)[..., None]
    more = (picture(night, Lamps.LIGHTS) - picture(night, Lamps.BRAKES)).mean(axis=-1)
    road = frame.semantic == ObjectClass.ROAD.value
    before = road & (np.abs(places[..., 1] - 3.0) < 1.0) & (places[..., 0] > 7.0) & (places[..., 0] < 15.0)
    beside = road & (np.abs(places[..., 1] - 3.0) > 12.0)
    board = frame.semantic == ObjectClass.STATIC.value
    assert before.sum() > 20 and beside.sum() > 200 and board.sum() > 20
    assert more[before].min() > 8.0
    assert np.abs(more[beside | board]).max() == 0.0
    assert (picture(noon, Lamps.LIGHTS) == picture(noon, Lamps.BRAKES)).all()


def test_lamps_of_signals_change_their_colour() -> None:
    builder, overlay = MeshBuilder(), MeshBuilder()
    overlay.panel((40.0, 90.0, 3.0), 0.0, 1.0, 1.0, colour=GREY, kind=ObjectClass.POLE)
    overlay.panel(
        (10.0, 0.0, 1.5), 0.0, 2.0, 2.0, colour=GREY, kind=ObjectClass.TRAFFIC_LIGHT, surface=Surface.EMISSIVE
    )
    camera = FirstPersonCamera(scene(builder), CONFIG, overlay.build())
    camera.paint(np.array([2, 3]), np.array([255, 20, 10], np.uint8))
    assert rgb(camera, weather())[40, 60].tolist() == [255.0, 20.0, 10.0]


def test_faults_blur_the_view_or_leave_nothing_of_it() -> None:
    builder = MeshBuilder()
    builder.panel((8.0, 0.0, 1.5), 0.0, 4.0, 2.0, colour=WHITE, kind=ObjectClass.TRAFFIC_SIGN, texture=HALVES)
    camera = FirstPersonCamera(scene(builder), CONFIG)
    sharp, blurred, none = (
        _faulty(camera, faults) for faults in ((Sensor.GPS,), (Sensor.BLUR,), (Sensor.VIEW, Sensor.BLUR))
    )
    np.testing.assert_array_equal(sharp, rgb(camera, weather()))
    assert (none == 0).all()
    assert blurred.mean() == pytest.approx(sharp.mean(), abs=2.0)
    assert np.abs(np.diff(blurred, axis=1)).max() < 0.6 * np.abs(np.diff(sharp, axis=1)).max()


def _faulty(camera: FirstPersonCamera, faults: tuple[Sensor, ...]) -> NDArray[np.float64]:
    picture = camera.render(EYE, weather(), faults=faults).rgb
    assert picture is not None
    return picture.astype(np.float64)


def test_antialiasing_mixes_colours_at_edges_only() -> None:
    builder = MeshBuilder()
    builder.panel((10.0, 0.3, 1.6), 0.2, 6.0, 3.0, colour=(255, 0, 0), kind=ObjectClass.WALL, surface=Surface.EMISSIVE)
    town = scene(builder)
    smooth, rough = (rgb(FirstPersonCamera(town, replace(CONFIG, antialiasing=on)), weather()) for on in (True, False))
    inside = (rough == [255.0, 0.0, 0.0]).all(axis=-1)
    assert inside.sum() > 300
    differs = np.abs(smooth - rough).max(axis=-1) > 8
    assert 10 < (differs & inside).sum() < 0.2 * inside.sum()


def small_picture() -> str:
    """Returns the digest of a small picture and its labels."""
    builder = MeshBuilder()
    builder.box((12.0, 3.0), 0.2, 3.0, 2.0, 0.0, 2.0, colour=GREY, kind=ObjectClass.BUILDING)
    builder.panel((8.0, 0.0, 1.5), 0.0, 2.0, 2.0, colour=WHITE, kind=ObjectClass.TRAFFIC_SIGN, texture=HALVES)
    camera = FirstPersonCamera(scene(builder), replace(CONFIG, width=24, height=16))
    digest, sky = hashlib.sha256(), weather(precipitation=50.0, sun_altitude_angle=20.0)
    frame = camera.render(EYE, sky, bodies=placed((10.0, -3.0, 1.0)), head_lights=True, faults=(Sensor.BLUR,), time=2.0)
    for part in (frame.rgb, frame.depth, frame.semantic, frame.instance):
        assert part is not None
        digest.update(part.tobytes())
    return digest.hexdigest()


@pytest.mark.long
def test_another_process_without_the_compiler_draws_the_same_bytes() -> None:
    script = "from tests.pictures.camera.test_first_person_camera import small_picture; print(small_picture())"
    root = Path(__file__).parents[3]
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=root,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.strip() == small_picture()


def test_buffers_stay_small() -> None:
    config = CameraConfig(outputs=tuple(CameraOutput))
    assert FirstPersonCamera(scene(MeshBuilder()), config).nbytes <= 15e6


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"width": 3}, "width is 3"),
        ({"height": 1.5}, "height is 1.5"),
        ({"field_of_view": 200.0}, "field_of_view is 200.0"),
        ({"outputs": ()}, "outputs is"),
        ({"outputs": ("rgb", "smell")}, "'smell'"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        CameraConfig(**settings)  # type: ignore[arg-type]  # wrong values on purpose
    with pytest.raises(ValueError, match=r"CameraMount\.up"):
        CameraMount(up=-1.0)


def test_an_empty_town_is_sky_over_nothing() -> None:
    town = replace(scene(MeshBuilder()), town=empty_mesh(), cells=sorted_by_cell(empty_mesh())[1])
    frame = FirstPersonCamera(town, CONFIG).render(EYE, weather())
    assert frame.depth is not None and np.isinf(frame.depth).all()


def test_landmarks_have_boxes_by_their_negative_keys() -> None:
    overlay = MeshBuilder()
    overlay.box((20.0, 0.0), 0.0, 4.0, 6.0, 0.0, 4.0, colour=GREY, kind=ObjectClass.BUILDING, instance=-3)
    frame = FirstPersonCamera(scene(MeshBuilder()), CONFIG, overlay.build()).render(EYE, weather())
    assert frame.boxes is not None
    assert frame.instance is not None
    assert frame.boxes.keys.tolist() == [-3]
    assert frame.boxes.pixels.tolist() == [int((frame.instance == -3).sum())]


@pytest.mark.parametrize(
    ("part", "output"), [("colours", "rgb"), ("classes", "semantic"), ("keys", "instance"), ("bodies", "boxes")]
)
def test_a_part_that_the_configuration_leaves_out_is_named(part: str, output: str) -> None:
    frame = CameraFrame(view_from(EYE, 8, 6, 60.0))
    with pytest.raises(PictureError, match=f"the picture has no {output}: add it to the outputs"):
        getattr(frame, part)
