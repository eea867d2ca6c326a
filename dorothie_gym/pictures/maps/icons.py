"""Icons: lights, stop and yield signs, and the pins of landmark sites."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.maps.town import LightColour
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.text import font
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.palette import Colour

ICON_SUPERSAMPLING = 4  # supersampling factor
_LAMPS = (
    (LightColour.RED, palette.LIGHT_RED),
    (LightColour.YELLOW, palette.LIGHT_AMBER),
    (LightColour.GREEN, palette.LIGHT_GREEN),
)


def lamp_colour(shown: LightColour) -> Colour:
    """Returns the colour of a lamp."""
    return dict(_LAMPS)[shown]


@lru_cache(maxsize=64)
def sign_icon(kind: SignalKind, size: int, shown: LightColour | None = None) -> pygame.Surface:
    """Returns a surface with a light or sign of a height [px]; a light without a colour has all lamps on.

    Raises:
        KeyError: there is no icon of this kind.
    """
    return {
        SignalKind.TRAFFIC_LIGHT: lambda: _light(size, shown),
        SignalKind.STOP: lambda: _stop(size),
        SignalKind.YIELD: lambda: _yield(size),
    }[kind]()


def _light(size: int, shown: LightColour | None) -> pygame.Surface:
    high, wide = size * ICON_SUPERSAMPLING, round(0.5 * size) * ICON_SUPERSAMPLING
    fine = pygame.Surface((wide, high), pygame.SRCALPHA, 32)
    rim = max(1, round(0.045 * high))
    pygame.draw.rect(fine, palette.LIGHT_RIM, fine.get_rect(), border_radius=wide // 3)
    pygame.draw.rect(fine, palette.LIGHT_BODY, fine.get_rect().inflate(-2 * rim, -2 * rim), border_radius=wide // 4)
    for k, (colour, ink) in enumerate(_LAMPS):
        lit = shown is None or shown is colour
        centre = (wide / 2.0, high * (0.2 + 0.3 * k))
        pygame.draw.circle(fine, ink if lit else palette.LIGHT_OFF, centre, 0.125 * high)
    return _smooth(fine)


def _stop(size: int) -> pygame.Surface:
    side = size * ICON_SUPERSAMPLING
    fine = pygame.Surface((side, side), pygame.SRCALPHA, 32)
    for radius, ink in ((0.5, palette.SIGN_WHITE), (0.44, palette.SIGN_RED)):
        pygame.draw.polygon(fine, ink, _regular(8, side / 2.0, radius * side / pn.cos(np.pi / 8), np.pi / 8).tolist())
    text = font(max(6, round(0.27 * side)), bold=True).render("STOP", True, palette.SIGN_WHITE)
    fine.blit(text, text.get_rect(center=(side // 2, side // 2)))
    return _smooth(fine)


def _yield(size: int) -> pygame.Surface:
    side = size * ICON_SUPERSAMPLING
    fine = pygame.Surface((side, side), pygame.SRCALPHA, 32)
    middle = np.array([side / 2.0, 0.36 * side])
    for radius, ink in ((0.6, palette.SIGN_WHITE), (0.53, palette.SIGN_RED), (0.28, palette.SIGN_WHITE)):
        corners = middle + radius * side * np.array([[-0.866, -0.5], [0.866, -0.5], [0.0, 1.0]])
        pygame.draw.polygon(fine, ink, corners.tolist())
    return _smooth(fine)


@lru_cache(maxsize=256)
def pin_icon(text: str, radius: int, bearing: int) -> pygame.Surface:
    """Returns a pin with a short text, its head at the centre of the surface and its tip at a bearing [degrees].

    Args:
        text: text on it, upright.
        radius: radius of its head [px].
        bearing: direction of the tip, clockwise from the right.
    """
    r = radius * ICON_SUPERSAMPLING
    side = round(4.2 * r)
    fine = pygame.Surface((side, side), pygame.SRCALPHA, 32)
    middle = np.array([side / 2.0, side / 2.0])
    turn = np.radians(bearing)
    tip = np.array([pn.cos(turn), pn.sin(turn)])
    across = np.array([-tip[1], tip[0]])
    for grow, ink in ((0.14 * r, palette.SIGN_WHITE), (0.0, palette.PIN)):
        body = np.stack((tip * (1.75 * r + 1.3 * grow), across * (r + grow) * 0.8, -across * (r + grow) * 0.8))
        body[1:] += tip * 0.55 * r
        pygame.draw.polygon(fine, ink, (middle + body).tolist())
        pygame.draw.circle(fine, ink, middle.tolist(), r + grow)
    size = round((1.2 if len(text) < 2 else 1.05) * r)
    letters = font(max(6, size), bold=True).render(text, True, palette.SIGN_WHITE)
    fine.blit(letters, letters.get_rect(center=(side // 2, side // 2)))
    return _smooth(fine)


def _regular(corners: int, middle: float, radius: float, turn: float) -> Array:
    angle = np.arange(corners) * 2.0 * np.pi / corners + turn
    return np.asarray(middle + radius * np.stack((pn.cos(angle), pn.sin(angle)), axis=-1))


def _smooth(fine: pygame.Surface) -> pygame.Surface:
    """Scales a supersampled surface down, with premultiplied colours for correct edges."""
    width, height = fine.get_size()
    return pygame.transform.smoothscale(
        fine.premul_alpha(), (width // ICON_SUPERSAMPLING, height // ICON_SUPERSAMPLING)
    )


def stamp(picture: pygame.Surface, icon: pygame.Surface, centre: Array) -> None:
    """Draws an icon centred on a pixel."""
    corner = (round(float(centre[0]) - icon.get_width() / 2.0), round(float(centre[1]) - icon.get_height() / 2.0))
    picture.blit(icon, corner, special_flags=pygame.BLEND_PREMULTIPLIED)
