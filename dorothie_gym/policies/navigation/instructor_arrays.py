"""State of the built-in instructor in arrays: one row of a batch is the instructor of one environment."""

from __future__ import annotations

import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.route_arrays import LegRecord, PlaceRecord
from dorothie_gym.maps.routing_graph import NONE
from dorothie_gym.support.compilation.records import (
    Flag,
    Float,
    Int32,
    RecordArray,
    argument,
    by_reference,
    empty_records,
)

CLOSED_PLACES = 64
"""Maximum number of places closed by roadblocks that an instructor remembers; every roadblock closes two."""

LEGS_AHEAD = 6
"""Number of legs on which roadblocks are looked for."""

LEGS = 96
"""Maximum number of legs that an instructor keeps of a route, the first. Routes through the towns have about 30."""

LEGS_LEFT = 12
"""Number of legs after which the rest of a longer route is planned separately."""


class StepKind(enum.IntEnum):
    """Kind of a step of the guidance."""

    NONE = 0
    GOAL = 1
    """Drive to a place given by name."""
    TURN = 2
    U_TURN = 3
    SWITCH = 4
    """Switch lanes."""
    STOP = 5
    ON = 6
    """Drive on."""


class ViewRecord:
    """View of the instructor at a decision."""

    station: Float  # place of the car [m]
    speed: Float  # [m/s]
    time: Float  # [s]
    turning: Float  # remaining length of the lane switch or U-turn in progress [m], else 0
    lane: Int32
    things: Int32  # number of rows of `InstructorArrays.things` in use
    waits: Flag  # whether the car was instructed to stop, and stands
    by_name: Flag  # whether goals on the Co-Wizard's map are only named


class SubgoalRecord:
    """A subgoal: its row of the landmarks, whether it counts and is not reached, and may be reached now."""

    landmark: Int32
    open: Flag
    allowed: Flag


class MarkRecord:
    """A landmark: its place, name (`LandmarkName`), and whether the Co-Wizard's map shows it.

    An unused row has the lane -1 and the name 0.
    """

    station: Float
    lane: Int32
    name: Int32
    known: Flag


class ThingRecord:
    """A static body in sight: its place and its distance [m]."""

    x: Float
    y: Float
    distance: Float


class RouteRecord:
    """Goal of the instructor, and progress on the route to it; -1 stands for none."""

    subgoal: Int32  # current subgoal
    landmark: Int32  # its landmark
    legs: Int32  # number of legs of the route; 0 without a route
    leg: Int32  # the current leg
    astray: Int32  # number of decisions for which the car has been off the route
    closed: Int32  # number of rows of `InstructorArrays.closed` in use
    cut: Flag  # whether the route has more legs than there is room for


class InstructionRecord:
    """Last instruction, as `NavigationInstruction`; -1 stands for none."""

    distance: Float  # stated distance to the place of the action [m]
    time: Float  # at which it was given [s]
    kind: Int32  # `StepKind`; with `first` and `second` it identifies the step: equal steps are repetitions
    first: Int32
    second: Int32
    action: Int32  # `ActionValue`
    street: Int32  # `StreetName`
    landmark: Int32  # `LandmarkName`
    sector: Int32  # index of `junction_exits.SECTORS`
    given: Flag  # whether there is one


@by_reference
class InstructorArrays(NamedTuple):
    """Instructor of an environment.

    Attributes:
        now: (1,) its current view.
        subgoals: subgoals, as they are now.
        marks: landmarks by their rows.
        names: `StreetName` of each street of the town.
        things: static bodies in sight.
        route: (1,) goal and progress.
        legs: legs of the route, or the first of them.
        closed: places closed by roadblocks.
        ahead: (`LEGS_AHEAD`,) scratch: lanes on which roadblocks are looked for.
        said: (1,) last instruction.
    """

    now: RecordArray[ViewRecord]
    subgoals: RecordArray[SubgoalRecord]
    marks: RecordArray[MarkRecord]
    names: NDArray[np.int32]
    things: RecordArray[ThingRecord]
    route: RecordArray[RouteRecord]
    legs: RecordArray[LegRecord]
    closed: RecordArray[PlaceRecord]
    ahead: NDArray[np.int32]
    said: RecordArray[InstructionRecord]


def instructor_arrays(*, subgoals: int, landmarks: int, streets: int, things: int) -> InstructorArrays:
    """Returns the arrays of an instructor without a goal.

    Args:
        subgoals: most subgoals.
        landmarks: most landmarks.
        streets: most streets.
        things: maximum number of static bodies in sight.
    """
    arrays = InstructorArrays(
        now=argument(empty_records(ViewRecord, 1)),
        subgoals=argument(empty_records(SubgoalRecord, subgoals)),
        marks=argument(empty_records(MarkRecord, landmarks)),
        names=np.zeros(streets, dtype=np.int32),
        things=argument(empty_records(ThingRecord, things)),
        route=argument(empty_records(RouteRecord, 1)),
        legs=argument(empty_records(LegRecord, LEGS)),
        closed=argument(empty_records(PlaceRecord, CLOSED_PLACES)),
        ahead=np.zeros(LEGS_AHEAD, dtype=np.int32),
        said=argument(empty_records(InstructionRecord, 1)),
    )
    arrays.marks["lane"] = NONE
    arrays.route["subgoal"] = arrays.route["landmark"] = NONE
    return arrays
