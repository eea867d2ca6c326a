"""Contexts that the Ad-Wizard gives to the participant when it changes a task."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dorothie_gym.dialogue import load_lexicon
from dorothie_gym.ontology import ExceptionKind, LandmarkName

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


def context(kind: ExceptionKind, landmark: LandmarkName, rng: np.random.Generator) -> str:
    """A message that tells why a task is added, dropped or changed.

    Args:
        kind: one of the task exceptions.
        landmark: the place of the task.
        rng: chooses the words.
    """
    name = load_lexicon().forms(landmark, "say")[0]
    sender = _SENDERS[int(rng.integers(len(_SENDERS)))]
    bodies = _BODIES[kind]
    return f"{sender}: {bodies[int(rng.integers(len(bodies)))].format(landmark=name)}"
