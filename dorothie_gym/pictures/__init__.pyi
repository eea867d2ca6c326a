"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .camera.session_camera import SessionCamera as SessionCamera
from .camera.session_pictures import windscreen_camera as windscreen_camera
from .maps.map_sheet import town_picture as town_picture
from .maps.street_names import Label as Label
from .maps.town_map import MapPainter as MapPainter
from .views.frames import PICTURE_SIZE as PICTURE_SIZE
from .views.frames import HumanWindow as HumanWindow
from .views.frames import SceneRenderer as SceneRenderer
from .views.playback import Playback as Playback
from .views.role_scene import RoleView as RoleView
from .views.scene import Scene as Scene
from .views.scene import SpokenLine as SpokenLine
from .views.session_scene import scene_of as scene_of
from .views.session_scene import utterances_of as utterances_of
from .views.session_views import SessionRenderer as SessionRenderer
