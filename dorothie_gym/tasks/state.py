"""State of the task: live, reached, deleted and changed subgoals."""

from __future__ import annotations

from collections.abc import Callable

from dorothie_gym.errors import StoryboardError
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.tasks.storyboard import Storyboard, with_reason


class TaskState:
    """State of a storyboard during a session.

    A subgoal is live unless it awaits its trigger or has been deleted. The last live subgoal of the storyboard is the
    final destination: it is reached after all others and ends the task. A triggered subgoal that follows it in the
    storyboard becomes the new final destination. Only live subgoals count for `after`. If every subgoal of a template
    awaits its trigger, the task begins with the first trigger.

    Attributes:
        storyboard: the storyboard of the session.
        live: indices of the live subgoals, including reached ones, in the order of the storyboard.
        version: number of changes so far; an equal version means an equal state.
    """

    def __init__(self, storyboard: Storyboard) -> None:
        self.storyboard = storyboard
        count = len(storyboard.subgoals)
        self._waiting = [subgoal.trigger for subgoal in storyboard.subgoals]
        self._deleted = [False] * count
        self._changed = [False] * count
        self._reached = [False] * count
        self.version = 0
        self.live = self._find_live()

    @property
    def destination(self) -> int:
        """Index of the last live subgoal; -1 before the first trigger of a task that begins with one."""
        return self.live[-1] if self.live else -1

    @property
    def done(self) -> bool:
        """Returns whether the final destination has been reached, which ends the task."""
        return bool(self.live) and self._reached[self.destination]

    @property
    def success(self) -> bool:
        """Returns whether every live subgoal has been reached."""
        return bool(self.live) and all(self._reached[i] for i in self.live)

    def reached(self, i: int) -> bool:
        """Returns whether a subgoal has been reached."""
        return self._reached[i]

    def changed(self, i: int) -> bool:
        """Returns whether the Ad-Wizard has changed a subgoal."""
        return self._changed[i]

    def allowed(self, i: int) -> bool:
        """Returns whether a stop at the landmark would complete the subgoal now."""
        live = self.live
        if i not in live or self._reached[i]:
            return False
        before = live[:-1] if i == live[-1] else self.storyboard.subgoals[i].after
        return all(self._reached[k] for k in before if k in live)

    def status(self, i: int) -> GoalStatus:
        """Returns Complete (reached), Abandoned (deleted), Ongoing (can be completed now) or Pending (not yet)."""
        if self._reached[i]:
            return GoalStatus.COMPLETE
        if self._deleted[i]:
            return GoalStatus.ABANDONED
        return GoalStatus.ONGOING if self.allowed(i) else GoalStatus.PENDING

    def landmark_of(self, i: int) -> int:
        """Returns the current landmark of a subgoal, as an index in `Storyboard.landmarks`."""
        subgoal = self.storyboard.subgoals[i]
        if self._changed[i] and subgoal.change_landmark is not None:
            return subgoal.change_landmark
        return subgoal.landmark

    def description(self, i: int) -> str:
        """Returns the current description of a subgoal, with the reason that the storyboard gives for it.

        The description after a change contains its own reason.
        """
        subgoal = self.storyboard.subgoals[i]
        if self._changed[i] and subgoal.change is not None:
            return subgoal.change
        return with_reason(subgoal.description, subgoal.reason)

    def arrive(self, landmark: int) -> list[int]:
        """Completes all permitted subgoals at a landmark where the car has stopped.

        Args:
            landmark: index in `Storyboard.landmarks`.

        Returns:
            The completed subgoals, in order; one completion may permit the next at the same landmark.
        """
        completed: list[int] = []
        while here := [i for i in self.live if self.landmark_of(i) == landmark and self.allowed(i)]:
            self._reached[here[0]] = True
            self._note_change()
            completed.append(here[0])
        return completed

    def trigger(self, i: int) -> None:
        """Adds a subgoal that waits for its trigger; raises `StoryboardError` with the reason if it must not."""
        self._require(i, self._refuse_trigger)
        self._waiting[i] = False
        self._note_change()

    def delete(self, i: int) -> None:
        """Deletes a live subgoal; raises `StoryboardError` with the reason if this is not permitted."""
        self._require(i, self._refuse_delete)
        self._deleted[i] = True
        self._note_change()

    def change(self, i: int) -> None:
        """Changes description and place of a live subgoal; raises `StoryboardError` if this is not permitted."""
        self._require(i, self._refuse_change)
        self._changed[i] = True
        self._note_change()

    def possible_triggers(self) -> tuple[int, ...]:
        """Returns the subgoals that `trigger` would accept now."""
        return self._accepted(self._refuse_trigger)

    def possible_deletions(self) -> tuple[int, ...]:
        """Returns the subgoals that `delete` would accept now."""
        return self._accepted(self._refuse_delete)

    def possible_changes(self) -> tuple[int, ...]:
        """Returns the subgoals that `change` would accept now."""
        return self._accepted(self._refuse_change)

    def _note_change(self) -> None:
        self.version += 1
        self.live = self._find_live()

    def _find_live(self) -> tuple[int, ...]:
        return tuple(i for i, waits in enumerate(self._waiting) if not waits and not self._deleted[i])

    def _accepted(self, refuse: Callable[[int], str | None]) -> tuple[int, ...]:
        return tuple(i for i in range(len(self.storyboard.subgoals)) if refuse(i) is None)

    def _require(self, i: int, refuse: Callable[[int], str | None]) -> None:
        count = len(self.storyboard.subgoals)
        reason = refuse(i) if 0 <= i < count else f"there is no such subgoal; use 0 to {count - 1}"
        if reason is not None:
            raise StoryboardError(self.storyboard.name, f"subgoals[{i}]", reason)

    def _refuse_trigger(self, i: int) -> str | None:
        if not self.storyboard.subgoals[i].trigger:
            return "is part of the task from the start; only subgoals marked `trigger` can be triggered"
        if not self._waiting[i]:
            return "has been triggered already"
        return "cannot be triggered, as the task is done" if self.done else None

    def _refuse_delete(self, i: int) -> str | None:
        subgoal = self.storyboard.subgoals[i]
        if not subgoal.delete:
            return "cannot be deleted, as the template does not mark it `delete`"
        if (reason := self._not_open(i)) is not None:
            return f"cannot be deleted, as {reason}"
        if i == self.destination:
            return "cannot be deleted, as it is the destination"
        until = subgoal.delete_after_subgoal
        if until is not None and not self._reached[until]:
            return f"cannot be deleted before subgoal {until} is reached"
        return None

    def _refuse_change(self, i: int) -> str | None:
        if self.storyboard.subgoals[i].change is None:
            return "cannot be changed, as the template does not mark it `change`"
        if (reason := self._not_open(i)) is not None:
            return f"cannot be changed, as {reason}"
        return "has been changed already" if self._changed[i] else None

    def _not_open(self, i: int) -> str | None:
        """Returns the reason why a subgoal cannot be reached now or any more; None if it can."""
        if self._waiting[i]:
            return "it is not part of the task yet"
        if self._deleted[i]:
            return "it has been deleted"
        return "it has been reached" if self._reached[i] else None
