"""Objects that the camera on the car shows, as inputs of models in place of all near ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive.recorded_perception import OBJECT_VALUES, ObjectKind
from dorothie_gym.evaluation.teacher_forced.features import Columns, VisibleBoxes, build, columns_of
from dorothie_gym.pictures.camera.visibility import PERCEPTION_CAMERA
from dorothie_gym.session.recording import Session
from tests.evaluation.teacher_forced.corpora import corpus

ACTORS = (ObjectKind.VEHICLE, ObjectKind.CYCLIST, ObjectKind.PEDESTRIAN, ObjectKind.PROP)
BEARING, DISTANCE = OBJECT_VALUES.index("bearing"), OBJECT_VALUES.index("distance")


@pytest.fixture(scope="module")
def recorded(played: Session) -> Columns:
    return columns_of(played)


@pytest.fixture(scope="module")
def pictured(played: Session) -> Columns:
    return columns_of(played, sight=VisibleBoxes())


def looks(columns: Columns) -> list[set[tuple[float, ...]]]:
    """Kind and values of the actors at each look."""
    rows = np.column_stack([columns.objects.kind, columns.objects.values])
    return [
        {tuple(row) for row in rows[first:last].tolist() if row[0] in ACTORS}
        for first, last in zip(columns.looks.start[:-1], columns.looks.start[1:], strict=True)
    ]


def test_the_camera_shows_some_of_the_recorded_actors_and_no_others(recorded: Columns, pictured: Columns) -> None:
    assert np.array_equal(recorded.looks.tenth, pictured.looks.tenth)
    assert bool(pictured.sessions.has_objects[0])
    before, after = looks(recorded), looks(pictured)
    assert all(seen <= near for seen, near in zip(after, before, strict=True))
    assert 0 < sum(map(len, after)) < 0.6 * sum(map(len, before))


def test_actors_beside_and_behind_the_car_are_not_shown(pictured: Columns) -> None:
    actors = pictured.objects.values[np.isin(pictured.objects.kind, ACTORS)]
    far = actors[actors[:, DISTANCE] > 15.0]
    assert len(far) and np.abs(far[:, BEARING]).max() < PERCEPTION_CAMERA.field_of_view / 2 + 15.0


def test_all_else_stays_as_recorded(recorded: Columns, pictured: Columns) -> None:
    for name in ("moves", "utterances", "actions", "landmarks", "streets", "goals"):
        for field, values in vars(getattr(recorded, name)).items():
            assert np.array_equal(values, getattr(getattr(pictured, name), field), equal_nan=values.dtype.kind == "f")
    lights = [columns.objects.kind[columns.objects.kind >= ObjectKind.LIGHT_GREEN] for columns in (recorded, pictured)]
    assert np.array_equal(*lights)


def test_sessions_without_surroundings_are_read_without_pictures(tmp_path: Path) -> None:
    folder = corpus(tmp_path)
    plain, seen = build(folder, cache=False), build(folder, sight=VisibleBoxes(), cache=False)
    assert plain.content == seen.content and plain.key != seen.key
