"""Dashboard in the lowest rows of the pictures of the navigation environments: instruction, distances and speeds.

It shows values of the vector observations that a camera cannot see. Like the indicators of Gymnasium's CarRacing
it is a part of the picture, drawn at `HEIGHT` x `WIDTH` pixels and enlarged to the size of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.support import portable_math as pm

WIDTH, HEIGHT = 84, 12
"""Size of the drawing [pixels]."""

SHARE: Final = 7
"""The dashboard takes one out of this many rows of a picture."""

FAR, NEAR, GOAL = 112.0, 28.0, 560.0
"""Lengths of the gauges of distance: to an instruction's place, in two units, and to a goal [m]."""

FASTEST: Final = 28.0
"""Length of the gauges of speed [m/s]."""

PANEL = (24, 24, 28)
AHEAD, PASSED = (255, 210, 0), (255, 40, 40)
"""Colours of a remaining distance, and of a distance past the place."""

PLANNED, GOAL_COLOUR = (60, 220, 60), (255, 80, 255)
"""Colours of the manoeuvre that the car prepares, and of the goal."""

SPEED, WANTED, LIMIT = (255, 255, 255), (0, 200, 255), (255, 40, 40)
"""Colours of the speed, of the requested speed, and of the marks at the limit."""

HAZARD, LIGHTS, STEERING = (255, 40, 40), (60, 120, 255), (255, 140, 0)
"""Colours of the lamps and of the gauge of the steering wheel."""

_ICON, _PLAN, _DISTANCE, _SPEED = 1, 14, 27, 56  # first columns of the parts
_GAUGE = 28  # width of a gauge [pixels]
_ROWS = (slice(1, 4), slice(5, 8), slice(9, 12))  # of the gauges


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Values that the dashboard shows.

    Attributes:
        action: action of the last instruction; None before the first, and where a goal was named instead.
        sector: its direction, an index of `SECTORS`; None without one.
        distance: from the car to its place, negative past it [m].
        planned: manoeuvre that the car prepares or carries out, of `ActionValue`; None if there is none.
        planned_sector: its direction.
        goal: place of the named goal ahead of the car and to its right [m]; None if it is not known.
        speed: speed of the car [m/s].
        wanted: target speed: the cruise speed, or the speed that the path allows [m/s].
        limit: speed limit [m/s]; None if unknown.
        hazard: whether the car brakes for a hazard.
        lights: whether the headlights are on.
        steering: share of the greatest steering angle, positive right; None where the car steers itself.
        traffic: side of the road on which vehicles drive, from which U-turns lead away.
    """

    action: ActionValue | None = None
    sector: int | None = None
    distance: float = 0.0
    planned: ActionValue | None = None
    planned_sector: int | None = None
    goal: tuple[float, float] | None = None
    speed: float = 0.0
    wanted: float = 0.0
    limit: float | None = None
    hazard: bool = False
    lights: bool = False
    steering: float | None = None
    traffic: DrivingSide = DrivingSide.RIGHT


def rows_of_dashboard(height: int) -> int:
    """Returns the number of rows of the dashboard in a picture with a height."""
    return max(1, round(height / SHARE))


def show_dashboard(picture: NDArray[np.uint8], readings: Readings) -> None:
    """Draws the dashboard over the lowest rows of a picture (h, w, 3)."""
    height, width = picture.shape[:2]
    rows = rows_of_dashboard(height)
    columns = min(width, round(WIDTH * rows / HEIGHT))
    drawn = draw_dashboard(readings)
    if (rows, columns) != (HEIGHT, WIDTH):
        drawn = drawn[np.arange(rows) * HEIGHT // rows][:, np.arange(columns) * WIDTH // columns]
    strip, left = picture[height - rows :], (width - columns) // 2
    strip[:] = PANEL
    strip[:, left : left + columns] = drawn


def draw_dashboard(readings: Readings) -> NDArray[np.uint8]:
    """Returns the dashboard (HEIGHT, WIDTH, 3)."""
    panel = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    panel[:] = PANEL
    if readings.goal is not None:
        _draw_needle(panel, *readings.goal)
        _fill(panel, 2, _DISTANCE, pm.hypot(*readings.goal) / GOAL, GOAL_COLOUR)
    elif readings.action is not None:
        _draw_icon(panel, _ICON, readings.action, readings.sector, readings.traffic, None)
        colour = AHEAD if readings.distance >= 0.0 else PASSED
        _fill(panel, 0, _DISTANCE, abs(readings.distance) / FAR, colour)
        _fill(panel, 1, _DISTANCE, abs(readings.distance) / NEAR, colour)
    if readings.planned is not None:
        _draw_icon(panel, _PLAN, readings.planned, readings.planned_sector, readings.traffic, PLANNED)
    _fill(panel, 0, _SPEED, readings.speed / FASTEST, SPEED)
    _fill(panel, 1, _SPEED, readings.wanted / FASTEST, WANTED)
    if readings.limit is not None:
        panel[[0, 4, 8], _SPEED + min(int(readings.limit / FASTEST * _GAUGE), _GAUGE - 1)] = LIMIT
    _draw_lamps(panel, readings)
    return panel


def _draw_lamps(panel: NDArray[np.uint8], readings: Readings) -> None:
    row, middle = _ROWS[2], _SPEED + _GAUGE // 2
    if readings.steering is not None:
        reach = round(readings.steering * (_GAUGE // 2))
        panel[row, min(middle, middle + reach) : max(middle, middle + reach)] = STEERING
        panel[row, middle] = SPEED
        return
    for lit, first, colour in ((readings.hazard, _SPEED, HAZARD), (readings.lights, middle, LIGHTS)):
        if lit:
            panel[row, first : first + _GAUGE // 2 - 2] = colour


def _fill(panel: NDArray[np.uint8], gauge: int, first: int, share: float, colour: tuple[int, int, int]) -> None:
    """Fills a gauge up to a share; the last pixel is as bright as its part that is filled."""
    length = min(max(share, 0.0), 1.0) * _GAUGE
    whole = int(length)
    panel[_ROWS[gauge], first : first + whole] = colour
    if whole < _GAUGE:
        part = length - whole
        panel[_ROWS[gauge], first + whole] = [round(p + part * (c - p)) for p, c in zip(PANEL, colour, strict=True)]


# --- Icons ------------------------------------------------------------------------------------------------------------

_SIZE = 11  # of an icon [pixels]

_UP = """
.....#.....
....###....
...#####...
..#######..
.#########.
....###....
....###....
....###....
....###....
....###....
....###....
"""

_UP_LEFT = """
########...
#######....
######.....
#######....
########...
###.#####..
##...#####.
#.....#####
.......####
........##.
.........#.
"""

_SWITCH_LEFT = """
#.........#
#...#.....#
...##......
#.###.....#
##########.
###########
.##########
#.###.....#
...##......
#...#.....#
#.........#
"""

_U_TURN = """
...######..
..########.
.###....###
.##......##
.##......##
.##......##
####.....##
####.....##
.##......##
.........##
.........##
"""

_STOP = """
...#####...
..#######..
.#########.
###########
###########
###########
###########
###########
.#########.
..#######..
...#####...
"""

_START = """
##.........
####.......
######.....
########...
##########.
###########
##########.
########...
######.....
####.......
##.........
"""

_FOLLOW = """
##...#...##
##...#...##
##.......##
##...#...##
##...#...##
##.......##
##...#...##
##...#...##
##.......##
##...#...##
##...#...##
"""

_OTHER = """
...........
.#########.
.#.......#.
.#.......#.
.#.......#.
.#.......#.
.#.......#.
.#.......#.
.#.......#.
.#########.
...........
"""


def _icon(text: str) -> NDArray[np.bool_]:
    return np.array([[letter == "#" for letter in line] for line in text.split()])


_ARROWS = {0: _icon(_UP), 45: _icon(_UP_LEFT)}
_LEFTWARD: Final = _icon(_SWITCH_LEFT)
_SHAPES = {
    ActionValue.U_TURN: _icon(_U_TURN),
    ActionValue.STOP: _icon(_STOP),
    ActionValue.START: _icon(_START),
    ActionValue.LANE_FOLLOW: _icon(_FOLLOW),
}
_UNKNOWN = _icon(_OTHER)
_COLOURS = {
    ActionValue.J_TURN: (255, 255, 255),
    ActionValue.LANE_SWITCH: (0, 200, 255),
    ActionValue.U_TURN: (255, 140, 0),
    ActionValue.STOP: (255, 40, 40),
    ActionValue.START: (60, 220, 60),
}


def icon_of(action: ActionValue, sector: int | None, traffic: DrivingSide) -> NDArray[np.bool_]:
    """Returns the shape of an action in a direction (11, 11): arrows of turns point into their sector."""
    angle = 0 if sector is None else SECTORS[sector]
    if action is ActionValue.J_TURN:
        odd = angle % 90
        return np.rot90(_ARROWS[odd], (angle - odd) // 90)
    if action is ActionValue.LANE_SWITCH:
        return _LEFTWARD if angle > 0 else _LEFTWARD[:, ::-1]
    shape = _SHAPES.get(action, _UNKNOWN)
    return shape[:, ::-1] if action is ActionValue.U_TURN and traffic is DrivingSide.LEFT else shape


def _draw_icon(
    panel: NDArray[np.uint8],
    first: int,
    action: ActionValue,
    sector: int | None,
    traffic: DrivingSide,
    colour: tuple[int, int, int] | None,
) -> None:
    square = panel[HEIGHT - _SIZE :, first : first + _SIZE]
    square[icon_of(action, sector, traffic)] = colour or _COLOURS.get(action, (200, 200, 200))


def _draw_needle(panel: NDArray[np.uint8], ahead: float, right: float) -> None:
    """Draws a needle from the centre of the first icon towards the goal: up is ahead."""
    square, middle, reach = panel[HEIGHT - _SIZE :, _ICON : _ICON + _SIZE], _SIZE // 2, pm.hypot(ahead, right)
    square[middle, middle] = SPEED
    if reach > 0.0:
        for step in range(2, 2 * middle + 1):
            length = 0.5 * step / reach
            square[middle - round(ahead * length), middle + round(right * length)] = GOAL_COLOUR
