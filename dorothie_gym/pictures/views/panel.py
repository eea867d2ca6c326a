"""Panel beside the view of a session: clock, subgoals, warnings and dialogue, as bubbles or as a transcript."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.ontology.roles import Role
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.text import shorten, words, wrap
from dorothie_gym.pictures.views.aerial import weather_summary
from dorothie_gym.pictures.views.scene import Scene, SpokenLine
from dorothie_gym.support.libraries import pygame

if TYPE_CHECKING:
    from dorothie_gym.pictures.palette import Colour

_PANEL_FINE = 2  # supersampling factor
_PAD = 20
_HEADER = 92
_BUBBLE_GAP = 8
_KMH_PER_MS = 3.6
_SPEAKERS: dict[Role, tuple[str, Colour, float]] = {
    # name, bubble colour, horizontal position: 0 left, 1 right, 0.5 centred
    Role.PARTICIPANT: ("Participant", palette.BUBBLE_PARTICIPANT, 0.0),
    Role.CO_WIZARD: ("Co-Wizard", palette.BUBBLE_CO_WIZARD, 1.0),
    Role.AD_WIZARD: ("Ad-Wizard", palette.BUBBLE_AD_WIZARD, 0.5),
    Role.AGENT: ("Car", palette.PANEL_EDGE, 0.5),
}


class Panel:
    """Panel; parts that do not change between frames are cached.

    Attributes:
        size: width and height [px].
        transcript: whether the dialogue is a transcript in columns instead of bubbles.
        talk: whether there is a dialogue.
    """

    def __init__(self, size: tuple[int, int], *, transcript: bool = False, talk: bool = True) -> None:
        self.size, self.transcript, self.talk = size, transcript, talk
        self._held: tuple[object, pygame.Surface] | None = None

    def draw(self, scene: Scene) -> pygame.Surface:
        """Returns a surface with the panel."""
        key = (
            tuple(scene.subgoals),
            tuple(scene.notes),
            tuple(scene.utterances),
            tuple(scene.exceptions),
            scene.caption,
        )
        if self._held is None or self._held[0] != key:
            pen = Pen(self.size)
            top = self._tasks(pen, scene, _HEADER)
            top = self._notes(pen, scene, top)
            if not self.talk:
                pass
            elif self.transcript:
                write_transcript(pen, scene, self.size, top)
            else:
                self._talk(pen, scene, top)
            self._held = (key, pygame.transform.smoothscale(pen.surface, self.size))
        body = self._held[1].copy()
        header = Pen((self.size[0], _HEADER - 4))
        self._header(header, scene)
        body.blit(pygame.transform.smoothscale(header.surface, (self.size[0], _HEADER - 4)), (0, 0))
        return body

    def _header(self, pen: Pen, scene: Scene) -> None:
        width = self.size[0]
        seconds = int(scene.time)
        clock = f"{seconds // 60:02d}:{seconds % 60:02d}"
        pen.text(clock, _PAD, 30, 27, palette.INK, bold=True)
        unit = pen.text("km/h", width - _PAD, 35, 14, palette.INK_SOFT, align=1.0)
        pen.text(f"{abs(scene.car.speed) * _KMH_PER_MS:.0f}", unit - 7, 30, 27, palette.INK, bold=True, align=1.0)
        sky = weather_summary(scene.weather)
        line = f"{scene.caption}  ·  {sky}" if scene.caption else sky
        room = width - 2 * _PAD
        if scene.car.lights:
            pen.text("lights on", width - _PAD, 66, 13, palette.STATE_INK["pending"], align=1.0)
            room -= 76
        pen.text(shorten(line, 13, room), _PAD, 66, 13, palette.INK_SOFT)
        pen.line(_PAD, 86, width - _PAD)

    def _tasks(self, pen: Pen, scene: Scene, top: int) -> int:
        """Draws the subgoals; returns their lower end [px]."""
        room = self.size[0] - 2 * _PAD - 28
        for text, state in scene.subgoals:
            lines = wrap(text, 14, room)
            if len(lines) > 2:
                lines = [lines[0], shorten(" ".join(lines[1:]), 14, room)]
            colour = palette.STATE[state]
            middle = top + 11
            pen.tick_box(_PAD + 8, middle, colour, state)
            ink = (
                palette.STATE_INK[state]
                if state in ("complete", "ongoing")
                else palette.INK_SOFT
                if state == "abandoned"
                else palette.INK
            )
            for line in lines:
                end = pen.text(line, _PAD + 28, top + 11, 14, ink)
                if state == "abandoned":
                    pen.strike(_PAD + 28, end, top + 12, ink)
                top += 19
            top += 7
        if scene.subgoals:
            pen.line(_PAD, top + 1, self.size[0] - _PAD)
            top += 10
        return top

    def _notes(self, pen: Pen, scene: Scene, top: int) -> int:
        """Draws the warnings; returns their lower end [px]."""
        for note in scene.notes:
            lines = wrap(note, 13, self.size[0] - 2 * _PAD - 24)
            height = 17 * len(lines) + 10
            pen.box(_PAD, top, self.size[0] - 2 * _PAD, height, palette.BUBBLE_AD_WIZARD, 7)
            for k, line in enumerate(lines):
                pen.text(line, _PAD + 12, top + 13 + 17 * k, 13, palette.NOTE, bold=True)
            top += height + 8
        return top

    def _talk(self, pen: Pen, scene: Scene, top: int) -> None:
        """Draws the dialogue, newest at the bottom, as far back as there is room."""
        bottom = self.size[1] - 14
        for line in reversed(spoken_and_done(scene)):
            bubble = _Bubble(line, self.size[0] - 2 * _PAD)
            if bottom - bubble.height < top:
                break
            bottom -= bubble.height
            bubble.draw(pen, bottom)
            bottom -= _BUBBLE_GAP


def spoken_and_done(scene: Scene) -> list[SpokenLine]:
    """Returns utterances and exceptions in order of time; exceptions have the numbers of their marks on the map."""
    lines = [
        SpokenLine(time=mark.time, speaker=Role.AD_WIZARD, text=f"[{number}] {mark.text}")
        for number, mark in enumerate(scene.exceptions, 1)
    ]
    return sorted([*scene.utterances, *lines], key=lambda line: line.time)


class _Bubble:
    """Layout of an utterance: speaker and time above the text, dialogue acts below."""

    def __init__(self, line: SpokenLine, room: int) -> None:
        self.name, self.colour, self.side = _SPEAKERS[line.speaker]
        self.line, self.room = line, room
        widest = int(room * (0.8 if self.side != 0.5 else 0.92)) - 24
        self.lines = wrap(line.text, 14, widest)
        self.acts = shorten(line.acts, 11, widest) if line.acts else ""
        self.head = f"{self.name}  {int(line.time) // 60}:{int(line.time) % 60:02d}"
        sizes = [words(text, 14, palette.INK).get_width() for text in self.lines]
        sizes.append(words(self.acts, 11, palette.INK).get_width() if self.acts else 0)
        sizes.append(words(self.head, 11, palette.INK).get_width())
        self.width = min(max(sizes) + 26, room)
        self.height = 22 + 19 * len(self.lines) + (17 if self.acts else 0) + 7

    def draw(self, pen: Pen, top: float) -> None:
        left = _PAD + (self.room - self.width) * self.side
        pen.box(left, top, self.width, self.height, self.colour, 11)
        pen.text(self.head, left + 12, top + 14, 11, palette.INK_SOFT)
        for k, text in enumerate(self.lines):
            pen.text(text, left + 12, top + 31 + 19 * k, 14, palette.INK)
        if self.acts:
            pen.text(self.acts, left + 12, top + self.height - 14, 11, palette.INK_SOFT)


class Pen:
    """Supersampled surface with coordinates in final pixels."""

    def __init__(self, size: tuple[int, int], ground: Colour = palette.PANEL) -> None:
        self.surface = pygame.Surface((size[0] * _PANEL_FINE, size[1] * _PANEL_FINE))
        self.surface.fill(ground)

    def text(
        self, text: str, x: float, middle: float, size: int, colour: Colour, bold: bool = False, align: float = 0.0
    ) -> float:
        """Draws a line of text; returns its right end, or its left end if right-aligned (1.0) [px]."""
        piece = words(text, size * _PANEL_FINE, colour, bold)
        left = x * _PANEL_FINE - align * piece.get_width()
        self.surface.blit(piece, (round(left), round(middle * _PANEL_FINE - piece.get_height() / 2)))
        return float((left + (1.0 - align) * piece.get_width()) / _PANEL_FINE)

    def box(self, x: float, y: float, width: float, height: float, colour: Colour, radius: int) -> None:
        """Fills a rounded box."""
        rect = pygame.Rect(
            round(x * _PANEL_FINE), round(y * _PANEL_FINE), round(width * _PANEL_FINE), round(height * _PANEL_FINE)
        )
        pygame.draw.rect(self.surface, colour, rect, border_radius=radius * _PANEL_FINE)

    def line(self, left: float, y: float, right: float) -> None:
        """Draws a thin horizontal line."""
        pygame.draw.rect(
            self.surface,
            palette.PANEL_EDGE,
            (left * _PANEL_FINE, y * _PANEL_FINE, (right - left) * _PANEL_FINE, _PANEL_FINE),
        )

    def strike(self, left: float, right: float, y: float, colour: Colour) -> None:
        """Strikes a line of text through."""
        pygame.draw.rect(
            self.surface, colour, (left * _PANEL_FINE, y * _PANEL_FINE, (right - left) * _PANEL_FINE, _PANEL_FINE)
        )

    def tick_box(self, x: float, y: float, colour: Colour, state: str) -> None:
        """Draws the mark of a subgoal: a ring, filled with a tick once complete."""
        centre = (x * _PANEL_FINE, y * _PANEL_FINE)
        if state in ("none", "pending", "abandoned"):
            pygame.draw.circle(self.surface, colour, centre, 8 * _PANEL_FINE, 2 * _PANEL_FINE)
            return
        pygame.draw.circle(self.surface, colour, centre, 8 * _PANEL_FINE)
        if state == "ongoing":
            pygame.draw.circle(self.surface, palette.PAPER, centre, 3 * _PANEL_FINE)
            return
        tick = [(x - 3.8, y + 0.2), (x - 1.1, y + 2.9), (x + 4.0, y - 2.8)]
        pygame.draw.lines(
            self.surface, palette.PAPER, False, [(a * _PANEL_FINE, b * _PANEL_FINE) for a, b in tick], 2 * _PANEL_FINE
        )


# --- Transcript -------------------------------------------------------------------------------------------------------

_ROW_TYPE = 12  # [px]
_ROW = 16  # [px] height of a line
_ENTRY_GAP = 3  # [px]
_TIME_WIDTH = 36  # [px]
_COLUMN_GAP = 22  # [px]
_NARROWEST_COLUMN = 300  # [px]
_INKS: dict[Role, Colour] = {
    Role.PARTICIPANT: palette.INK_PARTICIPANT,
    Role.CO_WIZARD: palette.INK_CO_WIZARD,
    Role.AD_WIZARD: palette.EXCEPTION,
    Role.AGENT: palette.INK_SOFT,
}


def write_transcript(pen: Pen, scene: Scene, size: tuple[int, int], top: float) -> None:
    """Writes utterances and exceptions in columns: all, or the last ones and the number of those left out.

    Args:
        pen: surface of the panel.
        scene: the scene.
        size: width and height of the panel [px].
        top: upper end of the columns [px].
    """
    left: float = _PAD
    for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
        left = pen.text(_SPEAKERS[role][0], left, top + 10, _ROW_TYPE, _INKS[role], bold=True) + 16
    pen.text("ring: start  ·  diamonds: exceptions", size[0] - _PAD, top + 10, 11, palette.INK_SOFT, align=1.0)
    top += 26
    lines, bottom, dropped = spoken_and_done(scene), size[1] - 12.0, 0
    most = max(1, (size[0] - 2 * _PAD + _COLUMN_GAP) // (_NARROWEST_COLUMN + _COLUMN_GAP))
    for count in range(1, most + 1):
        width = (size[0] - 2 * _PAD - (count - 1) * _COLUMN_GAP) // count
        entries = [(line, wrap(line.text, _ROW_TYPE, width - _TIME_WIDTH)) for line in lines]
        if (placed := _in_columns(entries, bottom, top, count, note=False)) is not None:
            break
    while placed is None:
        dropped += 1
        placed = _in_columns(entries[dropped:], bottom, top, most, note=True)
    if dropped:
        pen.text(f"{dropped} earlier lines left out", _PAD, top + 8, _ROW_TYPE, palette.INK_SOFT)
    for (line, rows), (column, y) in zip(entries[dropped:], placed, strict=True):
        x = _PAD + column * (width + _COLUMN_GAP)
        pen.text(f"{int(line.time) // 60}:{int(line.time) % 60:02d}", x + 28, y + 8, 11, palette.INK_SOFT, align=1.0)
        for k, row in enumerate(rows):
            pen.text(row, x + _TIME_WIDTH, y + 8 + k * _ROW, _ROW_TYPE, _INKS[line.speaker])


def _in_columns(
    entries: list[tuple[SpokenLine, list[str]]], bottom: float, top: float, columns: int, *, note: bool
) -> list[tuple[int, float]] | None:
    """Returns column and upper end [px] of each entry; None if they do not fit."""
    placed, column, y = [], 0, top + (_ROW + _ENTRY_GAP if note else 0)
    for _, rows in entries:
        height = len(rows) * _ROW
        if y + height > bottom:
            column, y = column + 1, top
            if column >= columns or y + height > bottom:
                return None
        placed.append((column, y))
        y += height + _ENTRY_GAP
    return placed
