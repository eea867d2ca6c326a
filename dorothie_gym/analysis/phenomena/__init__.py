"""The 24 phenomena of dialogue between people and cars, each found by a query over acts, texts and events."""

from dorothie_gym.analysis.phenomena.catalogue import PHENOMENA
from dorothie_gym.analysis.phenomena.dialogue_view import DialogueView, Occurrence, Phenomenon, Turn

__all__ = ["PHENOMENA", "DialogueView", "Occurrence", "Phenomenon", "Turn"]
