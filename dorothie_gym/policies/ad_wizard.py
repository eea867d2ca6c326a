"""Scripted Ad-Wizard: changes the world and the tasks a few times in a session."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from dorothie_gym.dialogue import load_lexicon
from dorothie_gym.maps import Town
from dorothie_gym.ontology import ExceptionKind, LandmarkName, PropKind, Role, Sensor, WeatherParameter
from dorothie_gym.policies.observation_parser import place_on_path, read_landmarks, read_subgoals, scalar
from dorothie_gym.policies.policy import Policy
from dorothie_gym.spaces import ActionDict, AdWizardAction, LanePosition, PropColumn, SpaceLimits


class Trick(enum.StrEnum):
    """What the Ad-Wizard may be up to."""

    ROADBLOCK = "roadblock"
    WEATHER = "weather"
    TASK = "task"
    SENSOR = "sensor"
    CROWD = "crowd"


KINDS: tuple[Trick, ...] = tuple(Trick)

ROADBLOCK_AHEAD = (55.0, 115.0)
"""How far ahead of the car a roadblock is placed [m]."""

CLEAR_OF_GOALS = 40.0
"""No roadblock is placed closer to a landmark's waypoint on the same lane [m]."""

MOST_ROADBLOCKS = 2

FIRST = 25.0
"""Nothing happens before this time [s]."""

SPACING = 35.0
"""Least time between two tricks [s]."""

WINDOW = 240.0
"""Tricks are planned within this time from the first moment [s]."""

EXPIRES = 60.0
"""A trick that finds no moment for this long is given up [s]."""

LIKELY = {Trick.ROADBLOCK: 1.4, Trick.WEATHER: 1.2, Trick.TASK: 1.6, Trick.SENSOR: 0.5, Trick.CROWD: 0.5}
"""How likely each trick is to be among those of a session, beside the others."""

BAD_WEATHER = (80.0, 140.0)
"""How long bad weather lasts [s]."""

ROADBLOCK_STAYS = 150.0
"""How long a roadblock stands [s]."""


@dataclass(frozen=True, kw_only=True)
class PlannedTrick:
    """A trick and when it is due [s]."""

    trick: Trick
    at: float


@dataclass(frozen=True, kw_only=True)
class Restoration:
    """Something to be put right again, and when [s]; `prop` is where a prop stands [m]."""

    at: float
    weather: WeatherParameter | None = None
    prop: tuple[float, float] | None = None


@dataclass(kw_only=True)
class AdWizardMind:
    """Plans of the Ad-Wizard; a step works on a copy, and every field holds an immutable value.

    Attributes:
        seed: of all chance.
        town: the map.
        planned: tricks to come.
        count: decisions taken.
        undo: what is to be put right again.
        roadblocks: how many have been placed.
        last: when the last trick was played [s].
    """

    seed: int
    town: Town
    planned: tuple[PlannedTrick, ...]
    count: int = 0
    undo: tuple[Restoration, ...] = ()
    roadblocks: int = 0
    last: float = -math.inf


class ScriptedAdWizard(Policy[AdWizardMind]):
    """Plays one to four tricks a session: roadblocks, weather, changed tasks, faulty sensors, crowds.

    Every change of a task comes with a message that gives the participant a reason. Bad weather clears up, and
    roadblocks are taken away again after a while.
    """

    def __init__(
        self, limits: SpaceLimits | None = None, *, rate: float = 2.5, kinds: Sequence[Trick | str] = KINDS
    ) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            rate: tricks a session on average, 0 to 4; at least one is played unless it is 0.
            kinds: what it may do; `Trick`s or their names.

        Raises:
            ValueError: if `rate` is out of its range or a kind is unknown.
        """
        super().__init__(Role.AD_WIZARD, limits)
        if not 0.0 <= rate <= 4.0:
            raise ValueError(f"rate is {rate}; it must be within 0 and 4")
        unknown = [str(kind) for kind in kinds if kind not in tuple(Trick)]
        if unknown:
            raise ValueError(f"kinds holds {unknown[0]!r}; the kinds are {', '.join(Trick)}")
        self._rate = rate
        self._kinds = tuple(Trick(kind) for kind in kinds)

    def initial_state(self, seed: int, town: Town) -> AdWizardMind:
        """Draws what is to happen in this session, and about when."""
        rng = np.random.default_rng((seed, 0))
        planned: list[PlannedTrick] = []
        if self._rate > 0.0 and self._kinds:
            count = 1 + int(rng.binomial(3, max(self._rate - 1.0, 0.0) / 3.0))
            times = np.sort(rng.uniform(FIRST, FIRST + WINDOW, size=count))
            weights = np.array([LIKELY[kind] for kind in self._kinds])
            order = rng.choice(len(self._kinds), size=len(self._kinds), replace=False, p=weights / weights.sum())
            for k, at in enumerate(times):
                planned.append(PlannedTrick(trick=self._kinds[int(order[k % len(order)])], at=float(at)))
        return AdWizardMind(seed=seed, town=town, planned=tuple(planned))

    def step(self, observation: Mapping[str, Any], state: AdWizardMind) -> tuple[ActionDict, AdWizardMind]:
        """Plays a trick, puts one right again, or does nothing."""
        mind = copy(state)
        mind.count += 1
        rng = np.random.default_rng((mind.seed, mind.count))
        now = scalar(observation, "time")
        action = _put_right(mind, observation, now) or self._next_trick(mind, observation, now, rng)
        return (action or AdWizardAction()).encode(self.limits), mind

    def _next_trick(
        self, mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
    ) -> AdWizardAction | None:
        if now < mind.last + SPACING:
            return None
        mind.planned = tuple(item for item in mind.planned if now < max(item.at, mind.last + SPACING) + EXPIRES)
        for item in mind.planned:
            action = _TRICKS[item.trick](mind, observation, now, rng) if now >= item.at else None
            if action is not None:
                mind.planned = tuple(other for other in mind.planned if other is not item)
                mind.last = now
                return action
        return None


def _put_right(mind: AdWizardMind, observation: Mapping[str, Any], now: float) -> AdWizardAction | None:
    due = next((item for item in mind.undo if item.at <= now), None)
    if due is None:
        return None
    mind.undo = tuple(item for item in mind.undo if item is not due)
    if due.weather is not None:
        low, high, clear = due.weather.low, due.weather.high, due.weather.clear_noon
        return AdWizardAction(exception=ExceptionKind.WEATHER, weather=due.weather, share=(clear - low) / (high - low))
    assert due.prop is not None
    for row, prop in enumerate(observation["props"]):
        x, y = float(prop[PropColumn.X]), float(prop[PropColumn.Y])
        if prop[PropColumn.KIND] > 0 and math.hypot(x - due.prop[0], y - due.prop[1]) < 3.0:
            return AdWizardAction(exception=ExceptionKind.DELETE_PROP, item=row)
    return None


def _roadblock(
    mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
) -> AdWizardAction | None:
    """A barrier across the lane that the car is about to take, not too near to a place it may have to stop at."""
    if mind.roadblocks >= MOST_ROADBLOCKS:
        return None
    if scalar(observation, "speed") < 3.0:
        return None
    ahead = float(rng.uniform(*ROADBLOCK_AHEAD))
    place = place_on_path(mind.town, observation, ahead)
    if place is None:
        return None
    lane, station = place
    town_lane = mind.town.lanes[lane]
    goals = [mark.station for mark in read_landmarks(observation, mind.town) if mark.lane == lane]
    if town_lane.in_junction or not 12.0 < station < town_lane.length - 8.0:
        return None
    if any(abs(goal - station) < CLEAR_OF_GOALS for goal in goals):
        return None
    mind.roadblocks += 1
    point = town_lane.position(round(station))
    mind.undo = (*mind.undo, Restoration(at=now + ROADBLOCK_STAYS, prop=(float(point[0]), float(point[1]))))
    return AdWizardAction(
        exception=ExceptionKind.PLACE_PROP,
        prop=PropKind.STREET_BARRIER,
        place=LanePosition(lane=lane, metres=round(station)),
    )


def _weather(
    mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
) -> AdWizardAction | None:
    """Fog, heavy rain or night, for a while."""
    parameter, share = (
        (WeatherParameter.FOG_DENSITY, float(rng.uniform(0.5, 0.85))),
        (WeatherParameter.PRECIPITATION, float(rng.uniform(0.65, 0.95))),
        (WeatherParameter.SUN_ALTITUDE_ANGLE, float(rng.uniform(0.2, 0.42))),
    )[int(rng.integers(3))]
    mind.undo = (*mind.undo, Restoration(at=now + float(rng.uniform(*BAD_WEATHER)), weather=parameter))
    return AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=round(share, 2))


def _task(
    mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
) -> AdWizardAction | None:
    """Adds, drops or changes a task, with a reason for the participant."""
    subgoals = read_subgoals(observation)
    marks = {mark.row: mark for mark in read_landmarks(observation, mind.town)}
    options = [
        *((ExceptionKind.TASK_TRIGGER, subgoal) for subgoal in subgoals if subgoal.can_trigger),
        *((ExceptionKind.TASK_DELETE, subgoal) for subgoal in subgoals if subgoal.can_delete),
        *((ExceptionKind.TASK_CHANGE, subgoal) for subgoal in subgoals if subgoal.can_change),
    ]
    options = [(kind, subgoal) for kind, subgoal in options if subgoal.landmark in marks]
    if not options:
        return None
    kind, subgoal = options[int(rng.integers(len(options)))]
    return AdWizardAction(exception=kind, item=subgoal.index, message=context(kind, marks[subgoal.landmark].name, rng))


def _sensor(
    mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
) -> AdWizardAction | None:
    """A sensor fails; it comes back by itself."""
    sensor = tuple(Sensor)[int(rng.integers(len(Sensor)))]
    return AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=sensor, on=True)


def _crowd(
    mind: AdWizardMind, observation: Mapping[str, Any], now: float, rng: np.random.Generator
) -> AdWizardAction | None:
    """More people or cars about, further down the way."""
    place = place_on_path(mind.town, observation, float(rng.uniform(60.0, 110.0)))
    if place is None:
        return None
    kind = ExceptionKind.SPAWN_PEDESTRIANS if rng.random() < 0.6 else ExceptionKind.SPAWN_VEHICLES
    return AdWizardAction(
        exception=kind,
        place=LanePosition(lane=place[0], metres=round(place[1])),
        count=int(rng.integers(1, 4)),
        extent=25,
    )


_TRICKS: dict[Trick, Callable[[AdWizardMind, Mapping[str, Any], float, np.random.Generator], AdWizardAction | None]] = {
    Trick.ROADBLOCK: _roadblock,
    Trick.WEATHER: _weather,
    Trick.TASK: _task,
    Trick.SENSOR: _sensor,
    Trick.CROWD: _crowd,
}


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
