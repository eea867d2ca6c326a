"""Working memory of the learned Co-Wizard: its commitments, written by its own network.

At each decision the network predicts the next value of each variable in `VARIABLES`, and an event of the goal
(`GoalEvent`, or a place on the map); `WorkingMemory.updated` stores both. All other content is derived from them and
from the observation: times, the navigator's route, and the end of a slow approach.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.baselines.roles.learned_role.encoding import AWAY
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps.routing import Place
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.config import CoWizardConfig
from dorothie_gym.policies.co_wizard.proposition_truth import reason_to_stand
from dorothie_gym.policies.knowledge import CoWizardKnowledge, Standstill
from dorothie_gym.policies.language_model.co_wizard_prompt import SHARED_NAMES
from dorothie_gym.policies.language_model.navigator import Navigator
from dorothie_gym.policies.policy import DecisionClock, replace
from dorothie_gym.policies.route_progress import default_lane_distance, default_lane_place
from dorothie_gym.policies.scripted_agent_limits import NUDGE_DISTANCE, USUAL_SPEED
from dorothie_gym.policies.speech import Remark
from dorothie_gym.policies.turn_lanes import junction_meant
from dorothie_gym.session.spaces.actions import LanePosition, Mental

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.observation_parser import SeenLandmark

ORDERS: Final = (None, Direction.LEFT, Direction.RIGHT, Direction.STRAIGHT, Direction.BACK, "street")
"""Requested turn: none, a direction, or only a street."""

SPEEDS: Final = tuple(range(10, 65, 5))
"""Cruise speeds that can be aimed at [km/h]."""

VARIABLES: Final[Mapping[str, int]] = MappingProxyType(
    {
        "order": len(ORDERS), "onto_street": 2, "skip": 4, "manoeuvre": 4, "halted": 2, "arrived": 2, "creeping": 2,
        "pausing": 2, "nudging": 2, "resting": 2, "speed": len(SPEEDS), "lights": 3, "proposed": 5, "offering": 2,
        "detour": 2, "slower": 2,
    }
)  # fmt: skip
"""Variables of the memory with the number of their values.

`manoeuvre` is none, a U-turn, or a lane switch to the left or right that was requested; `onto_street`: the turn leads
into the street that was named; `skip`: junctions to pass before it; `nudging`: the car goes a little further, to stop
again; `resting`: it commands a stop before a hazard; `lights`: not mentioned, on, off; `proposed`: a route that was
proposed and not answered yet (as the first values of `ORDERS`), `offering`, `detour` and `slower`: similarly.
"""

CONFIG: Final = CoWizardConfig()
"""Thresholds of the judgements."""

U_TURN: Final = 1
"""Value of `manoeuvre` for a requested U-turn."""

FRESH: Final = ("order", "nudging", "creeping")
"""Variables that can be set again to the same value, for each of which there is a binary output."""

STATUSES: Final = (None, GoalStatus.PENDING, GoalStatus.COMPLETE, GoalStatus.ABANDONED)
"""Statuses that an utterance gives to an errand."""


class GoalEvent(enum.IntEnum):
    """Events of the goal, besides the choice of a place on the map, which has the numbers after these."""

    KEEP = 0
    CLEAR = 1
    DOUBT = 2
    """The name stays, but its place on the map is not the one that is meant."""
    OFF_MAP_FIRST = 3
    """The first place that was just named becomes the goal, without a place on the map."""
    OFF_MAP_SECOND = 4


CREEP_SHORTFALL, CREEP_LEAST, CREEP_LEAD, CREEP_RENEW, SLOWER_DISTANCE = 12.0, 10.0, 16.0, 6.0, 30.0
"""Slow approach [m]: shortfall on the stated distance; least distance; lead of a place that is carried along, and
distance at which that is renewed; distance if none is stated."""

PLACE_SIGHT: Final = 80.0
"""Distance along the default lanes within which a place is looked for [m]; as that of the scripted Co-Wizard."""

REACTION: Final = 3.0
"""Time within which an utterance may change the memory [s]."""


@dataclass(frozen=True, kw_only=True)
class Update:
    """Output of the network for the memory.

    Attributes:
        values: next value of each variable, in the order of `VARIABLES`.
        fresh: whether each variable in `FRESH` is set again.
        goal: `GoalEvent`, or their number + row of the landmark.
        status: index in `STATUSES`, for the first place named, or for the goal.
    """

    values: tuple[int, ...]
    fresh: tuple[bool, ...]
    goal: int = GoalEvent.KEEP
    status: int = 0


@dataclass(frozen=True, kw_only=True)
class WorkingMemory:
    """Working memory.

    Attributes:
        town: the map.
        values: value of each variable.
        changed_at: time at which each variable was last changed or set again [s].
        goal: name of the goal; None if there is none.
        goal_mark: its row among the landmarks; -1 if it is not on the map.
        goal_at: time of its last change [s].
        former: the previous goal.
        street: street of the requested turn.
        junction: the junction from which the requested turn is counted; -1 for none.
        target: place where a nudge or a slow approach ends.
        navigator: route to the goal.
        ruled_out: places of houses and people that were visited or not meant.
        statuses: status of errands by place.
        updates: belief updates to be sent, the next first.
        plan: junctions of the route as sent last.
        standstill: current or last standstill, and the reason for it.
        told_to_stop_at: time at which it halted because of an utterance [s].
        told_to_turn_round_at: time of the last instruction to turn round [s].
        physical: its last physical action; None if there is none.
        physical_at: its time [s].
        junction_of_action: junction ahead at that time.
        said_at: time of its last remark by predicate or, without content, by move [s].
        spoke_at: time of its last remark [s].
        asked_at: time of its last question [s].
        asked_lane: lane before the junction at which the Co-Wizard last asked for the way; -1 for none.
        heard_at: time of the last utterance of the participant [s].
        last: its last remark that can be repeated; None at first.
        clock: time between decisions.
    """

    town: Town
    values: tuple[int, ...] = field(default_factory=lambda: initial_values(USUAL_SPEED))
    changed_at: tuple[float, ...] = (-AWAY,) * len(VARIABLES)
    goal: LandmarkName | None = None
    goal_mark: int = -1
    goal_at: float = -AWAY
    former: LandmarkName | None = None
    street: StreetName = StreetName.UNKNOWN
    junction: int = -1
    target: Place | None = None
    navigator: Navigator = Navigator()
    ruled_out: tuple[Place, ...] = ()
    statuses: tuple[tuple[LandmarkName, GoalStatus], ...] = ()
    updates: tuple[Mental, ...] = ()
    plan: tuple[int, ...] = ()
    standstill: Standstill = Standstill()
    told_to_stop_at: float = -AWAY
    told_to_turn_round_at: float = -AWAY
    physical: PhysicalAction | None = None
    physical_at: float = -AWAY
    junction_of_action: int = -1
    said_at: tuple[tuple[str, float], ...] = ()
    spoke_at: float = -AWAY
    asked_at: float = -AWAY
    asked_lane: int = -1
    heard_at: float = -AWAY
    last: Remark | None = None
    clock: DecisionClock = DecisionClock()

    @property
    def knowledge(self) -> CoWizardKnowledge:
        """Beliefs and intentions, with the thresholds of the scripted Co-Wizard."""
        return CoWizardKnowledge(
            town=self.town,
            config=CONFIG,
            goal=self.goal,
            goal_is_on_map=self.goal_mark >= 0,
            progress=self.navigator.route.progress,
            ruled_out=self.ruled_out,
            halted=bool(self.value("halted")),
            arrived=bool(self.value("arrived")),
            pausing=bool(self.value("pausing")),
            directed=bool(self.value("order")),
            to_turn_round=self.value("manoeuvre") == U_TURN,
            asks_for_detour=bool(self.value("detour")),
            blocked_at=self.navigator.blocked_at,
            told_to_stop_at=self.told_to_stop_at,
            told_to_turn_round_at=self.told_to_turn_round_at,
            standstill=self.standstill,
        )

    def distance_to(self, place: Place | None, view: CoWizardView) -> float | None:
        """Returns the distance to a place along the default lanes [m]; None if it is not near on them, or no place."""
        return None if place is None else default_lane_distance(self.town, view.here, place, PLACE_SIGHT)

    def value(self, name: str) -> int:
        """Returns the value of a variable."""
        return self.values[_INDEX[name]]

    def seen(self, view: CoWizardView, *, heard: bool) -> WorkingMemory:
        """Brings standstill, route and times up to date with an observation."""
        memory = replace(
            self,
            clock=self.clock.ticked(view.time),
            heard_at=view.time if heard else self.heard_at,
            navigator=self.navigator.followed(self.town, view),
        )
        standstill = memory.standstill.observed(view.time, standing=view.standing)
        memory = replace(memory, standstill=standstill)
        if view.standing:
            reason = reason_to_stand(memory.knowledge, view)
            memory = replace(memory, standstill=standstill.with_reason(reason, view.time))
        return memory._carrying_on(view)

    def updated(
        self,
        update: Update,
        view: CoWizardView,
        named: Sequence[LandmarkName],
        streets: Sequence[StreetName],
        distance: int | None,
    ) -> WorkingMemory:
        """Stores an output of the network.

        Args:
            update: the output.
            view: observation.
            named: places named in the utterance just heard.
            streets: streets named in it.
            distance: distance named in it [m].
        """
        if self._is_kept_by(update):
            return self
        now, fresh = view.time, dict(zip(FRESH, update.fresh, strict=True))
        changed = tuple(
            now if new != old or fresh.get(name, False) else at
            for name, new, old, at in zip(VARIABLES, update.values, self.values, self.changed_at, strict=True)
        )
        memory = replace(self, values=update.values, changed_at=changed)
        if memory.value("halted") and not self.value("halted") and now - self.heard_at < REACTION:
            memory = replace(memory, told_to_stop_at=now)
        if memory.value("manoeuvre") == U_TURN:
            memory = replace(memory, told_to_turn_round_at=now)
        if fresh["order"] or memory.value("skip") < self.value("skip"):
            choice = junction_meant(self.town, view.here, view.choice)
            street = streets[0] if streets and memory.value("onto_street") else self.street
            street = street if memory.value("onto_street") else StreetName.UNKNOWN
            memory = replace(memory, junction=-1 if choice is None else choice.junction, street=street)
        if fresh["nudging"]:
            memory = replace(memory, target=default_lane_place(self.town, view.here, float(distance or NUDGE_DISTANCE)))
        elif fresh["creeping"] and memory.value("creeping"):
            ahead = max((distance or SLOWER_DISTANCE) - CREEP_SHORTFALL, CREEP_LEAST)
            memory = replace(memory, target=None)._marked(view, ahead)
        memory = memory._with_status(update, named)
        return memory._with_goal(update.goal, view, named)

    def _is_kept_by(self, update: Update) -> bool:
        """Returns whether an output of the network changes nothing, as at most decisions."""
        keeps = update.goal == GoalEvent.KEEP and STATUSES[update.status] is None
        return keeps and update.values == self.values and not any(update.fresh) and self.value("manoeuvre") != U_TURN

    def _carrying_on(self, view: CoWizardView) -> WorkingMemory:
        """Moves the place of a slow approach along with the car, and sends the plan if the route has changed."""
        memory = self
        if self.value("creeping") and not self.value("halted") and view.manoeuvre is not PhysicalAction.U_TURN:
            left = self.distance_to(self.target, view)
            if left is None or left < CREEP_RENEW:
                memory = memory._marked(view, CREEP_LEAD)
        progress = memory.navigator.route.progress
        route = None if progress is None else progress.route
        if route is None:
            return memory
        indices = self.town.junction_indices
        plan = tuple(indices[junction] for junction in route.junctions(self.town) if junction in indices)
        if plan == memory.plan or not plan:
            return memory
        return replace(memory, plan=plan)._sending(Mental(action=MentalAction.PLAN_UPDATE, plan=plan))

    def _marked(self, view: CoWizardView, ahead: float) -> WorkingMemory:
        """Marks the goal as close ahead, so that the car approaches it slowly."""
        place, name = default_lane_place(self.town, view.here, ahead), self.goal or LandmarkName.UNKNOWN
        where = LanePosition(lane=place[0], metres=round(place[1]))
        memory = replace(self, target=place)
        if self.target is None:
            memory = memory._sending(Mental(action=MentalAction.GOAL_UPDATE, goals=(name,)))
        return memory._sending(Mental(action=MentalAction.KNOWLEDGE_UPDATE, landmark=name, place=where))

    def _sending(self, update: Mental) -> WorkingMemory:
        kept = tuple(
            one
            for one in self.updates
            if one != update and not (one.action is update.action is MentalAction.KNOWLEDGE_UPDATE)
        )
        return replace(self, updates=(*kept, update))

    def _with_status(self, update: Update, named: Sequence[LandmarkName]) -> WorkingMemory:
        """Stores the status of the first place named, or of the goal."""
        status, place = STATUSES[update.status], next(iter(named), self.goal)
        if status is None or place is None:
            return self
        memory = self._noting(place, status)
        if status is GoalStatus.COMPLETE and place in SHARED_NAMES and self.navigator.goal is not None:
            memory = replace(memory, ruled_out=(*memory.ruled_out, self.navigator.goal))
        return memory

    def _noting(self, place: LandmarkName, status: GoalStatus) -> WorkingMemory:
        statuses = (*(pair for pair in self.statuses if pair[0] is not place), (place, status))
        update = Mental(action=MentalAction.STATUS_UPDATE, landmark=place, status=status)
        return replace(self, statuses=statuses)._sending(update)

    def _with_goal(self, event: int, view: CoWizardView, named: Sequence[LandmarkName]) -> WorkingMemory:
        """Carries out an event of the goal."""
        if event == GoalEvent.KEEP:
            return self
        to, town = self.navigator.to, self.town
        if event >= len(GoalEvent):
            mark = next((one for one in view.landmarks if one.row == event - len(GoalEvent)), None)
            return self if mark is None else self._aiming(mark, view)
        memory = replace(self, navigator=to(town, view, None), goal_mark=-1, goal_at=view.time, plan=())
        if event == GoalEvent.CLEAR:
            return replace(memory, goal=None, former=self.goal)
        if event == GoalEvent.DOUBT:
            place = self.navigator.goal
            ruled = () if place is None or self.goal not in SHARED_NAMES else (place,)
            return replace(memory, ruled_out=(*self.ruled_out, *ruled))
        which = event - GoalEvent.OFF_MAP_FIRST
        if which >= len(named):
            return self
        return replace(memory, goal=named[which], former=self.goal)._noting(named[which], GoalStatus.UNKNOWN)

    def _aiming(self, mark: SeenLandmark, view: CoWizardView) -> WorkingMemory:
        memory = replace(
            self,
            goal=mark.name,
            former=self.goal if self.goal is not mark.name else self.former,
            goal_mark=mark.row,
            goal_at=view.time,
            navigator=self.navigator.to(self.town, view, mark.place),
        )
        memory = memory._sending(Mental(action=MentalAction.GOAL_UPDATE, goals=(mark.name,)))
        return memory._noting(mark.name, GoalStatus.ONGOING)

    def acted(self, physical: PhysicalAction | None, view: CoWizardView) -> WorkingMemory:
        """Records a physical action of the Co-Wizard."""
        if physical is None:
            return self
        return replace(self, physical=physical, physical_at=view.time, junction_of_action=view.junction)

    def spoken(self, remark: Remark, topic: str, view: CoWizardView, *, asks: bool, asks_way: bool) -> WorkingMemory:
        """Records a remark of the Co-Wizard: its topic, and whether it asks."""
        last = remark if asks or remark.act.slots else self.last
        said = (*(pair for pair in self.said_at if pair[0] != topic), (topic, view.time))
        lane = view.choice.lane if asks_way and view.choice is not None else self.asked_lane
        asked = view.time if asks else self.asked_at
        return replace(self, said_at=said, spoke_at=view.time, asked_at=asked, asked_lane=lane, last=last)


_INDEX: Final[Mapping[str, int]] = MappingProxyType({name: k for k, name in enumerate(VARIABLES)})


def initial_values(speed: int) -> tuple[int, ...]:
    """Returns the values at the start of a session, with the usual cruise speed [km/h]."""
    return tuple(speed_index(speed) if name == "speed" else 0 for name in VARIABLES)


def speed_index(speed: float) -> int:
    """Returns the index of the nearest speed in `SPEEDS`."""
    return min(max(round((speed - SPEEDS[0]) / 5.0), 0), len(SPEEDS) - 1)
