"""Codes that the records hold: kinds of bodies, states, colours of lights, reasons to wait."""

from __future__ import annotations

import enum
from typing import cast

import numpy as np

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ObjectClass

VEHICLES, PEDESTRIAN_CLASS, STATIC = (
    int(kind.value) for kind in (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.STATIC)
)
"""Object classes of bodies, as plain numbers."""

LANE_FOLLOW, LANE_SWITCH, U_TURN, J_TURN, STOP, START = (
    int(action.value)
    for action in (
        PhysicalAction.LANE_FOLLOW,
        PhysicalAction.LANE_SWITCH,
        PhysicalAction.U_TURN,
        PhysicalAction.J_TURN,
        PhysicalAction.STOP,
        PhysicalAction.START,
    )
)
"""Navigation actions, as plain numbers."""

NOBODY = cast(int, np.int64(-1))
"""No lane, node or body: a NumPy integer. For a plain number numba would compile its readers twice, for this value and
for others."""


class Kind(enum.IntEnum):
    """Kind of a vehicle."""

    EMPTY = 0
    """No vehicle: the row is free."""
    CAR = 1
    CYCLIST = 2
    EGO = 3
    """Vehicle of `TownEnv`, moved by highway-env or by a batch of egos."""
    DRIVEN = 4
    """The ego car of a session, which follows a path."""


class TrafficControl(enum.IntEnum):
    """Light or sign at the end of a lane."""

    NONE = 0
    LIGHT = 1
    STOP = 2
    YIELD = 3


class Colour(enum.IntEnum):
    """Colour of a traffic light."""

    GREEN = 0
    YELLOW = 1
    RED = 2


class Relation(enum.IntEnum):
    """Relation of one connector to another one of its junction."""

    APART = 0
    """Their paths do not cross."""
    FOE = 1
    """Their paths cross."""
    WAITS = 2
    """Their paths cross, and the other one has priority."""


class Wait(enum.IntEnum):
    """Reason for which a vehicle may not enter a junction."""

    NOT = 0
    LIGHT = 1
    """Its light is red, or yellow and it can stop."""
    STOP_SIGN = 2
    """It has not come to a standstill at its stop sign."""
    GIVING_WAY = 3
    """A vehicle with priority is coming."""
    TURN = 4
    """Another vehicle has been waiting for longer."""
    OCCUPIED = 5
    """Another vehicle is on a path that crosses its own."""
    CLOSED = 6
    """The ego turns round in the junction."""
    NO_ROOM = 7
    """There is no room beyond the junction."""


class Group(enum.IntEnum):
    """Array of a world that holds a body."""

    VEHICLES = 0
    PEDESTRIANS = 1
    PROPS = 2


class Walk(enum.IntEnum):
    """State of a pedestrian; a straying one crosses the road where there is no crosswalk."""

    EMPTY = 0
    WALKING = 1
    WAITING = 2
    CROSSING = 3
    STRAYING = 4


class Footway(enum.IntEnum):
    """Kind of a footway."""

    PAVEMENT = 0
    CORNER = 1
    STREET = 2


class EventCode(enum.IntEnum):
    """Kind of an event of the ego."""

    HAZARD_STOP = 1
    HAZARD_END = 2
    COLLISION = 3


class Breach(enum.IntEnum):
    """Kind of infraction of the traffic rules by the ego."""

    COLLISION = 0
    RED_LIGHT = 1
    STOP_SIGN = 2
    OFF_ROAD = 3
    WRONG_WAY = 4


COLLISION, RED_LIGHT, STOP_SIGN, OFF_ROAD, WRONG_WAY = (int(kind) for kind in Breach)
"""Kinds of infractions, as plain numbers."""


class Refusal(enum.IntEnum):
    """Answer to a navigation action: carried out, or the reason of a refusal."""

    NO_SPACE = -1
    """The arrays have no room for the new path: repeat with longer ones, see `world_arrays.lengthened`."""
    NONE = 0
    STOPPED = 1
    NOT_STOPPED = 2
    NO_NAVIGATION = 3
    IN_MANOEUVRE = 4
    FOLLOWING = 5
    COMMITTED = 6
    NO_SIDE = 7
    NO_LANE_LEFT = 8
    NO_LANE_RIGHT = 9
    NO_ROOM_LEFT = 10
    NO_ROOM_RIGHT = 11
    PROP_LEFT = 12
    PROP_RIGHT = 13
    NOT_LEFTMOST = 14
    NO_ONCOMING = 15
    PROP_AHEAD = 16
    NO_ROOM_TO_TURN = 17
    PROP_ONCOMING = 18
    NO_CHOICE = 19
    SAME_TURN = 20
    TURN_TOO_CLOSE = 21
    NOT_RIGHTMOST = 22


CARRIED_OUT, NO_SPACE = int(Refusal.NONE), int(Refusal.NO_SPACE)
"""Answers to navigation actions, as plain numbers."""


class Feasible(enum.IntEnum):
    """Flag of a navigation action that the ego would carry out, see `feasibility.FeasibleManoeuvres`."""

    LANE_FOLLOW = 1
    SWITCH_LEFT = 2
    SWITCH_RIGHT = 4
    U_TURN = 8
    J_TURN = 16


class Motion(enum.IntEnum):
    """State of motion of the car."""

    DRIVING = 0
    STOPPED = 1
    """Stopped by the action Stop, until Start or another manoeuvre."""
    WAITING = 2
    """Waiting at the end of the lane for a turn."""
    HAZARD = 3
    """Braking or standing because of a hazard ahead."""
