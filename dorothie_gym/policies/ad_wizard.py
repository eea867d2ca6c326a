"""Scripted Ad-Wizard: changes the world and the tasks a few times in a session."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np

from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.labelled_enums import check_complete
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import ExceptionKind, PropKind, Sensor, WeatherParameter
from dorothie_gym.policies.decision_random import decision_random
from dorothie_gym.policies.observation_parser import place_on_path, read_landmarks, read_subgoals, scalar, weather
from dorothie_gym.policies.policy import TypedPolicy, replace
from dorothie_gym.policies.task_exceptions import plays_every_exception, story_exception, task_message
from dorothie_gym.session.spaces.actions import AdWizardAction, LanePosition
from dorothie_gym.session.spaces.observations import ObservationMapping, PropColumn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import Rows

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.fields import SpaceLimits


class Trick(enum.StrEnum):
    """Kind of interference of the scripted Ad-Wizard."""

    ROADBLOCK = "roadblock"
    WEATHER = "weather"
    TASK = "task"
    SENSOR = "sensor"
    CROWD = "crowd"


KINDS: tuple[Trick, ...] = tuple(Trick)


@dataclass(frozen=True, kw_only=True)
class AdWizardConfig:
    """Tunable numbers of the scripted Ad-Wizard.

    No publication gives these values. They were set by hand so that sessions in the built-in towns stay solvable.

    Attributes:
        first_at: earliest time of a trick [s].
        window: length of the period after it in which tricks are planned [s].
        spacing: minimum time between two tricks [s].
        expires_after: time after which a trick that could not be played is dropped [s].
        weights: relative frequency with which each trick is drawn for a session.
        roadblock_ahead: range of distances ahead of the car at which a roadblock is placed [m].
        roadblock_margins: minimum distances of a roadblock from the start and the end of its lane [m].
        roadblock_speed: minimum speed of the car when one is placed [m/s].
        roadblock_clearance: minimum distance of a roadblock from a place where the car may have to stop [m].
        roadblock_time: time after which a roadblock is removed [s].
        most_roadblocks: maximum number of roadblocks in a session.
        bad_weather_time: range of durations of bad weather [s].
        crowd_ahead: range of distances ahead at which people or vehicles are spawned [m].
        crowd_extent: size of the area in which they are spawned [m].
        crowd_sizes: range of the number of people or vehicles that are spawned.
        crowd_of_people: probability that people are spawned instead of vehicles.
    """

    first_at: float = 25.0
    window: float = 240.0
    spacing: float = 35.0
    expires_after: float = 60.0
    weights: Mapping[Trick, float] = field(
        default_factory=lambda: {
            Trick.ROADBLOCK: 1.4,
            Trick.WEATHER: 1.2,
            Trick.TASK: 1.6,
            Trick.SENSOR: 0.5,
            Trick.CROWD: 0.5,
        }
    )
    roadblock_ahead: tuple[float, float] = (55.0, 115.0)
    roadblock_margins: tuple[float, float] = (12.0, 8.0)
    roadblock_speed: float = 3.0
    roadblock_clearance: float = 40.0
    roadblock_time: float = 150.0
    most_roadblocks: int = 2
    bad_weather_time: tuple[float, float] = (80.0, 140.0)
    crowd_ahead: tuple[float, float] = (60.0, 110.0)
    crowd_extent: int = 25
    crowd_sizes: tuple[int, int] = (4, 8)
    crowd_of_people: float = 0.6


WEATHERS: Mapping[WeatherParameter, tuple[float, tuple[float, float]]] = MappingProxyType(
    {
        WeatherParameter.FOG_DENSITY: (3.0, (0.5, 0.85)),
        WeatherParameter.PRECIPITATION: (3.0, (0.65, 0.95)),
        WeatherParameter.SUN_ALTITUDE_ANGLE: (3.0, (0.2, 0.42)),
        WeatherParameter.CLOUDINESS: (1.0, (0.8, 1.0)),
        WeatherParameter.WIND_INTENSITY: (1.0, (0.6, 1.0)),
        WeatherParameter.PRECIPITATION_DEPOSITS: (1.0, (0.5, 1.0)),
        WeatherParameter.WETNESS: (1.0, (0.5, 1.0)),
        WeatherParameter.SUN_AZIMUTH_ANGLE: (0.5, (0.25, 0.75)),
    }
)
"""Parameters that are changed in clear weather: weight, and range of the new value as a share of the parameter's."""

FOGS: Mapping[WeatherParameter, tuple[float, tuple[float, float]]] = MappingProxyType(
    {
        WeatherParameter.FOG_DISTANCE: (1.0, (0.3, 0.6)),
        WeatherParameter.FOG_FALLOFF: (1.0, (0.35, 0.6)),
    }
)
"""The same in fog, of which they are details."""

check_complete({*WEATHERS, *FOGS}, WeatherParameter, "WEATHERS", __name__)

FOGS_FROM = 0.4
"""Density that counts as fog, as a share of the maximum."""

PROPS: Mapping[PropKind, float] = MappingProxyType(
    {kind: 3.0 if kind is PropKind.STREET_BARRIER else 1.0 for kind in PropKind}
)
"""Props that block a lane, with their weights."""

SAME_PROP = 3.0
"""Distance within which a prop is recognized as the one placed [m]."""

_NO_ACTION = AdWizardAction()

MOST_TRICKS = 4
"""Largest average number of tricks per session that can be set."""


@dataclass(frozen=True, kw_only=True)
class PlannedTrick:
    """Trick and the time at which it is due [s]."""

    trick: Trick
    at: float


@dataclass(frozen=True, kw_only=True)
class Restoration:
    """Change that will be undone, a parameter of the weather or the position of a prop [m], and the time [s]."""

    at: float
    change: WeatherParameter | tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class AdWizardState:
    """Plans of the scripted Ad-Wizard.

    Attributes:
        seed: seed of all random draws.
        town: the map.
        config: tunable numbers.
        planned: remaining tricks.
        count: number of decisions taken.
        restorations: changes to be undone.
        roadblocks: number of roadblocks placed.
        last_at: time of the last trick [s].
    """

    seed: int
    town: Town
    config: AdWizardConfig
    planned: tuple[PlannedTrick, ...]
    count: int = 0
    restorations: tuple[Restoration, ...] = ()
    roadblocks: int = 0
    last_at: float = -math.inf

    def advanced(self, decisions: int = 1) -> AdWizardState:
        """Counts decisions."""
        return replace(self, count=self.count + decisions)

    def is_due(self, now: float) -> bool:
        """Returns whether enough time has passed since the last trick."""
        return now >= self.last_at + self.config.spacing

    def without_expired(self, now: float) -> AdWizardState:
        """Gives up the tricks that have found no moment for too long."""
        config, earliest = self.config, self.last_at + self.config.spacing
        kept = tuple(item for item in self.planned if now < max(item.at, earliest) + config.expires_after)
        return replace(self, planned=kept)

    def after_trick(self, done: PlannedTrick, now: float) -> AdWizardState:
        """Removes a trick that was played."""
        return replace(self, planned=tuple(item for item in self.planned if item is not done), last_at=now)

    def with_restoration(self, item: Restoration) -> AdWizardState:
        """Adds a change to be undone."""
        return replace(self, restorations=(*self.restorations, item))

    def after_restoration(self, done: Restoration) -> AdWizardState:
        """Removes a change that was undone."""
        return replace(self, restorations=tuple(item for item in self.restorations if item is not done))

    def after_roadblock(self) -> AdWizardState:
        """Counts a roadblock."""
        return replace(self, roadblocks=self.roadblocks + 1)


class PlaceOfLandmark(Protocol):
    """Landmark, in an observation or in an array."""

    @property
    def lane(self) -> int:
        """Lane of the place where a car stops for it."""
        ...

    @property
    def station(self) -> float:
        """Distance of that place along the lane [m]."""
        ...


Outcome: TypeAlias = tuple[AdWizardAction | None, AdWizardState]
"""Action of a trick, or None where it finds no moment, and the new state."""


class ScriptedAdWizard(TypedPolicy[AdWizardState]):
    """Plays one to four tricks in a session: roadblocks, weather, changed tasks, faulty sensors, crowds.

    Of a storyboard that is not shipped, it plays every change of the task that the storyboard marks.

    Every change of a task is announced by the message in the storyboard, or by one composed of its texts. Bad weather
    clears up, and roadblocks are removed after a while.

    Attributes:
        plays_tasks: whether it changes tasks.
    """

    def __init__(
        self,
        limits: SpaceLimits | None = None,
        *,
        rate: float = 2.5,
        kinds: Sequence[Trick | str] = KINDS,
        config: AdWizardConfig | None = None,
    ) -> None:
        """Prepares the policy.

        Args:
            limits: sizes of the spaces.
            rate: average number of tricks in a session, 0 to 4; at least one is played unless it is 0.
            kinds: permitted tricks or their names.
            config: tunable numbers; None takes the defaults.

        Raises:
            ValueError: `rate` is out of its range or a kind is unknown.
        """
        super().__init__(Role.AD_WIZARD, limits)
        if not 0.0 <= rate <= MOST_TRICKS:
            raise ValueError(f"rate is {rate}; it must be within 0 and {MOST_TRICKS}")
        unknown = [str(kind) for kind in kinds if kind not in tuple(Trick)]
        if unknown:
            raise ValueError(f"kinds holds {unknown[0]!r}; the kinds are {', '.join(Trick)}")
        self._rate, self._kinds = rate, tuple(Trick(kind) for kind in kinds)
        self.plays_tasks = rate > 0.0 and Trick.TASK in self._kinds
        self._config = AdWizardConfig() if config is None else config

    def initial_state(self, seed: int, town: Town) -> AdWizardState:
        """Draws the tricks of the session and their times."""
        rng, config = np.random.default_rng((seed, 0)), self._config
        planned: list[PlannedTrick] = []
        if self._rate > 0.0 and self._kinds:
            count = 1 + int(rng.binomial(MOST_TRICKS - 1, max(self._rate - 1.0, 0.0) / (MOST_TRICKS - 1.0)))
            times = np.sort(rng.uniform(config.first_at, config.first_at + config.window, size=count))
            weights = np.array([config.weights[kind] for kind in self._kinds])
            order = rng.choice(len(self._kinds), size=len(self._kinds), replace=False, p=weights / weights.sum())
            for k, at in enumerate(times):
                planned.append(PlannedTrick(trick=self._kinds[int(order[k % len(order)])], at=float(at)))
        return AdWizardState(seed=seed, town=town, config=config, planned=tuple(planned))

    def act(self, observation: ObservationMapping, state: AdWizardState) -> tuple[AdWizardAction, AdWizardState]:
        """Plays a trick, undoes one, or does nothing."""
        state = state.advanced()
        rng = decision_random(state.seed, state.count)
        now = scalar(observation, "time")
        action, state = _restore(state, observation, now)
        if action is None and self.plays_tasks and plays_every_exception(observation["story"]):
            action = story_exception(observation, state.town, now, _story_is_due(state, now))
            state = state if action is None else replace(state, last_at=now)
        if action is None:
            action, state = _play(state, observation, now, rng)
        return action or _NO_ACTION, state


def idle_until(policy: ScriptedAdWizard, state: AdWizardState, story: str) -> float:
    """Returns the earliest time at which the next step may do more than count a decision [s].

    Before that time a caller need not observe: `state.advanced()` is the state after the step.

    Args:
        policy: the policy.
        state: its state.
        story: story of the session.
    """
    if policy.plays_tasks and plays_every_exception(story):
        return -math.inf
    earliest = state.last_at + state.config.spacing
    times = (*(item.at for item in state.restorations), *(max(item.at, earliest) for item in state.planned))
    return min(times, default=math.inf)


def _story_is_due(state: AdWizardState, now: float) -> bool:
    return now >= state.config.first_at and state.is_due(now)


def _play(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Plays the first trick that is due and possible."""
    if not state.is_due(now):
        return None, state
    state = state.without_expired(now)
    for item in state.planned:
        if now >= item.at:
            action, state = _TRICKS[item.trick](state, observation, now, rng)
            if action is not None:
                return action, state.after_trick(item, now)
    return None, state


def _restore(state: AdWizardState, observation: ObservationMapping, now: float) -> Outcome:
    """Undoes a change that is due."""
    due = next((item for item in state.restorations if item.at <= now), None)
    if due is None:
        return None, state
    state = state.after_restoration(due)
    if isinstance(due.change, WeatherParameter):
        low, high, clear = due.change.low, due.change.high, due.change.clear_noon
        share = (clear - low) / (high - low)
        return AdWizardAction(exception=ExceptionKind.WEATHER, weather=due.change, share=share), state
    for row, prop in enumerate(observation["props"]):
        x, y = float(prop[PropColumn.X]), float(prop[PropColumn.Y])
        if prop[PropColumn.KIND] > 0 and pm.hypot(x - due.change[0], y - due.change[1]) < SAME_PROP:
            return AdWizardAction(exception=ExceptionKind.DELETE_PROP, item=row), state
    return None, state


def _roadblock(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Places a prop on the lane ahead, not too near to a place where the car may have to stop."""
    config = state.config
    if state.roadblocks >= config.most_roadblocks or scalar(observation, "speed") < config.roadblock_speed:
        return None, state
    ahead = float(rng.uniform(*config.roadblock_ahead))
    place = place_on_path(state.town, observation, ahead)
    if place is None:
        return None, state
    lane, station = place
    town_lane = state.town.lanes[lane]
    marks = read_landmarks(observation, state.town)
    suits = suits_roadblock(
        marks, lane, station, town_lane.length, config.roadblock_margins, config.roadblock_clearance
    )
    if town_lane.in_junction or not suits:
        return None, state
    point = town_lane.position(round(station))
    removal = Restoration(at=now + config.roadblock_time, change=(float(point[0]), float(point[1])))
    action = AdWizardAction(
        exception=ExceptionKind.PLACE_PROP,
        prop=tuple(PROPS)[int(rng.choice(len(PROPS), p=np.array(list(PROPS.values())) / sum(PROPS.values())))],
        place=LanePosition(lane=lane, metres=round(station)),
    )
    return action, state.after_roadblock().with_restoration(removal)


def suits_roadblock(
    marks: Rows[PlaceOfLandmark],
    lane: int,
    station: float,
    length: float,
    margins: tuple[float, float],
    clearance: float,
) -> bool:
    """Returns whether a roadblock at a place leaves room before it, behind it, and around landmarks.

    Args:
        marks: landmarks.
        lane: number of the lane.
        station: distance along it [m].
        length: its length [m].
        margins: minimum distances from the start and the end of its lane [m].
        clearance: minimum distance from places where a car stops for a landmark [m].
    """
    if not margins[0] < station < length - margins[1]:
        return False
    for k in range(len(marks)):
        if marks[k].lane == lane and abs(marks[k].station - station) < clearance:
            return False
    return True


def _weather(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Brings fog, heavy rain, night, wind, puddles, ... for a while; further changes follow while there is fog."""
    density = weather(observation, WeatherParameter.FOG_DENSITY) / WeatherParameter.FOG_DENSITY.high
    options = FOGS if density > FOGS_FROM else WEATHERS
    weights = np.array([weight for weight, _ in options.values()])
    parameter = tuple(options)[int(rng.choice(len(options), p=weights / weights.sum()))]
    share = float(rng.uniform(*options[parameter][1]))
    clearing = Restoration(at=now + float(rng.uniform(*state.config.bad_weather_time)), change=parameter)
    action = AdWizardAction(exception=ExceptionKind.WEATHER, weather=parameter, share=round(share, 2))
    return action, state.with_restoration(clearing)


def _task(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Adds, drops or changes a task, with a message for the participant."""
    subgoals = read_subgoals(observation)
    marks = {mark.row: mark for mark in read_landmarks(observation, state.town)}
    options = [
        *((ExceptionKind.TASK_TRIGGER, subgoal) for subgoal in subgoals if subgoal.can_trigger),
        *((ExceptionKind.TASK_DELETE, subgoal) for subgoal in subgoals if subgoal.can_delete),
        *((ExceptionKind.TASK_CHANGE, subgoal) for subgoal in subgoals if subgoal.can_change),
    ]
    options = [(kind, subgoal) for kind, subgoal in options if subgoal.landmark in marks]
    if not options:
        return None, state
    kind, subgoal = options[int(rng.integers(len(options)))]
    message = task_message(observation, kind, subgoal.index)
    return AdWizardAction(exception=kind, item=subgoal.index, message=message), state


def _sensor(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Makes a sensor fail; it recovers by itself."""
    sensor = tuple(Sensor)[int(rng.integers(len(Sensor)))]
    return AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=sensor, on=True), state


def _crowd(state: AdWizardState, observation: ObservationMapping, now: float, rng: np.random.Generator) -> Outcome:
    """Spawns people or vehicles on the road ahead."""
    config = state.config
    place = place_on_path(state.town, observation, float(rng.uniform(*config.crowd_ahead)))
    if place is None:
        return None, state
    people = rng.random() < config.crowd_of_people
    action = AdWizardAction(
        exception=ExceptionKind.SPAWN_PEDESTRIANS if people else ExceptionKind.SPAWN_VEHICLES,
        place=LanePosition(lane=place[0], metres=round(place[1])),
        count=int(rng.integers(*config.crowd_sizes, endpoint=True)),
        extent=config.crowd_extent,
    )
    return action, state


_TRICKS: dict[Trick, Callable[[AdWizardState, ObservationMapping, float, np.random.Generator], Outcome]] = {
    Trick.ROADBLOCK: _roadblock,
    Trick.WEATHER: _weather,
    Trick.TASK: _task,
    Trick.SENSOR: _sensor,
    Trick.CROWD: _crowd,
}
