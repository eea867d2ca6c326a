"""Points of the road at which the steps of a plan are due, and what the map holds against a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.routes import Anaphor, ConditionRelation, PlaceReference, PlanStep, StepAction
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.co_wizard.destinations import known_landmark
from dorothie_gym.policies.co_wizard.plan_memory import STEERING, DuePoint
from dorothie_gym.policies.road_ahead import Crossing, RoadAhead
from dorothie_gym.policies.route_progress import Choice, find_exit, streets_named

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.observation_parser import SeenLandmark

_BEHIND: Final = frozenset({ConditionRelation.AFTER, ConditionRelation.PAST, ConditionRelation.FROM})
"""Relations of a step that is due behind its place."""

_SHORT_OF: Final = frozenset({ConditionRelation.UNTIL, ConditionRelation.BEFORE, ConditionRelation.SEEN})
"""Relations of a stretch that ends before its junction."""

_AWAY: Final = frozenset({StepAction.U_TURN, StepAction.VISIT})
"""Steps behind which the road of the car is another one."""

_JUNCTION: Final = 12.0  # from the end of a lane to the middle of the junction [m]
_SAME_CORNER: Final = 8.0  # by which a junction "after" a landmark may begin before it [m]
_BEFORE_LINE: Final = 6.0  # room to the stop line when the car stops before a junction [m]
_BEHIND_JUNCTION: Final = 12.0  # room behind a junction when the car stops "past the lights" [m]

_OFFSETS: Final[Mapping[ConditionRelation, float]] = MappingProxyType(
    {
        ConditionRelation.PAST: 12.0,
        ConditionRelation.AFTER: 12.0,
        ConditionRelation.BEFORE: -12.0,
        ConditionRelation.SEEN: -35.0,
    }
)
"""Distance from a place beside the road at which a step is due [m]."""


@dataclass(frozen=True, kw_only=True)
class Objection:
    """Reason why the map contradicts a step.

    Attributes:
        reason: statement of it.
        landmark: landmark of the step that the car could drive to, by another road.
        street: street of the step that the car could look for, by another road.
    """

    reason: Proposition
    landmark: LandmarkName | None = None
    street: StreetName | None = None


class Landing(NamedTuple):
    """Point at which a step is due, and the place of the car behind it; None where that cannot be foreseen."""

    due: DuePoint
    behind: Place | None


class _Spot(NamedTuple):
    """Place of a condition on the road ahead: its distance [m], and the junction if it is at one."""

    distance: float
    crossing: Crossing | None = None


def road_of(state: CoWizardState, view: CoWizardView, step: PlanStep) -> RoadAhead:
    """Returns the road on which a step is looked for: straight on, or the route where the step does not steer."""
    progress = state.route.progress
    if step.action in STEERING or progress is None or not progress.legs:
        return RoadAhead.straight_on(state.town, view.here)
    lanes = tuple(leg.lane for leg in progress.legs)
    return RoadAhead.by_route(state.town, (lanes[0], view.station), lanes)


def first_objection(
    state: CoWizardState, view: CoWizardView, steps: Sequence[PlanStep]
) -> tuple[int, Objection] | None:
    """Returns the first step that the map contradicts, as its number and the reason; None if there is none.

    The steps are followed along the map, one behind the other, as far as that can be foreseen.
    """
    here: Place | None = view.here
    for number, step in enumerate(steps):
        if here is None:
            return None
        road = road_of(state, view, step) if number == 0 else RoadAhead.straight_on(state.town, here)
        found = find_point(state, view, road, step)
        if isinstance(found, Objection):
            return number, found
        here = found.behind
    return None


def find_point(state: CoWizardState, view: CoWizardView, road: RoadAhead, step: PlanStep) -> Landing | Objection:
    """Returns where on a road a step is due, or what the map holds against it.

    Args:
        state: state of the Co-Wizard.
        view: observation.
        road: the road, from the place at which the step before is over.
        step: the step.
    """
    spot: _Spot | None = None
    if step.condition is not None:
        place = step.condition.place
        if place.object is not None and place.object not in _SIGNALS | _EVERYWHERE:
            return Landing(DuePoint(object=place.object), None)
        found = _locate(state, view, road, place)
        if isinstance(found, Objection):
            return found
        spot = found
    if step.action is StepAction.TURN:
        return _turn(state, road, step, spot)
    if step.action is StepAction.FOLLOW:
        return _follow(state, view, road, step)
    if step.action is StepAction.STRAIGHT:
        return _straight(road, step, spot)
    return _at_place(road, step, spot)


# --- places of conditions ---------------------------------------------------------------------------------------------


_SIGNALS: Final = frozenset({ObjectClass.TRAFFIC_LIGHT, ObjectClass.TRAFFIC_SIGN})
"""Objects that the map has."""

_EVERYWHERE: Final = frozenset({ObjectClass.SIDE_WALK, ObjectClass.ROAD, ObjectClass.ROAD_LINE, ObjectClass.GROUND})
"""Objects that are where the car is: "as soon as there is a kerb"."""


def _locate(state: CoWizardState, view: CoWizardView, road: RoadAhead, place: PlaceReference) -> _Spot | Objection:
    """Returns where on a road a place is, or that it is not there."""
    if place.landmark is not None:
        return _locate_landmark(state, view, road, place.landmark, place.street)
    if place.object in _EVERYWHERE:
        return _Spot(0.0)
    if place.object is not None:
        return _locate_signal(road, place.object, place.ordinal or 1)
    if place.street is not None:
        return _locate_street(view, road, place.street, place.ordinal or 1)
    if place.ordinal is not None:
        crossing = _nth(road.crossings, place.ordinal)
        return _no_way(Direction.STRAIGHT) if crossing is None else _Spot(crossing.distance, crossing)
    return _locate_reference(state, road, place)


def _locate_landmark(
    state: CoWizardState, view: CoWizardView, road: RoadAhead, name: LandmarkName, street: StreetName | None
) -> _Spot | Objection:
    marks = [mark for mark in view.landmarks if mark.name is name and street in (None, mark.street)]
    passed = [(distance, mark) for mark in marks if (distance := road.distance_to(mark.x, mark.y)) is not None]
    ahead = [distance for distance, _ in passed if distance > 0.0]
    if ahead:
        return _Spot(min(ahead))
    mark = known_landmark(state, view, name, () if street is None else (street,))
    if mark is None:
        return Objection(reason=Proposition.of(Predicate.KNOWS, place=name, negated=True))
    if passed or _is_on_road_of_car(state, view, mark):
        return Objection(reason=Proposition.of(Predicate.BEHIND, place=name), landmark=name)
    named = None if mark.street is StreetName.UNKNOWN else mark.street
    return Objection(reason=Proposition.of(Predicate.LOCATED, place=name, street=named), landmark=name)


def _is_on_road_of_car(state: CoWizardState, view: CoWizardView, mark: SeenLandmark) -> bool:
    lanes = state.town.lanes
    return lanes[mark.lane].street >= 0 and lanes[mark.lane].street == lanes[view.lane].street


def _locate_signal(road: RoadAhead, kind: ObjectClass, ordinal: int) -> _Spot | Objection:
    if kind is ObjectClass.TRAFFIC_LIGHT:
        found = [crossing for crossing in road.crossings if crossing.lights]
    else:
        signs = {lane for signal in road.town.signals if signal.kind in _SIGNS for lane in signal.lanes}
        found = [crossing for crossing in road.crossings if crossing.lane in signs]
    crossing = _nth(found, ordinal)
    if crossing is None:
        return Objection(reason=Proposition.of(Predicate.SEES, object=kind, negated=True))
    return _Spot(crossing.distance, crossing)


_SIGNS: Final = frozenset({SignalKind.STOP, SignalKind.YIELD})


def _locate_street(view: CoWizardView, road: RoadAhead, street: StreetName, ordinal: int) -> _Spot | Objection:
    named = streets_named(view.raw["street_names"], street)
    found = [crossing for crossing in road.crossings if road.leads_onto(crossing, named)]
    crossing = _nth(found, ordinal)
    if crossing is not None:
        return _Spot(crossing.distance, crossing)
    if road.stretches and road.town.lanes[road.stretches[0].lane].street in named:
        return _Spot(0.0)
    crosses = Proposition.of(Predicate.ON_STREET, street=street, negated=True)
    return Objection(reason=crosses, street=street if named else None)


def _locate_reference(state: CoWizardState, road: RoadAhead, place: PlaceReference) -> _Spot | Objection:
    known = {Anaphor.START: state.plan.start, Anaphor.LAST_STOP: state.plan.stops}
    where = None if place.reference is None else known.get(place.reference)
    if where is None:
        return _Spot(0.0)
    distance = road.distance_of(where)
    if distance is None or distance < 0.0:
        return Objection(reason=Proposition.of(Predicate.BEHIND))
    return _Spot(distance)


# --- steps ------------------------------------------------------------------------------------------------------------


def _turn(state: CoWizardState, road: RoadAhead, step: PlanStep, spot: _Spot | None) -> Landing | Objection:
    """Returns the junction of a turn."""
    relation = None if step.condition is None else step.condition.relation
    fitting = [crossing for crossing in road.crossings if _has_turn(crossing, step.direction)]
    number = step.ordinal or 1
    if step.distance is not None:
        crossing = min(fitting, key=lambda one: abs(one.distance - float(step.distance or 0)), default=None)
    elif spot is None or relation is None:
        crossing = _nth(fitting, number)
    elif relation is ConditionRelation.BEFORE:
        limit = spot.distance - (0.0 if spot.crossing is not None else _JUNCTION)
        crossing = _last([one for one in fitting if one.distance < limit], number)
    elif relation in _BEHIND or (step.ordinal is not None and spot.crossing is None):
        limit = spot.distance + (1.0 if spot.crossing is not None else -_SAME_CORNER)
        crossing = _nth([one for one in fitting if one.distance >= limit], number)
    elif spot.crossing is not None:
        crossing = spot.crossing if spot.crossing in fitting else None
    else:
        crossing = min(fitting, key=lambda one: abs(one.distance + _JUNCTION - spot.distance), default=None)
    if crossing is None:
        return _no_way(step.direction)
    return Landing(DuePoint(junction=crossing.junction), _behind_turn(road, crossing, step.direction))


def _has_turn(crossing: Crossing, direction: Direction | None) -> bool:
    if direction is not None:
        return crossing.leads(direction)
    return crossing.leads(Direction.LEFT) or crossing.leads(Direction.RIGHT)


def _behind_turn(road: RoadAhead, crossing: Crossing, direction: Direction | None) -> Place | None:
    if direction is None:
        return None
    way = find_exit(road.town, Choice(lane=crossing.lane, distance=0.0, exits=crossing.exits), direction)
    return None if way is None else (way.lane, 0.0)


def _follow(state: CoWizardState, view: CoWizardView, road: RoadAhead, step: PlanStep) -> Landing | Objection:
    """Returns the junction at which the car comes onto a street, or where it is on it already."""
    if step.place is None or step.place.street is None:
        return Landing(DuePoint(), None)
    spot = _locate_street(view, road, step.place.street, 1)
    if isinstance(spot, Objection):
        return spot
    if spot.crossing is None:
        return Landing(DuePoint(), road.place_at(0.0))
    named = streets_named(view.raw["street_names"], step.place.street)
    way = next(way for way in spot.crossing.exits if road.town.lanes[way.lane].street in named)
    return Landing(DuePoint(junction=spot.crossing.junction), (way.lane, 0.0))


def _straight(road: RoadAhead, step: PlanStep, spot: _Spot | None) -> Landing | Objection:
    """Returns up to where the car goes straight on."""
    relation = None if step.condition is None else step.condition.relation
    if step.distance is not None:
        place = road.place_at(float(step.distance))
        return Landing(DuePoint(place=place), place)
    if spot is not None and spot.crossing is None:
        place = road.place_at(spot.distance)
        return Landing(DuePoint(place=place), place)
    if spot is not None and spot.crossing is not None and relation in _SHORT_OF:
        before = road.place_at(max(spot.distance - 1.0, 0.0))
        return Landing(DuePoint(junction=spot.crossing.junction), before)
    passable = [crossing for crossing in road.crossings if crossing.leads(Direction.STRAIGHT)]
    last = spot.crossing if spot is not None else _nth(passable, step.ordinal or 1)
    if last is None and step.ordinal is None:
        return Landing(DuePoint(), road.place_at(0.0))  # there is nothing to cross
    if last is None or not last.leads(Direction.STRAIGHT):
        return _no_way(Direction.STRAIGHT)
    return Landing(DuePoint(junction=last.junction, passed=True), road.place_at(road.junction_lanes(last) + 1.0))


def _at_place(road: RoadAhead, step: PlanStep, spot: _Spot | None) -> Landing | Objection:
    """Returns the place at which the car stops, or does what does not depend on a junction."""
    relation = ConditionRelation.AT if step.condition is None else step.condition.relation
    if spot is None and step.distance is None:
        return Landing(DuePoint(), road.place_at(0.0) if step.action not in _AWAY else None)
    if spot is None:
        distance = float(step.distance or 0)
    elif spot.crossing is not None and relation in _BEHIND:
        distance = road.junction_lanes(spot.crossing) + _BEHIND_JUNCTION
    elif spot.crossing is not None:
        distance = spot.distance - _BEFORE_LINE
    else:
        distance = spot.distance + _OFFSETS.get(relation, 0.0)
    place = road.place_at(max(distance, 0.0))
    return Landing(DuePoint(place=place), place if step.action not in _AWAY else None)


def _no_way(direction: Direction | None) -> Objection:
    """Returns the objection that the road ahead has no such way."""
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    return Objection(reason=Proposition.of(Predicate.POSSIBLE, action=action, direction=direction, negated=True))


def _nth(crossings: Sequence[Crossing], number: int) -> Crossing | None:
    return crossings[number - 1] if len(crossings) >= number else None


def _last(crossings: Sequence[Crossing], number: int) -> Crossing | None:
    return crossings[-number] if len(crossings) >= number else None
