"""Pictures of towns, drawn with pygame on surfaces that need no display."""

from dorothie_gym.world.graphics.labels import Label
from dorothie_gym.world.graphics.map import MapPainter, town_picture

__all__ = ["Label", "MapPainter", "town_picture"]
