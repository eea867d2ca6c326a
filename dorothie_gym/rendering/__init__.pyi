"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .frames import HumanWindow as HumanWindow
from .map_sheet import town_picture as town_picture
from .role_scene import RoleView as RoleView
from .scene import Scene as Scene
from .scene import SpokenLine as SpokenLine
from .session_scene import scene_of as scene_of
from .session_scene import utterances_of as utterances_of
from .session_views import SessionRenderer as SessionRenderer
from .street_names import Label as Label
from .town_map import MapPainter as MapPainter
