"""Views of a session: its map, the windscreen of the car, or both side by side with the dialogue as subtitles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.views.aerial import AerialView
from dorothie_gym.pictures.views.frames import SceneRenderer
from dorothie_gym.pictures.views.panel import Panel
from dorothie_gym.pictures.views.subtitles import Subtitles
from dorothie_gym.session.config import RenderView
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.views.scene import Scene

_SIZE = 1280, 720
_WINDSCREEN = 832, 540  # of `RenderView.BOTH`; the subtitles are below
_MAP_HEIGHT = 440  # the panel is below


class SessionRenderer:
    """Draws one view of sessions; no display is needed.

    Attributes:
        view: the view.
        windscreen: width and height of the picture that `draw` needs [px]; None for a view without one.
    """

    def __init__(self, view: RenderView) -> None:
        self.view = view
        sizes = {RenderView.MAP: None, RenderView.CAMERA: _SIZE, RenderView.BOTH: _WINDSCREEN}
        self.windscreen: tuple[int, int] | None = sizes[view]
        if view is RenderView.MAP:
            self._map = SceneRenderer()
        elif view is RenderView.BOTH:
            width, below = _SIZE[0] - _WINDSCREEN[0], _SIZE[1] - _MAP_HEIGHT
            self._aerial = AerialView((width, _MAP_HEIGHT), goals_only=True)
            self._panel = Panel((width, below), talk=False)
            self._subtitles = Subtitles((_WINDSCREEN[0], _SIZE[1] - _WINDSCREEN[1]))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames [px]."""
        return self._map.size if self.view is RenderView.MAP else _SIZE

    def draw(self, scene: Scene, picture: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Returns the frame (height, width, 3) of a scene.

        Args:
            scene: scene with the map and the dialogue.
            picture: picture through the windscreen (h, w, 3), of the size `windscreen`.

        Raises:
            ValueError: there is no such picture, and the view has a windscreen.
        """
        if self.view is RenderView.MAP:
            return self._map.draw(scene)
        width, height = self.windscreen or _SIZE
        if picture is None or picture.shape != (height, width, 3):
            shape = None if picture is None else picture.shape
            raise ValueError(f"picture has shape {shape}; the view {self.view} needs {(height, width, 3)}")
        return picture if self.view is RenderView.CAMERA else self._side_by_side(scene, picture)

    def _side_by_side(self, scene: Scene, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        left, top = _WINDSCREEN
        frame = np.empty((_SIZE[1], _SIZE[0], 3), dtype=np.uint8)
        frame[:top, :left] = picture
        frame[top:, :left] = _pixels(self._subtitles.draw(scene))
        frame[:_MAP_HEIGHT, left:] = _pixels(self._aerial.draw(scene, follow=True))
        frame[_MAP_HEIGHT:, left:] = _pixels(self._panel.draw(scene))
        frame[:, left : left + 2] = palette.SUBTITLE_GROUND
        return frame


def _pixels(surface: pygame.Surface) -> NDArray[np.uint8]:
    """Returns the pixels of a surface (height, width, 3)."""
    return np.asarray(pygame.surfarray.array3d(surface).swapaxes(0, 1), dtype=np.uint8)
