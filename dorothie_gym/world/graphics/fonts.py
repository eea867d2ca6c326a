"""The one typeface of all pictures: DejaVu Sans, as matplotlib (which highway-env brings along) ships it."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path
from typing import Any

_FILES = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
_loaded: dict[tuple[int, bool], Any] = {}


@cache
def font_path(bold: bool = False) -> str | None:
    """File of the typeface, found without importing matplotlib; None (pygame's own font) where it is not there."""
    spec = importlib.util.find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return None
    path = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / _FILES[bold]
    return str(path) if path.is_file() else None


def font(size: int, bold: bool = False) -> Any:
    """A `pygame.font.Font` of this height [px]. Needs no display."""
    import pygame

    if not pygame.font.get_init():
        pygame.font.init()
    held = _loaded.get((size, bold))
    if held is not None and _alive(held):
        return held
    made = pygame.font.Font(font_path(bold), size)
    _loaded[size, bold] = made
    return made


def _alive(held: Any) -> bool:
    """Whether a font may still be used: `pygame.quit()`, which others may call, kills all that were made before."""
    import pygame

    try:
        held.get_height()
    except pygame.error:
        return False
    return True
