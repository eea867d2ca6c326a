"""Reader of the dashboard: what somebody knows who sees nothing but its pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.dashboard import AHEAD, FAR, FASTEST, NEAR, PANEL, PASSED, Readings, draw_dashboard
from dorothie_gym.ontology import ActionValue
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from tests.envs.navigation_drivers import stops_in_time

Panel = NDArray[np.uint8]
Instruction = tuple[ActionValue, int | None]

_KNOWN: list[Instruction] = [
    *((ActionValue.J_TURN, sector) for sector in range(len(SECTORS))),
    (ActionValue.LANE_SWITCH, 6),
    (ActionValue.LANE_SWITCH, 2),
    *((action, None) for action in (ActionValue.U_TURN, ActionValue.STOP, ActionValue.START)),
]


def instruction_on(panel: Panel) -> Instruction | None:
    """Returns the instruction that the first icon shows."""
    return _found(panel[:, :13], lambda action, sector: draw_dashboard(Readings(action=action, sector=sector))[:, :13])


def planned_on(panel: Panel) -> Instruction | None:
    """Returns the manoeuvre that the second icon shows."""
    return _found(
        panel[:, 13:26],
        lambda action, sector: draw_dashboard(Readings(planned=action, planned_sector=sector))[:, 13:26],
    )


def _found(icon: Panel, draw: Callable[[ActionValue, int | None], Panel]) -> Instruction | None:
    return next((known for known in _KNOWN if np.array_equal(draw(*known), icon)), None)


def distance_on(panel: Panel) -> float:
    """Returns the distance to the place of the instruction, negative behind it [m]."""
    for gauge, length in ((5, NEAR), (1, FAR)):
        row = panel[gauge, 27:55].astype(float)
        for sign, colour in ((1.0, AHEAD), (-1.0, PASSED)):
            share = _filled(row, colour)
            if share is not None and (share < 27.99 or length == FAR):
                return sign * share / 28.0 * length
    return 0.0


def speed_on(panel: Panel) -> float:
    """Returns the speed [m/s]."""
    return (_filled(panel[1, 56:].astype(float), (255, 255, 255)) or 0.0) / 28.0 * FASTEST


def wanted_on(panel: Panel) -> float:
    """Returns the speed that is asked for [m/s]."""
    return (_filled(panel[5, 56:].astype(float), (0, 200, 255)) or 0.0) / 28.0 * FASTEST


def _filled(row: NDArray[np.float64], colour: tuple[int, int, int]) -> float | None:
    """Returns how many pixels of a gauge are filled with a colour; None if it has another colour."""
    ink, ground = np.array(colour, dtype=float), np.array(PANEL, dtype=float)
    shares = (row - ground) @ (ink - ground) / ((ink - ground) @ (ink - ground))
    pixels = row[(shares > 0.02)]
    if not len(pixels):
        return None
    fits = np.abs(row - (ground + shares[:, None] * (ink - ground))).max() < 3.0
    return float(shares.sum()) if fits else None


def obey_picture(picture: Panel, mask: Any) -> int:
    """Carries out the instruction on the dashboard of a picture of 84 x 84 pixels, as `navigation_drivers.obey`."""
    panel = picture[-12:]
    found, left, speed = instruction_on(panel), distance_on(panel), speed_on(panel)
    wanted = NavigationAction.NOTHING
    if found is not None:
        asked, sector = found
        planned = planned_on(panel)
        if asked is ActionValue.J_TURN and sector is not None and left > -5.0:
            wanted = NavigationAction.turn(sector)
        elif asked is ActionValue.U_TURN and left > -10.0:
            wanted = NavigationAction.U_TURN
        elif asked is ActionValue.LANE_SWITCH and left > -20.0 and (planned is None or planned[0] is not asked):
            wanted = NavigationAction.SWITCH_LEFT if sector == 6 else NavigationAction.SWITCH_RIGHT
        elif asked is ActionValue.START:
            wanted = NavigationAction.START
        elif asked is ActionValue.STOP and stops_in_time(speed, left):
            wanted = NavigationAction.STOP
    return int(wanted) if mask[wanted] else 0
