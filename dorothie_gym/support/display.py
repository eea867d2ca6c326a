"""Check that there is a screen for the windows of `render_mode="human"`."""

from __future__ import annotations

import os
from typing import Final

from dorothie_gym.support.libraries import pygame

DRIVER_VARIABLE: Final = "SDL_VIDEODRIVER"
"""Environment variable with which a user chooses SDL's video driver."""

_WITHOUT_SCREEN: Final = ("offscreen", "dummy")
"""Video drivers of SDL that show nothing; SDL chooses one by itself where there is no display."""


def open_display() -> None:
    """Opens the display.

    Raises:
        RuntimeError: there is no display, and the user has not chosen a driver that shows nothing.
    """
    try:
        pygame.display.init()
    except pygame.error as error:
        raise _no_window(str(error)) from error
    driver = pygame.display.get_driver()
    if driver in _WITHOUT_SCREEN and not os.environ.get(DRIVER_VARIABLE):
        pygame.display.quit()
        raise _no_window("there is no display")


def _no_window(reason: str) -> RuntimeError:
    return RuntimeError(f'no window can be opened ({reason}); use render_mode="rgb_array"')
