"""Pictures through the windscreen as JPEG: those that observations hold under `camera`, drawn when a seat looks."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from PIL import Image

from dorothie_gym.pictures.camera.session_pictures import windscreen_camera

if TYPE_CHECKING:
    from dorothie_gym.lab.console.config import ConsoleConfig
    from dorothie_gym.pictures.camera.session_camera import SessionCamera
    from dorothie_gym.session.live_session import LiveSession


class Windscreen:
    """Camera on the car of a session; the first picture builds the scene of the town.

    Args:
        config: size and quality of the pictures.
    """

    def __init__(self, config: ConsoleConfig) -> None:
        self._config = config
        self._session: LiveSession | None = None
        self._camera: SessionCamera | None = None

    def prepare(self, session: LiveSession) -> None:
        """Builds the scene of a session, which takes seconds if it is not in the cache."""
        camera = windscreen_camera(session.world.town, session.scenario, session.config, self._config.picture_size)
        self._session, self._camera = session, camera

    def is_ready(self, session: LiveSession) -> bool:
        """Returns whether the scene of a session is built."""
        return self._session is session and self._camera is not None

    def picture(self, session: LiveSession) -> bytes:
        """Returns the picture at the current decision of the session that was prepared, as JPEG."""
        assert self._camera is not None
        rgb = self._camera.render(session.world).rgb
        assert rgb is not None
        file = io.BytesIO()
        Image.fromarray(rgb).save(file, format="JPEG", quality=self._config.picture_quality)
        return file.getvalue()
