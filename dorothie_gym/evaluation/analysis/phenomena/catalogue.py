"""Catalogue of the 24 phenomena, each with its cause and its query."""

from __future__ import annotations

from functools import partial
from typing import Final

from dorothie_gym.evaluation.analysis.phenomena import changes, questions, routes
from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import DialogueView, Phenomenon, Query, both_speak
from dorothie_gym.ontology.world_exceptions import ExceptionKind

_TALK = "both sides speak"


def _always(number: int, title: str, find: Query, *forms: str) -> Phenomenon:
    return Phenomenon(number=number, title=title, cause=_TALK, has_cause=both_speak, find=find, forms=forms)


def _task(number: int, title: str, kind: ExceptionKind, cause: str, find: Query, *forms: str) -> Phenomenon:
    happens = partial(_happens, kind)
    return Phenomenon(number=number, title=title, cause=cause, has_cause=happens, find=find, forms=forms)


def _happens(kind: ExceptionKind, talk: DialogueView) -> bool:
    return changes.task_exception(talk, kind)


PHENOMENA: Final[tuple[Phenomenon, ...]] = (
    _always(1, "goal-level instruction, taken up", routes.goal_level, "goal"),
    _always(2, "step-level instruction, taken up", routes.step_level, "step"),
    _always(3, "two acts in one utterance", routes.two_acts, "two acts"),
    Phenomenon(
        number=4,
        title="question at a junction",
        cause="the car turns at a junction",
        has_cause=routes.turns_at_junctions,
        find=routes.asked_at_junction,
        forms=("answered",),
    ),
    _always(5, "yes/no question answered", questions.yes_no, "yes", "no", "unsure"),
    _always(6, "check, and its answer", questions.check, "confirmed", "denied"),
    _always(7, "align, and its answer", questions.align, "understood", "repaired"),
    Phenomenon(
        number=8,
        title="hidden place described and guessed",
        cause="a goal is hidden from the car",
        has_cause=changes.has_hidden_goal,
        find=changes.hidden_place,
        forms=("described", "described, refined"),
    ),
    Phenomenon(
        number=9,
        title="roadblock reported and bypassed",
        cause="the car comes near an object placed on the road",
        has_cause=changes.meets_roadblock,
        find=changes.roadblock,
        forms=("proposed", "instructed"),
    ),
    Phenomenon(
        number=10,
        title="fog, rain, night: slower, lights",
        cause="fog, rain or dusk sets in",
        has_cause=changes.has_dim_weather,
        find=changes.dim_weather,
        forms=("slower", "lights"),
    ),
    _task(11, "task added", ExceptionKind.TASK_TRIGGER, "a task is triggered", changes.task_added,
          "negotiated", "taken up"),
    _task(12, "task changed under way", ExceptionKind.TASK_CHANGE, "a task is changed", changes.task_changed,
          "both named", "in two steps"),
    _task(13, "task deleted, or resumed", ExceptionKind.TASK_DELETE, "a task is deleted", changes.task_deleted,
          "given up", "resumed"),
    Phenomenon(
        number=14,
        title="completion",
        cause="a goal is reached before the end of the drive",
        has_cause=changes.completes,
        find=changes.completion,
        forms=("reported", "asked"),
    ),
    _always(15, "perception asked for", questions.perception, "seen", "not seen"),
    Phenomenon(
        number=16,
        title="question for a reason",
        cause="the car stops by itself, or turns round",
        has_cause=questions.acts_by_itself,
        find=questions.reason,
        forms=("explained",),
    ),
    _always(17, "plan described on request", routes.plan_on_request, "described"),
    Phenomenon(
        number=18,
        title="correction of a wrong turn",
        cause="the car turns at a junction",
        has_cause=routes.turns_at_junctions,
        find=routes.wrong_turn,
        forms=("corrected", "answered"),
    ),
    _always(19, "overlapping exchanges", questions.overlap, "both answered"),
    _always(20, "irrelevant talk", questions.irrelevant, "human", "car"),
    Phenomenon(
        number=21,
        title="abandoned exchange",
        cause="a speaker asks a question",
        has_cause=questions.has_question,
        find=questions.abandoned,
        forms=("asked again", "dropped"),
    ),
    _always(22, "reference instead of a name", routes.references, "human", "car"),
    Phenomenon(
        number=23,
        title="negotiation",
        cause="a roadblock is met, a task is added or changed",
        has_cause=changes.gives_cause_to_negotiate,
        find=changes.negotiation,
        forms=("accepted", "insisted"),
    ),
    Phenomenon(
        number=24,
        title="speech trouble repaired",
        cause="a recogniser misheard the participant",
        has_cause=questions.has_mishearing,
        find=questions.speech_trouble,
        forms=("not understood", "misunderstood"),
    ),
)  # fmt: skip
"""Phenomena 1 to 24 in the order of the spec."""
