"""`Town-v0`: a plain highway-env environment in a town, without roles, dialogue or tasks."""

from __future__ import annotations

from dorothie_gym.sim.town_env import TownEnv

__all__ = ["TownEnv"]
