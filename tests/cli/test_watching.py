"""Watching a session: its speed, its clock, its video."""

from __future__ import annotations

import io
import json
import time
from pathlib import Path

import pytest
from click.testing import Result
from rich.console import Console
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.cli.live import LiveShow, script_lines
from dorothie_gym.cli.live_film import Film
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.pictures.views.playback import Playback
from dorothie_gym.pictures.views.session_scene import scene_of
from dorothie_gym.policies import make_policy
from dorothie_gym.session.recording import EventType, Session
from dorothie_gym.session.session_engine import SessionEngine


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_speed_plays_at_a_multiple_of_real_time() -> None:
    call("run", "--max-seconds", 1, "--json")  # compiles
    begun = time.perf_counter()
    done = call("run", "--max-seconds", 12, "--speed", 8, "--json")
    assert time.perf_counter() - begun >= 1.4
    assert json.loads(done.stdout)["wall_seconds"] < 1.4, "waiting is not simulation"


def test_drawing_a_video_is_not_reported_as_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("imageio", reason="needs the extra 'video'")
    monkeypatch.setattr(Film, "_append_decision", lambda self, engine: time.sleep(0.1))
    done = call("run", "--max-seconds", 10, "--video", "v.mp4", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["wall_seconds"] < 2.0


def test_progress_of_the_video_is_shown_on_a_terminal() -> None:
    class Drawn:
        frames, seconds = 312, 61.0

    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    engine = SessionEngine("brookside", max_cycles=1)
    engine.reset(seed=3)
    show = LiveShow(console, Drawn())  # type: ignore[arg-type]  # the two counts of a film
    with show:
        show(engine)
    assert "video: 312 frames drawn in 1:01" in console.file.getvalue()  # type: ignore[attr-defined]  # a StringIO


def test_terminal_picture_and_playback_have_one_clock(tmp_path: Path) -> None:
    engine = SessionEngine("brookside")
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    printed: list[tuple[float, str]] = []

    def watch(engine: SessionEngine) -> None:
        if engine.session.world.time >= 60.0:
            engine.max_cycles = 1  # the session ends here
        events = [event for event in engine.last_events if event.type is EventType.DIALOGUE_MOVE]
        printed.extend((line.time, line.text) for line in script_lines(events, str))

    play_session(engine, policies, seed=7, folder=tmp_path / "s", on_step=watch)
    speakers = (Role.PARTICIPANT, Role.CO_WIZARD)
    drawn = [line for line in scene_of(engine.session).utterances if line.speaker in speakers]
    session = Session.load(tmp_path / "s")
    playback = Playback(session, engine.town)
    replayed = [line for line in playback.scene(playback.last_frame).utterances if line.speaker in speakers]
    assert len(printed) > 3
    assert sorted((round(line.time, 2), line.text) for line in drawn) == sorted(
        (round(line.time, 2), line.text) for line in replayed
    )
    assert {round(line.time, 2) for line in drawn} == {round(at, 2) for at, _ in printed}


def test_playback_names_landmarks_like_the_session(tmp_path: Path) -> None:
    engine = SessionEngine("brookside")
    policies = {role: make_policy("silent", role, engine.limits) for role in AGENT_ROLES}
    engine.max_cycles = 2
    play_session(engine, policies, seed=7, folder=tmp_path / "s")
    names = [pin.label for pin in scene_of(engine.session).landmarks]
    assert "7-Eleven" in names
    assert [pin.label for pin in Playback(Session.load(tmp_path / "s"), engine.town).scene(0).landmarks] == names
