"""A participant who only tells the way: what it says and when, without words, from what the participant observes."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import NamedTuple

from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Entry, Place
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.observation_parser import (
    SeenLandmark,
    SeenSubgoal,
    place_on_lanes,
    read_landmarks,
    read_objects,
    read_subgoals,
    scalar,
    street_of,
)
from dorothie_gym.policies.route_progress import RouteJunction, RouteProgress
from dorothie_gym.spaces import ObjectColumn, Observation

TELL_DISTANCE = 110.0
"""A turn is told when it is this near [m]."""

SWITCH_DISTANCE = 80.0
"""A lane switch is told when it is this near [m]."""

STOP_DISTANCE = 95.0
"""That the car is to stop is told when the place is this near [m]."""

AGAIN = 9.0
"""What has not been done is told again after this time [s]."""

SIGHT = 80.0
"""A roadblock is noticed from here [m]."""

WITHIN = 1.9
"""A car that stands this close to the place has arrived [m]."""

COMFORTABLE, U_TURN_SPEED = 3.0, 3.5
"""With which the car slows down for a U-turn [m/s^2], and to which [m/s]."""

REACTION = 1.5
"""Time from telling to doing [s]."""


class Guidance(enum.StrEnum):
    """How the participant says where to go."""

    TURNS = "turns"
    """Turn by turn, before each junction; at the end, how far it is to where the car is to stop."""

    GOALS = "goals"
    """By the name of the next goal; turn by turn only to places that are not on the Co-Wizard's map."""


@dataclass(frozen=True, kw_only=True)
class NavigationInstruction:
    """What was said last.

    Attributes:
        act: move and slots: the action, and the street or landmark where one is named.
        sector: which way, as one of `ways.SECTORS`; None where the act has no direction.
        distance: how far ahead it is to be done, as said [m].
        time: when it was said [s].
    """

    act: DialogueAct
    sector: int | None = None
    distance: float = 0.0
    time: float = 0.0

    @property
    def action(self) -> ActionValue | None:
        """The action that the act asks for."""
        return next((value for value in self.act.slots if isinstance(value, ActionValue)), None)

    @property
    def landmark(self) -> LandmarkName | None:
        """The landmark that it names."""
        return next((value for value in self.act.slots if isinstance(value, LandmarkName)), None)

    @property
    def street(self) -> StreetName | None:
        """The street that it names."""
        return next((value for value in self.act.slots if isinstance(value, StreetName)), None)


class GuidanceStep(NamedTuple):
    """Something to be told: what tells it apart from others, and what an `NavigationInstruction` has of it."""

    key: tuple[object, ...]
    values: tuple[ActionValue | StreetName | LandmarkName, ...]
    sector: int | None = None
    distance: float = 0.0


class Instructor:
    """Tells the way to one subgoal after another.

    Attributes:
        journey: way to the present goal, or None when there is nothing left to do.
        goal: the landmark that the car is told the way to.
        blocked: roadblocks that were seen.
        way_left: of the present goal; also what progress is measured by.
        told: what was said last.
    """

    def __init__(self, town: Town, ways: JunctionExits, guidance: Guidance) -> None:
        self._town, self._ways, self._guidance = town, ways, guidance
        self.journey: RouteProgress | None = None
        self.goal: SeenLandmark | None = None
        self.blocked: tuple[Place, ...] = ()
        self.way_left = CostToGo(town)
        self.told: NavigationInstruction | None = None
        self._target: SeenSubgoal | None = None
        self._key: tuple[object, ...] = ()
        self._subgoals = b""

    def instruct(
        self, seen: Observation, known: frozenset[Place], *, waits: bool, turning: float
    ) -> NavigationInstruction | None:
        """Says something, or nothing.

        Args:
            seen: what the participant observes.
            known: places of the landmarks on the Co-Wizard's map.
            waits: whether the car was told to stop, and stands.
            turning: what is left of a lane switch or U-turn that it is in the middle of [m]; 0 where it is in none.

        Returns:
            What is said now; None if nothing is.
        """
        place = int(seen["lane"]), scalar(seen, "station")
        self._take_target(seen, place)
        if self.journey is None or self.goal is None:
            return None
        self._note_roadblocks(seen, place)
        if not turning:
            self._follow(place)
        if self._guidance is Guidance.GOALS and self.goal.place in known:
            said: GuidanceStep | None = self._name_goal()
        else:
            said = (
                self._tell_landing(place, turning, waits=waits) if turning else self._tell_way(seen, place, waits=waits)
            )
        if said is None:
            return None
        now = scalar(seen, "time")
        if said.key == self._key and self.told is not None and now - self.told.time < AGAIN:
            return None
        self._key = said.key
        act = DialogueAct.of(DialogueMove.INSTRUCT, *said.values)
        self.told = NavigationInstruction(act=act, sector=said.sector, distance=said.distance, time=now)
        return self.told

    # --- where to go ------------------------------------------------------------------------------------------------

    def _take_target(self, seen: Observation, place: Place) -> None:
        """Keeps the present subgoal while it is open; otherwise takes the closest one that may be reached now."""
        table = seen["subgoals"].tobytes()
        if table == self._subgoals:
            return  # nothing has changed, as in most decisions
        self._subgoals = table
        landmarks = {mark.row: mark for mark in read_landmarks(seen, self._town)}
        subgoals = read_subgoals(seen)
        if self._target is not None:
            now = subgoals[self._target.index]
            if now.open and now.allowed and now.landmark == self._target.landmark:
                return
        self._target, self.goal, self.journey, self._key = None, None, None, ()
        best = math.inf
        for subgoal in subgoals:
            mark = landmarks.get(subgoal.landmark)
            if not (subgoal.open and subgoal.allowed) or mark is None:
                continue
            journey = RouteProgress.plan(self._town, place, mark.place, self.blocked)
            cost = journey.route.cost if journey.route is not None else math.inf
            if self._target is None or cost < best:
                best, self._target, self.goal, self.journey = cost, subgoal, mark, journey
        self.way_left.aim(self.goal.place if self.goal is not None else None, self.blocked)

    def _note_roadblocks(self, seen: Observation, place: Place) -> None:
        assert self.journey is not None and self.goal is not None
        if not (seen["objects"][:, ObjectColumn.KIND] == ObjectClass.STATIC.value).any():
            return
        lanes = [leg.lane for leg in self.journey.legs[:6]]
        for thing in read_objects(seen):
            if thing.kind is not ObjectClass.STATIC or thing.distance > SIGHT:
                continue
            found = place_on_lanes(self._town, lanes, thing.x, thing.y)
            if found is None or (found[0] == place[0] and found[1] < place[1]):
                continue
            if any(there[0] == found[0] and abs(there[1] - found[1]) < 10.0 for there in self.blocked):
                continue
            # the cell behind the roadblock as well: the car's own cell counts as free
            behind = found[0], min(found[1] + 8.0, self._town.lanes[found[0]].length)
            self.blocked = (*self.blocked, found, behind)
            self.journey = self.journey.replanned(self._town, place, self.blocked)
            self.way_left.aim(self.goal.place, self.blocked)

    def _follow(self, place: Place) -> None:
        assert self.journey is not None
        self.journey = self.journey.followed(self._town, *place)
        if self.journey.lost(place[1]):
            self.journey = self.journey.replanned(self._town, place)
            self._key = ()

    # --- what to say ------------------------------------------------------------------------------------------------

    def _name_goal(self) -> GuidanceStep:
        assert self.goal is not None
        return GuidanceStep(("goal", self.goal.row), (self.goal.name,))

    def _tell_way(self, seen: Observation, place: Place, *, waits: bool) -> GuidanceStep | None:
        """The next step, if it is time to tell it; a car that has been stopped is told to go on."""
        journey = self.journey
        assert journey is not None
        if journey.astray:
            return None
        lane, station = place
        crossing, manoeuvre = journey.next_crossing(self._town, station), journey.next_manoeuvre(station)
        if manoeuvre is not None and (crossing is None or manoeuvre[1] < crossing.distance):
            entry, distance = manoeuvre
            alone = crossing is None or journey.needs_switch(self._town, lane, station, crossing)
            step = self._tell_manoeuvre(seen, lane, entry, distance) if alone or entry is Entry.U_TURN else None
            if step is not None:
                return step
            if crossing is None or entry is Entry.U_TURN:
                return _go_on(waits)
        if crossing is None:
            return self._tell_stop(journey.left(station), waits=waits)
        return self._tell_turn(seen, crossing) if crossing.distance <= TELL_DISTANCE else _go_on(waits)

    def _tell_turn(self, seen: Observation, crossing: RouteJunction) -> GuidanceStep:
        sector = self._ways.sector_of(crossing.lane, crossing.exit.connector)
        street = street_of(seen, self._town, crossing.exit.lane)
        values = (ActionValue.J_TURN, street) if street is not StreetName.UNKNOWN else (ActionValue.J_TURN,)
        return GuidanceStep(("turn", crossing.lane, crossing.exit.connector), values, sector, crossing.distance)

    def _tell_manoeuvre(self, seen: Observation, lane: int, entry: Entry, distance: float) -> GuidanceStep | None:
        """A U-turn, or a lane switch that is not made on the way into a turn."""
        if entry is Entry.U_TURN:
            speed = scalar(seen, "speed")
            braking = max(speed**2 - U_TURN_SPEED**2, 0.0) / (2.0 * COMFORTABLE)
            near = distance <= REACTION * speed + braking
            return GuidanceStep(("round", lane), (ActionValue.U_TURN,), None, distance) if near else None
        if distance > SWITCH_DISTANCE:
            return None
        left = entry is Entry.CHANGE_LEFT
        return GuidanceStep(
            ("lane", lane, left), (ActionValue.LANE_SWITCH,), nearest_sector(90.0 if left else -90.0), distance
        )

    def _tell_landing(self, place: Place, turning: float, *, waits: bool) -> GuidanceStep | None:
        """In the middle of a manoeuvre: that the goal is right behind it, while there is time to stop for it."""
        assert self.goal is not None
        lane, station = self.goal.place
        left = station - place[1]  # a car in a manoeuvre counts as being where that ends
        if lane == place[0] and -WITHIN <= left <= STOP_DISTANCE:
            return self._tell_stop(left + turning, waits=waits)
        return _go_on(waits)

    def _tell_stop(self, left: float, *, waits: bool) -> GuidanceStep | None:
        """That the car is to stop in so many metres; one that stands elsewhere than at the place is told to go on."""
        assert self.goal is not None
        if waits:
            return None if abs(left) <= WITHIN else _go_on(waits, left)
        if left > STOP_DISTANCE:
            return None
        return GuidanceStep(("stop", self.goal.row), (ActionValue.STOP, self.goal.name), None, max(left, 0.0))


def _go_on(waits: bool, distance: float = 0.0) -> GuidanceStep | None:
    return GuidanceStep(("on",), (ActionValue.START,), None, distance) if waits else None
