"""State of a decision of the navigation environments in arrays: of one environment, or of each of a batch."""

from __future__ import annotations

import enum
from typing import Annotated, Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.navigation.ad_wizard_trigger import PlansRecord
from dorothie_gym.maps.model import Array
from dorothie_gym.support.compilation.records import Flag, Float, Int32, RecordArray, by_reference, gives_row

CRUISE_LIMIT: Final = 100
"""Refusal of a cruise speed out of its range; the other codes are those of `codes.Refusal`."""


class Stage(enum.IntEnum):
    """Next part of a decision."""

    DONE = 0
    """None: the decision is complete."""
    ACTING = 1
    """The action must be carried out."""
    MOVING = 2
    """Sensor faults may have ended: Python must check before the rest of the physics is stepped."""
    NO_SPACE = 3
    """The arrays have no room for the path; with longer ones, see `world_arrays.lengthened`, `act` continues."""
    GUIDING = 4
    """The instructor must speak."""
    NO_COSTS = 5
    """Python must add the costs to the goal, because a roadblock has been seen; then the episode must be judged."""
    LOST = 6
    """The ego has left its path: `act` must lay a new one."""
    OBSERVING = 7
    """Only the observation must be written."""


class Event(enum.IntFlag):
    """Rare events of a decision, which Python handles."""

    WAITS = 1
    """A stage needs Python: `MOVING`, `NO_SPACE` or `NO_COSTS`."""
    NEAR = 2
    """The ego stands near a waypoint."""
    LOST = 4
    """The stage is `LOST`."""
    TOLD = 8
    """An instruction changes the Co-Wizard's beliefs."""


EVENTS: Final = 2
"""Column of `threads.turns_of` in which a thread records the events of its environments."""


class DriveRecord:
    """Decision of an environment."""

    controls: Annotated[NDArray[np.float64], "f8", (3,)]  # throttle, steer (positive right), brake
    speed: Float  # of the ego at its start [m/s]
    since: Float  # time of its start [s]
    goal_station: Float  # goal that progress is measured to [m]
    goal_lane: Int32  # -1 for none
    costs: Int32  # row of the costs to it
    new_costs: Int32  # row of the costs that were missing
    closed: Int32  # number of closed places that these costs know
    landmark: Int32  # landmark of the goal, -1 for none
    action: Int32  # `NavigationAction`
    order: Int32  # `PhysicalAction` that it stands for, or 0
    stage: Int32  # `Stage`
    refusal: Int32  # `codes.Refusal` or `CRUISE_LIMIT`
    refused: Int32  # belief updates that were refused before
    left: Int32  # substeps that are still to be made
    told_lane: Int32  # place of a goal that is not on the map, at the stated distance ahead; -1 for none
    told_station: Int32  # [m]
    halfway: Flag  # whether the action is carried out, so that only the physics must be stepped
    lost: Flag  # whether a new path must be laid
    begins: Flag  # whether the episode begins, so that there is nothing to judge
    faulty: Flag  # whether sensors are faulty, and may work again during the decision
    near: Flag  # whether the ego stands near a waypoint
    said: Flag  # whether an instruction was given at this decision
    fresh: Flag  # whether the goal has changed at this decision
    told: Flag  # whether either changes what the Co-Wizard believes; Python queues the belief updates


@by_reference
class DriveArrays(NamedTuple):
    """Decision of an environment in arrays, or of each of a batch.

    Attributes:
        state: (1,) the decision.
        rows: int32 (landmarks,) row of the costs to each landmark, without roadblocks.
        waypoints: (landmarks, 2) places where the ego arrives [m].
        plans: (1,) plans of the scripted Ad-Wizard.
    """

    state: RecordArray[DriveRecord]
    rows: NDArray[np.int32]
    waypoints: Array
    plans: RecordArray[PlansRecord]


@by_reference
class DrivingTown(NamedTuple):
    """Objects that all environments of a town share, besides its arrays.

    Attributes:
        sectors: int32 sector of each exit of the route tables, or -1.
        costs: (rows, cells + lanes) costs to goals, see `cost_to_go.cost_from`.
        max_seconds: time limit of an episode [s].
        pedals: whether the drivers use throttle, steering and brake; else they choose a `NavigationAction`.
    """

    sectors: NDArray[np.int32]
    costs: Array
    max_seconds: float
    pedals: bool


T = TypeVar("T", bound=tuple[Any, ...])


@gives_row
def row_of(batch: T, number: int) -> T:
    """Returns a row of each array of a named tuple: views, of the same types as those of a single environment."""
    return type(batch)(*(array[number] for array in batch))
