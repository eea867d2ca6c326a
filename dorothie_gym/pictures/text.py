"""Text on pictures: straight lines, and text along a path."""

from __future__ import annotations

import importlib.util
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.palette import Colour

_FILES = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
_loaded: dict[tuple[int, bool], pygame.font.Font] = {}


@cache
def font_path(bold: bool = False) -> str | None:
    """Returns the font file, found without importing matplotlib; None (pygame's default font) if it is missing."""
    spec = importlib.util.find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return None
    path = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / _FILES[bold]
    return str(path) if path.is_file() else None


def font(size: int, bold: bool = False) -> pygame.font.Font:
    """Returns a `pygame.font.Font` of a height [px]; needs no display."""
    if not pygame.font.get_init():
        pygame.font.init()
    held = _loaded.get((size, bold))
    if held is not None and _alive(held):
        return held
    made = pygame.font.Font(font_path(bold), size)
    _loaded[size, bold] = made
    return made


def _alive(held: pygame.font.Font) -> bool:
    """Returns whether a font is still valid: `pygame.quit()` invalidates all earlier ones."""
    try:
        held.get_height()
    except pygame.error:
        return False
    return True


# --- Lines of text ---------------------------------------------------------------------------------------------------


@lru_cache(maxsize=512)
def words(text: str, size: int, colour: Colour, bold: bool = False) -> pygame.Surface:
    """Returns a surface with a line of text."""
    return font(size, bold).render(text, True, colour)


def set_along(surface: pygame.Surface, text: str, path: Array, size: int, colour: Colour, bold: bool = True) -> None:
    """Draws text along a path (n, 2) [px], its letters centred on the line.

    On a straight path the text is drawn as a whole, which keeps the exact letter spacing.
    """
    steps = np.diff(path, axis=0)
    angle = np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0]))
    stations = np.concatenate(([0.0], np.cumsum(pn.hypot(*steps.T))))
    if angle.max() - angle.min() < 0.03:
        _stamp(surface, words(text, size, colour, bold), path.mean(axis=0), float(angle.mean()))
        return
    face = font(size, bold)
    total = face.size(text)[0]
    start = (stations[-1] - total) / 2.0
    middles = stations[:-1] + np.diff(stations) / 2.0
    for k, letter in enumerate(text):
        s = start + (face.size(text[:k])[0] + face.size(text[: k + 1])[0]) / 2.0
        at = np.array([np.interp(s, stations, path[:, 0]), np.interp(s, stations, path[:, 1])])
        _stamp(surface, words(letter, size, colour, bold), at, float(np.interp(s, middles, angle)))


def _stamp(surface: pygame.Surface, piece: pygame.Surface, centre: Array, angle: float) -> None:
    """Draws a surface rotated clockwise by an angle [rad] around its centre."""
    turned = pygame.transform.rotozoom(piece, -float(np.degrees(angle)), 1.0) if abs(angle) > 1e-3 else piece
    surface.blit(turned, turned.get_rect(center=(round(float(centre[0])), round(float(centre[1])))))


def wrap(text: str, size: int, width: int, bold: bool = False) -> list[str]:
    """Wraps a text into lines no wider than a width [px]; longer words are split."""
    face = font(size, bold)
    lines: list[str] = []
    line = ""
    for word in text.split():
        while face.size(word)[0] > width and len(word) > 1:
            cut = next(k for k in range(len(word) - 1, 0, -1) if k == 1 or face.size(word[:k])[0] <= width)
            if line:
                lines.append(line)
                line = ""
            lines.append(word[:cut])
            word = word[cut:]
        longer = f"{line} {word}".strip()
        if face.size(longer)[0] <= width:
            line = longer
        else:
            lines.append(line)
            line = word
    return [*lines, line] if line else lines


def shorten(text: str, size: int, width: int, bold: bool = False) -> str:
    """Shortens a text with an ellipsis if it is wider than a width [px]."""
    face = font(size, bold)
    if face.size(text)[0] <= width:
        return text
    while text and face.size(text.rstrip() + "…")[0] > width:
        text = text[:-1]
    return text.rstrip() + "…"
