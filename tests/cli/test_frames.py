"""Pictures and labels of recorded sessions as files."""

from __future__ import annotations

import hashlib
import itertools
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from numpy.typing import NDArray
from PIL import Image
from typer.testing import CliRunner

from dorothie_gym.archive import read_session
from dorothie_gym.archive.sdn import write_sdn
from dorothie_gym.cli import app
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, ObjectClass
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from tests.archive.sdn.builders import release

WIDTH, HEIGHT = 240, 160
SIZE = ("--size", f"{WIDTH}x{HEIGHT}", "--workers", 1)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions of ten seconds."""
    folder = tmp_path_factory.mktemp("corpus")
    config = EnvConfig(max_seconds=10.0, world=WorldConfig(vehicles=60, pedestrians=60))
    engine = SessionEngine("brookside", config=config)
    for seed in (4, 5):
        engine.reset(seed=seed)
        policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
        play_session(engine, policies, seed=seed, folder=folder / f"s{seed}")
    return folder


@pytest.fixture(scope="module")
def exported(corpus: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("exported") / "s4"
    done = call("frames", corpus / "s4", "--out", out, *SIZE, "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert facts["pictures"] == 20 and facts["boxes"] > 40
    assert facts["sessions"] == [
        {"session": "s4", "folder": str(out), "pictures": 20, "boxes": facts["boxes"], "new": True}
    ]
    return out


def annotations(folder: Path) -> dict[str, Any]:
    page: dict[str, Any] = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    return page


def numbers(path: Path) -> NDArray[np.int64]:
    """The instances of a picture."""
    red, green, blue = np.asarray(Image.open(path)).astype(np.int64).transpose(2, 0, 1)
    return np.asarray(red + 256 * green + 65536 * blue)


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_files_hold_what_the_camera_sees_at_the_decisions(exported: Path, corpus: Path) -> None:
    config = CameraConfig(width=WIDTH, height=HEIGHT, outputs=tuple(CameraOutput))
    pictures = RecordedPictures(Session.load(corpus / "s4"), load_town("brookside"), config)
    images = annotations(exported)["images"]
    assert [image["frame"] for image in images] == list(range(15, 301, 15))
    for image in images[::6]:
        picture = pictures.picture(image["frame"])
        assert picture.depth is not None and picture.semantic is not None and picture.instance is not None
        np.testing.assert_array_equal(np.asarray(Image.open(exported / image["file_name"])), picture.rgb)
        np.testing.assert_array_equal(np.asarray(Image.open(exported / image["semantic_file_name"])), picture.semantic)
        np.testing.assert_array_equal(numbers(exported / image["instance_file_name"]), picture.instance % 2**24)
        stored = np.asarray(Image.open(exported / image["depth_file_name"]))
        assert stored.dtype == np.uint16
        near = picture.depth < 255.0
        np.testing.assert_allclose(stored[near] / 256.0, picture.depth[near], atol=1.0 / 512.0)
        assert (stored[np.isinf(picture.depth)] == 0).all() and (stored[~np.isinf(picture.depth)] > 0).all()


def test_boxes_are_the_bounds_of_the_instances(exported: Path) -> None:
    page = annotations(exported)
    by_image = {image["id"]: [] for image in page["images"]}  # type: dict[int, list[dict[str, Any]]]
    for row in page["annotations"]:
        by_image[row["image_id"]].append(row)
    assert [row["id"] for row in page["annotations"]] == list(range(1, len(page["annotations"]) + 1))
    for image in page["images"]:
        found = numbers(exported / image["instance_file_name"])
        assert {row["instance"] for row in by_image[image["id"]]} == set(np.unique(found[found > 0]).tolist())
        for row in by_image[image["id"]]:
            rows, columns = np.nonzero(found == row["instance"])
            left, top, width, height = row["bbox"]
            assert (left, top) == (columns.min(), rows.min())
            assert (left + width, top + height) == (columns.max() + 1, rows.max() + 1)
            assert row["area"] == len(rows) and row["iscrowd"] == 0


def test_categories_are_carlas_classes_and_landmarks_by_name(exported: Path, corpus: Path) -> None:
    page, names = annotations(exported), [row["name"] for row in Session.load(corpus / "s4").header.landmarks]
    known = {row["id"]: row for row in page["categories"]}
    assert len(known) == len(page["categories"]) == 32
    assert known[ObjectClass.VEHICLES.value]["name"] == "Vehicles"
    found = set()
    for row in page["annotations"]:
        category = known[row["category_id"]]
        found.add(category["name"])
        if row["instance"] >= 2**23:
            assert category["name"] == names[2**24 - 1 - row["instance"]] and category["supercategory"] == "landmark"
        else:
            assert category["name"] in ("Vehicles", "Pedestrian")
    assert {"Vehicles", "Pedestrian"} < found


def test_boxes_in_space_project_around_the_boxes_in_the_picture(exported: Path) -> None:
    page = annotations(exported)
    cameras = {image["id"]: image["camera"] for image in page["images"]}
    compared = 0
    for row in page["annotations"]:
        if "box_3d" not in row:
            assert row["instance"] >= 2**23
            continue
        camera, box = cameras[row["image_id"]], row["box_3d"]
        signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * box["size"]
        c, s = np.cos(box["heading"]), np.sin(box["heading"])
        corners = np.column_stack((signs[:, 0] * c - signs[:, 1] * s, signs[:, 0] * s + signs[:, 1] * c, signs[:, 2]))
        seen = (corners + box["centre"] - camera["position"]) @ np.array(camera["rotation"]).T
        if seen[:, 2].min() < 1.0:
            continue
        x, y = (seen @ np.array(camera["intrinsics"]).T)[:, :2].T / seen[:, 2]
        left, top, width, height = row["bbox"]
        assert x.min() - 1.0 <= left and left + width <= x.max() + 1.0
        assert y.min() - 1.0 <= top and top + height <= y.max() + 1.0
        compared += 1
    assert compared > 30


@pytest.mark.long
def test_two_exports_give_equal_bytes_with_any_number_of_processes(
    exported: Path, corpus: Path, tmp_path: Path
) -> None:
    done = call("frames", corpus / "s4", "--out", tmp_path / "again", *SIZE[:2], "--workers", 2)
    assert done.exit_code == 0, done.output
    assert digests(tmp_path / "again") == digests(exported)


def test_a_corpus_is_resumed_session_by_session(exported: Path, corpus: Path, tmp_path: Path) -> None:
    out = tmp_path / "frames"
    shutil.copytree(exported, out / "s4")
    before = (out / "s4" / "annotations.json").stat().st_mtime_ns
    done = call("frames", corpus, "--out", out, *SIZE, "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert [(row["session"], row["new"]) for row in facts["sessions"]] == [("s4", False), ("s5", True)]
    assert (out / "s4" / "annotations.json").stat().st_mtime_ns == before
    assert sorted(path.name for path in out.iterdir()) == ["s4", "s5"]
    other = call("frames", corpus, "--out", out, *SIZE, "--rate", 1)
    assert other.exit_code == 2 and "holds frames with other settings" in other.output.replace("\n", " ")


def test_only_the_outputs_that_are_named_are_written(corpus: Path, tmp_path: Path) -> None:
    done = call("frames", corpus / "s4", "--out", tmp_path / "f", *SIZE, "--outputs", "rgb,boxes", "--rate", 0.5)
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in (tmp_path / "f").iterdir()) == ["annotations.json", "rgb"]
    page = annotations(tmp_path / "f")
    assert len(page["images"]) == 5 and page["annotations"] and "depth_file_name" not in page["images"][0]


def test_pictures_of_sdns_layout_have_its_names(corpus: Path, tmp_path: Path) -> None:
    session = write_sdn(Session.load(corpus / "s4"), tmp_path / "log_4")
    assert len(read_session(session).scene.actors)
    done = call(
        "frames", session, "--out", tmp_path / "f", *SIZE, "--layout", "sdn", "--rate", 10, "--outputs", "rgb,depth"
    )
    assert done.exit_code == 0, done.output
    names = sorted(int(path.stem) for path in (tmp_path / "f" / "rgba").glob("*.jpg"))
    assert names == list(range(1, 101))
    assert {path.stem for path in (tmp_path / "f" / "depth").glob("*.png")} == {str(number) for number in names}
    with Image.open(tmp_path / "f" / "rgba" / "7.jpg") as picture:
        assert (picture.format, picture.size) == ("JPEG", (WIDTH, HEIGHT))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--size", "big"), "--size is 'big'; it must be like 480x320"),
        (("--size", "4x4"), "CameraConfig.width is 4; it must be a whole number in 8..4096 pixels"),
        (("--outputs", "rgb,lidar"), "--outputs has 'lidar'; it must be of rgb, depth, semantic, instance, boxes"),
        (("--layout", "kitti"), "--layout is 'kitti'; it must be one of native, sdn"),
        (("--rate", 31), "FrameExport.rate is 31; it must be in 0.01..30"),
        (("--rate", 11, "--layout", "sdn"), "FrameExport.rate is 11; it must be in 0.01..10"),
    ],
)
def test_wrong_options_are_refused(options: tuple[object, ...], reason: str, corpus: Path, tmp_path: Path) -> None:
    failed = call("frames", corpus / "s4", "--out", tmp_path / "f", *options)
    assert failed.exit_code == 2 and reason in failed.output.replace("\n", " ")
    assert not (tmp_path / "f").exists()


def test_a_folder_with_other_files_is_left_alone(corpus: Path, tmp_path: Path) -> None:
    (tmp_path / "f").mkdir()
    (tmp_path / "f" / "mine.txt").write_text("mine")
    failed = call("frames", corpus / "s4", "--out", tmp_path / "f", *SIZE)
    assert failed.exit_code == 2 and "exists and holds something else" in failed.output.replace("\n", " ")
    assert [path.name for path in (tmp_path / "f").iterdir()] == ["mine.txt"]
    assert call("frames", corpus, "--out", corpus / "frames").exit_code == 2, "inside of what is read"


def test_a_session_without_surroundings_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    session = release(tmp_path / "in" / "release")
    failed = call("frames", session, "--out", tmp_path / "f", *SIZE, "--town", "brookside")
    assert failed.exit_code == 2 and "no recorded surroundings" in failed.output.replace("\n", " ")
    assert [path.name for path in tmp_path.iterdir()] == ["in"]
