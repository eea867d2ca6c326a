"""Subtitles under the windscreen: the current utterance, and dimmed the previous ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.ontology.roles import Role
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.text import shorten, wrap
from dorothie_gym.pictures.views.panel import Pen
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.palette import Colour
    from dorothie_gym.pictures.views.scene import Scene, SpokenLine

LINGER = 2.5
"""Time for which a line stays bright after it was heard [s]: long enough to read its end."""

_PAD = 24
_TYPE, _ROW, _GAP = 19, 25, 9  # [px]
_NAME_TYPE, _NAME_WIDTH = 14, 104  # [px]
_MOST_ROWS = 3  # rows of a line
_DIMMED = 0.5
_SPEAKERS: dict[Role, tuple[str, Colour]] = {
    Role.PARTICIPANT: ("Participant", palette.SUBTITLE_PARTICIPANT),
    Role.CO_WIZARD: ("Co-Wizard", palette.SUBTITLE_CO_WIZARD),
    Role.AD_WIZARD: ("Ad-Wizard", palette.SUBTITLE_AD_WIZARD),
    Role.AGENT: ("Car", palette.SUBTITLE_CAR),
}


class Subtitles:
    """Band of subtitles.

    Attributes:
        size: width and height [px].
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._held: tuple[object, pygame.Surface] | None = None

    def draw(self, scene: Scene) -> pygame.Surface:
        """Returns a surface with the last lines that fit, the newest at the bottom."""
        lines = shown_lines(scene)
        if self._held is None or self._held[0] != lines:
            pen = Pen(self.size, palette.SUBTITLE_GROUND)
            self._write(pen, lines)
            self._held = lines, pygame.transform.smoothscale(pen.surface, self.size)
        return self._held[1]

    def _write(self, pen: Pen, lines: list[tuple[SpokenLine, bool]]) -> None:
        left, room = _PAD + _NAME_WIDTH, self.size[0] - 2 * _PAD - _NAME_WIDTH
        bottom = self.size[1] - 14.0
        for line, bright in reversed(lines):
            rows = wrap(line.text, _TYPE, room)
            if len(rows) > _MOST_ROWS:
                rows = [*rows[: _MOST_ROWS - 1], shorten(" ".join(rows[_MOST_ROWS - 1 :]), _TYPE, room)]
            top = bottom - _ROW * len(rows)
            if top < 8.0:
                return
            name, ink = _SPEAKERS[line.speaker]
            if not bright:
                ink = _dimmed(ink)
            pen.text(name, left - 14, top + _ROW / 2, _NAME_TYPE, ink, align=1.0)
            for k, row in enumerate(rows):
                pen.text(row, left, top + _ROW * (k + 0.5), _TYPE, ink)
            bottom = top - _GAP


def shown_lines(scene: Scene) -> list[tuple[SpokenLine, bool]]:
    """Returns the lines of a scene by their start, and whether each is being spoken or has just been heard."""
    known = [(line, scene.time <= line.time + LINGER) for line in (*scene.utterances[-6:], *scene.speaking)]
    return sorted(known, key=lambda each: each[0].time if each[0].start is None else each[0].start)


def _dimmed(ink: Colour) -> Colour:
    red, green, blue = (
        round(low + _DIMMED * (high - low)) for low, high in zip(palette.SUBTITLE_GROUND, ink, strict=True)
    )
    return red, green, blue
