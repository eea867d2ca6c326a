"""Pictures of towns and sessions, drawn with pygame on surfaces that need no display."""

import os

# before the first import of pygame: its greeting would spoil machine-readable output
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

from dorothie_gym.rendering.map_sheet import town_picture
from dorothie_gym.rendering.street_names import Label
from dorothie_gym.rendering.town_map import MapPainter

__all__ = ["Label", "MapPainter", "town_picture"]
