"""The 24 phenomena of dialogue between people and cars, each found by a query over acts, texts and events."""

from dorothie_gym.analysis.phenomena.catalogue import PHENOMENA
from dorothie_gym.analysis.phenomena.dialogue_view import Finding, Phenomenon, Talk, Turn

__all__ = ["PHENOMENA", "Finding", "Phenomenon", "Talk", "Turn"]
