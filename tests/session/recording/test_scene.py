from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording import LIGHT_STATES, ActorKind, Session, SessionWriter
from tests.session.recording.builders import header, rows
from tests.session.recording.scenes import actors, lights, weather

COLUMNS = {"key": [3], "kind": ["cyclist"], "x": [1.0], "y": [2.0], "heading": [0.5], "speed": [4.0]}
SIZE = {"length": [1.8], "width": [0.6]}


def record(folder: Path, *, finish: bool) -> Session:
    """Two decisions with everything around the car, one with an empty road and no weather, one with the car alone."""
    with SessionWriter(folder, header()) as writer:
        for k, count in enumerate((5, 3)):
            writer.add_frames(rows(15 * k, 15))
            writer.add_actors(15 * k + 14, actors(count, seed=k))
            writer.add_lights(15 * k + 14, lights(k))
            writer.add_weather(15 * k + 14, weather(k))
        writer.add_frames(rows(30, 15))
        writer.add_actors(44, actors(0))
        writer.add_lights(44, {})
        writer.add_frames(rows(45, 15))
        if finish:
            writer.finish({"success": True})
    return Session.load(folder)


@pytest.mark.parametrize("finish", [True, False])
def test_scene_reads_back_as_it_was_handed_over(tmp_path: Path, finish: bool) -> None:
    session = record(tmp_path / "one", finish=finish)
    scene = session.scene
    assert session.complete is finish
    assert scene.actors.frames.tolist() == [14, 29, 44]
    for frame, count, seed in ((14, 5, 0), (29, 3, 1)):
        found = scene.actors.at(frame)
        assert found is not None and found.tobytes() == actors(count, seed=seed).tobytes()
    assert scene.lights.frames.tolist() == [14, 29, 44]
    shown = scene.lights.at(29)
    assert shown is not None
    assert {int(row["signal"]): str(LIGHT_STATES[row["state"]]) for row in shown} == lights(1)
    assert scene.weather.frames.tolist() == [14, 29]
    now = scene.weather.at(29)
    assert now is not None and dict(zip(now.dtype.names or (), now[0].tolist(), strict=True)) == weather(1)


def test_an_empty_road_is_not_a_road_that_was_not_recorded(tmp_path: Path) -> None:
    scene = record(tmp_path / "one", finish=True).scene
    empty = scene.actors.at(50)
    assert empty is not None and len(empty) == 0
    assert scene.actors.at(13) is None


def test_finished_and_interrupted_sessions_hold_the_same_scene(tmp_path: Path) -> None:
    whole, cut = record(tmp_path / "one", finish=True), record(tmp_path / "other", finish=False)
    assert whole.scene.equals(cut.scene)
    assert np.array_equal(whole.trajectory, cut.trajectory)


def test_session_without_a_scene_has_an_empty_one(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.append((), rows(0, 3))
        writer.finish({})
    scene = Session.load(tmp_path).scene
    assert (len(scene.actors), len(scene.lights), len(scene.weather), dict(scene.columns)) == (0, 0, 0, {})


def test_actors_may_be_given_as_columns_in_words(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.add_frames(rows(0, 1))
        writer.add_actors(0, {**COLUMNS, **SIZE})
    found = Session.load(tmp_path).scene.actors.at(0)
    assert found is not None and (found["kind"][0], found["length"][0]) == (ActorKind.CYCLIST, 1.8)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({**COLUMNS}, "columns key"),
        ({**COLUMNS, **SIZE, "kind": ["tram"]}, "'kind' is 'tram'.*pedestrian"),
        ({**COLUMNS, **SIZE, "kind": [9]}, "'kind' must be one of"),
        ({**COLUMNS, **SIZE, "x": [math.nan]}, "'x' has a value that is not finite"),
        ({**COLUMNS, **SIZE, "x": [1.0, 2.0]}, "'x'"),
        (np.zeros(3), "actors have type float64"),
    ],
)
def test_actors_of_another_form_are_refused(tmp_path: Path, given: Any, message: str) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.add_frames(rows(0, 1))
        with pytest.raises(SessionError, match=message):
            writer.add_actors(0, given)


def test_lights_and_weather_of_another_form_are_refused(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.add_frames(rows(0, 1))
        with pytest.raises(SessionError, match="signal 7 is 'blue'"):
            writer.add_lights(0, {7: "blue"})
        with pytest.raises(SessionError, match="weather has wetness"):
            writer.add_weather(0, {"wetness": 3.0})
        with pytest.raises(SessionError, match="'wetness' is inf"):
            writer.add_weather(0, {**weather(0), "wetness": math.inf})


def test_surroundings_belong_to_a_frame_of_the_car(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.add_frames(rows(0, 10))
        with pytest.raises(SessionError, match="frame 10 was not appended"):
            writer.add_actors(10, actors(1))
        writer.add_actors(9, actors(1))
        with pytest.raises(SessionError, match="frame 9 after 9"):
            writer.add_actors(9, actors(1))


def test_pictures_are_found_by_frame(tmp_path: Path) -> None:
    png = b"\x89PNG\r\n\x1a\n rest"
    with SessionWriter(tmp_path / "one", header()) as writer:
        writer.append((), rows(0, 10))
        writer.add_picture(3, png)
        with pytest.raises(SessionError, match="no PNG"):
            writer.add_picture(4, b"GIF89a")
        writer.finish({})
    session = Session.load(tmp_path / "one")
    assert {frame: path.read_bytes() for frame, path in session.pictures.items()} == {3: png}
    copied = Session.load(session.save(tmp_path / "copy"))
    assert list(copied.pictures) == [3] and copied.pictures[3].parent.parent == tmp_path / "copy"
