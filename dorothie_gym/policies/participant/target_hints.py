"""Hints that help to find the target, from the participant's map and the look of the place; expressions of feelings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.whereabouts import corner_of, is_on_right, signals_near
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.observation_parser import SeenLandmark, street_of
from dorothie_gym.policies.place_looks import distinguishing_look, look_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import DENSE, sight
from dorothie_gym.tasks.landmark_designs import features_of

if TYPE_CHECKING:
    from dorothie_gym.dialogue.looks import Appearance
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

FAMOUS = frozenset(LandmarkName) - {
    LandmarkName.HOUSE,
    LandmarkName.PERSON,
    LandmarkName.UNKNOWN,
    LandmarkName.QUERIED,
}
"""Landmarks that help to describe another place."""

_SIGNS = {
    SignalKind.TRAFFIC_LIGHT: ObjectClass.TRAFFIC_LIGHT,
    SignalKind.STOP: ObjectClass.TRAFFIC_SIGN,
    SignalKind.YIELD: ObjectClass.TRAFFIC_SIGN,
    SignalKind.SPEED: ObjectClass.TRAFFIC_SIGN,
}

_CLOSE, _FAR = 120.0, 220.0
"""Largest route length to a target that is called close, and smallest to one that is called far [m]."""

_IN_MIND = 12.0
"""Time for which a place that was named is understood as "it" [s]."""

_AS_NOUN = 0.5
"""Probability that a house is described by a noun phrase: "the yellow house with the black roof"."""

_AS_BUILDING = 0.4
"""Probability that it is otherwise called a building."""

_FEELINGS = 0.25
"""Probability of a remark about a feeling that has a cause, instead of a hint."""


def hint(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns a remark that helps to find the target or expresses a feeling; nothing if there is no new one."""
    felt = _feeling(state, view)
    if felt is not None and rng.random() < _FEELINGS:
        return (_said(state, felt),)
    if not state.guidance.guiding or not state.task.announced:
        return ()  # a car that finds its own route need not be told where the place is, nor how far
    named = is_in_mind(state, view)
    facts = [fact for fact in _facts(state, view) if fact not in state.task.told and (named or _can_name(fact))]
    if not facts:
        return ()
    return (_said(state, facts[int(rng.integers(len(facts)))], names_place=not named),)


def is_in_mind(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether "it" refers to the target because one of the speakers has just named it."""
    goal, speech = state.task.goal, state.speech
    recent = speech.said[-1:] if speech.has_just_spoken(view.time, _IN_MIND) else ()
    named = {value for item in (*recent, *speech.queue) for value in item.act.slots}
    person = goal is not None and goal.name is LandmarkName.PERSON  # who is no "it"
    return goal is not None and goal.name in named | speech.heard and not person


def _can_name(fact: Proposition) -> bool:
    """Returns whether a fact can be said together with the name of the place: not if it names another place."""
    return fact.get("landmark") is None


def looks_remark(
    state: ParticipantState, view: ParticipantView, goal: SeenLandmark, rng: np.random.Generator
) -> tuple[Remark, ...]:
    """Returns a remark on the look of a place, which tells a house or person from others; none if it is unknown."""
    individual, told = distinguishing_look(state.town, goal, view.landmarks), _features_told(state)
    if individual is not None and told.isdisjoint((individual.listed, individual.house)):
        return (_said(state, _distinguished(goal, individual, rng)),)
    features = list(_looks(state, goal))
    return (_said(state, features[int(rng.integers(len(features)))]),) if features else ()


def _distinguished(goal: SeenLandmark, look: Appearance, rng: np.random.Generator) -> Proposition:
    """Returns the statement that tells a house or person from the others: of its features, or as a noun phrase."""
    if goal.name is LandmarkName.PERSON:
        return Proposition.of(Predicate.LOOKS, place=goal.name, object=ObjectClass.PEDESTRIAN, feature=look.listed)
    if rng.random() < _AS_NOUN:
        return Proposition.of(Predicate.LOOKS, place=goal.name, feature=look.house)
    kind = ObjectClass.BUILDING if rng.random() < _AS_BUILDING else None
    return Proposition.of(Predicate.LOOKS, place=goal.name, object=kind, feature=look.listed)


def famous_nearby(goal: SeenLandmark, view: ParticipantView, within: float) -> SeenLandmark | None:
    """Returns the well-known landmark closest to the target, if one is near [m]."""
    found = [
        (abs(other.x - goal.x) + abs(other.y - goal.y), other.row, other)
        for other in view.landmarks
        if other.name in FAMOUS and other.name is not goal.name
    ]
    return min(found)[2] if found and min(found)[0] < within else None


def _said(state: ParticipantState, content: Proposition, *, names_place: bool = False) -> Remark:
    """Returns the remark that states a proposition, and remembers it; `names_place` says the name instead of "it"."""
    state.task = state.task.after_telling(content)
    side, topic = content.get("side"), str(content.predicate)
    if content.predicate is Predicate.LOCATED:
        topic = next(f"located_{name}" for name in ("side", "cross", "street") if content.get(name) is not None)
    if content.predicate is Predicate.FEELS:
        topic = f"feels_{content.get('feeling')}"
    if content.predicate is Predicate.LOOKS and str(content.get("feature")).startswith("the "):
        topic = "looks_like"
    topic = f"{'not_' * content.negated}{topic}"
    wording = Wording(topic=topic, direction=side if isinstance(side, Direction) else None)
    names_place = names_place or topic == "looks_like"
    elided = ("cause",) if names_place else ("place", "cause")
    return intend(CommunicativeFunction.INFORM, content, elided=elided, wording=wording, joined=True)


def _facts(state: ParticipantState, view: ParticipantView) -> Iterator[Proposition]:
    """Yields known facts about the route to the target and about its place."""
    goal, progress = state.task.goal, state.route.progress
    if goal is None:
        return
    if progress is not None:
        left = progress.left(view.station)
        if left < _CLOSE or left > _FAR:
            yield Proposition.of(Predicate.CLOSE, place=goal.name, negated=left > _FAR)
        direct = not progress.turns_round_first(state.town, view.station)
        if direct and progress.next_crossing(state.town, view.station) is None:
            yield Proposition.of(Predicate.LOCATED, place=goal.name, side=_side(state, view, goal))
    if goal.street is not StreetName.UNKNOWN and street_of(view.raw, state.town, view.lane) is goal.street:
        yield Proposition.of(Predicate.LOCATED, place=goal.name, street=goal.street)
    corner = corner_fact(state, view, goal)
    if corner is not None:
        yield corner
    near = famous_nearby(goal, view, state.config.near_landmark)
    if near is not None:
        yield Proposition.of(Predicate.NEAR, place=goal.name, landmark=near.name)
    signs = signals_near(state.town, goal.x, goal.y)
    for sign in dict.fromkeys(_SIGNS[kind] for kind in _SIGNS if kind in signs):
        yield Proposition.of(Predicate.NEAR, place=goal.name, object=sign)
    yield from _looks(state, goal)


def corner_fact(state: ParticipantState, view: ParticipantView, goal: SeenLandmark) -> Proposition | None:
    """Returns the corner at which a place lies; None if there is none, or if the streets have no names."""
    cross = corner_of(state.town, state.town.lanes[goal.lane].street, goal.x, goal.y)
    names = view.raw["street_names"]
    crossing = StreetName(int(names[cross])) if cross is not None and cross < len(names) else StreetName.UNKNOWN
    if StreetName.UNKNOWN in (crossing, goal.street) or crossing is goal.street:
        return None
    return Proposition.of(Predicate.LOCATED, place=goal.name, street=goal.street, cross=crossing)


def _features_told(state: ParticipantState) -> set[str]:
    features = (said.get("feature") for said in state.task.told)
    return {feature for feature in features if isinstance(feature, str)}


def _looks(state: ParticipantState, goal: SeenLandmark) -> Iterator[Proposition]:
    person, look = goal.name is LandmarkName.PERSON, look_of(state.town, goal)
    told = _features_told(state)
    single = features_of(goal.name) if look is None else replace(look, storeys=None).features
    for feature in (each for each in single if each not in told):
        kinds = (ObjectClass.PEDESTRIAN,) if person else (ObjectClass.BUILDING, None)
        for kind in kinds:
            yield Proposition.of(Predicate.LOOKS, place=goal.name, object=kind, feature=feature)


def _side(state: ParticipantState, view: ParticipantView, goal: SeenLandmark) -> Direction:
    return Direction.RIGHT if is_on_right(state.town, goal.lane, goal.x, goal.y) else Direction.LEFT


def _is_nearly_there(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car comes close to the target for the first time."""
    progress = state.route.progress
    missed = state.route.misses or state.guidance.passes
    return progress is not None and progress.left(view.station) < _CLOSE and not (progress.astray or missed)


def _feeling(state: ParticipantState, view: ParticipantView) -> Proposition | None:
    """Returns the participant's current feeling, and its reason; None if there is none, or if it was stated before."""
    goal, motion = state.task.goal, state.motion
    if motion.standstill(view.time) > state.style.patience and view.time >= motion.excused_until:
        felt = Proposition.of(Predicate.FEELS, feeling="impatient", cause=Proposition.of(Predicate.STANDS))
    elif sight(view.raw) < DENSE:
        poor = Proposition.of(Predicate.VISIBILITY, negated=True)
        felt = Proposition.of(Predicate.FEELS, feeling="nervous", cause=poor)
    elif goal is not None and _is_nearly_there(state, view):
        close = Proposition.of(Predicate.CLOSE, place=goal.name)
        felt = Proposition.of(Predicate.FEELS, feeling="pleased", cause=close)
    else:
        return None
    return None if felt in state.task.told else felt
