"""Phenomena 8 to 14, 23: places that are not on the map, and what the Ad-Wizard changes in the world and the task."""

from __future__ import annotations

from collections.abc import Iterator

from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    ExceptionKind,
    GoalStatus,
    MentalAction,
    PhysicalAction,
    Slot,
    WeatherParameter,
)
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.statistics.handling import OBSTACLES
from dorothie_gym.sessions.statistics.phenomena.query import CAR, HUMAN, Finding
from dorothie_gym.sessions.statistics.phenomena.talk import Talk, Turn, labels
from dorothie_gym.sessions.statistics.phenomena.ways import asks_where_next

M = DialogueMove

DIM = (
    WeatherParameter.FOG_DENSITY, WeatherParameter.FOG_DISTANCE, WeatherParameter.FOG_FALLOFF,
    WeatherParameter.PRECIPITATION, WeatherParameter.SUN_ALTITUDE_ANGLE,
)  # fmt: skip
"""Weather that takes sight: fog, rain, night."""

SOON = 60.0
"""What comes of a roadblock, or of a place that is not known, is settled within this time [s]."""


def hidden_place(talk: Talk) -> Iterator[Finding]:
    """8: the car says that it does not know a place, the participant describes it, the car marks a guess."""
    for turn in talk.by(CAR, M.EXPLAIN, M.QUERY_W, M.QUERY_YN, M.CHECK, M.CONFUSE, M.REPLY_N):
        unknown = turn.mentions(GoalStatus.UNKNOWN) and labels(turn.names(Slot.LANDMARK)) & talk.hidden_goals
        if not unknown or not talk.believed(MentalAction.KNOWLEDGE_UPDATE, since=turn.start, until=turn.end + SOON):
            continue
        described = next((a for a in talk.answers(turn, within=SOON) if _describes(a)), None)
        if described is not None:
            steps = talk.answers(turn, M.INSTRUCT, within=3 * SOON)
            refined = any(a.number > described.number and a.names(Slot.ACTION) for a in steps)
            yield Finding(turn, "described, refined" if refined else "described")


def _describes(turn: Turn) -> bool:
    tells = turn.does(M.REPLY_W, M.EXPLAIN, M.CLARIFY, M.INSTRUCT)
    return tells and bool(turn.names(Slot.STREET) or turn.names(Slot.LANDMARK))


def has_hidden_goal(talk: Talk) -> bool:
    """Whether a subgoal's landmark is hidden from the car."""
    return bool(talk.hidden_goals)


def roadblock(talk: Talk) -> Iterator[Finding]:
    """9: the car tells of something across the road, another way is talked over, and taken."""
    for turn in talk.by(CAR, M.EXPLAIN):
        if not any(set(act.slots) & set(OBSTACLES) for act in turn.doing(M.EXPLAIN)):
            continue
        following = [turn, *talk.later(turn, within=SOON)]
        proposed = any(other.speaker is CAR and other.does(M.QUERY_YN, M.QUERY_W, M.CHECK) for other in following)
        told = any(other.speaker is HUMAN and other.does(M.INSTRUCT, M.REPLY_W) for other in following)
        until = turn.end + SOON
        anew = talk.believed(MentalAction.PLAN_UPDATE, since=turn.start, until=until) or talk.did(
            PhysicalAction.U_TURN, PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH, since=turn.start, until=until
        )
        if (proposed or told) and anew:
            yield Finding(turn, "proposed" if proposed else "told")


def meets_roadblock(talk: Talk) -> bool:
    """Whether the car comes near something that the Ad-Wizard put on the road."""
    return talk.met_roadblock is not None


def dim_weather(talk: Talk) -> Iterator[Finding]:
    """10: once fog, rain or dusk set in, the participant wants less speed or more light, and gets it or an answer."""
    first = min((event.time for event in _dimming(talk)), default=None)
    if first is None:
        return
    wishes = {
        ActionValue.SPEED_CHANGE: (PhysicalAction.SPEED_CHANGE, "slower"),
        ActionValue.LIGHT_CHANGE: (PhysicalAction.LIGHT_CHANGE, "lights"),
    }
    for turn in talk.by(HUMAN, M.INSTRUCT, M.QUERY_YN, M.CHECK):
        if turn.start < first:
            continue
        for value, (action, form) in wishes.items():
            done = talk.did(action, since=turn.start, until=turn.end + 15.0)
            if turn.mentions(value) and (done or talk.answered(turn)):
                yield Finding(turn, form)


def has_dim_weather(talk: Talk) -> bool:
    """Whether the Ad-Wizard brings fog, rain or night."""
    return any(True for _ in _dimming(talk))


def _dimming(talk: Talk) -> Iterator[Event]:
    names = {str(parameter) for parameter in DIM}
    return (e for e in talk.exceptions(ExceptionKind.WEATHER) if str(e.data.get("parameter")) in names)


def task_added(talk: Talk) -> Iterator[Finding]:
    """11: the participant tells of a new errand; the car takes it up, or asks when."""
    for _, turn in _told(talk, ExceptionKind.TASK_TRIGGER):
        if not turn.does(M.INSTRUCT, M.EXPLAIN):
            continue
        question = next(talk.answers(turn, M.QUERY_W, M.QUERY_YN, M.CHECK), None)
        if question is not None and talk.answered(question):
            yield Finding(turn, "negotiated")
        elif talk.answered(turn):
            yield Finding(turn, "taken up")


def task_changed(talk: Talk) -> Iterator[Finding]:
    """12: the participant takes one place back for another, and the car takes it up."""
    for event in talk.exceptions(ExceptionKind.TASK_CHANGE):
        for turn in talk.by(HUMAN, M.INSTRUCT, M.EXPLAIN):
            if turn.start < event.time or not talk.answered(turn):
                continue
            places = turn.names(Slot.LANDMARK)
            if len(places) > 1 and turn.mentions(GoalStatus.ABANDONED, GoalStatus.ONGOING, GoalStatus.PENDING):
                yield Finding(turn, "both named")
            elif str(event.data.get("landmark")) in labels(places) and (
                turn.mentions(GoalStatus.ABANDONED) or _gave_up(talk, turn)
            ):
                yield Finding(turn, "in two steps")


def _gave_up(talk: Talk, turn: Turn) -> bool:
    """Whether a place is given up right before or after the new one is named."""
    around = [*talk.before(turn, within=20.0), *talk.later(turn, within=20.0)]
    return any(other.speaker is HUMAN and other.mentions(GoalStatus.ABANDONED) for other in around)


def task_deleted(talk: Talk) -> Iterator[Finding]:
    """13: the participant gives up an errand; perhaps comes back to it later."""
    for _, turn in _told(talk, ExceptionKind.TASK_DELETE):
        if not turn.mentions(GoalStatus.ABANDONED):
            continue
        given_up = turn.names(Slot.LANDMARK)
        resumed = any(
            other.number > turn.number and other.names(Slot.LANDMARK) & given_up for other in talk.by(HUMAN, M.INSTRUCT)
        )
        yield Finding(turn, "resumed" if resumed else "given up")


def _told(talk: Talk, kind: ExceptionKind) -> Iterator[tuple[Event, Turn]]:
    """The participant's turns that name the landmark of a task's exception after it happened."""
    for event in talk.exceptions(kind):
        for turn in talk.by(HUMAN):
            if turn.start >= event.time and str(event.data.get("landmark")) in labels(turn.names(Slot.LANDMARK)):
                yield event, turn


def task_exception(talk: Talk, kind: ExceptionKind) -> bool:
    """Whether the Ad-Wizard changes the task so, and time is left to talk about it."""
    return any(talk.session.duration - event.time > 10.0 for event in talk.exceptions(kind))


def completion(talk: Talk) -> Iterator[Finding]:
    """14: the participant says that an errand is done, or the car asks where to go next."""
    for event in _completed(talk):
        for turn in talk.turns:
            if not 0.0 <= turn.start - event.time <= SOON:
                continue
            if turn.speaker is HUMAN and turn.mentions(GoalStatus.COMPLETE) and turn.does(M.EXPLAIN):
                yield Finding(turn, "told")
            elif turn.speaker is CAR and asks_where_next(talk, turn.number):
                yield Finding(turn, "asked")


def completes(talk: Talk) -> bool:
    """Whether a subgoal is reached and the drive goes on."""
    return any(True for _ in _completed(talk))


def _completed(talk: Talk) -> Iterator[Event]:
    for event in talk.session.of_type(EventType.SUBGOAL):
        if event.data.get("status") == GoalStatus.COMPLETE.label and talk.session.duration - event.time > 5.0:
            yield event


def negotiation(talk: Talk) -> Iterator[Finding]:
    """23: the car proposes something and says what for; the participant agrees, or insists on something else."""
    for turn in talk.by(CAR, M.QUERY_YN, M.CHECK):
        proposes = any(
            act.values(Slot.ACTION) or act.values(Slot.STREET) or act.values(Slot.LANDMARK)
            for act in turn.doing(M.QUERY_YN, M.CHECK)
        )
        grounds = turn.does(M.EXPLAIN) or any(
            other.speaker is CAR and other.does(M.EXPLAIN) for other in talk.before(turn, within=10.0)
        )
        answer = next(talk.answers(turn, M.REPLY_Y, M.REPLY_N, M.CONFIRM, M.INSTRUCT, M.ACKNOWLEDGE), None)
        if proposes and grounds and answer is not None:
            yield Finding(turn, "accepted" if answer.does(M.REPLY_Y, M.CONFIRM, M.ACKNOWLEDGE) else "insisted")


def gives_cause_to_negotiate(talk: Talk) -> bool:
    """Whether a roadblock is met or the task changes."""
    kinds = (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_CHANGE)
    return meets_roadblock(talk) or any(task_exception(talk, kind) for kind in kinds)
