"""Tables of landmarks and subgoals in observations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.session.spaces.observations import LandmarkColumn, SubgoalColumn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.session.observations import Table
    from dorothie_gym.tasks.storyboard import Landmark, TaskState


def write_landmarks(table: Table, landmarks: Sequence[Landmark]) -> None:
    """Writes landmarks as rows of `LandmarkColumn`."""
    for row, landmark in zip(table, landmarks, strict=False):
        row[LandmarkColumn.NAME] = landmark.name.value
        row[LandmarkColumn.X], row[LandmarkColumn.Y] = landmark.position
        row[LandmarkColumn.LANE], row[LandmarkColumn.STATION] = landmark.lane, landmark.station
        row[LandmarkColumn.STREET] = landmark.street


def write_subgoals(table: Table, task: TaskState, *, permissions: bool) -> None:
    """Writes the subgoals as rows of `SubgoalColumn`.

    Args:
        table: table, all rows of which are written.
        task: current state of the task.
        permissions: whether untriggered subgoals and the permitted changes of each subgoal are written.
    """
    table[:] = 0.0
    triggers, deletions, changes = task.possible_triggers(), task.possible_deletions(), task.possible_changes()
    for i, (row, subgoal) in enumerate(zip(table, task.storyboard.subgoals, strict=False)):
        live = i in task.live
        if not (live or permissions or task.status(i) is GoalStatus.ABANDONED):
            continue  # not yet triggered: unknown to the participant
        row[SubgoalColumn.LIVE] = live
        row[SubgoalColumn.LANDMARK] = task.landmark_of(i)
        row[SubgoalColumn.STATUS] = task.status(i).value
        row[SubgoalColumn.REACHED] = task.reached(i)
        row[SubgoalColumn.ALLOWED] = task.allowed(i)
        row[SubgoalColumn.AFTER] = sum(1 << k for k in subgoal.after)
        if permissions:
            row[SubgoalColumn.CAN_TRIGGER] = i in triggers
            row[SubgoalColumn.CAN_DELETE] = i in deletions
            row[SubgoalColumn.CAN_CHANGE] = i in changes
