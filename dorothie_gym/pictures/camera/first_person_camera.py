"""First-person camera: RGB, depth, semantic classes, instances and boxes of a town, on one processor core."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import PictureError
from dorothie_gym.pictures.camera.atlas import AtlasArrays
from dorothie_gym.pictures.camera.birds_eye import draw_birds_eye
from dorothie_gym.pictures.camera.cells import CellOrder, CellTable, new_order, sorted_by_cell
from dorothie_gym.pictures.camera.daylight import Daylight, daylight_of
from dorothie_gym.pictures.camera.faces import new_faces
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays
from dorothie_gym.pictures.camera.halos import Halos, add_halos, no_halos
from dorothie_gym.pictures.camera.head_lights import draw_head_lights, new_head_lights
from dorothie_gym.pictures.camera.labels import find_boxes, new_labels, write_labels
from dorothie_gym.pictures.camera.lighting import LampMap, add_rain
from dorothie_gym.pictures.camera.mesh import TOWN, Mesh, empty_mesh
from dorothie_gym.pictures.camera.models.model_bank import ModelBank, PlacementRecord
from dorothie_gym.pictures.camera.motion_labels import write_flow, write_normals
from dorothie_gym.pictures.camera.optics import light_numbers, optics_of
from dorothie_gym.pictures.camera.pose import CameraPose, View, view_from
from dorothie_gym.pictures.camera.rasterizer import VisibilityBuffer, new_buffer
from dorothie_gym.pictures.camera.samples import new_samples
from dorothie_gym.pictures.camera.scene_drawing import draw_scene
from dorothie_gym.pictures.camera.sensor_faults import apply_faults
from dorothie_gym.pictures.camera.shading import shade
from dorothie_gym.pictures.camera.shadows import new_shadow_maps, turn_sun
from dorothie_gym.pictures.camera.texturing import textures_of
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.support.compilation import direct, fixed
from dorothie_gym.support.compilation.records import RecordArray, argument, empty_records, plain
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.world_exceptions import Sensor
    from dorothie_gym.sim.weather import Weather

T = TypeVar("T")

_ROOM = 4096  # triangles of bodies, at first
_NO_BODIES = empty_records(PlacementRecord, 0)

_draw_scene, _shade, _write_labels = fixed(draw_scene), fixed(shade), fixed(write_labels)
_draw_head_lights, _add_halos = direct(draw_head_lights), fixed(add_halos)
_write_flow, _write_normals, _draw_birds_eye = fixed(write_flow), fixed(write_normals), fixed(draw_birds_eye)

_FROM_ABOVE = CameraOutput.RGB, CameraOutput.BIRDS_EYE
"""Outputs that need no buffer of labels."""


@shared
@dataclass(frozen=True, kw_only=True)
class CameraScene:
    """Data that all cameras of a town share.

    Attributes:
        town: objects of every session, sorted by cell.
        cells: cells of the town.
        ground: materials and colours of the ground.
        atlas: textures.
        lamps: light of street lamps.
        bank: models of bodies.
        noise: (256, 256) of the sky, see `sky_noise`.
    """

    town: Mesh
    cells: CellTable
    ground: GroundArrays
    atlas: AtlasArrays
    lamps: LampMap
    bank: ModelBank
    noise: NDArray[np.float32]


@dataclass(frozen=True)
class CameraFrame:
    """One picture. Parts that the configuration does not name are None.

    Attributes:
        view: projection.
        rgb: (h, w, 3) uint8.
        depth: (h, w) float32 distance along the axis [m], infinite for the sky.
        semantic: (h, w) uint8 `ObjectClass`.
        instance: (h, w) int32 key of the body, 0 for none.
        boxes: boxes of the visible bodies.
        optical_flow: (h, w, 2) float32, see `CameraOutput`, like the following.
        normals: (h, w, 3) float32.
        birds_eye: (h, w) uint8 `ObjectClass`.
    """

    view: View
    rgb: NDArray[np.uint8] | None = None
    depth: NDArray[np.float32] | None = None
    semantic: NDArray[np.uint8] | None = None
    instance: NDArray[np.int32] | None = None
    boxes: Boxes | None = None
    optical_flow: NDArray[np.float32] | None = None
    normals: NDArray[np.float32] | None = None
    birds_eye: NDArray[np.uint8] | None = None

    @property
    def colours(self) -> NDArray[np.uint8]:
        """`rgb`; this and the following raise `PictureError` if the configuration leaves the part out."""
        return _drawn(self.rgb, CameraOutput.RGB)

    @property
    def classes(self) -> NDArray[np.uint8]:
        """`semantic`."""
        return _drawn(self.semantic, CameraOutput.SEMANTIC)

    @property
    def keys(self) -> NDArray[np.int32]:
        """`instance`."""
        return _drawn(self.instance, CameraOutput.INSTANCE)

    @property
    def bodies(self) -> Boxes:
        """`boxes`."""
        return _drawn(self.boxes, CameraOutput.BOXES)


@dataclass(frozen=True)
class EarlierView:
    """Reference of optical flow.

    Attributes:
        pose: pose of the camera in the earlier picture.
        bodies: places of the bodies then.
    """

    pose: CameraPose
    bodies: RecordArray[PlacementRecord]


def _drawn(part: T | None, output: CameraOutput) -> T:
    if part is None:
        raise PictureError(f"the picture has no {output.value}: add it to the outputs of the camera's configuration")
    return part


@dataclass(frozen=True)
class Boxes:
    """Boxes around the visible pixels of bodies, by ascending key.

    Attributes:
        keys: (n,) int32 key of each body.
        limits: (n, 4) int32 left, top, right and bottom, the latter two one past the last pixel [pixels].
        pixels: (n,) int32 number of visible pixels.
    """

    keys: NDArray[np.int32]
    limits: NDArray[np.int32]
    pixels: NDArray[np.int32]


class FirstPersonCamera:
    """Camera that draws a town, the static objects of a session, and bodies.

    Its buffers are allocated once. A picture depends on the arguments of `render` alone, not on earlier pictures.
    """

    def __init__(self, scene: CameraScene, config: CameraConfig, overlay: Mesh | None = None) -> None:
        """Allocates the buffers.

        Args:
            scene: data that all cameras of the town share.
            config: settings.
            overlay: static objects of the session, such as landmarks.
        """
        self.scene, self.config = scene, config
        self._overlay, self._overlay_cells, order = sorted_by_cell(empty_mesh() if overlay is None else overlay)
        self._rows = np.argsort(order, kind="stable")  # of the overlay as given
        width, height, samples = config.width, config.height, config.samples
        self._draws_rgb = CameraOutput.RGB in config.outputs
        self._labelled = any(output not in _FROM_ABOVE for output in config.outputs)
        self._bodies = empty_mesh(_ROOM)
        self._box = np.zeros((2, 3))
        self._samples = new_samples()
        self._shadows = new_shadow_maps(enabled=config.shadows and self._draws_rgb)
        self._pose: CameraPose | None = None
        self._halos = no_halos()
        self._keys = np.unique(self._overlay.instances[self._overlay.instances != TOWN])
        if self._draws_rgb:
            self._buffer = new_buffer(width * samples, height * samples)
            self._orders = self._new_orders(width * samples, height * samples)
            self._textures = textures_of(scene.atlas)
            self._faces = new_faces()
            self._beams = new_head_lights()
            self._scratch = np.zeros(max(width, height), np.uint8)
            self._light_key: tuple[float, ...] = ()
            self._casts_shadows = False
        if self._labelled:
            self._label_buffer = new_buffer(width, height)
            self._label_orders = self._new_orders(width, height)
            self._labels = new_labels(width, height)
        if CameraOutput.BIRDS_EYE in config.outputs:
            self._map_buffer = new_buffer(width, height)
            self._corners = np.zeros((4, 3))

    def _new_orders(self, width: int, height: int) -> tuple[CellOrder, CellOrder]:
        return new_order(self.scene.cells, width, height), new_order(self._overlay_cells, width, height)

    def paint(self, rows: NDArray[np.int64], colours: NDArray[np.uint8]) -> None:
        """Gives triangles of the overlay other colours, such as those of the lamps of signals.

        Args:
            rows: (n,) of the overlay as it was given.
            colours: (n, 3) RGB.
        """
        self._overlay.colours[self._rows[rows]] = colours

    def glow(self, halos: Halos) -> None:
        """Gives following pictures the halos of traffic lights."""
        self._halos = halos

    def view_of(self, pose: CameraPose) -> View:
        """Returns the projection of a picture from a pose; that of the last pose is kept."""
        if pose is not self._pose:
            self._view = view_from(pose, self.config.width, self.config.height, self.config.field_of_view)
            self._pose = pose
        return self._view

    def render(
        self,
        pose: CameraPose,
        weather: Weather,
        *,
        bodies: RecordArray[PlacementRecord] = _NO_BODIES,
        time: float = 0.0,
        head_lights: bool = False,
        faults: Collection[Sensor] = (),
        earlier: EarlierView | None = None,
    ) -> CameraFrame:
        """Draws a picture.

        Args:
            pose: pose of the camera.
            weather: weather and sun.
            bodies: moving bodies, as from `model_bank.place_bodies`.
            time: simulated seconds, which move the rain.
            head_lights: whether the car's headlights are on.
            faults: faulty sensors, which act on RGB.
            earlier: what optical flow is measured from; None for a first picture, without movement.
        """
        config = self.config
        view = self.view_of(pose)
        bodies = argument(bodies)
        rgb: NDArray[np.uint8] | None = None
        placed = -1
        if self._draws_rgb:
            light = self._daylight(weather, head_lights)
            placed = self._draw(
                view.scaled(config.samples), self._buffer, self._orders, bodies, placed, self._casts_shadows
            )
            if light.beams > 0.0:
                _draw_head_lights(self._beams, pose.x, pose.y, pose.heading, bodies)
            picture = np.empty((config.height, config.width, 3), np.uint8)
            optics = optics_of(view, self._light_numbers, self._shadows, pose)
            _shade(
                view, optics, self._buffer, config.samples,
                self.scene.town, self._overlay, self._bodies, self.scene.ground, self._textures, light,
                self.scene.noise, self.scene.lamps, self._beams, self._shadows, self._samples, self._faces,
                picture.reshape(-1, 3),
            )  # fmt: skip
            if self._halos.lit.any():
                _add_halos(view, optics, self._buffer, config.samples, self._halos, picture)
            if light.rainfall > 0.02:
                add_rain(picture, light.rainfall, round(time * 30.0))
            apply_faults(picture, faults, self._scratch)
            rgb = picture
        if self._labelled:
            self._draw(view, self._label_buffer, self._label_orders, bodies, placed)
            return self._write_labels(view, rgb, bodies, earlier)
        return CameraFrame(view, rgb, birds_eye=self._birds_eye(view, bodies))

    def _daylight(self, weather: Weather, head_lights: bool) -> Daylight:
        """Returns the light of a weather, and turns the maps of shadows, once as long as it stays."""
        key = *weather.values.values(), head_lights
        if key != self._light_key:
            self._light_key, self._light = key, daylight_of(weather, head_lights=head_lights)
            self._light_numbers = light_numbers(self._light)
            self._casts_shadows = turn_sun(self._shadows, self._light.sun, float(self._light.sunshine.max()))
        return self._light

    def _draw(
        self,
        view: View,
        buffer: VisibilityBuffer,
        orders: tuple[CellOrder, CellOrder],
        bodies: RecordArray[PlacementRecord],
        placed: int,
        casts_shadows: bool = False,
    ) -> int:
        """Draws all triangles, and shadows if requested; returns the number of triangles of bodies.

        These are copied first if `placed`, which is their number otherwise, is negative.
        """
        scene, bank = self.scene, self.scene.bank
        while True:
            count = _draw_scene(
                view, buffer, scene.town, scene.cells, orders[0], self._overlay, self._overlay_cells, orders[1],
                bank.mesh, bank.ranges, bank.boxes, bodies, self._box, self._bodies, placed,
                self._shadows, casts_shadows,
            )  # fmt: skip
            if count <= self._bodies.size:
                return count
            self._bodies = empty_mesh(2 * count)

    def _write_labels(
        self,
        view: View,
        rgb: NDArray[np.uint8] | None,
        bodies: RecordArray[PlacementRecord],
        earlier: EarlierView | None,
    ) -> CameraFrame:
        labels, outputs = self._labels, self.config.outputs
        _write_labels(
            view,
            self._label_buffer,
            self.scene.town,
            self._overlay,
            self._bodies,
            self.scene.ground,
            self._samples,
            labels,
        )
        boxes: Boxes | None = None
        if CameraOutput.BOXES in outputs:
            keys = np.unique(np.concatenate((self._keys, plain(bodies)["key"])))
            table = np.zeros((len(keys), 5), np.int32)
            find_boxes(labels.instance, keys, table)
            seen = table[:, 4] > 0
            boxes = Boxes(keys[seen], table[seen, :4], table[seen, 4])
        return CameraFrame(
            view,
            rgb,
            labels.depth.copy() if CameraOutput.DEPTH in outputs else None,
            labels.semantic.copy() if CameraOutput.SEMANTIC in outputs else None,
            labels.instance.copy() if CameraOutput.INSTANCE in outputs else None,
            boxes,
            self._flow(view, bodies, earlier) if CameraOutput.OPTICAL_FLOW in outputs else None,
            self._normals(view) if CameraOutput.NORMALS in outputs else None,
            self._birds_eye(view, bodies),
        )

    def _flow(
        self, view: View, bodies: RecordArray[PlacementRecord], earlier: EarlierView | None
    ) -> NDArray[np.float32]:
        flow = np.zeros((view.height, view.width, 2), np.float32)
        if earlier is not None:
            before = view_from(earlier.pose, view.width, view.height, self.config.field_of_view)
            _write_flow(
                view, before, self._label_buffer, self.scene.town, self._overlay, self._bodies, self._labels.depth,
                bodies, argument(earlier.bodies), flow,
            )  # fmt: skip
        return flow

    def _normals(self, view: View) -> NDArray[np.float32]:
        normals = np.empty((view.height, view.width, 3), np.float32)
        _write_normals(view, self._label_buffer, self.scene.town, self._overlay, self._bodies, normals)
        return normals

    def _birds_eye(self, view: View, bodies: RecordArray[PlacementRecord]) -> NDArray[np.uint8] | None:
        if CameraOutput.BIRDS_EYE not in self.config.outputs:
            return None
        scene, classes = self.scene, np.empty((view.height, view.width), np.uint8)
        _draw_birds_eye(
            view, self.config.metres_per_pixel, self._map_buffer, scene.town, scene.cells, self._overlay,
            self._overlay_cells, scene.bank.mesh, scene.bank.ranges, bodies, scene.ground, self._corners, classes,
        )  # fmt: skip
        return classes

    @property
    def nbytes(self) -> int:
        """Size of the buffers [bytes]."""
        parts: list[tuple[object, ...]] = [self._bodies, self._overlay, self._samples]
        if self._draws_rgb:
            parts += [self._buffer, *self._orders, self._shadows, self._beams]
        if self._labelled:
            parts += [self._label_buffer, *self._label_orders, self._labels]
        if CameraOutput.BIRDS_EYE in self.config.outputs:
            parts += [self._map_buffer]
        return sum(array.nbytes for part in parts for array in part if isinstance(array, np.ndarray))
