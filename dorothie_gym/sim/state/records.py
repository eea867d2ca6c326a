"""The records that the compiled loops work on, field by field.

Records are read and written by attribute (`vehicle.speed`), compiled and in plain Python alike.
"""

from __future__ import annotations

import enum
from typing import Any, TypeAlias

import numpy as np

from dorothie_gym.ontology import ObjectClass, PhysicalAction
from dorothie_gym.sim.traffic.parameters import CLOSED, GOALS, PLANNED

VEHICLES, PEDESTRIAN_CLASS, STATIC = (
    int(kind.value) for kind in (ObjectClass.VEHICLES, ObjectClass.PEDESTRIAN, ObjectClass.STATIC)
)
"""Object classes of bodies, as plain numbers."""

U_TURN = int(PhysicalAction.U_TURN.value)

Records: TypeAlias = Any
"""An array of records; mypy knows no types of their fields."""


def plain(records: Records) -> Any:
    """The same records as an array whose fields are read by name only, which is several times faster in Python."""
    return records.view(np.dtype((np.void, records.dtype)), np.ndarray)


def fields(records: Records, *names: str) -> Any:
    """Some fields of the first record as an array without axes, to be read or written all at once in Python.

    ``fields(...).item()`` is a tuple of plain numbers, and ``fields(...)[()] = numbers`` takes one, either in about the
    time that a single field of `plain` takes.
    """
    return records.view(np.ndarray)[list(names)][:1].reshape(())


NOBODY: Any = np.int64(-1)
"""No lane, node or body. For a plain number numba would compile its readers twice: for this value, and for others."""


class Kind(enum.IntEnum):
    """What a vehicle is."""

    EMPTY = 0
    CAR = 1
    CYCLIST = 2
    EGO = 3
    DRIVEN = 4


class Control(enum.IntEnum):
    """What has to be heeded at the end of a lane."""

    NONE = 0
    LIGHT = 1
    STOP = 2
    YIELD = 3


class Colour(enum.IntEnum):
    """What a light shows."""

    GREEN = 0
    YELLOW = 1
    RED = 2


class Relation(enum.IntEnum):
    """Of one connector to another one of its junction."""

    APART = 0
    FOE = 1
    WAITS = 2


class Wait(enum.IntEnum):
    """Why a vehicle may not enter a junction."""

    NOT = 0
    LIGHT = 1
    """Its light is red, or yellow and it can stop."""
    STOP_SIGN = 2
    """It has not come to a stand at its stop sign."""
    GIVING_WAY = 3
    """Somebody comes who has priority."""
    TURN = 4
    """Somebody else has been waiting for longer."""
    OCCUPIED = 5
    """Somebody is on a path that crosses its own."""
    CLOSED = 6
    """The car turns round in the junction."""
    NO_ROOM = 7
    """There is no room behind the junction."""


class Group(enum.IntEnum):
    """In which array of a world a body is."""

    VEHICLES = 0
    PEDESTRIANS = 1
    PROPS = 2


class Walk(enum.IntEnum):
    """What a pedestrian does; who strays crosses the road where there is no crosswalk."""

    EMPTY = 0
    WALKING = 1
    WAITING = 2
    CROSSING = 3
    STRAYING = 4


class Footway(enum.IntEnum):
    """What a way is that people walk along."""

    PAVEMENT = 0
    CORNER = 1
    STREET = 2


LANE = np.dtype(
    [
        ("length", "f8"),  # [m]
        ("limit", "f8"),  # speed limit [m/s]
        ("curve_speed", "f8"),  # at which its tightest bend is driven [m/s]
        ("half_width", "f8"),  # [m]
        ("cos_first", "f8"), ("sin_first", "f8"), ("cos_last", "f8"), ("sin_last", "f8"),  # directions of its ends
        ("left_edge", "f8"), ("low_edge", "f8"), ("right_edge", "f8"), ("high_edge", "f8"),  # bounding box [m]
        ("first", "i4"), ("last", "i4"),  # first and last row of its points
        ("rank", "i4"),  # place in the order of the network's lanes: settles ties
        ("successor", "i4"), ("successors", "i4"),  # where its list begins in `neighbours`, and how many there are
        ("predecessor", "i4"), ("predecessors", "i4"),
        ("left", "i4"), ("right", "i4"),  # lanes that one may change to, or -1
        ("junction", "i4"),  # number of the junction that it crosses, or -1
        ("exit", "i4"),  # of a connector: the first lane behind the junction, or -1
        ("place", "i4"),  # of a connector: its place among those of its junction
        ("relation", "i4"),  # of a connector: where its row of `relations` begins
        ("control", "i4"),  # `Control`
        ("cycling", "b1"),  # whether cyclists ride on it: it is slow, and one may go on without coming to a fast one
        ("programme", "i4"), ("slot", "i4"),  # light programme, and the place of its light in it
        ("sibling", "i4"), ("siblings", "i4"),  # rows of `siblings`
        ("passage", "i4"), ("passages", "i4"),  # rows of `passages`
    ],
    align=True,
)  # fmt: skip
"""A lane of a town."""

ENTRY = np.dtype(
    [
        ("cos", "f8"), ("sin", "f8"),  # mean direction of the lane near the cell
        ("limit", "f8"),  # headings whose cosine to that is less are off by more than `cells.TURNED`
        ("along_low", "f8"), ("along_high", "f8"),  # box around those segments: along that direction [m]
        ("across_low", "f8"), ("across_high", "f8"),  # and across it [m]
        ("lane", "i4"),
        ("first", "i4"), ("last", "i4"),  # its segments that can be the closest ones from within the cell
    ],
    align=True,
)  # fmt: skip
"""A lane in the list of a cell."""

SIBLING = np.dtype([("until", "f8"), ("lane", "i4")], align=True)
"""A lane that begins where another one begins: who is on it before `until` [m] is in the way on the other one, too."""

PASSAGE = np.dtype([("start", "f8"), ("stop", "f8"), ("across", "f8"), ("crossing", "i4")], align=True)
"""A lane's way over a crosswalk: its stations there, and how far along the crosswalk it is met [m]."""

PROGRAMME = np.dtype(
    [("offset", "f8"), ("cycle", "f8"), ("phase", "i4"), ("phases", "i4"), ("colour", "i4"), ("slots", "i4")],
    align=True,
)
"""A light programme: its phases' ends are `phase_ends[phase : phase + phases]`, and `colours` begin at `colour`."""

WALKWAY = np.dtype(
    [("length", "f8"), ("first", "i4"), ("last", "i4"), ("mouth", "i4"), ("mouths", "i4"), ("half_width", "f8"),
     ("next_walk", "i4", (2,)), ("next_end", "i4", (2,)), ("kind", "i4"), ("lane", "i4")],
    align=True,
)  # fmt: skip
"""A way along which people walk: its points, the mouths of crosswalks along it, and where one walks on beyond its two
ends, or -1; its kind (`Footway`), and of a street walk the lane that it is beside, else -1."""

CROSSING = np.dtype(
    [("x", "f8", (2,)), ("y", "f8", (2,)), ("cos", "f8"), ("sin", "f8"), ("length", "f8"), ("height", "f8"),
     ("walk", "i4", (2,)), ("station", "f8", (2,)), ("light", "i4"), ("lights", "i4")],
    align=True,
)  # fmt: skip
"""A crosswalk: its two ends, its direction from the first to the second, the pavements that it joins, and where the
lanes are in `neighbours` whose lights must be red while one crosses."""

MOUTH = np.dtype([("station", "f8"), ("crossing", "i4"), ("end", "i4")], align=True)
"""Where a crosswalk leaves a pavement."""

VEHICLE = np.dtype(
    [
        ("x", "f8"), ("y", "f8"),  # position of its middle [m]
        ("heading", "f8"), ("cos", "f8"), ("sin", "f8"),  # [rad]
        ("speed", "f8"),  # [m/s]
        ("height", "f8"),  # of the road under it [m]
        ("acceleration", "f8"), ("slip", "f8"),  # what it does: [m/s^2], and sine of the slip angle
        ("desired", "f8"),  # speed that it likes [m/s]
        ("length", "f8"), ("width", "f8"), ("radius", "f8"),  # [m]; half its diagonal
        ("to_right", "f8"),  # where it keeps in its lane [m]
        ("station", "f8"), ("lateral", "f8"),  # on the lane that it follows [m]
        ("own_station", "f8"), ("own_lateral", "f8"),  # on the lane that is closest [m]
        ("timer", "f8"),  # since it thought of changing lanes [s]
        ("standing", "f8"),  # for how long it has been standing, its light not being red [s]
        ("stuck", "f8"),  # the same less the time for which the light ahead was not green, also behind others [s]
        ("crash_age", "f8"),  # since it crashed [s]
        ("odometer", "f8"),  # way driven [m]
        ("distance", "f8"),  # from its front to the line before the next junction [m]
        ("seen", "f8"), ("asked", "f8"), ("since", "f8"),  # when it came near, asked, began to wait [s]
        ("claim_since", "f8"), ("claim_asked", "f8"),  # [s]
        ("rerouted", "f8"),  # when it chose another way last, for want of room on the one it planned [s]
        ("random", "i8"),
        ("lane", "i4"), ("segment", "i4"),  # the closest lane; the closest segment of the lane that it follows
        ("planned", "i4"), ("plan", "i4", (PLANNED,)),  # lanes ahead; the first is the one that it follows
        ("approach", "i4"), ("approach_lane", "i4"),  # connector that it announced, and where it comes from
        ("claim", "i4"), ("inside", "i4"),  # connector that it was let into, and that it is on
        ("kind", "i4"), ("wait", "i4"),
        ("key", "i4"),  # tells it apart from other bodies; who comes back after towing has a new one
        ("stood", "b1"), ("crashed", "b1"),
        ("blocked", "b1"),  # whether a prop is next ahead
        ("touched", "b1"),  # whether the car has touched it
    ],
    align=True,
)  # fmt: skip
"""A car or cyclist; a place that is empty has the kind `Kind.EMPTY`."""

PEDESTRIAN = np.dtype(
    [
        ("x", "f8"), ("y", "f8"), ("heading", "f8"), ("cos", "f8"), ("sin", "f8"), ("speed", "f8"), ("height", "f8"),
        ("station", "f8"), ("direction", "f8"),  # along the pavement or crosswalk [m], and 1 or -1
        ("pace", "f8"),  # speed that it likes [m/s]
        ("aside", "f8"),  # how far to the right of the middle it keeps [m]
        ("waited", "f8"), ("odometer", "f8"),
        ("far", "f8"),  # of who strays: to the other side of the road [m]
        ("staying", "f8"), ("left_x", "f8"), ("left_y", "f8"),  # for how long it has not got on [s], and from where [m]
        ("crash_age", "f8"),  # since it was touched [s]
        ("random", "i8"),
        ("walk", "i4"), ("segment", "i4"), ("crossing", "i4"), ("mouth", "i4"), ("state", "i4"), ("key", "i4"),
        ("crashed", "b1"),
    ],
    align=True,
)  # fmt: skip
"""Somebody on foot."""

PROP = np.dtype(
    [
        ("x", "f8"), ("y", "f8"), ("heading", "f8"), ("cos", "f8"), ("sin", "f8"), ("height", "f8"),
        ("length", "f8"), ("width", "f8"), ("radius", "f8"),
        ("station", "f8", (4,)), ("lane", "i4", (4,)), ("key", "i4"), ("present", "b1"),
    ],
    align=True,
)  # fmt: skip
"""A thing on the road, and the lanes that it reaches into."""

NODE = np.dtype(
    [("station", "f8"), ("speed", "f8"), ("cos", "f8"), ("sin", "f8"), ("half_length", "f8"),
     ("lane", "i4"), ("next", "i4"), ("before", "i4"), ("body", "i4")],
    align=True,
)  # fmt: skip
"""A body in the list of a lane, ordered by station."""

POINT = np.dtype(
    [
        ("s", "f8"),  # distance along the path [m]
        ("x", "f8"), ("y", "f8"), ("heading", "f8"), ("cos", "f8"), ("sin", "f8"), ("height", "f8"),
        ("station", "f8"),  # along its lane [m]; during a U-turn where that ends
        ("speed", "f8"),  # that curves, limits and the path's end allow [m/s]
        ("left", "f8"), ("right", "f8"),  # how far the car's corners sweep to either side of the path [m]
        ("lane", "i4"),
        ("manoeuvre", "b1"),  # whether the path is off the lanes' middles here: lane switch or U-turn
    ],
    align=True,
)  # fmt: skip
"""A point of the path that the car follows."""

CAR = np.dtype(
    [
        ("points", "i4"), ("at", "i4"),  # of the path: how many, and the one at or before the car
        ("s", "f8"), ("offset", "f8"),  # where it is along the path, and how far to the right of it [m]
        ("stop_at", "f8"),  # where it has to stop, infinite where the path does not end [m]
        ("runs", "i4"), ("run", "i4"),  # lanes of the path one after another: how many, and the one that it is on
        ("run_lane", "i4", (PLANNED,)), ("run_first", "i4", (PLANNED,)),  # and the first point on each
        ("action", "i4"), ("action_end", "f8"),  # manoeuvre, a `PhysicalAction` or 0, and where it ends [m]
        ("cruise", "f8"),  # desired speed [m/s]
        ("held", "b1"), ("hold_speed", "f8"),  # whether it stops by command, and how fast it still is then; -1 for none
        ("goals", "i4"), ("goal", "f8", (GOALS,)),  # places along the path to come up to slowly [m]
        ("lateral_sum", "f8"), ("lateral_last", "f8"), ("speed_sum", "f8"),  # memory of the controllers
        ("throttle", "f8"), ("steer", "f8"), ("brake", "f8"),
        ("manual", "b1"),  # whether these three are given, and not found by the controllers
        ("before", "f8"),  # speed at the start of the substep [m/s]
        ("friction", "f8"),  # share of the dry road's grip
        ("wind", "f8"), ("wind_heading", "f8"), ("wind_phase", "f8", (3,)),  # strength in [0, 1], where to, gusts
        ("roadblock", "f8"),  # how far ahead of its middle a prop is seen on the path [m], or infinite
        ("sweeping", "b1"), ("sweep_first", "i4"), ("sweep_last", "i4"),  # points still to be passed turning round
        ("closed", "i4", (CLOSED,)), ("closed_at", "f8", (CLOSED,)),  # junctions that it needs to turn round, and when
        ("kind", "i4"), ("gap", "f8"), ("ahead_speed", "f8"), ("other", "i4"),  # what limits its speed: `ObjectClass`
        ("tight", "b1"), ("line", "b1"),  # or 0, gap [m], speed [m/s], key; whether in a manoeuvre, or for a line
        ("hazard", "i4"), ("hazard_gap", "f8"), ("hazard_key", "i4"),  # what it stops for: as `kind`, 0 for nothing
        ("hazard_since", "i8"), ("hazard_seen", "i8"),  # frames
        ("stopped_until", "i8"), ("collision_stop", "i8"),  # frames for which it stands after a collision
        ("collisions", "i8"),  # those of its own making
        ("events", "i4"), ("frames", "i4"),  # rows of `events` and `trace` that are in use
    ],
    align=True,
)  # fmt: skip
"""What drives the session's car, the vehicle of the kind `Kind.DRIVEN`."""


class EventCode(enum.IntEnum):
    """What happened to the car."""

    HAZARD_STOP = 1
    HAZARD_END = 2
    COLLISION = 3


EVENT = np.dtype(
    [
        ("frame", "i8"), ("code", "i4"), ("kind", "i4"), ("key", "i4"), ("body", "i4"), ("own", "b1"),
        ("value", "f8"),  # gap [m], seconds, or speed [m/s]
        ("x", "f8"), ("y", "f8"), ("station", "f8"), ("lane", "i4"),
    ],
    align=True,
)  # fmt: skip
"""Something that happened to the car: an `EventCode`, with the class, key and number of the counterpart."""

TRACE = ("frame", "x", "y", "heading", "speed", "throttle", "steer", "brake", "lane", "offset")
"""Columns of the way of the car."""

POSE = ("x", "y", "heading", "speed", "height", "turning")
"""Columns of its poses: place [m], heading [rad], speed [m/s], height of the road [m], 1 if it turns round."""

CLOCK = np.dtype(
    [("time", "f8"), ("frame", "i8"), ("collisions", "i8"), ("run_over", "i8"), ("random", "i8"), ("towed", "i8"),
     ("keys", "i8"), ("straying", "i8")],
    align=True,
)  # fmt: skip
"""What a world counts: time [s], substeps, collisions of vehicles, pedestrians touched, vehicles towed, keys given, and
how many stray over a road now; `random` is a number from which those of all bodies are drawn."""

LAMP = np.dtype([("until", "f8"), ("phase", "i4")], align=True)
"""The phase of a light programme now, which holds until a time [s]."""

SEEN = np.dtype(
    [
        ("distance2", "f8"),  # square of its distance, as it seems [m^2]
        ("x", "f8"), ("y", "f8"),  # where it seems to be [m]
        ("heading", "f8"), ("cos", "f8"), ("sin", "f8"), ("speed", "f8"),
        ("length", "f8"), ("width", "f8"), ("height", "f8"),  # its outline, and the height of the road under it [m]
        ("kind", "i4"),  # value of the ontology's `ObjectClass`
        ("key", "i4"),
        ("body", "i4"), ("group", "i4"),  # its place in the array of its `Group`
    ],
    align=True,
)  # fmt: skip
"""A body that is perceived."""

EYE = np.dtype(
    [
        ("seed", "i8"),
        ("sight", "f8"),  # within which nothing is missed [m]
        ("fog", "f8"), ("fog_start", "f8"), ("rain", "f8"), ("light", "f8"), ("lamps", "f8"), ("clarity", "f8"),
        ("clear", "b1"),  # whether all within `visibility.CLEAR_SIGHT` is seen where it is
    ],
    align=True,
)  # fmt: skip
"""How well one sees: the fields of `visibility.Visibility`, and the seed of errors and misses."""

LINE = np.dtype(
    [("x", "f8"), ("y", "f8"), ("cos", "f8"), ("sin", "f8"), ("half_width", "f8"), ("height", "f8"), ("is_stop", "b1")],
    align=True,
)  # fmt: skip
"""The end of a lane with a light or a stop sign: place [m], direction, half of the lane's width and height [m]."""

MARK = np.dtype([("near", "i4"), ("stood", "b1")], align=True)
"""A line, as one car has it: whether it has stood there; `near` lists the lines near it, for this moment only."""

FINDING = np.dtype([("station", "f8"), ("pose", "i4"), ("kind", "i4"), ("number", "i4")], align=True)
"""What was found: at which pose, `rules.Found`, and of which line or lane; on a lane, how far along it [m]."""
