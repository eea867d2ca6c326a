"""The 24 phenomena that talk between people and cars has, each found by a query over acts, texts and events."""

from dorothie_gym.sessions.statistics.phenomena.catalogue import PHENOMENA
from dorothie_gym.sessions.statistics.phenomena.query import Finding, Phenomenon
from dorothie_gym.sessions.statistics.phenomena.talk import Talk, Turn

__all__ = ["PHENOMENA", "Finding", "Phenomenon", "Talk", "Turn"]
