"""State of the scripted participant between decisions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import Role
from dorothie_gym.policies.observation_parser import (
    SeenLandmark,
    SeenSubgoal,
)
from dorothie_gym.policies.participant.config import ParticipantStyle
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.policies.utterance_input import HeardUtterance


@dataclass(kw_only=True)
class ParticipantState:
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
    style: ParticipantStyle
    count: int = 0
    voice: SpeechState = field(default_factory=lambda: SpeechState(role=Role.PARTICIPANT))
    subgoals: tuple[SeenSubgoal, ...] = ()
    target: int | None = None
    goal: SeenLandmark | None = None
    told: bool = False
    told_at: float = -math.inf
    described: bool = False
    guiding: bool = False
    journey: RouteProgress | None = None
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
