"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .recorded_pictures import RecordedPictures as RecordedPictures
from .session_camera import SessionCamera as SessionCamera
from .session_pictures import camera_of as camera_of
from .session_pictures import windscreen_camera as windscreen_camera
