from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.camera import EVERYTHING, RGB, measure
from benchmarks.commands import app
from benchmarks.opengl_reference import opengl_reference
from benchmarks.report import camera_report
from benchmarks.report_chart import draw
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures.camera.pose import pose_on_car
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.session_engine import SessionEngine

SMALL = ["--town", "brookside", "--vehicles", "3", "--pedestrians", "2", "--seconds", "2", "--repeats", "1"]
ROW = {"width", "height", "outputs", "antialias", "milliseconds", "milliseconds_p99", "milliseconds_drive"}


@pytest.mark.long
def test_rows_are_the_sizes_and_outputs_that_are_asked_for(tmp_path: Path) -> None:
    figures = measure("brookside", sizes=((16, 12), (32, 24)), vehicles=3, pedestrians=2, seconds=2.0, repeats=1)
    assert json.loads(json.dumps(figures)) == figures
    kinds = [(row["width"], row["height"], tuple(row["outputs"]), row["antialias"]) for row in figures["rows"]]
    each = [(RGB, True), (RGB, False), (EVERYTHING, True)]
    assert kinds == [(*size, parts, smooth) for size in ((16, 12), (32, 24)) for parts, smooth in each]
    for row in figures["rows"]:
        assert set(row) == ROW
        assert 0.0 < row["milliseconds_drive"] <= row["milliseconds_p99"]
        assert row["milliseconds"] > 0.0
    assert figures["first_picture_seconds"] > 0.0 and figures["cold_picture_seconds"] is None
    assert figures["town_bytes"] > figures["camera_bytes"] / 10 > 1e5
    assert (figures["places"], figures["drive_pictures"]) == (9, 11)
    report = camera_report(figures)
    assert "pictures of 16 x 12 per second" in report.headline and len(report.rows) >= 6
    draw(report, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").is_file()


@pytest.mark.long
def test_command_prints_rows_as_json() -> None:
    result = CliRunner().invoke(app, ["camera", *SMALL, "--size", "16x12", "--outputs", "rgb,depth", "--json"])
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    (row,) = figures["rows"]
    assert (row["width"], row["height"], row["outputs"], row["antialias"]) == (16, 12, ["rgb", "depth"], True)
    assert {"first_picture_seconds", "town_bytes", "camera_bytes", "opengl", "metadrive"} <= set(figures)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--size", "84"], "--size 84: give it as WIDTHxHEIGHT"),
        (["--size", "4x4"], "CameraConfig.width is 4"),
        (["--outputs", "rgb,rgb"], "--outputs rgb,rgb: give all, or different ones of rgb,depth"),
        (["--outputs", "radar"], "--outputs radar"),
        (["--town", "nowhere"], "known towns are"),
    ],
)
def test_invalid_option_is_reported_in_one_line(arguments: list[str], said: str) -> None:
    result = CliRunner().invoke(app, ["camera", *arguments, "--seconds", "1"])
    assert result.exit_code == 2 and result.stdout == ""
    assert result.stderr.startswith("Error: ") and said in " ".join(result.stderr.split())


@pytest.mark.skipif(find_spec("moderngl") is None, reason="moderngl is not installed")
def test_opengl_draws_the_same_view() -> None:
    engine = SessionEngine(load_town("brookside"))
    engine.reset(seed=0)
    world = engine.session.world
    scene = SessionScene(town_scene(engine.town), (), engine.session.scenario.storyboard.landmarks)
    reference = opengl_reference(scene, 120, 80)
    if reference is None:
        pytest.skip("there is no driver with EGL")
    config = CameraConfig(width=120, height=80, outputs=(CameraOutput.SEMANTIC,))
    x, y = world.car.position.tolist()
    pose = pose_on_car(config.mount, x, y, float(world.car.height), float(world.car.heading))
    drawn = reference.draw(pose)
    reference.close()
    classes = SessionCamera(scene, config).render(world).semantic
    assert classes is not None
    sky = (drawn == drawn[0, 60]).all(axis=-1)
    assert (sky == (classes == ObjectClass.SKY.value)).mean() > 0.97
    assert not np.array_equal(drawn[:40], drawn[40:])
