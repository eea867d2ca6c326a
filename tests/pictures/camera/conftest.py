"""A session in a crowded town, and its scene."""

from __future__ import annotations

import pytest

from dorothie_gym.pictures.camera.session_pictures import scene_of
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig


@pytest.fixture(scope="module")
def engine() -> SessionEngine:
    engine = SessionEngine("brookside", config=EnvConfig(world=WorldConfig(vehicles=40, pedestrians=30)))
    engine.reset(seed=3)
    engine.session.world.step(150)
    return engine


@pytest.fixture(scope="module")
def scene(engine: SessionEngine) -> SessionScene:
    return scene_of(engine.town, engine.scenario)
