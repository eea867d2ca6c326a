"""Answers to open questions about the drive: speed, limit, traffic, weather, distance, time and the list of errands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, ObjectClass
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.proposition_truth import (
    believes,
    distance_to_goal,
    reason_to_be_slow,
    seconds_to_goal,
    speed_limit,
)
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import is_dark, is_foggy, is_rainy, weather
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.travel_time import travel_time

CLOUDY: Final = 60.0
"""Cloudiness from which on the sky is called cloudy [%]."""

_LISTED: Final = 3  # most errands that are named in one answer

_Answer: TypeAlias = Callable[[CoWizardState, CoWizardView, LandmarkName | None], tuple[Remark, ...]]
"""Answer to a question, about a place if one is named."""


def drive_answer(
    state: CoWizardState, view: CoWizardView, asked: Proposition, place: LandmarkName | None
) -> tuple[Remark, ...]:
    """Returns the answer to an open question about the drive; empty for other questions.

    Args:
        state: state of the Co-Wizard.
        view: observation.
        asked: content of the question.
        place: landmark named in the question.
    """
    predicate = asked.predicate
    if predicate is Predicate.BECAUSE:
        effect = asked.get("effect")
        about_speed = isinstance(effect, Proposition) and effect.predicate is Predicate.DRIVES_AT
        return _why_slow(state, view) if about_speed and not view.standing else ()
    if predicate is Predicate.FEELS:
        return (intend(Function.ANSWER, Proposition.of(Predicate.FEELS, feeling="fine"), elided=("feeling",)),)
    answer = _limit if asked.get("limit") is True else _ANSWERS.get(predicate)
    return () if answer is None or asked.get("later") is True else answer(state, view, place)


def _speed(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    if view.standing:
        return (intend(Function.ANSWER, Proposition.of(Predicate.STANDS), wording=Wording(topic="stands")),)
    speed = round(3.6 * view.speed)
    content = Proposition.of(Predicate.DRIVES_AT, speed=speed)
    return (intend(Function.ANSWER, content, wording=Wording(speed=speed)),)


def _limit(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    limit = speed_limit(state.town, view.lane)
    content = Proposition.of(Predicate.DRIVES_AT, speed=limit, limit=True)
    return (intend(Function.ANSWER, content, wording=Wording(topic="limit", speed=limit)),)


def _traffic(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    crowded = Proposition.of(Predicate.CROWDED, object=ObjectClass.VEHICLES)
    holds = believes(state.knowledge, view, crowded)
    return (intend(Function.ANSWER, crowded if holds else crowded.opposite),)


def _weather(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    parameter, high = _conspicuous(view)
    content = Proposition.of(Predicate.WEATHER, parameter=parameter, high=high)
    wording = Wording(topic=f"{'much' if high else 'less'}_{parameter}")
    return (intend(Function.ANSWER, content, wording=wording),)


def _conspicuous(view: CoWizardView) -> tuple[WeatherParameter, bool]:
    """Returns the parameter of the weather that is worth mentioning first, and whether it is high."""
    if is_foggy(view.raw):
        return WeatherParameter.FOG_DENSITY, True
    if is_rainy(view.raw):
        return WeatherParameter.PRECIPITATION, True
    if is_dark(view.raw):
        return WeatherParameter.SUN_ALTITUDE_ANGLE, True
    if weather(view.raw, WeatherParameter.CLOUDINESS) >= CLOUDY:
        return WeatherParameter.CLOUDINESS, True
    return WeatherParameter.PRECIPITATION, False


def _why_slow(state: CoWizardState, view: CoWizardView) -> tuple[Remark, ...]:
    cause, speed = reason_to_be_slow(state.knowledge, view), round(3.6 * view.speed)
    effect = Proposition.of(Predicate.DRIVES_AT, speed=speed)
    because = Proposition.of(Predicate.BECAUSE, effect=effect, cause=cause)
    limit = cause.get("speed")
    wording = Wording(topic="because", speed=limit if isinstance(limit, int) else None)
    return (intend(Function.ANSWER, because, elided=("effect",), wording=wording),)


def _distance(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    goal = state.beliefs.goal
    metres = distance_to_goal(state.knowledge, view) if place in (None, goal) else _way_to(state, view, place)
    if metres is None or not 0.0 <= metres < 1e5:
        return _unknown_way(state, place or goal)
    content = Proposition.of(Predicate.DISTANCE, place=place or goal, metres=_rounded(metres))
    said = intend(Function.ANSWER, content, elided=("place",))
    return said, *_time(state, view, place, joined=True)


def _rounded(metres: float) -> int:
    return max(10, 10 * round(metres / 10) if metres < 300.0 else 50 * round(metres / 50))


def _way_to(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> float | None:
    mark = next((mark for mark in view.landmarks if mark.name is place), None)
    if mark is None:
        return None
    route = router(state.town).route(view.here, mark.place, state.route.blocked)
    return None if route is None else route.length


def _arrival(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    return _time(state, view, place) or _unknown_way(state, place or state.beliefs.goal)


def _time(
    state: CoWizardState, view: CoWizardView, place: LandmarkName | None, *, joined: bool = False
) -> tuple[Remark, ...]:
    """Returns the answer when the car would be at a place, the goal if none is named; empty where it cannot be told."""
    goal = state.beliefs.goal
    seconds = seconds_to_goal(state.knowledge, view)
    mark = next((mark for mark in view.landmarks if mark.name is place), None)
    if place not in (None, goal) and mark is not None:
        progress = RouteProgress.plan(state.town, view.here, mark.place, state.route.blocked)
        expected = travel_time(state.town, progress, view.station, view.time, view.speed, state.knowledge.cruise)
        seconds = round(expected) if expected < 1e5 else None
    elif place not in (None, goal):
        seconds = None
    if seconds is None:
        return ()
    arrives = Proposition.of(Predicate.ARRIVES_IN, place=place or goal, seconds=seconds)
    return (intend(Function.ANSWER, arrives, elided=("place",), joined=joined),)


def _unknown_way(state: CoWizardState, place: LandmarkName | None) -> tuple[Remark, ...]:
    if place is None:
        return (intend(Function.ANSWER, Proposition.of(Predicate.GOAL, negated=True)),)
    return (intend(Function.UNCERTAIN_ANSWER),)


def _tasks(state: CoWizardState, view: CoWizardView, place: LandmarkName | None) -> tuple[Remark, ...]:
    """Returns the goal and the errands that are put off."""
    goal = state.beliefs.goal
    later = [name for name, status in state.beliefs.statuses if status is GoalStatus.PENDING and name is not goal]
    known = [act_builders.destination(goal)] if goal is not None else []
    known += [act_builders.errand(name, GoalStatus.PENDING) for name in later]
    if not known:
        return (
            intend(Function.ANSWER, Proposition.of(Predicate.GOAL, negated=True), wording=Wording(topic="no_list")),
        )
    return tuple(
        intend(Function.ANSWER, content, wording=Wording(topic="listed"), joined=number > 0)
        for number, content in enumerate(known[:_LISTED])
    )


_ANSWERS: Final[Mapping[Predicate, _Answer]] = MappingProxyType(
    {
        Predicate.DRIVES_AT: _speed,
        Predicate.CROWDED: _traffic,
        Predicate.WEATHER: _weather,
        Predicate.DISTANCE: _distance,
        Predicate.ARRIVES_IN: _arrival,
        Predicate.TASK: _tasks,
    }
)
