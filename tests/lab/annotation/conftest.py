"""Chromium, and a session with sound, for the tests of the tool in the browser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import EventType, Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.support.audio import encode_flac
from tests.chromium import chromium


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium("--autoplay-policy=no-user-gesture-required") as launched:
        yield launched


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Session of 40 s in brookside, with tones of half a second as audio of its spans where FLAC can be written."""
    folder = tmp_path_factory.mktemp("recorded")
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=40.0))
    engine.reset(seed=7)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=7, folder=folder / "plain")
    recorded = Session.load(folder / "plain")
    if find_spec("soundfile") is None:
        return recorded
    tone = encode_flac((0.2 * np.sin(np.arange(8000) / 5.0)).astype(np.float32))
    events, files = [], {}
    for k, event in enumerate(recorded.events):
        if event.type is EventType.DIALOGUE_MOVE:
            name = f"utterance_{k}_0.flac"
            (folder / name).write_bytes(tone)
            files[name] = folder / name
            event = replace(event, data={**event.data, "audio": name})
        events.append(event)
    return replace(recorded, events=tuple(events), audio=files)


@pytest.fixture
def room(browser: Any, session: Session, tmp_path: Path) -> Iterator[Any]:
    from tests.lab.annotation.people import Room  # needs the extra console
    from tests.lab.annotation.serving import Served

    session.save(tmp_path / "corpus" / "one")
    with Served(tmp_path / "corpus") as served:
        made = Room(browser, served, session)
        yield made
        for page in made.pages:
            page.context.close()
    assert not made.errors
