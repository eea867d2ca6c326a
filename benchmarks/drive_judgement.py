"""Judgement of a driving test: was the plan driven, and was the reply of the expected kind?

The judge reads the true path of the car and the map, and shares no code with the Co-Wizard's own search for the points
at which steps are due.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.drive_log import DriveLog, Moment, Passage, replies
from dorothie_gym.dialogue.routes import (
    ConditionRelation,
    DrivingPlan,
    PlaceReference,
    PlanStep,
    StepAction,
    StepChange,
)
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology import DialogueMove, LandmarkName, ObjectClass, StreetName

REPLY_WITHIN: Final = 20.0
"""Time from the last utterance to the last words that count as the reply [s]."""

STOP_WITHIN: Final = 15.0
"""Largest distance of a stop from the expected place along the road [m]."""

PROMPTLY: Final = 30.0
"""Time within which the car does what needs no place: stops, waits, switches [s]."""

U_TURN_ROOM: Final = 25.0
"""Largest distance between the places before and behind a U-turn [m]."""

BESIDE: Final = 50.0
"""Largest distance of a landmark from the car as it passes it [m]."""

_CONFIRMS: Final = frozenset(
    {DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.REPLY_Y, DialogueMove.EXPLAIN, DialogueMove.CHECK}
)
_ASKS: Final = frozenset({DialogueMove.QUERY_W, DialogueMove.QUERY_YN, DialogueMove.CHECK})
_REASONS: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.REPLY_W, DialogueMove.REPLY_N, DialogueMove.REPLY_U})

_ABOUT: Final[Mapping[str, frozenset[str]]] = {
    "speed": frozenset({"drives_at", "stands"}),
    "traffic": frozenset({"crowded"}),
    "next_turn": frozenset({"will"}),
    "why_slow": frozenset({"because", "not_stands", "stands"}),
    "weather": frozenset({"weather"}),
    "where": frozenset({"on_street", "near", "located"}),
    "distance": frozenset({"distance", "arrives_in", "close"}),
    "time": frozenset({"arrives_in"}),
    "list": frozenset({"task", "goal"}),
    "speed_limit": frozenset({"limit"}),
    "ahead": frozenset({"sees"}),
}
"""Predicates that answer a question about a topic."""


def judge_reply(log: DriveLog, expected: str, about: str | None) -> str | None:
    """Returns what is wrong with the reply; None if it is of the expected kind."""
    said = replies(log, log.told + REPLY_WITHIN)
    if not said:
        return "no reply"
    if all(one.move is DialogueMove.CONFUSE for one in said):
        return "not understood"
    if expected != "answer" and all(one.move is DialogueMove.REPLY_N and not one.slots for one in said):
        return "a bare no"
    topics = {predicate for one in said for predicate in one.predicates}
    if about is not None and expected in ("answer", "reason") and topics.isdisjoint(_ABOUT[about]):
        return f"no answer about {about}"
    fitting = {
        "confirm": any(one.move in _CONFIRMS for one in said),
        "reason": any(one.move in _REASONS and one.predicates for one in said),
        "ask": any(one.move in _ASKS for one in said),
    }
    return None if fitting.get(expected, True) else f"no reply of the kind {expected}"


@dataclass
class PlanJudge:
    """Judge of one plan.

    Attributes:
        log: the drive.
        landmarks: positions of the landmarks of the town by name [m].
        streets: indices of the streets by name.
        at: time from which the next step is looked for [s].
        goals: number of destinations that visits have accounted for.
    """

    log: DriveLog
    landmarks: Mapping[LandmarkName, tuple[float, float]]
    streets: Mapping[StreetName, frozenset[int]]
    at: float = 0.0
    goals: int = 0

    def judge(self, plan: DrivingPlan) -> str | None:
        """Returns the first step that was not driven, and why; None if the whole plan was."""
        self.at = self.log.began
        for number, step in enumerate(plan, start=1):
            wrong = _JUDGES[step.action](self, step)
            if wrong is not None:
                return f"step {number} ({step.describe()}): {wrong}"
            if step.action in (StepAction.WAIT, StepAction.VISIT) and self._still_waits():
                return None  # the passenger does not say that the drive is to go on
        return None

    def _still_waits(self) -> bool:
        """Returns whether the car stands to the end from the present step on."""
        return all(one.speed < 1.0 for one in self.log.moments[-6:]) and not self.log.moments[-1].held

    # --- places -----------------------------------------------------------------------------------------------------

    def passed(self, name: LandmarkName, since: float) -> float | None:
        """Returns the time at which the car comes by a landmark first [s]; None if it does not."""
        x, y = self.landmarks[name]
        moments = self.log.since(since)
        for now, later in itertools.pairwise(moments):
            if along(now, x, y) >= 0.0 > along(later, x, y) and math.hypot(now.x - x, now.y - y) < BESIDE:
                return later.time
        return None

    def spot(self, place: PlaceReference, passages: Sequence[Passage]) -> int | None:
        """Returns which of some junctions a place is; None if it is none of them."""
        if place.object is ObjectClass.TRAFFIC_LIGHT:
            fitting = [number for number, one in enumerate(passages) if one.lights]
        elif place.street is not None:
            named = self.streets.get(place.street, frozenset())
            lanes = self.log.town.lanes
            fitting = [
                number
                for number, one in enumerate(passages)
                if one.streets & named and lanes[one.before].street not in named
            ]
        else:
            fitting = list(range(len(passages)))
        number = (place.ordinal or 1) - 1
        return fitting[number] if number < len(fitting) else None

    # --- steps ------------------------------------------------------------------------------------------------------

    def turn(self, step: PlanStep) -> str | None:
        """Judges a turn: taken at the expected junction, straight across those before."""
        passages = self.log.passages(self.at)
        wanted = str(step.direction) if step.direction is not None else None
        turned = next((number for number, one in enumerate(passages) if one.direction != "straight"), None)
        if turned is None:
            return f"no turn within the time, {len(passages)} junctions passed"
        if wanted is not None and passages[turned].direction != wanted:
            return f"turned {passages[turned].direction} at junction {turned + 1}"
        wrong = self._at_junction(step, passages, turned)
        self.at = passages[turned].time
        return wrong

    def _at_junction(self, step: PlanStep, passages: Sequence[Passage], turned: int) -> str | None:
        wanted = str(step.direction) if step.direction is not None else passages[turned].direction
        could = [number for number, one in enumerate(passages[: turned + 1]) if wanted in one.open]
        place = None if step.condition is None else step.condition.place
        relation = None if step.condition is None else step.condition.relation
        if step.distance is not None:
            driven = self._driven(self.at, passages[turned].time)
            far = abs(driven - step.distance) > max(60.0, step.distance / 2)
            return f"turned after {driven:.0f} m" if far else None
        if place is None or relation is None or place.reference is not None:
            expected = (step.ordinal or 1) - 1
            return None if could.index(turned) == expected else f"turned at opportunity {could.index(turned) + 1}"
        if place.landmark is not None:
            return self._at_landmark(step, relation, place.landmark, passages, could, turned)
        spot = self.spot(place, passages)
        behind = relation in (ConditionRelation.AFTER, ConditionRelation.PAST)
        if relation is ConditionRelation.BEFORE:
            return "the place was passed" if spot is not None and spot <= turned else None
        if spot is None:
            return "the place was not reached"
        if behind:
            later = [number for number in could if number > spot]
            wanted_number = (step.ordinal or 1) - 1
            right = wanted_number < len(later) and later[wanted_number] == turned
            return None if right else f"turned at junction {turned + 1}, the place is {spot + 1}"
        return None if turned == spot else f"turned at junction {turned + 1}, the place is {spot + 1}"

    def _at_landmark(
        self,
        step: PlanStep,
        relation: ConditionRelation,
        name: LandmarkName,
        passages: Sequence[Passage],
        could: Sequence[int],
        turned: int,
    ) -> str | None:
        x, y = self.landmarks[name]
        by = self.passed(name, self.at)
        behind = by is not None and by <= passages[turned].time
        away = [math.hypot(one.x - x, one.y - y) for one in passages]
        if relation in (ConditionRelation.AFTER, ConditionRelation.PAST) or step.ordinal is not None:
            if not behind and away[turned] > 45.0:
                return f"turned {away[turned]:.0f} m before the {name.label}"
            between = [number for number in could if by is not None and by < passages[number].time]
            late = len([number for number in between if number < turned]) > (step.ordinal or 1) - 1
            return "turned later than at the first opportunity" if late else None
        if relation is ConditionRelation.BEFORE:
            begun = max(
                (one.time for one in self.log.since(self.at) if one.lane == passages[turned].before), default=0.0
            )
            return "the place was passed" if by is not None and by <= begun and away[turned] > 30.0 else None
        nearer = [number for number in could if away[number] < away[turned] - 20.0]
        if nearer or away[turned] > 90.0:
            return f"turned {away[turned]:.0f} m from the {name.label}"
        return None

    def _driven(self, since: float, until: float) -> float:
        moments = [moment for moment in self.log.since(since) if moment.time <= until]
        return sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in itertools.pairwise(moments))

    def straight(self, step: PlanStep) -> str | None:
        """Judges a stretch straight on."""
        passages = self.log.passages(self.at)
        place = None if step.condition is None else step.condition.place
        if place is not None and place.landmark is not None:
            by = self.passed(place.landmark, self.at)
            if by is None:
                return f"did not come to the {place.landmark.label}"
            if any(one.direction != "straight" and one.time < by for one in passages):
                return "turned before the place"
            self.at = by
            return None
        count = step.ordinal or 1
        if place is not None:
            spot = self.spot(place, passages)
            if spot is None:
                return "the place was not reached"
            behind = step.condition is not None and step.condition.relation in _PASSED
            count = spot + behind
        if step.distance is not None:
            count = 0
        if any(one.direction != "straight" for one in passages[:count]):
            return "turned"
        if len(passages) < count:
            return f"only {len(passages)} of {count} junctions passed"
        if count:
            self.at = passages[count - 1].time
        return None

    def stop(self, step: PlanStep) -> str | None:
        """Judges a stop."""
        stands = self.log.stands(self.at)
        if not stands:
            return "no stop within the time"
        moment, place = stands[0], None if step.condition is None else step.condition.place
        begun, self.at = self.at, moment.time
        said = " ".join(one.text.lower() for one in replies(self.log, self.log.told + REPLY_WITHIN))
        if step.side is not None and str(step.side) == "left" and "left" not in said:
            return "the side was not taken up"
        if place is None or place.reference is not None:
            since = max(self.log.told, begun, 0.0)
            return f"stopped {moment.time - since:.0f} s later" if moment.time - since > PROMPTLY else None
        relation = ConditionRelation.AT if step.condition is None else step.condition.relation
        if place.landmark is not None:
            x, y = self.landmarks[place.landmark]
            ahead = along(moment, x, y)
            if math.hypot(moment.x - x, moment.y - y) > math.hypot(BESIDE, ahead):
                return f"stopped elsewhere than at the {place.landmark.label}"
        else:
            found = self._ahead_of_junction(place, moment)
            if found is None:
                return "the place was not reached"
            ahead = found
        low, high = _STOPS.get(relation, (-STOP_WITHIN, STOP_WITHIN))
        return None if low <= ahead <= high else f"stopped {ahead:+.0f} m before the place"

    def _ahead_of_junction(self, place: PlaceReference, moment: Moment) -> float | None:
        """Returns the distance from a stop to the edge of the junction of a place [m], negative behind it."""
        passages = self.log.passages(self.log.began)
        gone = [one for one in passages if one.time <= moment.time]
        spot = self.spot(place, passages)
        if spot is not None and spot < len(gone):
            return -self._driven(gone[spot].time, moment.time)
        lane = self.log.town.lanes[moment.lane]
        lit = self.log.town.light(moment.lane, 0.0) is not None
        return lane.length - moment.station if lit or place.object is None else None

    def wait(self, step: PlanStep) -> str | None:
        """Judges a pause."""
        stands = self.log.stands(self.at - 3.0)
        if not stands:
            return "no stop within the time"
        self.at = max(stands[0].time, self.at)
        return None

    def go(self, step: PlanStep) -> str | None:
        """Judges a start."""
        moving = next((one for one in self.log.since(self.at) if one.speed > 1.0), None)
        if moving is None:
            return "did not drive on"
        self.at = moving.time
        return None

    def lane(self, step: PlanStep) -> str | None:
        """Judges a change of lane; one that is not there has to be remarked on."""
        town, moments = self.log.town, self.log.since(self.at)
        side = LinkType.LANE_CHANGE_RIGHT if str(step.direction) == "right" else LinkType.LANE_CHANGE_LEFT
        for now, later in itertools.pairwise(moments):
            if town.neighbour(now.lane, side) == later.lane:
                self.at = later.time
                return None
        refused = any("possible" in one.predicates for one in self.log.said)
        there = any(town.neighbour(one.lane, side) is not None for one in moments[:20])
        return None if refused and not there else "the lane was not changed"

    def u_turn(self, step: PlanStep) -> str | None:
        """Judges a turn back."""
        moments, town = self.log.since(self.at), self.log.town
        place = None if step.condition is None else step.condition.place
        for number, now in enumerate(moments):
            later = next((one for one in moments[number + 1 : number + 30] if _is_reversed(now, one)), None)
            if later is not None and not town.lanes[now.lane].in_junction:
                self.at = later.time
                if place is None or place.landmark is None:
                    return None
                x, y = self.landmarks[place.landmark]
                away = math.hypot(now.x - x, now.y - y)
                return None if away < 90.0 else f"turned round {away:.0f} m from the place"
        return "did not turn round"

    def speed(self, step: PlanStep) -> str | None:
        """Judges the speed that the car is set to."""
        moments = self.log.since(self.at)
        before = moments[0].cruise
        for moment in moments:
            if step.speed is not None:
                reached = abs(moment.cruise - step.speed) <= 3.0
            else:
                slower = step.change is StepChange.SLOWER
                reached = moment.cruise <= before - 4.0 if slower else moment.cruise >= before + 4.0
            if reached:
                self.at = moment.time
                return None
        return f"the speed stays at {moments[-1].cruise:.0f} km/h"

    def lights(self, step: PlanStep) -> str | None:
        """Judges the head lights."""
        wanted = step.change is StepChange.ON
        return None if self.log.moments[-1].lights is wanted else "the lights were not switched"

    def follow(self, step: PlanStep) -> str | None:
        """Judges a drive along a street."""
        name = None if step.place is None else step.place.street
        named = frozenset() if name is None else self.streets.get(name, frozenset())
        found = next((one for one in self.log.since(self.at) if self.log.town.lanes[one.lane].street in named), None)
        if found is None:
            return "did not come to the street"
        self.at = found.time
        return None

    def avoid(self, step: PlanStep) -> str | None:
        """Judges whether a street was kept off."""
        name = None if step.place is None else step.place.street
        named = frozenset() if name is None else self.streets.get(name, frozenset())
        lanes = self.log.town.lanes
        on_it = [lanes[one.lane].street in named and not lanes[one.lane].in_junction for one in self.log.since(self.at)]
        entered = any(later and not now for now, later in itertools.pairwise(on_it))
        return "the street was entered" if entered else None

    def visit(self, step: PlanStep) -> str | None:
        """Judges an errand: adopted as destination, in its order; the last ones need not come up within the time."""
        name = None if step.place is None or step.place.landmark is None else step.place.landmark
        if name is None:
            return None if LandmarkName.UNKNOWN in self.log.goals else "the place was not taken for a destination"
        self.goals += 1
        if self.goals > 1:
            earlier = self.log.goals[: self.goals - 1]
            return "the order of the errands is wrong" if name in earlier and name is self.log.goals[-1] else None
        current = self.log.goals[-1] if self.log.goals else None
        return None if current is name else f"drives to {current.label if current is not None else 'nowhere'}"


def _is_reversed(now: Moment, later: Moment) -> bool:
    """Returns whether the car has turned back on the spot between two moments."""
    close = math.hypot(later.x - now.x, later.y - now.y) < U_TURN_ROOM
    return close and math.cos(later.heading - now.heading) < -0.9


def along(moment: Moment, x: float, y: float) -> float:
    """Returns how far a point lies ahead of the car along its heading [m]; negative behind it."""
    return (x - moment.x) * math.cos(moment.heading) + (y - moment.y) * math.sin(moment.heading)


_PASSED: Final = frozenset({ConditionRelation.AFTER, ConditionRelation.PAST})

_STOPS: Final[Mapping[ConditionRelation, tuple[float, float]]] = {
    ConditionRelation.PAST: (-40.0, 5.0),
    ConditionRelation.AFTER: (-40.0, 5.0),
    ConditionRelation.BEFORE: (-5.0, 40.0),
    ConditionRelation.SEEN: (-STOP_WITHIN, 60.0),
}
"""Range of the distance from a stop to its place [m], where that is not `STOP_WITHIN` to both sides."""

_JUDGES: Final[Mapping[StepAction, Callable[[PlanJudge, PlanStep], str | None]]] = {
    StepAction.TURN: PlanJudge.turn,
    StepAction.STRAIGHT: PlanJudge.straight,
    StepAction.LANE: PlanJudge.lane,
    StepAction.U_TURN: PlanJudge.u_turn,
    StepAction.STOP: PlanJudge.stop,
    StepAction.GO: PlanJudge.go,
    StepAction.FOLLOW: PlanJudge.follow,
    StepAction.AVOID: PlanJudge.avoid,
    StepAction.SPEED: PlanJudge.speed,
    StepAction.LIGHTS: PlanJudge.lights,
    StepAction.VISIT: PlanJudge.visit,
    StepAction.WAIT: PlanJudge.wait,
}
