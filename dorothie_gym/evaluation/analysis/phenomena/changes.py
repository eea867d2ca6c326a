"""Queries of phenomena 8 to 14 and 23: places that are not on the map, and exceptions of the Ad-Wizard."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType

from dorothie_gym.evaluation.analysis.exception_attribution import OBSTACLES
from dorothie_gym.evaluation.analysis.phenomena.dialogue_view import CAR, HUMAN, DialogueView, Occurrence, Turn, labels
from dorothie_gym.evaluation.analysis.phenomena.routes import asks_where_next
from dorothie_gym.ontology.actions import MentalAction, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot
from dorothie_gym.ontology.world_exceptions import ExceptionKind, WeatherParameter
from dorothie_gym.session.recording.events import Event, EventType

M = DialogueMove

DIM: Mapping[WeatherParameter, float] = MappingProxyType(
    {WeatherParameter.FOG_DENSITY: 30.0, WeatherParameter.PRECIPITATION: 30.0, WeatherParameter.SUN_ALTITUDE_ANGLE: 5.0}
)
"""Weather that reduces sight: minimum values of fog and rain [%], maximum altitude of the sun [degrees]."""

SLOWER = re.compile(r"\bslow\w*|\beasy\b|\bcareful\w*|\bnot so fast\b|\btoo fast\b|\bdown to\b|\bbrake\b")
LIGHTS = re.compile(r"\blights?\b|\bheadlights?\b|\bbeams?\b")

_COMPARES = re.compile(
    r"\b(?:short|quick|fast|clos|near|saf|bett|long)(?:er|est)\b|\bblock\w*|\bclosed\b|\bon (?:the|our) way\b"
    r"|\binstead\b|\bdetour\b|\bshortcut\b|\bother way\b|\bjam\b|\bavoid\b"
)

MAX_SIGHT_LEAD = 10.0
"""Longest time between sight of an object on the road and the car's coming near [s]."""

SETTLEMENT_WINDOW = 60.0
"""Time within which a roadblock or an unknown place must be resolved [s]."""


def hidden_place(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 8: the car says that it does not know a place, the participant describes it, the car marks a guess."""
    for turn in talk.by(CAR, M.EXPLAIN, M.QUERY_W, M.QUERY_YN, M.CHECK, M.CONFUSE, M.REPLY_N):
        unknown = turn.mentions(GoalStatus.UNKNOWN) and labels(turn.names(Slot.LANDMARK)) & talk.hidden_goals
        described = (
            next((a for a in talk.answers(turn, within=SETTLEMENT_WINDOW) if _describes(a, unknown)), None)
            if unknown
            else None
        )
        if described is None:
            continue
        since = described.start
        if talk.believed(MentalAction.KNOWLEDGE_UPDATE, since=since, until=described.end + SETTLEMENT_WINDOW):
            steps = talk.answers(turn, M.INSTRUCT, within=3 * SETTLEMENT_WINDOW)
            refined = any(a.number > described.number and a.names(Slot.ACTION) for a in steps)
            yield Occurrence(turn, "described, refined" if refined else "described")


def _describes(turn: Turn, places: Collection[str]) -> bool:
    """Returns whether a turn describes a position: by a street, or by a place other than the given ones."""
    describes = turn.does(M.REPLY_W, M.EXPLAIN, M.CLARIFY, M.INSTRUCT)
    return describes and bool(turn.names(Slot.STREET) or labels(turn.names(Slot.LANDMARK)) - frozenset(places))


def has_hidden_goal(talk: DialogueView) -> bool:
    """Returns whether a subgoal's landmark is hidden from the car."""
    return bool(talk.hidden_goals)


def roadblock(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 9: the car reports an object across the road, another route is discussed and taken."""
    for turn in talk.by(CAR, M.EXPLAIN):
        if not any(set(act.slots) & set(OBSTACLES) for act in turn.doing(M.EXPLAIN)):
            continue
        if not any(-MAX_SIGHT_LEAD <= turn.start - met <= SETTLEMENT_WINDOW for met in talk.met_roadblocks):
            continue
        following = [turn, *talk.later(turn, within=SETTLEMENT_WINDOW)]
        proposal = next((t for t in following if t.speaker is CAR and t.does(M.QUERY_YN, M.QUERY_W, M.CHECK)), None)
        instruction = next((t for t in following if t.speaker is HUMAN and t.does(M.INSTRUCT, M.REPLY_W)), None)
        first = proposal or instruction
        if first is not None and _goes_another_way(talk, since=turn.start, until=first.end + SETTLEMENT_WINDOW):
            yield Occurrence(turn, "proposed" if proposal is not None else "instructed")


def _goes_another_way(talk: DialogueView, *, since: float, until: float) -> bool:
    around = (PhysicalAction.U_TURN, PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH)
    replanned = talk.believed(MentalAction.PLAN_UPDATE, since=since, until=until)
    return replanned or talk.did(*around, since=since, until=until)


def meets_roadblock(talk: DialogueView) -> bool:
    """Returns whether the car comes near an object that the Ad-Wizard put on the road."""
    return bool(talk.met_roadblocks)


def dim_weather(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 10: in fog, rain or at night the participant requests less speed or more light, and the car responds."""
    stretches = tuple(_dim(talk))
    wishes = (
        (ActionValue.SPEED_CHANGE, SLOWER, PhysicalAction.SPEED_CHANGE, False, "slower"),
        (ActionValue.LIGHT_CHANGE, LIGHTS, PhysicalAction.LIGHT_CHANGE, True, "lights"),
    )
    for turn in talk.by(HUMAN, M.INSTRUCT, M.QUERY_YN, M.CHECK):
        if not any(since <= turn.start <= until for since, until in stretches):
            continue
        for value, words, action, up, form in wishes:
            done = talk.switched(action, up, since=turn.start, until=turn.end + 15.0)
            if turn.mentions(value) and (done or (turn.says(words) and talk.answered(turn))):
                yield Occurrence(turn, form)


def has_dim_weather(talk: DialogueView) -> bool:
    """Returns whether the Ad-Wizard causes fog, rain or night, with time left for the dialogue."""
    return any(talk.session.duration - since > 10.0 for since, _ in _dim(talk))


def _dim(talk: DialogueView) -> Iterator[tuple[float, float]]:
    """Returns the stretches of time [s] with fog, rain or night, each from an exception until its end."""
    since: dict[WeatherParameter, float] = {}
    for event in talk.exceptions(ExceptionKind.WEATHER):
        parameter = next((each for each in DIM if str(each) == event.data.get("parameter")), None)
        value = event.data.get("value")
        if parameter is None or not isinstance(value, int | float):
            continue
        low = parameter is WeatherParameter.SUN_ALTITUDE_ANGLE
        if (value <= DIM[parameter]) if low else (value >= DIM[parameter]):
            since.setdefault(parameter, event.time)
        elif parameter in since:
            yield since.pop(parameter), event.time
    yield from ((begun, math.inf) for begun in since.values())


def task_added(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 11: the participant names a new task; the car takes it up, or asks when."""
    for _, turn in _turns_after_exception(talk, ExceptionKind.TASK_TRIGGER, M.INSTRUCT, M.EXPLAIN):
        question = next(talk.answers(turn, M.QUERY_W, M.QUERY_YN, M.CHECK), None)
        if question is not None and talk.answered(question):
            yield Occurrence(turn, "negotiated")
        elif talk.answered(turn):
            yield Occurrence(turn, "taken up")


def task_changed(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 12: the participant replaces one place by another, and the car takes it up."""
    for event in talk.exceptions(ExceptionKind.TASK_CHANGE):
        for turn in talk.by(HUMAN, M.INSTRUCT, M.EXPLAIN):
            if turn.start < event.time or not talk.answered(turn):
                continue
            places = turn.names(Slot.LANDMARK)
            if str(event.data.get("landmark")) not in labels(places):
                continue
            if len(places) > 1 and turn.mentions(GoalStatus.ABANDONED, GoalStatus.ONGOING, GoalStatus.PENDING):
                yield Occurrence(turn, "both named")
            elif turn.mentions(GoalStatus.ABANDONED) or _gave_up(talk, turn):
                yield Occurrence(turn, "in two steps")


def _gave_up(talk: DialogueView, turn: Turn) -> bool:
    """Returns whether a place is given up right before or after the new one is named."""
    around = [*talk.before(turn, within=20.0), *talk.later(turn, within=20.0)]
    return any(other.speaker is HUMAN and other.mentions(GoalStatus.ABANDONED) for other in around)


def task_deleted(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 13: the participant gives up a task, and may resume it later."""
    for _, turn in _turns_after_exception(talk, ExceptionKind.TASK_DELETE):
        if not turn.mentions(GoalStatus.ABANDONED):
            continue
        given_up = turn.names(Slot.LANDMARK)
        resumed = any(
            other.number > turn.number and other.names(Slot.LANDMARK) & given_up for other in talk.by(HUMAN, M.INSTRUCT)
        )
        yield Occurrence(turn, "resumed" if resumed else "given up")


def _turns_after_exception(
    talk: DialogueView, kind: ExceptionKind, *moves: DialogueMove
) -> Iterator[tuple[Event, Turn]]:
    """Yields the participant's turns with one of the moves that name the landmark of an earlier task exception."""
    for event in talk.exceptions(kind):
        for turn in talk.by(HUMAN, *moves):
            if turn.start >= event.time and str(event.data.get("landmark")) in labels(turn.names(Slot.LANDMARK)):
                yield event, turn


def task_exception(talk: DialogueView, kind: ExceptionKind) -> bool:
    """Returns whether the Ad-Wizard changes the task in this way, with time left for the dialogue."""
    return any(talk.session.duration - event.time > 10.0 for event in talk.exceptions(kind))


def completion(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 14: the participant says that a task is done, or the car asks for the next destination."""
    for event in _completed(talk):
        for turn in talk.turns:
            if not 0.0 <= turn.start - event.time <= SETTLEMENT_WINDOW:
                continue
            places = labels(turn.names(Slot.LANDMARK))
            is_it = not places or str(event.data.get("landmark")) in places
            if turn.speaker is HUMAN and turn.mentions(GoalStatus.COMPLETE) and turn.does(M.EXPLAIN) and is_it:
                yield Occurrence(turn, "reported")
            elif turn.speaker is CAR and asks_where_next(talk, turn.number):
                yield Occurrence(turn, "asked")


def completes(talk: DialogueView) -> bool:
    """Returns whether a subgoal is reached before the end of the drive."""
    return any(True for _ in _completed(talk))


def _completed(talk: DialogueView) -> Iterator[Event]:
    for event in talk.session.of_type(EventType.SUBGOAL):
        if event.data.get("status") == GoalStatus.COMPLETE.label and talk.session.duration - event.time > 5.0:
            yield event


def negotiation(talk: DialogueView) -> Iterator[Occurrence]:
    """Finds 23: the car makes a proposal with a reason; the participant agrees, or insists on another action."""
    for turn in talk.by(CAR, M.QUERY_YN, M.CHECK):
        proposes = any(
            act.values(Slot.ACTION) or act.values(Slot.STREET) or act.values(Slot.LANDMARK)
            for act in turn.doing(M.QUERY_YN, M.CHECK)
        )
        if not proposes or not _has_grounds(talk, turn):
            continue
        answer = next(talk.replies(turn, M.REPLY_Y, M.REPLY_N, M.CONFIRM, M.INSTRUCT, M.ACKNOWLEDGE), None)
        if answer is not None:
            yield Occurrence(turn, "accepted" if answer.does(M.REPLY_Y, M.CONFIRM, M.ACKNOWLEDGE) else "insisted")


def _has_grounds(talk: DialogueView, turn: Turn) -> bool:
    """Returns whether the car gives the reason of a proposal: soon after a change, or by a comparison."""
    grounds = [turn, *(other for other in talk.before(turn, within=10.0) if other.speaker is CAR)]
    grounds = [other for other in grounds if other.does(M.EXPLAIN)]
    changed = [event.time for event in talk.exceptions(ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_CHANGE)]
    fresh = any(0.0 <= turn.start - time <= SETTLEMENT_WINDOW for time in (*changed, *talk.met_roadblocks))
    return any(fresh or other.says(_COMPARES) or turn.says(_COMPARES) for other in grounds)


def gives_cause_to_negotiate(talk: DialogueView) -> bool:
    """Returns whether a roadblock is met or the task changes."""
    kinds = (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_CHANGE)
    return meets_roadblock(talk) or any(task_exception(talk, kind) for kind in kinds)
