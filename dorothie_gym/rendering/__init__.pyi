"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .map_sheet import town_picture as town_picture
from .street_names import Label as Label
from .town_map import MapPainter as MapPainter
