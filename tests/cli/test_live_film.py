"""Films of sessions: while they are played, and of recorded ones."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from numpy.typing import NDArray
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.cli import live_film as film_module
from dorothie_gym.cli import sessions as sessions_module
from dorothie_gym.cli.live_film import Film
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import CameraConfig, EnvConfig, RenderView
from dorothie_gym.session.recording import Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from tests.archive.sdn.builders import release

LEFT, TOP = 832, 540
"""Width and height of the windscreen beside the map [px]."""


class Reel:
    """Writer that keeps the frames."""

    def __init__(self, path: Path, frames_per_second: float) -> None:
        self.path, self.rate = path, frames_per_second
        self.frames: list[NDArray[np.uint8]] = []
        path.write_bytes(b"begun")

    def append_data(self, image: NDArray[np.uint8]) -> None:
        self.frames.append(image.copy())

    def close(self) -> None:
        self.path.write_bytes(b"whole")


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[NDArray[np.uint8]]]:
    """A recorded session of twelve seconds, and its film."""
    folder, reels = tmp_path_factory.mktemp("filmed"), []

    def writer(path: Path, rate: float) -> Reel:
        reels.append(Reel(path, rate))
        return reels[-1]

    config = EnvConfig(max_seconds=12.0, world=WorldConfig(vehicles=40, pedestrians=40))
    engine = SessionEngine("brookside", config=config)
    engine.reset(seed=4)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(film_module, "video_writer", writer)
        with Film(folder / "v.mp4", RenderView.BOTH) as film:
            play_session(engine, policies, seed=4, folder=folder / "s", on_step=film)
    assert film.frames == len(reels[0].frames) and reels[0].rate == 10
    return folder / "s", reels[0].frames


@pytest.fixture
def reels(monkeypatch: pytest.MonkeyPatch) -> list[Reel]:
    made: list[Reel] = []

    def writer(path: Path, rate: float) -> Reel:
        made.append(Reel(path, rate))
        return made[-1]

    monkeypatch.setattr(sessions_module, "video_writer", writer)
    monkeypatch.setattr(sessions_module, "check_video", lambda path: None)  # without the extra, too
    return made


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.long
def test_a_film_has_ten_frames_in_a_second(filmed: tuple[Path, list[NDArray[np.uint8]]]) -> None:
    _, frames = filmed
    assert len(frames) == 121 and {frame.shape for frame in frames} == {(720, 1280, 3)}


@pytest.mark.long
def test_between_decisions_a_film_shows_what_the_record_shows(filmed: tuple[Path, list[NDArray[np.uint8]]]) -> None:
    """All bodies move, and the car follows its trajectory: the record of the session gives nearly the same pictures."""
    folder, frames = filmed
    again = RecordedPictures(Session.load(folder), load_town("brookside"), CameraConfig(width=LEFT, height=TOP))
    equal = []
    for number in range(10, 121, 4):
        picture = again.picture(3 * number).rgb
        assert picture is not None
        equal.append(float((picture == frames[number][:TOP, :LEFT]).all(axis=-1).mean()))
    assert np.mean(equal) > 0.99 and min(equal) > 0.95
    moves = [float((a[:TOP, :LEFT] != b[:TOP, :LEFT]).mean()) for a, b in itertools.pairwise(frames[100:])]
    assert np.median(moves) > 0.02, "the car drives"


@pytest.mark.long
def test_a_recorded_session_is_filmed_in_every_view(
    filmed: tuple[Path, list[NDArray[np.uint8]]], reels: list[Reel], tmp_path: Path
) -> None:
    folder, frames = filmed
    for view, shape in (("both", (720, 1280, 3)), ("camera", (720, 1280, 3)), ("map", (800, 1280, 3))):
        video = tmp_path / f"{view}.mp4"
        done = call("film", folder, "--out", video, "--view", view, "--fps", 1, "--json")
        assert done.exit_code == 0, done.output
        facts = json.loads(done.stdout)
        assert (facts["session"], facts["town"], facts["view"], facts["video"]) == ("s", "brookside", view, str(video))
        assert facts["pictures"] == len(reels[-1].frames) == 12 and reels[-1].rate == 1
        assert {frame.shape for frame in reels[-1].frames} == {shape}
        assert video.read_bytes() == b"whole" and [path.name for path in tmp_path.glob(".*")] == []
    both = reels[0].frames
    band = frames[30][TOP:, :LEFT], both[2][TOP:, :LEFT]  # at 3 s
    assert (band[0] == band[1]).all(axis=-1).mean() > 0.97, "the same subtitles"


def test_run_films_the_windscreen_unless_another_view_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made: list[Reel] = []
    monkeypatch.setattr(film_module, "video_writer", lambda path, rate: made.append(Reel(path, rate)) or made[-1])
    monkeypatch.setattr("dorothie_gym.cli.run.check_video", lambda path: None)
    for options, shape in (((), (720, 1280, 3)), (("--view", "map"), (800, 1280, 3))):
        done = call("run", "--max-seconds", 1, "--video", tmp_path / "v.mp4", "--json", *options)
        assert done.exit_code == 0, done.output
        assert made[-1].frames[-1].shape == shape and len(made[-1].frames) == 11
    assert all(view in call("run", "--view", "side").output for view in ("map", "camera", "both"))


def test_a_session_without_surroundings_cannot_be_filmed(reels: list[Reel], tmp_path: Path) -> None:
    session = release(tmp_path / "release")
    failed = call("film", session, "--out", tmp_path / "v.mp4", "--town", "brookside")
    assert failed.exit_code == 2 and "no recorded surroundings" in failed.output.replace("\n", " ")
    assert not (tmp_path / "v.mp4").exists() and not reels
