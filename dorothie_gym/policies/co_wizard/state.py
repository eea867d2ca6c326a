"""State of the scripted Co-Wizard between decisions."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

from dorothie_gym.dialogue import Direction
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import (
    GoalStatus,
    LandmarkName,
    MentalAction,
    ObjectClass,
    Role,
    StreetName,
)
from dorothie_gym.policies.co_wizard.config import USUAL_SPEED, CoWizardStyle
from dorothie_gym.policies.route_progress import RouteProgress
from dorothie_gym.policies.speech import SpeechState
from dorothie_gym.spaces import LanePosition, Mental


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
class CoWizardState:
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
    style: CoWizardStyle
    count: int = 0
    voice: SpeechState = field(default_factory=lambda: SpeechState(role=Role.CO_WIZARD))
    goal: LandmarkName | None = None
    place: Place | None = None
    exact: bool = False
    journey: RouteProgress | None = None
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
        where = LanePosition(lane=place[0], metres=round(place[1]))
        self.notes = (
            *(note for note in self.notes if note.action is not MentalAction.KNOWLEDGE_UPDATE),
            Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=landmark, place=where),
        )
        self.note(Mental(action=MentalAction.GOAL_UPDATE, goals=(landmark,)))
