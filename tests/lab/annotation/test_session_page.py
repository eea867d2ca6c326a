"""What browsers get of a session: the car, bodies, pictures, sound."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dorothie_gym.archive import read_session
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.lab.annotation.session_page import PICTURE_SIZE, SessionPage
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import EventType, Session
from dorothie_gym.session.session_engine import SessionEngine
from tests.archive.sdn.builders import release
from tests.lab.annotation.builders import recorded


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Session of twelve seconds in brookside."""
    folder = tmp_path_factory.mktemp("recorded")
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=12.0))
    engine.reset(seed=7)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=7, folder=folder / "s")
    return Session.load(folder / "s")


@pytest.fixture(scope="module")
def page(session: Session) -> SessionPage:
    return SessionPage(session, SourceText.of(session))


def test_the_car_is_where_it_was_recorded(session: Session, page: SessionPage) -> None:
    poses = page.content()["poses"]
    rows = session.trajectory[::6]
    assert len(poses) == len(rows) and [pose[0] for pose in poses[:2]] == [0.03, 0.23]
    assert np.abs(np.array(poses)[:, 1] - rows["x"]).max() <= 0.006


def test_windows_of_bodies_hold_each_record_once(session: Session, page: SessionPage) -> None:
    found = [row for first in (0, 300, 600) for row in page.bodies(first)]
    table = session.scene.actors
    assert [round(30 * time) for time, _ in found] == table.frames.tolist()
    assert sum(len(bodies) for _, bodies in found) == len(table.rows)
    assert page.bodies(10**9) == []


def test_pictures_are_those_of_the_camera_at_the_frame(page: SessionPage) -> None:
    first, again, later = (np.asarray(Image.open(io.BytesIO(page.picture(k))), dtype=int) for k in (0, 0, 330))
    assert first.shape == (PICTURE_SIZE[1], PICTURE_SIZE[0], 3)
    assert np.array_equal(first, again) and np.abs(first - later).mean() > 1.0


def test_sessions_of_unknown_towns_have_neither_map_nor_pictures(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    page = SessionPage(one, text)
    assert page.town is None and page.content()["town"] is None and not page.content()["pictures"]
    with pytest.raises(SessionError, match="'crossing' is not known; give --maps"):
        page.picture(0)


def test_sound_is_served_by_the_names_of_the_record_only(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    (tmp_path / "a.flac").write_bytes(b"fLaC")
    events = [
        replace(event, data={**event.data, "audio": "a.flac"}) if event.type is EventType.DIALOGUE_MOVE else event
        for event in one.events
    ]
    page = SessionPage(replace(one, events=tuple(events), audio={"a.flac": tmp_path / "a.flac"}), text)
    assert page.content()["utterances"][1]["audio"] == ["a.flac"]
    assert page.audio("a.flac") == b"fLaC"
    for name in ("b.flac", "../s/session.json", ""):
        with pytest.raises(SessionError, match="has no audio of this name"):
            page.audio(name)


def test_recordings_of_sdn_are_found_beside_the_log(tmp_path: Path) -> None:
    release(tmp_path / "log")
    (tmp_path / "log" / "utterance").mkdir()
    (tmp_path / "secret.wav").write_bytes(b"no")
    session = read_session(tmp_path / "log")
    names = ["u_1.wav", "../../secret.wav", "/etc/passwd", "u_2.flac"]
    moves = iter(names)
    events = [
        replace(event, data={**event.data, "audio": next(moves, "none.wav")})
        if event.type is EventType.DIALOGUE_MOVE
        else event
        for event in session.events
    ]
    for name in ("u_1.wav", "u_2.flac"):
        (tmp_path / "log" / "utterance" / name).write_bytes(name.encode())
    session = replace(session, events=tuple(events))
    page = SessionPage(session, SourceText.of(session), tmp_path / "log")
    found = {name for row in page.content()["utterances"] for name in row["audio"]}
    assert found == {"u_1.wav", "u_2.flac"} and page.audio("u_1.wav") == b"u_1.wav"
    with pytest.raises(SessionError, match="no audio"):
        page.audio("../../secret.wav")


def test_the_events_of_the_page_are_words(page: SessionPage) -> None:
    events = page.content()["events"]
    assert events and all(words and kind != EventType.DIALOGUE_MOVE for _, kind, _, words in events)
