"""A short spoken session."""

from __future__ import annotations

from pathlib import Path

from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.policies import ALL_SCRIPTED
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig


def spoken_session(folder: Path, seed: int = 5, seconds: float = 40.0) -> Path:
    """Records a spoken session of the scripted roles in brookside, without traffic; returns its folder."""
    config = EnvConfig(channel=ChannelKind.SPEECH, max_seconds=seconds, world=WorldConfig(vehicles=0, pedestrians=0))
    engine = SessionEngine("brookside", config=config)
    policies = {role: player.make(role, engine.limits) for role, player in ALL_SCRIPTED.items()}
    play_session(engine, policies, seed=seed, folder=folder)
    return folder
