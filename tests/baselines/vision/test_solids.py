"""Boxes in space: numbers that a picture shows, and back; mirrored and enlarged pictures."""

import math

import numpy as np
import pytest
import torch

from dorothie_gym.baselines.vision.frames import BOX_DTYPE, SPACE_COLUMNS
from dorothie_gym.baselines.vision.solids import (
    Focals,
    enlarged,
    mirrored,
    solid_loss,
    solids_from,
    solids_of,
    spaces_of,
)
from dorothie_gym.pictures.camera.pose import CameraPose, view_from
from dorothie_gym.session.config import CameraConfig

CONFIG = CameraConfig(width=320, height=192)
FOCALS = Focals.of(CONFIG)


def bodies(*spaces):
    rows = np.zeros(len(spaces), BOX_DTYPE)
    for row, values in zip(rows, spaces, strict=True):
        for name, value in zip(SPACE_COLUMNS, values, strict=True):
            row[name] = value
    return rows


SOME = bodies(
    (3.0, 0.5, 12.0, 4.5, 1.8, 1.5, 0.4), (-8.0, 1.0, 9.0, 0.6, 0.6, 1.7, -3.0), (0.0, -2.0, 60.0, 8.0, 2.5, 3.0, 3.1)
)


def test_solids_give_the_boxes_in_space_back():
    solids, known = solids_of(SOME, FOCALS)
    back = spaces_of(solids, FOCALS)
    assert known.all()
    for column, name in enumerate(SPACE_COLUMNS):
        assert back[:, column] == pytest.approx(SOME[name], abs=1e-4)


def test_projected_middles_are_those_of_the_camera():
    view = view_from(CameraPose(0.0, 0.0, 0.0, 0.0), CONFIG.width, CONFIG.height, CONFIG.field_of_view)
    aside, down, ahead = (SOME[name].astype(float) for name in ("x", "y", "z"))
    places, _ = view.project(np.column_stack((aside, down, ahead)) @ (view.axes * [[1.0], [-1.0], [1.0]]))
    solids, _ = solids_of(SOME, FOCALS)
    assert solids[:, :2] * [CONFIG.width, CONFIG.height] == pytest.approx(places, abs=1e-3)


def test_body_seen_from_the_same_side_has_the_same_turn_wherever_it_is():
    placed = [(12.0 * math.sin(a), 0.0, 12.0 * math.cos(a), 4.0, 2.0, 1.5, 0.7 + a) for a in (-0.6, 0.0, 0.5)]
    solids, _ = solids_of(bodies(*placed), FOCALS)
    assert np.arctan2(solids[:, 6], solids[:, 7]) == pytest.approx(0.7, abs=1e-5)


def test_middle_beside_the_camera_is_unknown():
    _, known = solids_of(bodies((2.0, 0.0, 0.5, 4.0, 2.0, 1.5, 0.0), (2.0, 0.0, -3.0, 4.0, 2.0, 1.5, 0.0)), FOCALS)
    assert not known.any()


def test_mirrored_solids_are_those_of_the_mirrored_bodies():
    other = SOME.copy()
    other["x"], other["heading"] = -SOME["x"], -SOME["heading"]
    found = mirrored(torch.from_numpy(solids_of(SOME, FOCALS)[0]))
    assert found.numpy() == pytest.approx(solids_of(other, FOCALS)[0], abs=1e-5)


def test_enlarged_middle_part_is_the_same_scene_nearer_by():
    nearer = SOME.copy()
    nearer["z"] = SOME["z"] * 0.5  # twice as large, with the same offsets from the axis
    found = enlarged(torch.from_numpy(solids_of(SOME, FOCALS)[0]), 0.25, 0.25, 0.5)
    assert found[:, :6].numpy() == pytest.approx(solids_of(nearer, FOCALS)[0][:, :6], abs=1e-5)


def test_head_without_offsets_puts_middles_into_the_boxes():
    boxes = torch.tensor([[0.3, 0.6, 0.2, 0.1]])
    raw = torch.tensor([[0.5, -1.0, 2.0, 1.0, 0.5, 0.4, 0.0, 1.0]])
    assert solids_from(boxes, raw)[0].tolist() == pytest.approx([0.4, 0.5, 2.0, 1.0, 0.5, 0.4, 0.0, 1.0])


def test_loss_measures_middles_in_sizes_of_the_box_and_is_zero_without_objects():
    true, boxes = torch.zeros(1, 8), torch.tensor([[0.5, 0.5, 0.1, 0.2]])
    assert solid_loss(true, true, boxes) == 0.0
    assert float(solid_loss(true + torch.tensor([0.1, 0.2, 0, 0, 0, 0, 0.3, 0]), true, boxes)) == pytest.approx(2.3)
    assert solid_loss(true[:0], true[:0], boxes[:0]) == 0.0
