"""What is in the way: bodies on the path ahead, and bodies about to be there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.car.path import Path

LOOKAHEAD = 45.0
"""How far ahead the path is watched [m]."""

SIDE_MARGIN = 0.35
"""Room kept beside the car [m]."""

HEIGHT_MARGIN = 2.5
"""Things further above or below are on another road [m]."""

PREDICTIONS = (0.0, 0.5, 1.0, 1.5)
"""Times at which moving bodies are looked for on the path [s]."""

REACTION = 0.4
"""Time until brakes bite, kept in hand [s]."""

STANDSTILL_GAP = 2.5
"""Gap that is left to a body that stands [m]."""

ROADBLOCK_GAP = 10.0
"""Gap that is left to a prop [m]: room for a U-turn, which swings out 9 m ahead of the car's nose."""

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
    """Something ahead on the path: its gap to the car's nose [m] and its speed along the path [m/s]."""

    kind: ObjectClass
    gap: float
    speed: float = 0.0
    key: int = -1

    def safe_speed(self, friction: float = 1.0) -> float:
        """Speed from which the car can still stop behind it (Gipps 1981, with the leader braking as hard) [m/s]."""
        braking = HARD_BRAKING * friction
        margin = ROADBLOCK_GAP if self.kind is ObjectClass.STATIC else STANDSTILL_GAP
        room = max(self.gap - margin, 0.0)
        slack = braking * REACTION
        return -slack + math.sqrt(slack**2 + self.speed**2 + 2 * braking * room)


def bodies_ahead(
    path: Path, s: float, bodies: Sequence[Body], *, length: float, width: float, height: float
) -> Hazard | None:
    """The body on the path ahead, or soon to be there, that allows the least speed.

    Args:
        path: path of the car.
        s: where the car's middle is on it [m].
        bodies: all that is perceived.
        length: of the car [m].
        width: of the car [m].
        height: of the road under the car [m].
    """
    if not bodies:
        return None
    first, last = path.index_at(s), path.index_at(s + LOOKAHEAD) + 1
    line = path.points[first:last]  # (m, 2)
    if len(line) < 2:
        return None
    stations, headings = path.s[first:last], path.headings[first:last]
    normals = np.column_stack((-np.sin(headings), np.cos(headings)))  # to the right
    worst: Hazard | None = None
    for body in bodies:
        if abs(body.height - height) > HEIGHT_MARGIN:
            continue
        hazard = _on_line(body, line, stations, headings, normals, s, length, width)
        if hazard is not None and (worst is None or hazard.safe_speed() < worst.safe_speed()):
            worst = hazard
    return worst


def _on_line(
    body: Body, line: np.ndarray, stations: np.ndarray, headings: np.ndarray, normals: np.ndarray,
    s: float, length: float, width: float,
) -> Hazard | None:  # fmt: skip
    reach = LOOKAHEAD + 2.0 * abs(body.speed) + body.length
    if abs(body.x - line[0, 0]) > reach or abs(body.y - line[0, 1]) > reach:
        return None
    for time in PREDICTIONS if body.speed > 0.2 else PREDICTIONS[:1]:
        x = body.x + time * body.speed * np.cos(body.heading)
        y = body.y + time * body.speed * np.sin(body.heading)
        dx, dy = x - line[:, 0], y - line[:, 1]
        k = int(np.argmin(dx * dx + dy * dy))
        turn = body.heading - headings[k]
        if time > 0.0 and abs(np.sin(turn)) < 0.35:
            return None  # goes along the path: where it is now is what counts
        across = dx[k] * normals[k, 0] + dy[k] * normals[k, 1]
        along = dx[k] * np.cos(headings[k]) + dy[k] * np.sin(headings[k])
        half_width = (body.width * abs(np.cos(turn)) + body.length * abs(np.sin(turn))) / 2
        half_length = (body.length * abs(np.cos(turn)) + body.width * abs(np.sin(turn))) / 2
        ends = k == 0 or k == len(line) - 1
        if abs(across) > width / 2 + half_width + SIDE_MARGIN or (ends and abs(along) > half_length + 1.0):
            continue
        gap = float(stations[k] - s) + (along if ends else 0.0) - length / 2 - half_length
        if gap < -length / 2 - half_length:
            continue  # behind the car's middle
        speed = max(body.speed * float(np.cos(turn)), 0.0) if time == 0.0 else 0.0
        return Hazard(kind=body.kind, gap=gap, speed=speed, key=body.key)
    return None
