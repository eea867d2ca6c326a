"""What the scripted Co-Wizard believes and remembers, and what it takes from an observation."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from dorothie_gym.dialogue import Direction
from dorothie_gym.ontology import (
    GoalStatus,
    LandmarkName,
    MentalAction,
    ObjectClass,
    PhysicalAction,
    Role,
    StreetName,
)
from dorothie_gym.policies.journey import Choice, Journey, is_choice, next_choice
from dorothie_gym.policies.scenery import SeenLandmark, SeenObject, read_landmarks, read_objects, scalar
from dorothie_gym.policies.speech import Voice
from dorothie_gym.spaces import ExitColumn, Mental, Motion
from dorothie_gym.spaces import Place as MapPlace
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.routing import Place

USUAL_SPEED = 40
"""Cruise speed when nothing is said about it [km/h]."""


@dataclass(frozen=True, kw_only=True)
class Style:
    """How a Co-Wizard talks in a session.

    Attributes:
        echoes: chance that an acknowledgement repeats what was asked for.
        checks: chance that a place without a street is checked.
        tells: chance that it says what it does by its own plan.
        silent: chance that a plain instruction is not acknowledged.
        asks: chance that it asks for the way where it might as well go straight on.
        proposes: chance that it proposes a way at a junction instead of asking for one.
        mishears: chance that it does not catch an instruction.
        careful: chance that it stops before a junction to ask.
        chats: chance that it answers small talk.
        eases: whether it slows down well before it turns.
        gentle: whether it slows down well before a place on the map.
        rambles: chance that it tells what it is up to in the same breath as something else.
        offers: chance that it proposes to do a task first that is on the way.
        reassures: chance that it makes sure to have heard a description right.
        pace: speed at which it drives when nothing is said about it [km/h].
    """

    echoes: float
    checks: float
    tells: float
    silent: float
    asks: float = 0.5
    proposes: float = 0.0
    mishears: float = 0.0
    careful: float = 0.0
    chats: float = 0.0
    eases: bool = False
    gentle: bool = False
    rambles: float = 0.0
    offers: float = 0.0
    reassures: float = 0.0
    pace: int = USUAL_SPEED

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Style:
        """A style by chance."""
        return cls(
            echoes=float(rng.uniform(0.1, 0.4)),
            checks=float(rng.uniform(0.1, 0.4)),
            tells=float(rng.uniform(0.0, 0.18)),
            silent=float(rng.uniform(0.3, 0.6)),
            asks=float(rng.uniform(0.5, 1.0)),
            proposes=float(rng.uniform(0.1, 0.6)),
            mishears=float(rng.uniform(0.0, 0.05)),
            careful=float(rng.uniform(0.9, 1.0)),
            eases=bool(rng.random() < 0.3),
            gentle=bool(rng.random() < 0.25),
            rambles=float(rng.uniform(0.15, 0.5)),
            offers=float(rng.uniform(0.3, 1.0)),
            reassures=float(rng.uniform(0.0, 0.3)),
            pace=int(rng.choice((30, 35, 40))),
            chats=float(rng.uniform(0.1, 0.6)),
        )


class Wish(enum.Enum):
    """A manoeuvre that the human asked for and that waits for its place."""

    U_TURN = "u_turn"
    SWITCH_LEFT = "switch_left"
    SWITCH_RIGHT = "switch_right"


@dataclass(frozen=True, kw_only=True)
class Directive:
    """A turn that the human asked for.

    Attributes:
        direction: which way; None if only a street was named.
        street: the street named, UNKNOWN if none was.
        skip: opportunities to leave out before it is taken.
        junction: the next junction with a choice when it was heard, -1 if there was none.
    """

    direction: Direction | None
    street: StreetName = StreetName.UNKNOWN
    skip: int = 0
    junction: int = -1


@dataclass(kw_only=True)
class CoWizardMind:
    """Beliefs and memory of the Co-Wizard; a step works on a copy, and every field holds an immutable value.

    Attributes:
        seed: of all chance.
        town: the map.
        style: how it talks.
        count: decisions taken.
        voice: what it means to say.
        goal: landmark it is to go to.
        place: where it believes the goal to be.
        exact: whether that is from the map; else it is a guess.
        journey: way to the goal, if its place is on the map.
        plan: junctions of the plan as noted last.
        directive: turn asked for.
        wish: manoeuvre asked for.
        wish_until: when it is given up [s].
        halted: whether the car is to stand.
        nudge: place to go on to and stop at again.
        creeping: whether the place is close and its guess is carried along.
        told_to_stop_at: when it was last told to stop [s].
        speed: cruise speed aimed at [km/h].
        slow_until: until when a speed for the moment only is kept [s].
        usual: cruise speed on open road, as told last [km/h].
        not_there: places of houses and people that were done with, or that were not the ones meant.
        lights: lights aimed at, None if nothing was said.
        notes: belief updates still to be made.
        statuses: what became of landmarks.
        blocked: places that cannot be passed.
        detour_at: since when an answer about a way round is waited for [s].
        turn_sent: lane and angle of the last turn commanded.
        turn_sent_at: when [s].
        commanded_at: when a lane switch or U-turn was last commanded [s].
        stop_sent_at: when Stop was last commanded [s].
        asked: lane before the junction that was asked about.
        considered: lane before the junction at which it has decided whether to ask.
        asked_at: when the last question was put [s].
        standing_since: since when the car has been standing [s].
        hazard_told: when a hazard was last explained [s].
        arrived: whether the car has stopped at its goal and waits for what comes next.
        idle_since: since when it has known nothing to do [s].
        heard_at: when the human last spoke [s].
        proposed: way that it has proposed and waits for an answer to.
        misses: how often it has driven past the goal.
        avoided: places that it does not come by any more, for it missed the goal when it did.
        rest_until: until when it stands for something in the way [s].
        rest_for: what that is.
        pausing: whether it stops before the junction ahead until it is told the way.
        rested: whether it has decided whether to stop for good at the present hazard.
        weather_told: whether it has remarked on the weather as it is.
        slower_asked: whether it has proposed to slow down and waits for an answer.
        offer: place that it has proposed to go to first and waits for an answer about.
        missed: act that it has not caught.
        lost_told: whether it has said that it does not know where it is.
        described: whether it has been told where the goal is, which is not on the map.
        steered_at: when it was last told what to do next [s].
    """

    seed: int
    town: Town
    style: Style
    count: int = 0
    voice: Voice = field(default_factory=lambda: Voice(role=Role.CO_WIZARD))
    goal: LandmarkName | None = None
    place: Place | None = None
    exact: bool = False
    journey: Journey | None = None
    plan: tuple[int, ...] = ()
    directive: Directive | None = None
    wish: Wish | None = None
    wish_until: float = 0.0
    halted: bool = False
    nudge: Place | None = None
    creeping: bool = False
    told_to_stop_at: float = -math.inf
    speed: int = USUAL_SPEED
    slow_until: float = math.inf
    usual: int = USUAL_SPEED
    not_there: tuple[Place, ...] = ()
    lights: bool | None = None
    notes: tuple[Mental, ...] = ()
    statuses: tuple[tuple[LandmarkName, GoalStatus], ...] = ()
    blocked: tuple[Place, ...] = ()
    detour_at: float | None = None
    turn_sent: tuple[int, int] = (-1, 0)
    turn_sent_at: float = -math.inf
    commanded_at: float = -math.inf
    stop_sent_at: float = -math.inf
    asked: int = -1
    considered: int = -1
    asked_at: float = -math.inf
    standing_since: float | None = 0.0
    hazard_told: float = -math.inf
    arrived: bool = False
    idle_since: float = 0.0
    heard_at: float = -math.inf
    proposed: Directive | None = None
    misses: int = 0
    avoided: tuple[Place, ...] = ()
    rest_until: float = -math.inf
    rest_for: ObjectClass = ObjectClass.UNLABELED
    pausing: bool = False
    rested: bool = False
    weather_told: bool = False
    slower_asked: bool = False
    offer: LandmarkName | None = None
    missed: bool = False
    lost_told: bool = False
    described: bool = False
    steered_at: float = -math.inf

    def note(self, mental: Mental) -> None:
        """Adds a belief update, unless the same one waits already."""
        if mental not in self.notes:
            self.notes = (*self.notes, mental)

    def note_status(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Remembers what became of a landmark."""
        self.statuses = (*(pair for pair in self.statuses if pair[0] is not landmark), (landmark, status))
        self.note(Mental(action=MentalAction.STATUS_UPDATE, landmark=landmark, status=status))

    def note_place(self, landmark: LandmarkName, place: Place) -> None:
        """Marks a guess of where a landmark is, and makes it the goal."""
        self.place = place
        where = MapPlace(lane=place[0], metres=round(place[1]))
        self.notes = (
            *(note for note in self.notes if note.action is not MentalAction.KNOWLEDGE_UPDATE),
            Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=landmark, place=where),
        )
        self.note(Mental(action=MentalAction.GOAL_UPDATE, goals=(landmark,)))


@dataclass(frozen=True, kw_only=True)
class View:
    """An observation of the Co-Wizard, read; `lane` and `station` are corrected by the turn options."""

    raw: Mapping[str, Any]
    time: float
    speed: float
    lane: int
    station: float
    speaking: float
    motion: Motion
    hazard: ObjectClass
    manoeuvre: PhysicalAction | None
    angle: float
    cruise: float
    lights: bool
    choice: Choice | None
    landmarks: tuple[SeenLandmark, ...]
    objects: tuple[SeenObject, ...]
    waypoints: np.ndarray

    @classmethod
    def read(cls, observation: Mapping[str, Any], town: Town) -> View:
        """Reads what every decision needs."""
        manoeuvre = int(observation["manoeuvre"])
        waypoints = observation["waypoints"]
        view = cls(
            raw=observation,
            time=scalar(observation, "time"),
            speed=scalar(observation, "speed"),
            lane=int(observation["lane"]),
            station=scalar(observation, "station"),
            speaking=scalar(observation, "speaking"),
            motion=Motion(int(observation["motion"])),
            hazard=ObjectClass(int(observation["hazard"])),
            manoeuvre=PhysicalAction(manoeuvre) if manoeuvre else None,
            angle=scalar(observation, "manoeuvre_angle"),
            cruise=scalar(observation, "cruise_speed"),
            lights=bool(observation["lights"]),
            choice=None,
            landmarks=read_landmarks(observation, town),
            objects=read_objects(observation),
            waypoints=waypoints[np.any(waypoints != 0.0, axis=1)],
        )
        return _located(view, town)

    @property
    def position(self) -> tuple[float, float]:
        """Where it believes the car to be [m]."""
        x, y = self.raw["pose"][:2]
        return float(x), float(y)

    @property
    def here(self) -> Place:
        """Where the car is."""
        return self.lane, self.station

    @property
    def standing(self) -> bool:
        """Whether the car stands."""
        return self.speed < 0.3

    @property
    def junction(self) -> int:
        """The next junction with a choice, -1 if there is none."""
        return self.choice.junction if self.choice is not None else -1

    @property
    def manoeuvring(self) -> bool:
        """Whether the car is switching lanes or turning round."""
        return self.manoeuvre in (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN)


def _located(view: View, town: Town) -> View:
    """The view with its place corrected: the turn options ahead are known even where the position has drifted."""
    believed = next_choice(town, view.lane, view.station)
    rows = [row for row in view.raw["exits"] if row[ExitColumn.PRESENT]]
    if not rows:
        return replace(view, choice=believed)
    exits = tuple(sorted(int(row[ExitColumn.LANE]) for row in rows))
    distance = float(rows[0][ExitColumn.DISTANCE])
    candidates = _lanes_by_exits(town).get(exits, ())
    if believed is not None and (believed.lane in candidates or not candidates):
        return replace(view, choice=replace(believed, distance=distance))
    if not candidates:
        return replace(view, choice=believed)
    lane = candidates[0]
    choice = Choice(lane=lane, distance=distance, exits=town.exits(lane))
    station = town.lanes[lane].length - distance
    if station < 0.0:
        return replace(view, choice=choice)
    return replace(view, choice=choice, lane=lane, station=station)


@lru_cache(maxsize=16)
def _lanes_by_exits(town: Town) -> Mapping[tuple[int, ...], tuple[int, ...]]:
    """For the lanes that the exits of a junction lead to, the lanes that have those exits."""
    found: dict[tuple[int, ...], list[int]] = {}
    for lane in town.lanes:
        if is_choice(town, lane.id):
            found.setdefault(tuple(sorted(way.lane for way in town.exits(lane.id))), []).append(lane.id)
    return {exits: tuple(lanes) for exits, lanes in found.items()}
