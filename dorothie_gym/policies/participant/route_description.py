"""Description of the route over the next junctions: by turns, landmarks, streets or compass points.

Each step is checked on the map: the junction that a listener would find by the words is the one on the route.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import ConditionRelation, PlaceReference, PlanStep, StepAction, StepCondition
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology.slots import LandmarkName, ObjectClass, StreetName
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.participant.order_wording import FUNCTIONS
from dorothie_gym.policies.participant.target_hints import FAMOUS
from dorothie_gym.policies.persona import Directions
from dorothie_gym.policies.plan_propositions import content_of
from dorothie_gym.policies.road_ahead import Crossing, RoadAhead
from dorothie_gym.policies.route_progress import Choice, RouteJunction, find_exit, streets_named
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.turn_lanes import turn_lanes, way_before_change
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.routing import Leg, Place
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.dialogue_acts import DialogueMove
    from dorothie_gym.policies.participant.state import ParticipantState, StepKey
    from dorothie_gym.policies.participant.view import ParticipantView

MOST_STEPS: Final = 4
"""Number of steps after which nobody remembers the first."""

_FARTHEST: Final = 3  # opportunity up to which one counts: "the third left"
_CORNER: Final = 12.0  # from the end of a lane to the middle of its junction [m]
_AT_CORNER: Final = 26.0  # distance from the middle of a junction of a landmark on its corner [m]
_JUST_BEHIND: Final = 90.0  # distance up to which a turn is "after" a landmark [m]
_SEEN_LATER: Final = 15.0  # distance to a landmark that is still ahead when the words end [m]
_WORDS: Final = 3.0  # time to say a way [s]
_EXACT: Final = 30.0  # deviation from a compass point up to which a street leads there [degrees]
_STOP_SIGNS: Final = frozenset({SignalKind.STOP})
_SIGNS: Final = frozenset({SignalKind.STOP, SignalKind.YIELD})
_COMPASS: Final = ("east", "north", "west", "south")


@dataclass(frozen=True, kw_only=True)
class WayStep:
    """Step of the way ahead.

    Attributes:
        keys: identities of the steps of the guidance that it covers: junctions crossed straight on, and the turn.
        step: the step.
        wording: topic and particulars of its words.
    """

    keys: tuple[tuple[str, int, int], ...]
    step: PlanStep
    wording: Wording


class _Turn(NamedTuple):
    """Turn to be described: the road that leads to it, its junction, and how the route goes on."""

    road: RoadAhead
    crossing: Crossing
    junction: RouteJunction
    fitting: tuple[Crossing, ...]

    @property
    def number(self) -> int:
        return self.fitting.index(self.crossing) + 1


_Described: TypeAlias = tuple[PlanStep, Wording] | None
_Describe: TypeAlias = Callable[["ParticipantState", "ParticipantView", _Turn], _Described]


def way_ahead(
    state: ParticipantState, view: ParticipantView, count: int, manner: Directions, rng: np.random.Generator
) -> tuple[WayStep, ...]:
    """Returns the next steps of the route, as many as can be described; none where a lane change or U-turn is next.

    Args:
        state: state of the participant.
        view: observation.
        count: largest number of steps.
        manner: manner of giving directions.
        rng: random generator of the decision.
    """
    legs, here = state.route.to_goal.legs, view.place
    if state.town.lanes[view.lane].in_junction:  # the way begins behind the junction that the car is crossing
        behind = next((k for k, leg in enumerate(legs) if not state.town.lanes[leg.lane].in_junction), len(legs))
        legs = legs[behind:]
        if not legs:
            return ()
        here = legs[0].lane, legs[0].start
    return _along(state, view, here, legs, min(count, MOST_STEPS), manner, rng)


def way_behind_u_turn(
    state: ParticipantState, view: ParticipantView, count: int, manner: Directions, rng: np.random.Generator
) -> tuple[WayStep, ...]:
    """Returns the steps of the route behind its U-turn, if that comes before any junction; arguments as `way_ahead`."""
    legs = state.route.to_goal.legs
    for place, leg in enumerate(legs):
        if place and leg.entry is LaneEntry.U_TURN:
            return _along(state, view, (leg.lane, leg.start), legs[place:], min(count, MOST_STEPS), manner, rng)
        if state.town.lanes[leg.lane].in_junction:
            break
    return ()


def _along(
    state: ParticipantState,
    view: ParticipantView,
    here: Place,
    legs: Sequence[Leg],
    count: int,
    manner: Directions,
    rng: np.random.Generator,
) -> tuple[WayStep, ...]:
    """Returns the steps along some legs of the route."""
    town = state.town
    found: list[WayStep] = []
    road, crossed = RoadAhead.straight_on(town, here), list[tuple[Crossing, RouteJunction]]()
    for junction in _turns_of(legs, town, here[1]):
        crossing = next((one for one in road.crossings if one.junction == junction.exit.junction_id), None)
        if len(found) == count or crossing is None:
            break
        if junction.direction is Direction.STRAIGHT:
            crossed.append((crossing, junction))
            continue
        fitting = tuple(one for one in road.crossings if one.leads(junction.direction))
        if crossing not in fitting:
            break
        onto = _exit_meant(town, crossing, junction)
        if onto is None:
            break
        said = _described(state, view, _Turn(road, crossing, junction, fitting), manner, rng)
        if said is None:
            break
        keys = tuple(_key_of(one) for one in (*(passed for _, passed in crossed), junction))
        found.append(WayStep(keys=keys, step=said[0], wording=said[1]))
        road, crossed = RoadAhead.straight_on(town, (onto, 0.0)), []
    else:
        if crossed and len(found) < count:
            found.append(_straight_on(state, view, road, crossed, manner))
    return tuple(found)


def way_remarks(steps: Sequence[WayStep], move: DialogueMove) -> tuple[Remark, ...]:
    """Returns the remarks that state the steps in one breath.

    Args:
        steps: the steps.
        move: an instruction, an answer to an open question, or a clarification.
    """
    function = FUNCTIONS[move]
    return tuple(
        intend(function, content_of(one.step), wording=one.wording, joined=number > 0)
        for number, one in enumerate(steps)
    )


def _exit_meant(town: Town, crossing: Crossing, junction: RouteJunction) -> int | None:
    """Returns the lane onto which a listener turns; None where the direction leads to another road than the route."""
    choice = Choice(lane=crossing.lane, distance=0.0, exits=crossing.exits)
    way, lanes = find_exit(town, choice, junction.direction), town.lanes
    same = way is not None and lanes[way.lane].road_id == lanes[junction.exit.lane].road_id
    return way.lane if way is not None and same else None


def _turns_of(legs: Sequence[Leg], town: Town, station: float) -> Iterator[RouteJunction]:
    """Yields the junctions on some legs with a choice or with turn lanes, up to the next U-turn."""
    distance = 0.0
    for place, (leg, following) in enumerate(itertools.pairwise(legs)):
        if following.entry is LaneEntry.U_TURN:
            return
        begin = leg.start if place else station
        if following.entry is not LaneEntry.FOLLOW:
            distance += way_before_change(town, leg, following, begin)
            continue
        distance += max(leg.end - begin, 0.0)
        way = next((one for one in town.exits(leg.lane) if one.connector == following.lane), None)
        chosen = len(town.exits(leg.lane)) > 1 or leg.lane in turn_lanes(town)
        if way is not None and chosen and way.junction_id >= 0 and not town.lanes[leg.lane].in_junction:
            yield RouteJunction(lane=leg.lane, exit=way, distance=distance)


def _key_of(junction: RouteJunction) -> StepKey:
    return "turn", junction.lane, junction.exit.connector


def _straight_on(
    state: ParticipantState,
    view: ParticipantView,
    road: RoadAhead,
    crossed: Sequence[tuple[Crossing, RouteJunction]],
    manner: Directions,
) -> WayStep:
    """Returns the last step of a way that turns nowhere any more."""
    number = len(crossed)
    last = crossed[-1][0]
    marks = _landmarks_beside(state, view, road) if manner is Directions.LANDMARKS else []
    behind = [
        (distance, name)
        for distance, name in marks
        if last.distance - _AT_CORNER < distance < last.distance + _JUST_BEHIND
    ]
    if behind:
        place = PlaceReference(landmark=min(behind)[1])
        step = PlanStep(
            action=StepAction.STRAIGHT, condition=StepCondition(relation=ConditionRelation.PAST, place=place)
        )
        keys = tuple(_key_of(junction) for _, junction in crossed)
        return WayStep(keys=keys, step=step, wording=Wording(topic="way_past"))
    lights = [one for one in road.crossings if one.lights]
    keys = tuple(_key_of(junction) for _, junction in crossed)
    if last.lights and lights[0] is last:
        place = PlaceReference(object=ObjectClass.TRAFFIC_LIGHT)
        condition = StepCondition(relation=ConditionRelation.PAST, place=place)
        step = PlanStep(action=StepAction.STRAIGHT, condition=condition)
        return WayStep(keys=keys, step=step, wording=Wording(topic="way_straight_lights"))
    topic = "way_straight_two" if number == 2 else "way_straight"
    step = PlanStep(action=StepAction.STRAIGHT, ordinal=number if number == 2 else None)
    return WayStep(keys=keys, step=step, wording=Wording(topic=topic))


# --- manners ----------------------------------------------------------------------------------------------------------


def _described(
    state: ParticipantState, view: ParticipantView, turn: _Turn, manner: Directions, rng: np.random.Generator
) -> _Described:
    """Returns the turn in the speaker's manner, or else in a plain one; None for a turn back at a junction."""
    if turn.junction.direction is Direction.BACK:
        return None
    options = [said for describe in _MANNERS[manner] if (said := describe(state, view, turn)) is not None]
    if not options:
        return None
    return options[1] if len(options) > 1 and rng.random() < _OTHER_MANNER else options[0]


_OTHER_MANNER: Final = 0.2  # probability that a step is described otherwise than one prefers


def _by_number(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    if turn.number > _FARTHEST:
        return None
    direction = turn.junction.direction
    step = PlanStep(action=StepAction.TURN, direction=direction, ordinal=turn.number)
    return step, Wording(topic="way_nth", direction=direction, ordinal=turn.number)


def _plainly(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    if turn.number > 1:
        return None
    direction = turn.junction.direction
    return PlanStep(action=StepAction.TURN, direction=direction), Wording(topic="way_plain", direction=direction)


def _by_landmark(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    """Describes a turn by a landmark on its corner, or behind which it is the first opportunity."""
    options = []
    spoken = view.speed * _WORDS if turn.road.stretches[0].lane == view.lane else 0.0
    for distance, name in _landmarks_beside(state, view, turn.road):
        relation = _relation(turn, distance, spoken)
        if relation is not None:
            options.append((relation is not ConditionRelation.AT, abs(distance - turn.crossing.distance), name))
    if not options:
        return None
    after, _, name = min(options, key=lambda row: row[:2])
    relation = ConditionRelation.AFTER if after else ConditionRelation.AT
    return _conditional(turn, relation, PlaceReference(landmark=name), f"way_{relation}")


def _landmarks_beside(
    state: ParticipantState, view: ParticipantView, road: RoadAhead
) -> list[tuple[float, LandmarkName]]:
    """Returns the well-known landmarks of a name of their own beside a road, with the distances to them [m]."""
    goal = state.task.goal
    known = [mark for mark in view.landmarks if mark.name in FAMOUS and view.unique(mark)]
    others = [mark for mark in known if goal is None or mark.name is not goal.name]
    found = ((road.distance_to(mark.x, mark.y), mark.name) for mark in others)
    return [(distance, name) for distance, name in found if distance is not None]


def _relation(turn: _Turn, distance: float, spoken: float) -> ConditionRelation | None:
    """Returns how a turn lies to a place on the road; None where the place does not tell it.

    Args:
        turn: the turn.
        distance: distance to the place [m].
        spoken: distance that the car drives while the words are said [m].
    """
    if distance < _SEEN_LATER + spoken:
        return None
    nearest = min(turn.fitting, key=lambda one: abs(one.distance + _CORNER - distance))
    if nearest == turn.crossing and abs(turn.crossing.distance + _CORNER - distance) < _AT_CORNER:
        return ConditionRelation.AT
    behind = next((one for one in turn.fitting if one.distance >= distance - _CORNER), None)
    follows = behind == turn.crossing and turn.crossing.distance - distance < _JUST_BEHIND
    return ConditionRelation.AFTER if follows and distance < turn.crossing.distance else None


def _by_signal(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    """Describes a turn by the traffic lights or the stop sign at its junction."""
    if turn.crossing.lights:
        return _at_nth(turn, [one for one in turn.road.crossings if one.lights], ObjectClass.TRAFFIC_LIGHT)
    stops, signs = _lanes_of(state.town, _STOP_SIGNS), _lanes_of(state.town, _SIGNS)
    before = [one for one in turn.road.crossings if one.lane in signs and one.distance <= turn.crossing.distance]
    if turn.crossing.lane not in stops or any(one.lane not in stops for one in before):
        return None
    return _at_nth(turn, before, ObjectClass.TRAFFIC_SIGN)


def _at_nth(turn: _Turn, crossings: Sequence[Crossing], kind: ObjectClass) -> _Described:
    number = crossings.index(turn.crossing) + 1
    if number > _FARTHEST:
        return None
    ordinal = number if number > 1 else None
    return _conditional(turn, ConditionRelation.AT, PlaceReference(object=kind, ordinal=ordinal), "way_at", ordinal)


def _lanes_of(town: Town, kinds: frozenset[SignalKind]) -> frozenset[int]:
    return frozenset(lane for signal in town.signals if signal.kind in kinds for lane in signal.lanes)


def _by_street(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    """Describes a turn by the street onto which it leads, where that is the first way onto it."""
    names = view.raw
    onto = street_of(names, state.town, turn.junction.exit.lane)
    if onto is StreetName.UNKNOWN or street_of(names, state.town, turn.crossing.lane) is onto:
        return None
    named = streets_named(names["street_names"], onto)
    first = next((one for one in turn.road.crossings if turn.road.leads_onto(one, named)), None)
    if first != turn.crossing:
        return None
    return _conditional(turn, ConditionRelation.AT, PlaceReference(street=onto), "way_onto")


def _by_compass(state: ParticipantState, view: ParticipantView, turn: _Turn) -> _Described:
    """Describes a turn by the point of the compass to which the street behind it leads."""
    heading = math.degrees(float(state.town.lanes[turn.junction.exit.lane].headings[0]))
    point = min(range(4), key=lambda quarter: abs(wrap_degrees(heading - 90.0 * quarter)))
    plain = _by_street(state, view, turn) or _by_number(state, view, turn)
    if abs(wrap_degrees(heading - 90.0 * point)) > _EXACT or plain is None:
        return None
    step, wording = plain
    return step, Wording(
        topic=f"{wording.topic}_compass",
        direction=wording.direction,
        ordinal=wording.ordinal,
        compass=_COMPASS[point],
    )


def _conditional(
    turn: _Turn, relation: ConditionRelation, place: PlaceReference, topic: str, ordinal: int | None = None
) -> _Described:
    direction = turn.junction.direction
    condition = StepCondition(relation=relation, place=place)
    step = PlanStep(action=StepAction.TURN, direction=direction, condition=condition)
    return step, Wording(topic=topic, direction=direction, ordinal=ordinal)


_MANNERS: Final[Mapping[Directions, tuple[_Describe, ...]]] = MappingProxyType(
    {
        Directions.TURNS: (_by_number, _by_signal, _by_street),
        Directions.LANDMARKS: (_by_landmark, _by_signal, _by_number),
        Directions.STREETS: (_by_street, _by_number),
        Directions.COMPASS: (_by_compass, _by_street, _by_number),
        Directions.VAGUE: (_plainly, _by_number),
    }
)
"""Ways of describing a turn, the preferred one first."""
