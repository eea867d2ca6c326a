"""Lines on the road keep their contrast at a distance, compared with pictures of many more pixels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.sim.weather import Weather

WIDTH, HEIGHT, FINER = 480, 320, 4
LIMITS = (10.0, 20.0, 30.0, 40.0, 60.0)
"""Distances between which contrast is compared [m]."""


def blocks(
    values: Array,
) -> Array:
    """Returns the means over the pixels of a fine picture in each pixel of the coarse one."""
    return np.asarray(values.reshape(HEIGHT, FINER, WIDTH, FINER).mean(axis=(1, 3)))


@pytest.mark.long
def test_lines_have_the_contrast_of_supersampled_pictures_up_to_60_metres() -> None:
    town = load_town("midtown")
    scene = SessionScene(town_scene(town))
    coarse = SessionCamera(scene, CameraConfig(width=WIDTH, height=HEIGHT))
    outputs = (CameraOutput.RGB, CameraOutput.SEMANTIC, CameraOutput.DEPTH)
    fine = SessionCamera(scene, CameraConfig(width=WIDTH * FINER, height=HEIGHT * FINER, outputs=outputs))
    lanes = [lane for lane in town.lanes if not lane.in_junction and lane.length >= 70.0]
    columns: list[list[Array]] = [[], [], [], []]
    for lane in lanes[:: max(1, len(lanes) // 6)]:
        x, y = lane.position(2.0).tolist()
        pose = coarse.pose_on(x, y, lane.height_at(2.0), lane.heading_at(2.0))
        frame = fine.camera.render(pose, Weather())
        assert frame.depth is not None
        line = frame.classes == ObjectClass.ROAD_LINE.value
        asphalt = blocks((line | (frame.classes == ObjectClass.ROAD.value)).astype(np.float64)) == 1.0
        picture = coarse.camera.render(pose, Weather()).colours.astype(np.float64).mean(axis=2)
        parts = (
            picture,
            blocks(frame.colours.astype(np.float64).mean(axis=2)),
            blocks(line.astype(np.float64)),
            blocks(np.where(np.isfinite(frame.depth), frame.depth, 1e3).astype(np.float64)),
        )
        for column, part in zip(columns, parts, strict=True):
            column.append(part[asphalt])
    shown, expected, share, depth = (np.concatenate(column) for column in columns)
    for low, high in pairwise(LIMITS):
        there = (depth >= low) & (depth < high)
        assert (share[there] > 0.2).sum() > 30
        weight = share[there] - share[there].mean()
        assert (weight * shown[there]).sum() / (weight * expected[there]).sum() == pytest.approx(1.0, abs=0.15), low
