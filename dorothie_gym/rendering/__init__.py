"""Pictures of towns, drawn with pygame on surfaces that need no display."""

import os

# Before anybody imports pygame: its greeting on standard output would spoil what commands print for programs.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

from dorothie_gym.rendering.map_sheet import town_picture  # noqa: E402
from dorothie_gym.rendering.street_names import Label  # noqa: E402
from dorothie_gym.rendering.town_map import MapPainter  # noqa: E402

__all__ = ["Label", "MapPainter", "town_picture"]
