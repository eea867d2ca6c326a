"""What the scripted participant remembers, and what it takes from an observation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dorothie_gym.ontology import LandmarkName, Role
from dorothie_gym.policies.hearing import HeardUtterance
from dorothie_gym.policies.journey import Journey
from dorothie_gym.policies.scenery import (
    SeenLandmark,
    SeenObject,
    SeenSubgoal,
    read_landmarks,
    read_objects,
    read_subgoals,
    scalar,
)
from dorothie_gym.policies.speech import Voice
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.routing import Place

STANDING = 0.3
"""Below this speed the car stands [m/s]."""

TURNED = 0.8
"""Below this cosine of the angle between car and lane the car is in the middle of turning round."""


@dataclass(frozen=True, kw_only=True)
class Style:
    """How a participant talks in a session.

    Attributes:
        guides: chance that a place which the car may know is guided to turn by turn all the same.
        names_goal: chance that the place is named when guiding.
        names_street: chance that a street is added to a place or a turn.
        hurries: chance that the next task follows in the same breath as the report of the last.
        patience: standing time after which it asks why [s].
        chat: seconds between remarks beside the matter, on average [s].
        waits: chance that the way is told only when the car asks, or when it is nearly too late.
        hints: chance that a step is not commanded, but said to be what one should do.
        reasons: chance that a reason is given with a place, or a step.
        aligns: chance that it makes sure to have been understood.
        nods: chance that what the car explains is acknowledged.
        curious: chance that it asks why the car does something unexpected.
        puzzled: chance that it asks again what the car has said into its own words.
    """

    guides: float
    names_goal: float
    names_street: float
    hurries: float
    patience: float
    chat: float
    waits: float = 0.0
    hints: float = 0.0
    reasons: float = 0.0
    aligns: float = 0.0
    nods: float = 0.2
    curious: float = 0.0
    puzzled: float = 0.0

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Style:
        """A style by chance: two in five guide most of the way themselves."""
        return cls(
            guides=0.2 if rng.random() < 0.4 else 0.02,
            names_goal=float(rng.uniform(0.4, 1.0)),
            names_street=float(rng.uniform(0.1, 0.7)),
            hurries=float(rng.uniform(0.4, 0.95)),
            patience=float(rng.uniform(7.0, 14.0)),
            chat=float(rng.uniform(40.0, 120.0)),
            waits=float(rng.uniform(0.5, 0.95)),
            hints=float(rng.uniform(0.42, 0.87)),
            reasons=float(rng.uniform(0.24, 0.54)),
            aligns=float(rng.uniform(0.0, 0.15)),
            nods=float(rng.uniform(0.5, 0.85)),
            curious=float(rng.uniform(0.02, 0.25)),
            puzzled=float(rng.uniform(0.0, 0.35)),
        )


@dataclass(kw_only=True)
class ParticipantMind:
    """Memory of the participant; a step works on a copy of it, and every field holds an immutable value.

    Attributes:
        seed: of all chance.
        town: the map.
        style: how it talks.
        count: decisions taken.
        voice: what it means to say.
        subgoals: the tasks as seen last.
        target: the subgoal it is about.
        goal: landmark of that subgoal.
        told: whether the car has been told of it.
        told_at: when [s].
        described: whether the car, which does not know the place, has been told where it is.
        guiding: whether the way is told turn by turn.
        journey: the way to the target.
        best: least distance to the target so far [m].
        guided: what was last told to do: a word for it and the lanes concerned.
        guided_at: when [s].
        repeats: how often that has been repeated.
        rounds: how often the car has been told to turn round.
        changes: lanes that it has been told to leave, and when [s].
        announced: whether the car has been told that the place is near.
        misses: how often the car has gone past the place.
        avoided: places that the car is not led by any more, for it went past the target when it was.
        eased: whether it has been told to go slowly because of that.
        stop_text: words to stop the car with.
        stopped_at: when they were said [s].
        nudged_at: when the car was last told to go a bit further [s].
        blocked: places that cannot be passed.
        standing_since: since when the car has been standing [s].
        stood_since: when the car was last seen to move [s].
        heard_at: when the car last spoke [s].
        excused_until: until when a standing car is not asked about [s].
        asked_at: when it was last asked [s].
        slowed: whether the car was told to slow down for the weather.
        dim_since: since when the weather has been such that it should [s].
        lights_at: when lights were last talked about [s].
        chat_at: when to talk beside the matter next [s].
        speed_before: speed at the decision before [m/s].
        left_to_ask: step that is told only when the car asks.
        drawn_for: step for which it has been drawn whether it is.
        goes_on: whether the next task is named in the breath that reports the last.
        go_at: when the car, which has been told to wait, is to go on [s].
        hurried: whether the car has been told to go faster.
        next_at: the next task is not named before this time, unless the car asks [s].
        put_off: subgoals that were interrupted by others, and are to be resumed.
        puzzled_by: what the car said that was not caught.
        wondered_at: when something unexpected was last asked about, or let pass [s].
    """

    seed: int
    town: Town
    style: Style
    count: int = 0
    voice: Voice = field(default_factory=lambda: Voice(role=Role.PARTICIPANT))
    subgoals: tuple[SeenSubgoal, ...] = ()
    target: int | None = None
    goal: SeenLandmark | None = None
    told: bool = False
    told_at: float = -math.inf
    described: bool = False
    guiding: bool = False
    journey: Journey | None = None
    best: float = math.inf
    guided: tuple[str, int, int] | None = None
    guided_at: float = -math.inf
    repeats: int = 0
    rounds: int = 0
    changes: tuple[tuple[int, float], ...] = ()
    announced: bool = False
    misses: int = 0
    avoided: tuple[Place, ...] = ()
    eased: bool = False
    stop_text: str = ""
    stopped_at: float = -math.inf
    nudged_at: float = -math.inf
    blocked: tuple[Place, ...] = ()
    standing_since: float | None = 0.0
    stood_since: float = 0.0
    heard_at: float = 0.0
    excused_until: float = 0.0
    asked_at: float = -math.inf
    slowed: bool = False
    dim_since: float = math.inf
    lights_at: float = -math.inf
    chat_at: float = math.inf
    speed_before: float = 0.0
    left_to_ask: bool = False
    drawn_for: tuple[str, int, int] | None = None
    goes_on: bool = False
    go_at: float = math.inf
    hurried: bool = False
    next_at: float = -math.inf
    put_off: frozenset[int] = frozenset()
    puzzled_by: HeardUtterance | None = None
    wondered_at: float = -math.inf


@dataclass(frozen=True, kw_only=True)
class View:
    """An observation of the participant, read; `turning` tells that the car stands across its lane."""

    raw: Mapping[str, Any]
    time: float
    speed: float
    lane: int
    station: float
    speaking: float
    landmarks: tuple[SeenLandmark, ...]
    subgoals: tuple[SeenSubgoal, ...]
    objects: tuple[SeenObject, ...]
    turning: bool

    @classmethod
    def read(cls, observation: Mapping[str, Any], town: Town) -> View:
        """Reads what every decision needs."""
        lane, station = int(observation["lane"]), scalar(observation, "station")
        across = float(observation["pose"][2]) - town.lanes[lane].heading_at(station)
        return cls(
            raw=observation,
            time=scalar(observation, "time"),
            speed=scalar(observation, "speed"),
            lane=lane,
            station=station,
            speaking=scalar(observation, "speaking"),
            landmarks=read_landmarks(observation, town),
            subgoals=read_subgoals(observation),
            objects=read_objects(observation),
            turning=math.cos(across) < TURNED,
        )

    @property
    def position(self) -> tuple[float, float]:
        """Where the car is [m]."""
        x, y = self.raw["pose"][:2]
        return float(x), float(y)

    @property
    def place(self) -> Place:
        """Where the car is."""
        return self.lane, self.station

    @property
    def standing(self) -> bool:
        """Whether the car stands."""
        return self.speed < STANDING

    def landmark(self, row: int) -> SeenLandmark | None:
        """The landmark of a row."""
        return next((landmark for landmark in self.landmarks if landmark.row == row), None)

    def unique(self, landmark: SeenLandmark) -> bool:
        """Whether no other landmark bears the same name."""
        return sum(other.name is landmark.name for other in self.landmarks) == 1 and landmark.name not in (
            LandmarkName.HOUSE,
            LandmarkName.PERSON,
        )
