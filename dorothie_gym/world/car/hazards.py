"""What is in the way: bodies on the path ahead, and bodies about to be there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.car.path import SPACING, Path
from dorothie_gym.world.town.model import Array

LOOKAHEAD = 45.0
"""How far ahead the path is watched [m]."""

SIDE_MARGIN = 0.35
"""Room kept beside the car [m]."""

MANOEUVRE_MARGIN = 0.75
"""The same in a lane switch or U-turn [m]: where the curvature of a U-turn changes sign the car leaves its line by up
to 0.67 m, because the bicycle's course cannot turn at once."""

HEIGHT_MARGIN = 2.5
"""Things further above or below are on another road [m]."""

PREDICTIONS = (0.0, 0.5, 1.0, 1.5)
"""Times at which moving bodies are looked for on the path [s]."""

CROSSING = 0.35
"""Sine of the angle to the path from which on a moving body counts as crossing it."""

REACTION = 0.4
"""Time until brakes bite, kept in hand [s]."""

STANDSTILL_GAP = 2.5
"""Gap that is left to a body that stands [m]."""

ROADBLOCK_GAP = 12.5
"""Gap that is left to a prop [m]: room for a U-turn (`path.U_TURN_REACH` from the car's middle)."""

LINE_GAP = 1.5
"""Gap that is left to the line before a junction [m]."""

TIGHT_GAP = 1.0
"""Gap that is left to what stands, while the car turns or switches lanes [m]."""

HARD_BRAKING = 4.0
"""Deceleration that the safe speed counts on [m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A thing that can be hit, as perceived.

    Attributes:
        key: tells it apart from others, the same over time.
        kind: its object class.
        x: position of its middle [m]; `y` likewise.
        heading: [rad].
        length: [m].
        width: [m].
        speed: along its heading [m/s].
        height: of the road it is on [m].
    """

    key: int
    kind: ObjectClass
    x: float
    y: float
    heading: float
    length: float
    width: float
    speed: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """Something ahead on the path: its gap to the car's nose [m] and its speed along the path [m/s].

    `tight` tells that the car is in the middle of a manoeuvre, in which it goes up to things more closely; `line` that
    the gap is that to the line before a junction, and `kind` is what holds the car there.
    """

    kind: ObjectClass
    gap: float
    speed: float = 0.0
    key: int = -1
    tight: bool = False
    line: bool = False

    def safe_speed(self, friction: float = 1.0) -> float:
        """Speed from which the car can still stop behind it (Gipps 1981, with the leader braking as hard) [m/s]."""
        braking = HARD_BRAKING * friction
        slack = braking * REACTION
        return -slack + math.sqrt(slack**2 + self.speed**2 + 2 * braking * self._room)

    def braking(self, speed: float) -> float:
        """Deceleration that stops the car behind it from a speed [m/s], or slows it to the same speed [m/s^2]."""
        return max(speed**2 - self.speed**2, 0.0) / (2 * max(self._room, 0.05))

    @property
    def _room(self) -> float:
        """Way that is left to the place where the car is to stop [m]."""
        if self.line:
            margin = LINE_GAP
        elif self.tight and self.speed < 0.5:
            margin = TIGHT_GAP
        else:
            margin = ROADBLOCK_GAP if self.kind is ObjectClass.STATIC else STANDSTILL_GAP
        return max(self.gap - margin, 0.0)


def bodies_ahead(
    path: Path, s: float, bodies: Sequence[Body], *, length: float, width: float, speed: float = 0.0
) -> Hazard | None:
    """The body on the path ahead, or soon to be there, that allows the least speed.

    Args:
        path: path of the car.
        s: where the car's middle is on it [m].
        bodies: all that is perceived.
        length: of the car [m].
        width: of the car [m].
        speed: of the car [m/s]: the faster it is, the farther it looks.
    """
    if not bodies:
        return None
    tight = bool(path.manoeuvre[path.index_at(s)])
    ahead = _Ahead.of(path, s, max(LOOKAHEAD, speed * REACTION + speed**2 / (2 * HARD_BRAKING) + ROADBLOCK_GAP))
    if len(ahead.stations) < 2:
        return None
    worst: Hazard | None = None
    for body in bodies:
        hazard = ahead.meet(body, length=length, width=width, tight=tight)
        if hazard is not None and (worst is None or hazard.safe_speed() < worst.safe_speed()):
            worst = hazard
    return worst


@dataclass(frozen=True, eq=False)
class _Ahead:
    """The stretch of path that is watched: points (m, 2), their distance from the car's middle, heights, directions."""

    points: Array
    stations: Array
    heights: Array
    headings: Array
    cosines: Array
    sines: Array

    @classmethod
    def of(cls, path: Path, s: float, reach: float) -> _Ahead:
        cut = slice(path.index_at(s), path.index_at(s + reach) + 1)
        headings = path.headings[cut]
        return cls(path.points[cut], path.s[cut] - s, path.heights[cut], headings, np.cos(headings), np.sin(headings))

    def meet(self, body: Body, *, length: float, width: float, tight: bool) -> Hazard | None:
        """The first place of the path where the car would touch a body, now or where it is heading."""
        reach = float(self.stations[-1]) + 2.0 * abs(body.speed) + body.length + length
        if abs(body.x - self.points[0, 0]) > reach or abs(body.y - self.points[0, 1]) > reach:
            return None
        turn = body.heading - self.headings
        parallel, square = np.abs(np.cos(turn)), np.abs(np.sin(turn))
        margin = MANOEUVRE_MARGIN if tight else SIDE_MARGIN
        half_width = (body.width * parallel + body.length * square) / 2 + width / 2 + margin  # (m,)
        half_length = (body.length * parallel + body.width * square) / 2  # (m,)
        level = np.abs(self.heights - body.height) <= HEIGHT_MARGIN
        for time in PREDICTIONS if body.speed > 0.2 else PREDICTIONS[:1]:
            dx = body.x + time * body.speed * math.cos(body.heading) - self.points[:, 0]
            dy = body.y + time * body.speed * math.sin(body.heading) - self.points[:, 1]
            across = np.abs(dy * self.cosines - dx * self.sines)
            along = dx * self.cosines + dy * self.sines
            touching = (across <= half_width) & (np.abs(along) <= half_length + SPACING) & level
            if time > 0.0:
                touching &= square >= CROSSING  # who goes along the path is where it is now
            if not touching.any():
                continue
            k = int(np.argmax(touching))
            gap = float(self.stations[k] + along[k] - half_length[k]) - length / 2
            speed = max(body.speed * math.cos(float(turn[k])), 0.0) if time == 0.0 else 0.0
            return Hazard(kind=body.kind, gap=gap, speed=speed, key=body.key, tight=tight)
        return None
