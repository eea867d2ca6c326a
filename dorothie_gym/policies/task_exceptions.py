"""Task exceptions of the scripted Ad-Wizard: those that a user's own storyboard marks, and their messages."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal, read_landmarks, read_subgoals
from dorothie_gym.session.spaces.actions import AdWizardAction
from dorothie_gym.session.spaces.fields import MESSAGE_LENGTH
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks.parsing import is_shipped_story
from dorothie_gym.tasks.storyboard import BECAUSE

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.observations import ObservationMapping

PRESSING_DISTANCE = 150.0
"""Distance of the car from the place of a subgoal within which its exceptions are not postponed [m]."""

EARLIEST = 5.0
"""Earliest time of an exception that cannot be postponed, such as the first trigger of a task [s]."""


@lru_cache(maxsize=64)
def plays_every_exception(story: str) -> bool:
    """Returns whether all exceptions of a story are played, as for storyboards that are not shipped."""
    return bool(story) and not is_shipped_story(story)


def story_exception(observation: ObservationMapping, town: Town, now: float, due: bool) -> AdWizardAction | None:
    """Returns an exception that the storyboard marks and that is possible now; None if there is none.

    A subgoal is changed before it is deleted. An exception that will soon be impossible is not postponed: the car is
    close to the place, or (for a trigger) to any place of an open subgoal, or no subgoal is open.

    Args:
        observation: observation of the Ad-Wizard.
        town: the map.
        now: time [s].
        due: whether an exception that can be postponed is due.
    """
    subgoals = read_subgoals(observation)
    marks = {mark.row: mark for mark in read_landmarks(observation, town)}
    options = [(kind, subgoal) for kind, subgoal in _options(subgoals) if subgoal.landmark in marks]
    if not due:
        near = {subgoal.index for subgoal in subgoals if subgoal.open and _is_near(observation, marks, subgoal)}
        idle = not any(subgoal.open for subgoal in subgoals)
        options = [
            (kind, subgoal)
            for kind, subgoal in options
            if (idle or near if kind is ExceptionKind.TASK_TRIGGER else subgoal.index in near)
        ]
    if not options or now < EARLIEST:
        return None
    kind, subgoal = options[0]
    message = task_message(observation, kind, subgoal.index)
    return AdWizardAction(exception=kind, item=subgoal.index, message=message)


def _options(subgoals: Sequence[SeenSubgoal]) -> Iterator[tuple[ExceptionKind, SeenSubgoal]]:
    """Yields the task exceptions that are possible now, those that exclude others last."""
    yield from ((ExceptionKind.TASK_CHANGE, subgoal) for subgoal in subgoals if subgoal.can_change)
    yield from ((ExceptionKind.TASK_TRIGGER, subgoal) for subgoal in subgoals if subgoal.can_trigger)
    deletable = (subgoal for subgoal in subgoals if subgoal.can_delete and not subgoal.can_change)
    yield from ((ExceptionKind.TASK_DELETE, subgoal) for subgoal in deletable)


def _is_near(observation: ObservationMapping, marks: Mapping[int, SeenLandmark], subgoal: SeenSubgoal) -> bool:
    mark = marks.get(subgoal.landmark)
    x, y = float(observation["pose"][0]), float(observation["pose"][1])
    return mark is not None and pm.hypot(mark.x - x, mark.y - y) < PRESSING_DISTANCE


_OPENINGS: Mapping[ExceptionKind, str] = {
    ExceptionKind.TASK_TRIGGER: "New on your list",
    ExceptionKind.TASK_DELETE: "Off your list",
    ExceptionKind.TASK_CHANGE: "Change of plan",
}
_FIELDS: Mapping[ExceptionKind, str] = {
    ExceptionKind.TASK_TRIGGER: "trigger_messages",
    ExceptionKind.TASK_DELETE: "delete_messages",
    ExceptionKind.TASK_CHANGE: "change_messages",
}


def task_message(observation: ObservationMapping, kind: ExceptionKind, subgoal: int) -> str:
    """Returns a message to the participant about a change of its tasks.

    It is the message in the storyboard, or else the storyboard's description of the task, with its reason if it
    gives one: "New on your list: Buy milk at Ikea, because the shop next door is closed".

    Args:
        observation: observation of the Ad-Wizard.
        kind: one of the task exceptions.
        subgoal: number of the subgoal.
    """
    if message := _line(observation, _FIELDS[kind], subgoal):
        return message
    described = _line(observation, "changes" if kind is ExceptionKind.TASK_CHANGE else "tasks", subgoal)
    if kind is ExceptionKind.TASK_DELETE:
        described = described.partition(BECAUSE)[0]  # the reason is that of the task, not of its end
    text = f"{_OPENINGS[kind]}: {described or f'task {subgoal + 1}'}"
    return textwrap.shorten(text, MESSAGE_LENGTH, placeholder=" ...")


def _line(observation: ObservationMapping, field: str, subgoal: int) -> str:
    """Returns a subgoal's line of a text; empty if the text has none."""
    lines = str(observation[field]).split("\n")
    return lines[subgoal] if subgoal < len(lines) else ""
