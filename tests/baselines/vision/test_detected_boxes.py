"""Objects that a trained detector finds: their places in the town, and nothing else of the record."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

pytest.importorskip("transformers")

from dorothie_gym.archive import Task
from dorothie_gym.archive.recorded_perception import ObjectKind
from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.dataset import Dataset
from dorothie_gym.baselines.model_entries import find_row
from dorothie_gym.baselines.model_zoo import make_model
from dorothie_gym.baselines.trainer import BEST_FILE
from dorothie_gym.baselines.vision import detected_boxes
from dorothie_gym.baselines.vision.detected_boxes import DetectedBoxes, actors_at, looked_at, objects_in
from dorothie_gym.baselines.vision.detector import Detector
from dorothie_gym.baselines.vision.frames import SPACE_COLUMNS
from dorothie_gym.baselines.vision.segformer import SegFormer
from dorothie_gym.errors import CheckpointError
from dorothie_gym.evaluation.teacher_forced.features import columns_of, points
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.pictures.camera.pose import CameraPose, view_from
from dorothie_gym.session.recording import ActorKind, Session
from tests.baselines.vision.test_detector import TINY
from tests.baselines.vision.test_segformer import TINY as TINY_READER
from tests.evaluation.teacher_forced.features.played import play

ANY = 0.0
"""Threshold by which every query is an object."""


def trained(folder: Path, *, threshold: float = ANY, inputs: str = "predicted", seed: int = 0) -> Path:
    """Random weights of both models, as trainings write them; returns the folder of the detector."""
    torch.manual_seed(seed)
    reader, detector = (folder / name / "small" / "seed-0" for name in ("segformer", "detr"))
    checkpoints.save(reader / BEST_FILE, SegFormer(TINY_READER), {"config": TINY_READER.to_json()})
    about = {
        "config": TINY.to_json(),
        "inputs": inputs,
        "segformer": checkpoints.sha256_of(reader / BEST_FILE),
        "figures": {"threshold": threshold},
    }
    checkpoints.save(detector / BEST_FILE, Detector(TINY), about)
    return detector


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Six seconds of the scripted roles in brookside."""
    return play(tmp_path_factory.mktemp("played") / "session", seconds=6.0)


def one_object(x: float, y: float, heading: float, kind: int = 0, width: float = 1.8) -> np.ndarray:
    """The object in the picture of a camera at (100, 50), 1.5 m high, that looks to the south-east and down."""
    pose = CameraPose(100.0, 50.0, 1.5, math.radians(45.0), math.radians(-2.0))
    view = view_from(pose, 128, 64, 90.0)
    right, up, ahead = view.axes @ (np.array([x, y, 0.8]) - view.origin)
    space = np.array([[right, -up, ahead, 4.5, width, 1.5, heading - pose.heading]])
    assert space.shape == (1, len(SPACE_COLUMNS))
    return actors_at(np.eye(3)[[kind]] * 0.9, space, view, pose.heading)


def test_objects_lie_where_they_are_in_the_town() -> None:
    (found,) = one_object(110.0, 65.0, -3.0)
    assert (found["x"], found["y"]) == pytest.approx((110.0, 65.0)) and found["heading"] == pytest.approx(-3.0)
    assert (found["length"], found["width"], found["speed"]) == (4.5, 1.8, 0.0)


def test_kinds_are_those_of_actors_and_a_narrow_vehicle_is_a_cyclist() -> None:
    kinds = [one_object(110.0, 60.0, 0.0, kind)["kind"][0] for kind in range(3)]
    assert kinds == [ActorKind.VEHICLE, ActorKind.PEDESTRIAN, ActorKind.PROP]
    assert one_object(110.0, 60.0, 0.0, width=0.7)["kind"][0] == ActorKind.CYCLIST


def test_sure_queries_are_objects_and_no_others() -> None:
    boxes = np.array([[0.2, 0.5, 0.1, 0.1], [0.5, 0.5, 0.1, 0.1], [0.8, 0.5, 0.1, 0.1]])
    scores = np.array([[0.2, 0.1, 0.0], [0.1, 0.6, 0.55], [0.9, 0.3, 0.0]])
    assert objects_in(boxes, scores, 0.5).tolist() == [2, 1]  # the surest first
    view = view_from(CameraPose(0.0, 0.0, 1.5, 0.0), 128, 64, 90.0)
    found = actors_at(scores[[2, 1]], np.tile([0.0, 0.0, 9.0, 4.0, 1.8, 1.5, 0.0], (2, 1)), view, 0.0)
    assert found["kind"].tolist() == [ActorKind.VEHICLE, ActorKind.PEDESTRIAN]
    assert found["key"].tolist() == [1, 2]


def test_object_of_several_queries_is_found_once() -> None:
    boxes = np.array([[0.50, 0.5, 0.2, 0.1], [0.52, 0.5, 0.2, 0.1], [0.60, 0.5, 0.2, 0.1]])
    scores = np.array([[0.6, 0.0, 0.0], [0.8, 0.0, 0.0], [0.7, 0.0, 0.0]])
    assert objects_in(boxes, scores, 0.5).tolist() == [1, 2]  # the last overlaps the surest by less than one half
    assert objects_in(boxes, scores, 0.9).tolist() == []


def test_nothing_of_the_recorded_actors_gets_in(session: Session, tmp_path: Path) -> None:
    town = find_town("brookside", None)
    assert town is not None
    found = DetectedBoxes(trained(tmp_path)).actors(session, town)
    table = session.scene.actors
    assert np.isin(found.frames, table.frames).all() and 0.25 * len(table) <= len(found) <= len(table)
    counts = np.diff(found.offsets)
    assert counts.min() >= 1 and counts.max() <= TINY.queries
    assert (found.rows["speed"] == 0.0).all() and set(found.rows["key"].tolist()) == set(range(1, counts.max() + 1))
    assert not np.isin(found.rows["x"], table.rows["x"]).any()


def test_last_record_before_each_event_is_looked_at_and_every_fourth_of_the_others() -> None:
    records = np.arange(0, 150, 15)
    assert looked_at(records, np.array([], np.int64)).tolist() == [0, 4, 8]
    assert looked_at(records, np.array([0, 45, 47, 48, 140])).tolist() == [0, 2, 3, 4, 8, 9]


def test_features_read_the_last_look_before_each_point(session: Session, tmp_path: Path) -> None:
    recorded = columns_of(session)
    found = columns_of(session, sight=DetectedBoxes(trained(tmp_path)))
    count = 0
    for task in Task:
        table = points(recorded, task)
        last = table.frames_stop[table.frames_stop > table.frames_start] - 1
        tenths = [columns.looks.tenth[columns.frames.look[last]] for columns in (recorded, found)]
        assert np.array_equal(*tenths)
        count += len(last)
    assert count > 0


def test_objects_are_found_once_and_equal_again(session: Session, tmp_path: Path, monkeypatch) -> None:
    town = find_town("brookside", None)
    assert town is not None
    sight = DetectedBoxes(trained(tmp_path / "here"))
    first, other = sight.actors(session, town), DetectedBoxes(trained(tmp_path / "there")).actors(session, town)
    assert first.equals(other)
    monkeypatch.setattr(detected_boxes, "RecordedPictures", None)  # would fail
    assert DetectedBoxes(sight.detector).actors(session, town).equals(first)


def test_other_weights_have_another_digest(tmp_path: Path) -> None:
    first, again, other = (
        DetectedBoxes(trained(tmp_path / name, seed=seed)).digest for name, seed in (("a", 0), ("b", 0), ("c", 1))
    )
    assert first == again != other


def test_features_have_the_objects_that_were_found(session: Session, tmp_path: Path) -> None:
    none = DetectedBoxes(trained(tmp_path / "none", threshold=2.0))
    found = columns_of(session, sight=DetectedBoxes(trained(tmp_path / "all")))
    seen = columns_of(session, sight=none)
    actors = [kind.value for kind in ObjectKind if kind < ObjectKind.LIGHT_GREEN]
    assert np.isin(found.objects.kind, actors).any() and not np.isin(seen.objects.kind, actors).any()
    lights = [
        np.sort(columns.objects.kind[columns.objects.kind >= ObjectKind.LIGHT_GREEN]) for columns in (found, seen)
    ]
    assert np.array_equal(*lights)


def test_detectors_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="run first: dorothie-gym train detr"):
        DetectedBoxes(tmp_path / "detr" / "small" / "seed-0")
    with pytest.raises(CheckpointError, match="reads true classes and depths"):
        DetectedBoxes(trained(tmp_path / "true", inputs="true"))
    mixed = trained(tmp_path / "mixed")
    checkpoints.save(tmp_path / "mixed" / "segformer" / "small" / "seed-0" / BEST_FILE, SegFormer(TINY_READER), {})
    with pytest.raises(CheckpointError, match="trained with another SegFormer"):
        DetectedBoxes(mixed)
    (tmp_path / "mixed" / "segformer" / "small" / "seed-0" / BEST_FILE).unlink()
    with pytest.raises(CheckpointError, match="is missing; the detector"):
        DetectedBoxes(mixed)


def test_damaged_objects_are_found_again(session: Session, tmp_path: Path) -> None:
    town = find_town("brookside", None)
    assert town is not None
    sight = DetectedBoxes(trained(tmp_path))
    first = sight.actors(session, town)
    kept = sorted((sight.detector / detected_boxes.OBJECTS_FOLDER).iterdir())
    assert len(kept) == 2
    for path in kept:
        path.write_bytes(b"nothing")
    assert sight.actors(replace(session), town).equals(first)


def test_queries_are_those_before_events_and_other_pictures_have_others(session: Session, tmp_path: Path) -> None:
    town = find_town("brookside", None)
    assert town is not None
    frames, values = DetectedBoxes(trained(tmp_path)).queries(session, town)
    assert values.shape == (len(frames), TINY.queries, TINY.size) and values.dtype == np.float16
    first = session.scene.actors.frames
    assert all(
        frames[frames < event.frame // 3 * 3].max() == first[first < event.frame // 3 * 3].max()
        for event in session.events
        if event.frame > first[0] + 2
    )
    assert len({vectors.tobytes() for vectors in values}) == len(frames) > 1


def test_model_reads_the_queries_at_the_last_look(session: Session, tmp_path: Path) -> None:
    for fold in ("train", "val/seen"):
        session.save(tmp_path / "corpus" / fold / "played")
    detector = trained(tmp_path / "runs")
    material = Dataset.load(tmp_path / "corpus", "hashing").seeing("detections", detector=detector)
    row = find_row("toto-queries")
    model = make_model(row, "small", material, 0).eval()
    examples = material.examples("train", model.spec, queries=True)
    inputs, _ = examples.take(torch.arange(len(examples)))
    assert inputs["detector"].shape == (len(examples), TINY.queries, TINY.size)
    seen = inputs["detector"].flatten(1).abs().sum(1) > 0
    assert seen.any() and torch.equal(seen, inputs["window_mask"].any(1))
    with torch.inference_mode():
        before = model(inputs).move
        after = model({**inputs, "detector": inputs["detector"] + 1.0}).move
    assert before.isfinite().all() and not torch.equal(before[seen], after[seen])
    with pytest.raises(ValueError, match="there are no queries"):
        make_model(row, "small", Dataset.load(tmp_path / "corpus", "hashing"), 0)
