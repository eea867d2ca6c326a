"""Task exceptions of the scripted Ad-Wizard: those that a user's own storyboard marks, and their messages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from dorothie_gym.dialogue import load_lexicon
from dorothie_gym.maps import Town
from dorothie_gym.ontology import ExceptionKind, LandmarkName
from dorothie_gym.policies.observation_parser import SeenLandmark, SeenSubgoal, read_landmarks, read_subgoals
from dorothie_gym.spaces import AdWizardAction, ObservationMapping
from dorothie_gym.tasks import is_shipped_story

PRESSING_DISTANCE = 150.0
"""Distance of the car from the place of a subgoal within which its exceptions are not postponed [m]."""

EARLIEST = 5.0
"""Earliest time of an exception that cannot be postponed, such as the first trigger of a task [s]."""


@lru_cache(maxsize=64)
def plays_every_exception(story: str) -> bool:
    """Returns whether every exception of a story is played, as of those that are not shipped."""
    return bool(story) and not is_shipped_story(story)


def story_exception(
    observation: ObservationMapping, town: Town, now: float, due: bool, rng: np.random.Generator
) -> AdWizardAction | None:
    """Returns an exception that the storyboard marks and that is possible now; None for none.

    A subgoal is changed before it is deleted. An exception that will soon be impossible is not postponed: the car is
    close to the place, or (for a trigger) to any place of an open subgoal, or no subgoal is open.

    Args:
        observation: observation of the Ad-Wizard.
        town: the map.
        now: time [s].
        due: whether an exception that can be postponed is due.
        rng: random generator of the decision.
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
    message = task_message(kind, marks[subgoal.landmark].name, rng)
    return AdWizardAction(exception=kind, item=subgoal.index, message=message)


def _options(subgoals: Sequence[SeenSubgoal]) -> Iterator[tuple[ExceptionKind, SeenSubgoal]]:
    """Yields the task exceptions that are possible now; those that exclude others come last."""
    yield from ((ExceptionKind.TASK_CHANGE, subgoal) for subgoal in subgoals if subgoal.can_change)
    yield from ((ExceptionKind.TASK_TRIGGER, subgoal) for subgoal in subgoals if subgoal.can_trigger)
    deletable = (subgoal for subgoal in subgoals if subgoal.can_delete and not subgoal.can_change)
    yield from ((ExceptionKind.TASK_DELETE, subgoal) for subgoal in deletable)


def _is_near(observation: ObservationMapping, marks: Mapping[int, SeenLandmark], subgoal: SeenSubgoal) -> bool:
    mark = marks.get(subgoal.landmark)
    x, y = float(observation["pose"][0]), float(observation["pose"][1])
    return mark is not None and math.hypot(mark.x - x, mark.y - y) < PRESSING_DISTANCE


_SENDERS = ("Your friend texts", "A message comes in", "Your phone rings", "Your sister writes", "A call from home")

_BODIES: Mapping[ExceptionKind, tuple[str, ...]] = {
    ExceptionKind.TASK_TRIGGER: (
        "could you stop at {landmark} as well?",
        "there is one more thing to do at {landmark}.",
        "please don't forget to come by {landmark} too.",
        "can you fit in {landmark} on the way?",
    ),
    ExceptionKind.TASK_DELETE: (
        "no need to go to {landmark} any more.",
        "somebody else has taken care of {landmark}.",
        "you can leave out {landmark} today.",
    ),
    ExceptionKind.TASK_CHANGE: (
        "{landmark} does not work out, have a look at the new plan.",
        "don't go to {landmark}, there is another place for that.",
        "there is a change: not {landmark}, see your list.",
    ),
}


def task_message(kind: ExceptionKind, landmark: LandmarkName, rng: np.random.Generator) -> str:
    """Returns a message to the participant with the reason for a change of its tasks.

    Args:
        kind: one of the task exceptions.
        landmark: place of the task.
        rng: random generator of the decision.
    """
    name = load_lexicon().forms(landmark, "say")[0]
    sender = _SENDERS[int(rng.integers(len(_SENDERS)))]
    bodies = _BODIES[kind]
    return f"{sender}: {bodies[int(rng.integers(len(bodies)))].format(landmark=name)}"
