"""Frames of a session: aerial view on the left, subgoals and dialogue on the right."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures import palette
from dorothie_gym.pictures.views.aerial import AerialView
from dorothie_gym.pictures.views.panel import Panel
from dorothie_gym.support.display import open_display
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.views.scene import Scene

PICTURE_SIZE = (1640, 900)
"""Width and height of the picture of a whole session with its transcript [px]."""

_SMALLEST_FRAME = (640, 400)


class SceneRenderer:
    """Draws scenes offscreen; no display is needed.

    Attributes:
        size: width and height of the frames [px].
    """

    def __init__(self, size: tuple[int, int] = (1280, 800), *, transcript: bool = False) -> None:
        """Allocates the views.

        Args:
            size: width and height [px].
            transcript: whether the panel has a transcript in columns, which holds more than bubbles.

        Raises:
            ValueError: the size is too small for a map and a panel.
        """
        if size[0] < _SMALLEST_FRAME[0] or size[1] < _SMALLEST_FRAME[1]:
            raise ValueError(f"size: {size} is smaller than {_SMALLEST_FRAME}")
        self.size = size
        panel_width = min(800 if transcript else 400, round((0.5 if transcript else 0.4) * size[0]))
        self._aerial = AerialView((size[0] - panel_width, size[1]))
        self._panel = Panel((panel_width, size[1]), transcript=transcript)

    def draw(self, scene: Scene, follow: bool = True) -> NDArray[np.uint8]:
        """Draws a scene.

        Args:
            scene: scene to show.
            follow: whether to show about 160 m around the car, north up, instead of the whole town.

        Returns:
            Pixels (height, width, 3) in 0..255.
        """
        pixels = pygame.surfarray.array3d(self._surface(scene, follow))  # (width, height, 3)
        return np.ascontiguousarray(pixels.swapaxes(0, 1))

    def save(self, scene: Scene, path: str | os.PathLike[str], follow: bool = False) -> None:
        """Writes a scene as a PNG file.

        Raises:
            FileNotFoundError: the folder of `path` does not exist.
        """
        target = Path(path)
        if not target.parent.is_dir():
            raise FileNotFoundError(f"{target}: the folder {target.parent} does not exist; make it first")
        pygame.image.save(self._surface(scene, follow), str(target), ".png")

    def _surface(self, scene: Scene, follow: bool) -> pygame.Surface:
        frame = pygame.Surface(self.size)
        view = self._aerial.draw(scene, follow)
        frame.blit(view, (0, 0))
        frame.blit(self._panel.draw(scene), (view.get_width(), 0))
        pygame.draw.rect(frame, palette.PANEL_EDGE, (view.get_width() - 1, 0, 2, self.size[1]))
        return frame


class HumanWindow:
    """Window on the screen that shows frames.

    Attributes:
        closed: whether the user has closed the window; further frames are then ignored.
    """

    def __init__(self, size: tuple[int, int] = (1280, 800), title: str = "dorothie_gym") -> None:
        """Opens the window.

        Raises:
            RuntimeError: there is no display.
        """
        open_display()
        try:
            self._screen = pygame.display.set_mode(size)
        except pygame.error as error:
            raise RuntimeError(f'no window can be opened ({error}); use render_mode="rgb_array"') from error
        pygame.display.set_caption(title)
        self._clock = pygame.time.Clock()
        self.closed = False

    def show(self, frame: NDArray[np.uint8], frames_per_second: float = 0.0) -> None:
        """Shows a frame (height, width, 3), limited to a frame rate [1/s] (0: no limit)."""
        if self.closed:
            return
        for event in pygame.event.get():
            if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE):
                self.close()
                return
        pygame.surfarray.blit_array(self._screen, frame.swapaxes(0, 1))
        pygame.display.flip()
        if frames_per_second > 0:
            self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Closes the window; may be called more than once."""
        if not self.closed:
            self.closed = True
            pygame.display.quit()
