from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive import read_session
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.pictures.views.playback import Playback
from dorothie_gym.pictures.views.scene import Scene
from dorothie_gym.pictures.views.session_scene import scene_of
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from tests.archive.sdn.builders import release

TOWN = load_town("brookside")


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> tuple[Session, dict[int, Scene]]:
    """A session, and the expected scenes by frame."""
    folder, scenes = tmp_path_factory.mktemp("seen") / "one", {}

    def look(env: DuoWizardEnv) -> None:
        scenes[env.session.world.frame] = scene_of(env.session)

    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=60.0))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    play_session(env, policies, seed=2, folder=folder, on_step=look)
    return Session.load(folder), scenes


def test_playback_shows_what_was_visible(seen: tuple[Session, dict[int, Scene]]) -> None:
    session, scenes = seen
    playback = Playback(session, TOWN)
    for frame in (15, 600, 1800):
        then, now = scenes[frame], playback.scene(frame)
        assert (now.car.x, now.car.y, now.car.heading, now.car.speed) == (
            then.car.x,
            then.car.y,
            then.car.heading,
            then.car.speed,
        )
        assert now.car.lights == then.car.lights and now.weather == then.weather and now.time == then.time
        assert {(a.x, a.y) for a in now.others} == {(a.x, a.y) for a in then.others}
        assert now.subgoals == then.subgoals
        assert {line.text for line in then.utterances} <= {line.text for line in now.utterances}
        assert [(pin.x, pin.y, pin.hidden) for pin in now.landmarks] == [
            (pin.x, pin.y, pin.hidden) for pin in then.landmarks
        ]
        assert np.allclose([pin.waypoint for pin in now.landmarks], [pin.waypoint for pin in then.landmarks])


def test_others_move_between_decisions(seen: tuple[Session, dict[int, Scene]]) -> None:
    playback = Playback(seen[0], TOWN)
    one, between, other = ({a.x for a in playback.scene(frame).others} for frame in (600, 607, 615))
    assert between - one - other


@pytest.mark.parametrize("rate", [0.5, 10.0, 30.0])
def test_playback_keeps_its_frame_rate(seen: tuple[Session, dict[int, Scene]], rate: float) -> None:
    playback = Playback(seen[0], TOWN)
    count = playback.count(rate)
    assert count == pytest.approx(60 * rate, abs=1)
    assert [round(s.time * 30) for s in _first(playback, rate, 3)] == [1, 1 + round(30 / rate), 1 + round(60 / rate)]


def _first(playback: Playback, rate: float, count: int) -> list[Scene]:
    scenes = playback.scenes(rate)
    return [next(scenes) for _ in range(count)]


def test_sdn_session_is_shown_over_a_town(tmp_path: Path) -> None:
    session = read_session(release(tmp_path / "release"))
    scene = Playback(session, TOWN).scene(600)
    assert scene.utterances and scene.landmarks and not scene.others
    row = session.trajectory[np.searchsorted(session.trajectory["frame"], 600)]
    assert (scene.car.x, scene.car.y) == (row["x"], row["y"])


def test_session_without_frames_shows_its_departure(seen: tuple[Session, dict[int, Scene]]) -> None:
    session = dataclasses.replace(seen[0], trajectory=seen[0].trajectory[:0], events=())
    lane, station = session.header.departure
    scene = Playback(session, TOWN).scene(0)
    assert (scene.car.x, scene.car.y) == pytest.approx(tuple(TOWN.lanes[lane].position(station)))
