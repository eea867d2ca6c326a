"""Boards with street names: legible from 50 m before a stop line, and 20 m after a junction."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.model import NO_STREET, Array, Lane
from dorothie_gym.pictures.camera.atlas import STREET_NAMES
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
from dorothie_gym.pictures.camera.mesh import Surface
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.pictures.maps.markings import stop_stations
from dorothie_gym.session.config import CameraConfig
from dorothie_gym.sim.weather import Weather

WORDS = ("Abbey", "Birch", "Castle", "Dalton", "Elm", "Forest", "Garden", "Harbour", "Iris", "Juniper", "King", "Lake")
KINDS = ("Street", "Avenue", "Lane", "Road", "Way", "Place")
TOWNS = ["midtown", *(pytest.param(name, marks=pytest.mark.slow) for name in ("northgate", "millbrook", "generated:3"))]
MATCH = 0.5
"""Correlation with the drawn texture from which a name counts as legible, if no other name has more."""


@cache
def camera_in(name: str) -> tuple[Town, SessionCamera]:
    town = load_town(name)
    names = [f"{WORDS[k % len(WORDS)]} {KINDS[k // len(WORDS)]}" for k in range(len(town.streets))]
    return town, SessionCamera(SessionScene(town_scene(town), names), CameraConfig(width=480, height=270))


def shrunk(picture: Array, width: int, height: int) -> Array:
    """Returns a picture (h, w) at a smaller size, without its mean."""
    image = Image.fromarray(picture.astype(np.float32)).resize((width, height), Image.Resampling.BOX)
    small = np.asarray(image, dtype=np.float64)
    return np.asarray(small - small.mean())


def legible_names(town: Town, camera: SessionCamera, frame: CameraFrame) -> set[int]:
    """Returns the streets whose names are read on the three largest panels of each of them in view."""
    mesh, atlas = camera.scene.town.mesh, camera.scene.camera_scene.atlas
    grey = frame.colours.astype(np.float64).mean(axis=2)
    textures = []
    for street in range(len(town.streets)):
        first, width, height, _ = atlas.table[STREET_NAMES + street].tolist()
        texels = atlas.texels[first : first + width * height].reshape(height, width, 4)[::-1, :, :3]
        textures.append(texels.astype(np.float64).mean(axis=2))
    read: set[int] = set()
    for street in range(len(town.streets)):
        named = (mesh.textures == STREET_NAMES + street) & (mesh.surfaces == int(Surface.EMISSIVE))
        corners = mesh.corners[named].astype(np.float64)
        toward = ((corners.mean(axis=1) - frame.view.origin) * mesh.normals[named]).sum(axis=1)
        boxes = [box for box in map(lambda part: box_of(frame, part), corners[toward < 0.0]) if box is not None]
        for box in sorted(boxes, key=lambda box: box[0] - box[2])[:3]:
            if best_match(grey, box, textures) == street:
                read.add(street)
    return read


def box_of(frame: CameraFrame, corners: Array) -> tuple[int, int, int, int] | None:
    """Returns left, top, right and bottom of a panel in the picture, None if it is not whole or too small."""
    pixels, depths = frame.view.project(corners)
    left, top, right, bottom = (round(float(v)) for v in (*pixels.min(axis=0), *pixels.max(axis=0)))
    inside = depths.min() > 3.0 and left >= 1 and top >= 1 and right <= 479 and bottom <= 269
    return (left, top, right, bottom) if inside and right - left >= 12 and bottom - top >= 4 else None


def best_match(grey: NDArray[np.float64], box: tuple[int, int, int, int], textures: list[Array]) -> int:
    """Returns the texture that correlates best with a box, up to a pixel aside; -1 if none does well."""
    left, top, right, bottom = box
    crops = [grey[top + j : bottom + j, left + i : right + i] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    crops = [crop - crop.mean() for crop in crops if crop.shape == (bottom - top, right - left)]
    found = []
    for texture in textures:
        wanted = shrunk(texture, right - left, bottom - top)
        norm = np.sqrt((wanted * wanted).sum())
        found.append(max(float((c * wanted).sum() / (norm * np.sqrt((c * c).sum()) + 1e-9)) for c in crops))
    best = int(np.argmax(found))
    return best if found[best] > MATCH else -1


def seen_from(camera: SessionCamera, lane: Lane, station: float) -> CameraFrame:
    x, y = lane.position(station).tolist()
    return camera.camera.render(camera.pose_on(x, y, lane.height_at(station), lane.heading_at(station)), Weather())


@pytest.mark.long
@pytest.mark.parametrize("name", TOWNS)
def test_names_of_crossing_streets_are_legible_50_metres_before_the_line(name: str) -> None:
    town, camera = camera_in(name)
    stops, read = stop_stations(town), []
    for lane in town.lanes[::3]:
        others = {town.lanes[e.lane].street for e in town.exits(lane.id) if e.junction_id >= 0}
        others -= {lane.street, NO_STREET}
        if not lane.in_junction and lane.street != NO_STREET and len(others) == 1 and stops.get(lane.id, 0.0) > 50.0:
            read.append(others <= legible_names(town, camera, seen_from(camera, lane, stops[lane.id] - 50.0)))
    assert len(read) > 8
    assert np.mean(read) >= 0.95


@pytest.mark.long
@pytest.mark.parametrize("name", TOWNS)
def test_the_name_of_the_own_street_is_legible_20_metres_after_a_junction(name: str) -> None:
    town, camera = camera_in(name)
    read = []
    for lane in town.lanes[::3]:
        begins = any(town.lanes[k].in_junction for k in town.predecessors(lane.id))
        if not lane.in_junction and lane.street != NO_STREET and begins and lane.length > 44.0:
            read.append(lane.street in legible_names(town, camera, seen_from(camera, lane, 20.0)))
    assert len(read) > 8
    assert np.mean(read) >= 0.95
