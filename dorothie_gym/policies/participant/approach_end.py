"""End of an approach as people describe it: the side of the street, and what stands beside the place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.maps.whereabouts import is_on_right, signals_near
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass
from dorothie_gym.policies.participant.target_hints import corner_fact, famous_nearby
from dorothie_gym.policies.place_looks import distinguishing_look
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.policies.observation_parser import SeenLandmark
    from dorothie_gym.policies.participant.state import ParticipantState, StepKey
    from dorothie_gym.policies.participant.view import ParticipantView

_BESIDE = 40.0
"""Distance within which a landmark marks the end of an approach [m]."""


class _Mark(NamedTuple):
    """Mark beside the place: the fact, the topic of its words, and the arguments that are not spoken."""

    fact: Proposition
    topic: str
    elided: tuple[str, ...] = ("place",)


def ending(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns the remark on the side of the street and on what stands there; nothing if it was said already."""
    goal = state.task.goal
    if goal is None:
        return ()
    side = _side_of(state, goal)
    marks = [mark for mark in _marks(state, view, goal) if mark.fact not in state.task.told]
    if not marks:
        return () if goal.name is LandmarkName.PERSON else side_fact(state, goal)
    fact, topic, elided = marks[int(rng.integers(len(marks)))]
    located = Proposition.of(Predicate.LOCATED, place=goal.name, side=side)
    state.task = state.task.after_telling(located).after_telling(fact)
    wording = Wording(topic=topic, direction=side)
    said = intend(CommunicativeFunction.INFORM, fact, located, elided=elided, wording=wording, joined=True)
    return (said,)


def side_fact(state: ParticipantState, goal: SeenLandmark) -> tuple[Remark, ...]:
    """Returns the remark on the side of the street; nothing if it was said already."""
    side = _side_of(state, goal)
    located = Proposition.of(Predicate.LOCATED, place=goal.name, side=side)
    if located in state.task.told:
        return ()
    state.task = state.task.after_telling(located)
    wording = Wording(topic="located_side", direction=side)
    return (intend(CommunicativeFunction.INFORM, located, elided=("place",), wording=wording, joined=True),)


def ending_behind(
    state: ParticipantState, view: ParticipantView, last: StepKey, rng: np.random.Generator
) -> tuple[Remark, ...]:
    """Returns the remark on the end of the way behind a turn, if that turn is the last one of the route."""
    progress = state.route.progress
    turns = [] if progress is None else list(progress.crossings(state.town, view.station))
    if not turns or (turns[-1].lane, turns[-1].exit.connector) != last[1:]:
        return ()
    if progress is None or any(leg.entry is LaneEntry.U_TURN for leg in progress.legs[1:]):
        return ()
    return ending(state, view, rng)


def _side_of(state: ParticipantState, goal: SeenLandmark) -> Direction:
    return Direction.RIGHT if is_on_right(state.town, goal.lane, goal.x, goal.y) else Direction.LEFT


def _marks(state: ParticipantState, view: ParticipantView, goal: SeenLandmark) -> Iterator[_Mark]:
    """Yields what stands beside a place, or tells it from its neighbours."""
    look = distinguishing_look(state.town, goal, view.landmarks)
    if goal.name is LandmarkName.PERSON:  # who is no "it"
        if look is not None:
            person = ObjectClass.PEDESTRIAN
            fact = Proposition.of(Predicate.LOOKS, place=goal.name, object=person, feature=look.listed)
            yield _Mark(fact, "at_end_person")
        return
    near = famous_nearby(goal, view, _BESIDE)
    if near is not None and view.unique(near):
        yield _Mark(Proposition.of(Predicate.NEAR, place=goal.name, landmark=near.name), "at_end")
    signs = signals_near(state.town, goal.x, goal.y)
    if SignalKind.TRAFFIC_LIGHT in signs:
        yield _Mark(Proposition.of(Predicate.NEAR, place=goal.name, object=ObjectClass.TRAFFIC_LIGHT), "at_end")
    elif SignalKind.STOP in signs:
        yield _Mark(Proposition.of(Predicate.NEAR, place=goal.name, object=ObjectClass.TRAFFIC_SIGN), "at_end")
    corner = corner_fact(state, view, goal)
    if corner is not None:
        yield _Mark(corner, "at_end")
    if look is not None:
        yield _Mark(Proposition.of(Predicate.LOOKS, place=goal.name, feature=look.house), "at_end_house", ())
