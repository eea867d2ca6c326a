"""Frames of a session: aerial view on the left, subgoals and dialogue on the right."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology import Role
from dorothie_gym.rendering import palette
from dorothie_gym.rendering.aerial import AerialView, weather_summary
from dorothie_gym.rendering.palette import Colour
from dorothie_gym.rendering.scene import Scene, SpokenLine
from dorothie_gym.rendering.text import shorten, words, wrap

if TYPE_CHECKING:
    import pygame


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
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._held: tuple[object, pygame.Surface] | None = None

    def draw(self, scene: Scene) -> pygame.Surface:
        """Returns a surface with the panel."""
        import pygame

        key = (tuple(scene.subgoals), tuple(scene.notes), tuple(scene.utterances), scene.caption)
        if self._held is None or self._held[0] != key:
            pen = _Pen(self.size)
            top = self._tasks(pen, scene, _HEADER)
            top = self._notes(pen, scene, top)
            self._talk(pen, scene, top)
            self._held = (key, pygame.transform.smoothscale(pen.surface, self.size))
        body = self._held[1].copy()
        header = _Pen((self.size[0], _HEADER - 4))
        self._header(header, scene)
        body.blit(pygame.transform.smoothscale(header.surface, (self.size[0], _HEADER - 4)), (0, 0))
        return body

    def _header(self, pen: _Pen, scene: Scene) -> None:
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
            pen.text("lights on", width - _PAD, 66, 13, palette.STATE["pending"], align=1.0)
            room -= 76
        pen.text(shorten(line, 13, room), _PAD, 66, 13, palette.INK_SOFT)
        pen.line(_PAD, 86, width - _PAD)

    def _tasks(self, pen: _Pen, scene: Scene, top: int) -> int:
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
                colour
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

    def _notes(self, pen: _Pen, scene: Scene, top: int) -> int:
        """Draws the warnings; returns their lower end [px]."""
        for note in scene.notes:
            lines = wrap(note, 13, self.size[0] - 2 * _PAD - 24)
            height = 17 * len(lines) + 10
            pen.box(_PAD, top, self.size[0] - 2 * _PAD, height, palette.BUBBLE_AD_WIZARD, 7)
            for k, line in enumerate(lines):
                pen.text(line, _PAD + 12, top + 13 + 17 * k, 13, palette.NOTE, bold=True)
            top += height + 8
        return top

    def _talk(self, pen: _Pen, scene: Scene, top: int) -> None:
        """Draws the dialogue, newest at the bottom, as far back as there is room."""
        bottom = self.size[1] - 14
        for line in reversed(scene.utterances):
            bubble = _Bubble(line, self.size[0] - 2 * _PAD)
            if bottom - bubble.height < top:
                break
            bottom -= bubble.height
            bubble.draw(pen, bottom)
            bottom -= _BUBBLE_GAP


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

    def draw(self, pen: _Pen, top: float) -> None:
        left = _PAD + (self.room - self.width) * self.side
        pen.box(left, top, self.width, self.height, self.colour, 11)
        pen.text(self.head, left + 12, top + 14, 11, palette.INK_SOFT)
        for k, text in enumerate(self.lines):
            pen.text(text, left + 12, top + 31 + 19 * k, 14, palette.INK)
        if self.acts:
            pen.text(self.acts, left + 12, top + self.height - 14, 11, palette.INK_SOFT)


class _Pen:
    """Supersampled surface with coordinates in final pixels."""

    def __init__(self, size: tuple[int, int]) -> None:
        import pygame

        self.surface = pygame.Surface((size[0] * _PANEL_FINE, size[1] * _PANEL_FINE))
        self.surface.fill(palette.PANEL)

    def text(
        self, text: str, x: float, middle: float, size: int, colour: Colour, bold: bool = False, align: float = 0.0
    ) -> float:
        """Draws a line of text; returns its right end, or its left end if right-aligned (1.0) [px]."""
        piece = words(text, size * _PANEL_FINE, colour, bold)
        left = x * _PANEL_FINE - align * piece.get_width()
        self.surface.blit(piece, (round(left), round(middle * _PANEL_FINE - piece.get_height() / 2)))
        return float((left + (1.0 - align) * piece.get_width()) / _PANEL_FINE)

    def box(self, x: float, y: float, width: float, height: float, colour: Colour, radius: int) -> None:
        import pygame

        rect = pygame.Rect(
            round(x * _PANEL_FINE), round(y * _PANEL_FINE), round(width * _PANEL_FINE), round(height * _PANEL_FINE)
        )
        pygame.draw.rect(self.surface, colour, rect, border_radius=radius * _PANEL_FINE)

    def line(self, left: float, y: float, right: float) -> None:
        import pygame

        pygame.draw.rect(
            self.surface,
            palette.PANEL_EDGE,
            (left * _PANEL_FINE, y * _PANEL_FINE, (right - left) * _PANEL_FINE, _PANEL_FINE),
        )

    def strike(self, left: float, right: float, y: float, colour: Colour) -> None:
        import pygame

        pygame.draw.rect(
            self.surface, colour, (left * _PANEL_FINE, y * _PANEL_FINE, (right - left) * _PANEL_FINE, _PANEL_FINE)
        )

    def tick_box(self, x: float, y: float, colour: Colour, state: str) -> None:
        """Draws the mark of a subgoal: a ring, filled with a tick once complete."""
        import pygame

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


# --- Frames -----------------------------------------------------------------------------------------------------------

_SMALLEST_FRAME = (640, 400)


class SceneRenderer:
    """Draws scenes offscreen; no display is needed.

    Attributes:
        size: width and height of the frames [px].
    """

    def __init__(self, size: tuple[int, int] = (1280, 800)) -> None:
        """Allocates the views.

        Args:
            size: width and height [px].

        Raises:
            ValueError: the size is too small for a map and a panel.
        """
        if size[0] < _SMALLEST_FRAME[0] or size[1] < _SMALLEST_FRAME[1]:
            raise ValueError(f"size: {size} is smaller than {_SMALLEST_FRAME}")
        self.size = size
        panel_width = min(400, round(0.4 * size[0]))
        self._aerial = AerialView((size[0] - panel_width, size[1]))
        self._panel = Panel((panel_width, size[1]))

    def draw(self, scene: Scene, follow: bool = True) -> NDArray[np.uint8]:
        """Draws a scene.

        Args:
            scene: scene to show.
            follow: whether to show about 160 m around the car, north up, instead of the whole town.

        Returns:
            Pixels (height, width, 3) in 0..255.
        """
        import pygame

        pixels = pygame.surfarray.array3d(self._surface(scene, follow))  # (width, height, 3)
        return np.ascontiguousarray(pixels.swapaxes(0, 1))

    def save(self, scene: Scene, path: str | os.PathLike[str], follow: bool = False) -> None:
        """Writes a scene as a PNG file.

        Raises:
            FileNotFoundError: the folder of `path` does not exist.
        """
        import pygame

        target = Path(path)
        if not target.parent.is_dir():
            raise FileNotFoundError(f"{target}: the folder {target.parent} does not exist; make it first")
        pygame.image.save(self._surface(scene, follow), str(target), ".png")

    def _surface(self, scene: Scene, follow: bool) -> pygame.Surface:
        import pygame

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
        import pygame

        try:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
        except pygame.error as error:
            raise RuntimeError(f'no window can be opened ({error}); use render_mode="rgb_array"') from error
        pygame.display.set_caption(title)
        self._clock = pygame.time.Clock()
        self.closed = False

    def show(self, frame: NDArray[np.uint8], frames_per_second: float = 0.0) -> None:
        """Shows a frame (height, width, 3), limited to a frame rate [1/s] (0: no limit)."""
        import pygame

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
        import pygame

        if not self.closed:
            self.closed = True
            pygame.display.quit()
