"""Storyboards: templates with `$NAME` references, the storyboard bound to a town, and the state of its task."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Protocol

from dorothie_gym.errors import StoryboardError
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.support.copying import shared

MESSAGE_LENGTH = 240
"""Greatest length of a message of the Ad-Wizard [characters]."""

_REFERENCE = re.compile(r"\$([A-Za-z_]\w*)")


@dataclass(frozen=True, kw_only=True)
class Variable:
    """Name that is bound to a landmark whose category starts with `category`."""

    name: str
    category: str


@dataclass(frozen=True, kw_only=True)
class Dependent:
    """Name that is bound to one attribute value of the landmark of a variable."""

    name: str
    variable: str
    attribute: str


class Channel(enum.StrEnum):
    """Way in which a message reaches the participant; `WARNING` is one of the car or of another device."""

    CALL = "call"
    TEXT_MESSAGE = "text message"
    VOICE_MESSAGE = "voice message"
    EMAIL = "e-mail"
    NOTE = "note"
    RADIO_CALL = "radio call"
    WARNING = "warning"


@dataclass(frozen=True, kw_only=True)
class TaskMessage:
    """Message to the participant about a change of its tasks.

    Attributes:
        sender: person or device that sent the message, e.g. "Priya", "your sister", "the dashboard".
        channel: medium by which it reaches the participant.
        text: words of the sender, with the reason for the change.
    """

    sender: str
    channel: Channel
    text: str

    def __str__(self) -> str:
        """Returns the message as the participant reads it, e.g. "Call from Priya: The vet closes early, so hurry."."""
        return f"{self.channel.capitalize()} from {self.sender}: {self.text}"

    def filled(self, values: Mapping[str, str]) -> TaskMessage:
        """Returns the message with its references replaced."""
        return TaskMessage(sender=fill(self.sender, values), channel=self.channel, text=fill(self.text, values))


@dataclass(frozen=True, kw_only=True)
class TaskMessages:
    """Messages of a subgoal, by the task exception that they accompany; None where the storyboard has none."""

    trigger: TaskMessage | None = None
    delete: TaskMessage | None = None
    change: TaskMessage | None = None

    def of(self, kind: ExceptionKind) -> TaskMessage | None:
        """Returns the message of a task exception."""
        match kind:
            case ExceptionKind.TASK_TRIGGER:
                return self.trigger
            case ExceptionKind.TASK_DELETE:
                return self.delete
            case ExceptionKind.TASK_CHANGE:
                return self.change
        return None

    def given(self) -> Iterator[tuple[str, TaskMessage]]:
        """Yields (name of the field, message) for the messages that are given."""
        for field in fields(self):
            message: TaskMessage | None = getattr(self, field.name)
            if message is not None:
                yield field.name, message

    def filled(self, values: Mapping[str, str]) -> TaskMessages:
        """Returns the messages with their references replaced."""
        return TaskMessages(**{name: message.filled(values) for name, message in self.given()})


NO_MESSAGES = TaskMessages()
"""Messages of a subgoal for which the storyboard gives none."""


@dataclass(frozen=True, kw_only=True)
class SubgoalTemplate:
    """Subgoal of a template.

    Attributes:
        destination: "$VARIABLE", or the ontology label of a landmark.
        description: text with `$NAME` references.
        after: indices of the subgoals that must be reached before.
        trigger: whether the subgoal is inactive until the Ad-Wizard triggers it.
        delete: whether the Ad-Wizard may delete the subgoal.
        change: description after a change by the Ad-Wizard; None if the subgoal cannot change.
        change_destination: destination after the change; None if it stays the same.
        delete_after_subgoal: index of the subgoal that must be reached before a deletion; None for no condition.
        leaves: whether the person at the destination disappears once the subgoal is reached.
        reason: why the subgoal matters, a clause as after "because"; None if the template does not say.
        messages: messages to the participant when the Ad-Wizard triggers, deletes or changes the subgoal.
    """

    destination: str
    description: str
    after: tuple[int, ...] = ()
    trigger: bool = False
    delete: bool = False
    change: str | None = None
    change_destination: str | None = None
    delete_after_subgoal: int | None = None
    leaves: bool = False
    reason: str | None = None
    messages: TaskMessages = NO_MESSAGES


@shared
@dataclass(frozen=True, kw_only=True)
class StoryboardTemplate:
    """Storyboard template (paper, appendix "Task Configuration"); `parse_template` creates and validates it.

    Attributes:
        name: name in error messages and listings.
        story: text with `$NAME` references.
        subgoals: subgoals in order; the last live one is the final destination.
        variables: names bound to landmarks.
        dependents: names bound to attribute values.
        hidden: variables whose positions are hidden from the Co-Wizard, in the order of the file.
    """

    name: str
    story: str
    subgoals: tuple[SubgoalTemplate, ...]
    variables: tuple[Variable, ...] = ()
    dependents: tuple[Dependent, ...] = ()
    hidden: tuple[str, ...] = ()

    def destinations(self) -> tuple[str, ...]:
        """Returns the distinct destinations of all subgoals, including those after changes."""
        both = ((subgoal.destination, subgoal.change_destination) for subgoal in self.subgoals)
        return tuple(dict.fromkeys(ref for pair in both for ref in pair if ref is not None))

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yields (field, text) for all texts that may contain references."""
        yield "story", self.story
        for index, subgoal in enumerate(self.subgoals):
            yield f"subgoals[{index}].description", subgoal.description
            if subgoal.change is not None:
                yield f"subgoals[{index}].change", subgoal.change
            if subgoal.reason is not None:
                yield f"subgoals[{index}].reason", subgoal.reason
            for kind, message in subgoal.messages.given():
                yield f"subgoals[{index}].messages.{kind}.from", message.sender
                yield f"subgoals[{index}].messages.{kind}.text", message.text


def variable_of(destination: str) -> str | None:
    """Returns the variable of a destination; None if the destination names a landmark."""
    return destination[1:] if destination.startswith("$") else None


def references(text: str) -> tuple[str, ...]:
    """Returns the names of the `$NAME` references in a text, in order."""
    return tuple(_REFERENCE.findall(text))


def fill(text: str, values: Mapping[str, str]) -> str:
    """Returns the text with each `$NAME` replaced by its value."""
    return _REFERENCE.sub(lambda match: values[match[1]], text)


BECAUSE = ", because "
"""Words between a description and its reason."""


def with_reason(description: str, reason: str | None) -> str:
    """Returns a description with its reason, e.g. "Buy milk at Ikea, because the shop next door is closed"."""
    return description if reason is None else f"{description.rstrip(' .')}{BECAUSE}{reason}"


# --- storyboards bound to a town --------------------------------------------------------------------------------------


class LandmarkSite(Protocol):
    """Candidate site of a landmark in a town (the `Site` of a town implements it)."""

    @property
    def id(self) -> int:
        """Id of the site in its town."""
        ...

    @property
    def lane(self) -> int:
        """Id of the lane that gives access."""
        ...

    @property
    def station(self) -> float:
        """Distance of the waypoint along the lane [m]."""
        ...

    @property
    def position(self) -> tuple[float, float]:
        """Position of the landmark (x, y) [m]."""
        ...

    @property
    def waypoint(self) -> tuple[float, float]:
        """Closest point on the lane (x, y) [m]."""
        ...

    @property
    def street(self) -> int:
        """Index of the street."""
        ...


@shared
@dataclass(frozen=True, kw_only=True)
class Landmark:
    """Landmark at its site.

    Attributes:
        index: index in `Storyboard.landmarks`.
        name: landmark of the ontology.
        label: name on maps; several houses and people are numbered.
        category: dotted category.
        site: id of the site.
        lane: id of the lane that gives access.
        station: distance of the waypoint along the lane [m].
        position: position of the landmark (x, y) [m].
        waypoint: closest point on the lane (x, y) [m].
        street: index of the street.
        hidden: whether the position is hidden from the Co-Wizard.
    """

    index: int
    name: LandmarkName
    label: str
    category: str
    site: int
    lane: int
    station: float
    position: tuple[float, float]
    waypoint: tuple[float, float]
    street: int
    hidden: bool


@shared
@dataclass(frozen=True, kw_only=True)
class Subgoal:
    """Subgoal with texts filled in and landmarks given by index; fields as in `SubgoalTemplate`."""

    landmark: int
    description: str
    after: tuple[int, ...] = ()
    trigger: bool = False
    delete: bool = False
    change: str | None = None
    change_landmark: int | None = None
    delete_after_subgoal: int | None = None
    leaves: bool = False
    reason: str | None = None
    messages: TaskMessages = NO_MESSAGES


@shared
@dataclass(frozen=True, kw_only=True)
class Storyboard:
    """Storyboard bound to a town.

    Attributes:
        name: name of the template.
        story: text for the participant.
        subgoals: subgoals in the order of the template, including those that await their trigger.
        landmarks: all landmarks of the town. The first ten are those of the ontology, in the order of its ids; further
            houses and people follow.
    """

    name: str
    story: str
    subgoals: tuple[Subgoal, ...]
    landmarks: tuple[Landmark, ...]


# --- State of the task ------------------------------------------------------------------------------------------------
# State of the task: live, reached, deleted and changed subgoals.


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
