"""Labelled pictures of recorded sessions: chosen places, no faulty camera, kept between runs."""

from __future__ import annotations

import itertools
import os
import random
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.baselines.vision import frames
from dorothie_gym.baselines.vision.frames import FrameSampling, load_frames
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.ontology import ObjectClass, Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import EventType, Session
from dorothie_gym.session.recording.events import Event
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.support.user_cache import SEAL_FILE
from tests.support.cache_damage import DAMAGES

SMALL = FrameSampling(width=96, height=64, spacing=6.0, wait=3.0, most=5)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions of 15 seconds in the training fold, in one town: the scene of another takes seconds to build."""
    made, folder = tmp_path_factory.mktemp("made"), tmp_path_factory.mktemp("corpus")
    config = EnvConfig(max_seconds=15.0, world=WorldConfig(vehicles=40, pedestrians=40))
    generate_corpus(made, sessions=2, seed=6, towns=("brookside",), config=config)
    for place, session in enumerate(sorted(made.rglob("session.json"))):
        shutil.copytree(session.parent, folder / "train" / f"{place}")
    return folder


def places(session: Session, chosen: np.ndarray) -> np.ndarray:
    rows = session.trajectory[np.searchsorted(session.trajectory["frame"], chosen)]
    return np.stack([rows["x"], rows["y"]], axis=1)


def test_pictures_are_apart_in_place_or_time(corpus):
    session = Corpus.load(corpus).entries[0].load()
    chosen = SMALL.candidates(session)
    away = np.linalg.norm(np.diff(places(session, chosen), axis=0), axis=1)
    assert len(chosen) > 2 and ((away >= 6.0) | (np.diff(chosen) >= 3.0 * 30)).all()


def test_pictures_of_a_faulty_camera_are_left_out(corpus):
    session = Corpus.load(corpus).entries[0].load()
    chosen = SMALL.candidates(session)
    first, last = int(chosen[1]), int(chosen[2])
    faults = [
        Event(
            frame=frame,
            type=EventType.EXCEPTION,
            source=Role.AD_WIZARD,
            data={"kind": "SENSOR_FAULT", "sensor": "blur", "on": on},
        )
        for frame, on in ((first - 1, True), (last + 1, False))
    ]
    broken = replace(session, events=(*session.events, *faults))
    left = SMALL.candidates(broken)
    assert len(left) and not ((left >= first) & (left <= last)).any()


@pytest.mark.long
def test_labels_belong_to_the_pictures(corpus, tmp_path):
    pictures = load_frames(Corpus.load(corpus), SMALL, folder=tmp_path)["train"]
    batch = pictures.take(range(len(pictures)))
    assert 4 <= len(pictures) <= 10
    assert batch.rgb.shape == (len(pictures), 64, 96, 3) and batch.rgb.std() > 20.0
    sky = batch.semantic == ObjectClass.SKY.value
    assert sky.any() and np.isinf(batch.depth[sky]).all() and np.isfinite(batch.depth[~sky]).all()
    assert pictures.pixel_counts.sum() == batch.semantic.size
    for boxes, semantic in zip(batch.boxes, batch.semantic, strict=True):
        for box in boxes:
            inside = semantic[box["top"] : box["bottom"], box["left"] : box["right"]]
            assert (inside == box["kind"]).sum() >= box["pixels"] // 2


@pytest.mark.long
def test_boxes_in_space_contain_the_pixels_and_project_around_the_boxes(corpus, tmp_path):
    sampling = replace(SMALL, spacing=2.0, wait=0.5, pixels=12)
    drawn = load_frames(Corpus.load(corpus), sampling, folder=tmp_path)["train"]
    pictures = drawn.take(range(min(len(drawn), 24)))
    width, height = sampling.width, sampling.height
    compared = 0
    for boxes, depth, semantic in zip(pictures.boxes, pictures.depth, pictures.semantic, strict=True):
        for box in boxes[boxes["z"] > 4.0]:
            signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * [
                box["length"],
                box["width"],
                box["height"],
            ]
            c, s = np.cos(box["heading"]), np.sin(box["heading"])
            pitch = np.radians(sampling.camera.mount.pitch)
            ahead, aside, up = signs[:, 0] * c - signs[:, 1] * s, signs[:, 0] * s + signs[:, 1] * c, signs[:, 2]
            z = box["z"] + ahead * np.cos(pitch) + up * np.sin(pitch)
            x, y = box["x"] + aside, box["y"] - (up * np.cos(pitch) - ahead * np.sin(pitch))
            columns, rows = width / 2 + width / 2 * x / z, height / 2 + width / 2 * y / z  # 90 degrees wide
            assert columns.min() - 1.0 <= box["left"] and box["right"] <= columns.max() + 1.0
            assert rows.min() - 1.0 <= box["top"] and box["bottom"] <= rows.max() + 1.0
            inside = (slice(box["top"], box["bottom"]), slice(box["left"], box["right"]))
            shown = depth[inside][semantic[inside] == box["kind"]]
            assert ((shown > z.min() - 0.1) & (shown < z.max() + 0.1)).any()
            compared += 1
    assert compared > 5


@pytest.mark.long
def test_pictures_are_drawn_once_and_equal_in_other_processes(corpus, tmp_path, monkeypatch):
    here = load_frames(Corpus.load(corpus), SMALL, folder=tmp_path / "here")["train"]
    there = load_frames(Corpus.load(corpus), SMALL, folder=tmp_path / "there", workers=2)["train"]
    assert here.key == there.key
    for first, second in zip(here.sessions, there.sessions, strict=True):
        assert np.array_equal(first.rgb, second.rgb) and np.array_equal(first.boxes, second.boxes)
    monkeypatch.setattr(frames, "_write", None)  # would fail
    again = load_frames(Corpus.load(corpus), SMALL, folder=tmp_path / "here")["train"]
    assert np.array_equal(again.take([1]).rgb, here.take([1]).rgb)


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("file", ["depth.npy", "boxes.npy", SEAL_FILE])
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_damaged_pictures_are_drawn_again(corpus, tmp_path, kind, file):
    sampling = replace(SMALL, most=1)
    before = load_frames(Corpus.load(corpus), sampling, folder=tmp_path)["train"]
    first = before.sessions[0]
    depth, boxes = np.array(first.depth), np.array(first.boxes)
    DAMAGES[kind](tmp_path / first.key / file, random.Random(0))
    after = load_frames(Corpus.load(corpus), sampling, folder=tmp_path)["train"]
    assert np.array_equal(after.sessions[0].depth, depth) and np.array_equal(after.sessions[0].boxes, boxes)


def test_pictures_with_objects_only(corpus, tmp_path):
    sampling = replace(SMALL, spacing=2.0, wait=0.5, pixels=12)
    pictures = load_frames(Corpus.load(corpus), sampling, folder=tmp_path)["train"]
    assert len(pictures)
    assert all(boxes["pixels"].max() >= 12 for boxes in pictures.take(range(len(pictures))).boxes)


def test_pictures_in_the_users_cache_are_bounded(corpus, tmp_path, monkeypatch):
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path))
    monkeypatch.setattr(frames, "MOST_BYTES", 0)
    few, fewer = (replace(SMALL, most=most) for most in (2, 1))
    for sampling in (few, fewer):
        load_frames(Corpus.load(corpus), sampling)
    entries = set((tmp_path / "frames").iterdir())
    assert len(entries) == 4, "other processes may read what was used a moment ago"
    for entry in entries:
        os.utime(entry, (0.0, 0.0))
    used = load_frames(Corpus.load(corpus), few)["train"]
    assert {entry.name for entry in (tmp_path / "frames").iterdir()} == {session.key for session in used.sessions}
    assert used.take(range(len(used))).rgb.std() > 20.0


def test_cache_that_is_switched_off_is_reported(corpus, monkeypatch):
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", "")
    with pytest.raises(SessionError, match="DOROTHIE_GYM_CACHE"):
        load_frames(Corpus.load(corpus), SMALL)


@pytest.mark.parametrize("change", [{"width": 100}, {"most": 0}, {"spacing": 0.0}, {"pixels": -1}])
def test_settings_out_of_range_are_refused(change):
    with pytest.raises(ValueError, match="FrameSampling"):
        replace(SMALL, **change)
