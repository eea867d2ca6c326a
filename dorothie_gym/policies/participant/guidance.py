"""Telling the way: turns, turning round, lanes, and stopping at the very place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import Direction, Wording, speech_seconds, word_act
from dorothie_gym.maps.routing import Entry
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role, Slot, SlotValue, StreetName
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.participant.arriving import NEAR, READY, SLOW_SPEED, WITHIN, about_to_arrive, approach
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.route_progress import (
    BRAKING,
    END_ROOM,
    U_TURN_SPEED_SQUARED,
    Choice,
    RouteJunction,
    find_exit,
    next_choice,
)
from dorothie_gym.policies.speech import Remark, remark

TELL_DISTANCE = 110.0
"""A turn is told when it is this near [m]."""

CLOSE_BY = 150.0
"""A car that leaves the way with the place nearer than this, [m]"""

AROUND = 60.0
"""and then is farther from it by more than this, has gone past it [m]."""

TOO_LATE = 60.0
"""A turn is told when it is this near, even if the car has not asked [m]."""

AGAIN = 9.0
"""What has not been done is told again after this time [s]."""

SWITCHING = 13.0
"""The car is given this long for a lane change before the next one is told [s]."""

TAKES_OVER = 130.0
"""A car that looks for a place by itself is guided from here on [m]."""

CORNER, RIGHT_BEHIND = 50.0, 55.0
"""At a junction nearer than the first, a place no further behind it than the second is easily missed [m]."""

CAREFUL = 15.0
"""Speed that the car is told to go at when it has missed a place before [km/h]."""

RUN_UP, RUN_UP_FOR_LANE = 45.0, 50.0
"""A place is to be so far behind a U-turn that leads to it, and so much farther for each lane change between [m]."""

COMES_BACK = 30.0
"""A car that is told again after this time to leave a lane has come back to it [s]."""

CIRCLES = 3
"""After having the car turned round so often for a place, the participant leads it there some other way."""


def follow_journey(mind: ParticipantState, view: ParticipantView) -> None:
    """Brings the way up to date, and plans anew where the car has left it."""
    if mind.journey is None or view.turning:
        return
    before = mind.journey.left(view.station)
    mind.journey = mind.journey.followed(mind.town, view.lane, view.station)
    passed = view.standing and mind.journey.left(view.station) < -WITHIN
    if passed:
        mind.guiding = True
    if mind.journey.astray >= 3 or passed:
        former = mind.journey
        mind.journey = former.replanned(mind.town, view.place, mind.blocked + mind.avoided)
        gone_past = before < CLOSE_BY and mind.journey.left(view.station) > before + AROUND
        if mind.guiding and (before < 15.0 or gone_past):
            mind.misses, mind.eased = mind.misses + 1, False
            way_in = former.way_in()
            if mind.misses > 1 and way_in is not None:
                mind.avoided = (*mind.avoided, way_in)
                mind.journey = former.replanned(mind.town, view.place, mind.blocked + mind.avoided)
        mind.announced, mind.stop_text = False, ""
        missed = mind.guiding and mind.guided is not None and mind.guided[0] == "turn"
        if missed and mind.journey.left(view.station) > before + 60.0 and math.isfinite(before):
            mind.voice = mind.voice.cleared().plan(
                remark(DialogueMove.EXPLAIN, wording=Wording(topic="wrong_way"), expires=view.time + 4.0)
            )
    mind.best = min(mind.best, mind.journey.left(view.station))


def watch(mind: ParticipantState, view: ParticipantView) -> None:
    """Takes over a car that goes far out of its way or does not get on by itself."""
    if mind.guiding or mind.journey is None or not mind.told:
        return
    if mind.described and mind.journey.left(view.station) < TAKES_OVER:
        mind.guiding = True
        return
    standing = 0.0 if mind.standing_since is None else view.time - mind.standing_since
    lost = mind.journey.left(view.station) > mind.best + 350.0
    if lost:
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, wording=Wording(topic="wrong_way")))
    if lost or (standing > 40.0 and view.time > mind.excused_until):
        mind.guiding = True


def guide(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Says what is to be done next, if it is time to."""
    if mind.journey is None or not mind.told or view.turning or mind.journey.astray:
        return
    _stop_circling(mind, view)
    if not _may_speak(mind, view):
        return
    if approach(mind, view, rng) or not mind.guiding:
        return
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    if step is None:
        return
    key, distance, words = step
    if _ease(mind, view) or (key[0] == "round" and _takes_a_run_up(mind, view)):
        return
    near = distance < (_turning_distance(mind, view) if key[0] == "round" else TELL_DISTANCE)
    if _left_to_ask(mind, view, key, distance, words.wording.direction is Direction.STRAIGHT, rng):
        return
    waited = view.time - max(mind.guided_at, mind.heard_at)
    on_its_lane = key[0] == "round" and mind.journey.turns_round_on(view.lane)
    if on_its_lane and mind.standing_since is not None and view.time - mind.standing_since > 4.0:
        near = True
    stuck = view.standing and waited > AGAIN and view.time > mind.excused_until
    if not near and stuck:
        key, words = ("on", view.lane, 0), remark(DialogueMove.INSTRUCT, ActionValue.START)
        near = True
    overdue = stuck or (key[0] != "turn" and waited > AGAIN)
    if key[0] == "lane" and (view.time - mind.guided_at < SWITCHING or view.time < mind.excused_until):
        return
    if near and (mind.guided != key or overdue):
        again = mind.guided == key
        if key[0] in ("turn", "lane") and not again and rng.random() < mind.style.hints:
            words = replace(words, act=DialogueAct(DialogueMove.EXPLAIN, words.act.slots))
        note_told(mind, view, key)
        mind.voice = mind.voice.plan(*_rounded_off(mind, words, again, rng))


def _stop_circling(mind: ParticipantState, view: ParticipantView) -> None:
    """Leads the car another way that it was turned round for, or told to change lanes on, again and again."""
    assert mind.journey is not None
    in_vain = sum(lane == view.lane for lane, _ in mind.changes) > 1
    if mind.rounds < CIRCLES and not in_vain:
        return
    way_in = (view.lane, mind.town.lanes[view.lane].length / 2) if in_vain else mind.journey.way_in()
    mind.rounds, mind.changes = 0, tuple(told for told in mind.changes if told[0] != view.lane)
    if way_in is not None:
        mind.avoided = (*mind.avoided, way_in)
        mind.journey = mind.journey.replanned(mind.town, view.place, mind.blocked + mind.avoided)


def _may_speak(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether it is free to say a step: close to the place there is no time for anything else."""
    if mind.guiding and about_to_arrive(mind, view):
        mind.voice = mind.voice.cleared()
    return mind.voice.idle and view.speaking <= 0.0


def _rounded_off(mind: ParticipantState, words: Remark, again: bool, rng: np.random.Generator) -> tuple[Remark, ...]:
    """A step with what else is said in the same breath: a reason before it, or a question whether it was heard."""
    draw = rng.random()
    if words.act.values(Slot.ACTION) == (ActionValue.U_TURN,):
        # it is not to miss the moment: the shorter of what comes to mind
        drawn = [word_act(words.act, Role.PARTICIPANT, rng, words.wording, style=mind.voice.style) for _ in range(2)]
        return (replace(words, text=min(drawn, key=speech_seconds)),)
    if again and rng.random() < 0.25:
        return words, remark(DialogueMove.ALIGN, joined=True)
    if draw < mind.style.aligns:
        return words, remark(DialogueMove.ALIGN, joined=True)
    if draw < mind.style.aligns + 0.7 * mind.style.reasons:
        return words, remark(DialogueMove.EXPLAIN, joined=True, wording=Wording(topic="hint"))
    return (words,)


def _left_to_ask(
    mind: ParticipantState,
    view: ParticipantView,
    key: tuple[str, int, int],
    distance: float,
    goes_straight: bool,
    rng: np.random.Generator,
) -> bool:
    """Whether the way at a junction is kept back until the car asks; that it goes straight on need not be said."""
    if key[0] != "turn" or mind.guided == key:
        return False
    standing = 0.0 if mind.standing_since is None else view.time - mind.standing_since
    if mind.drawn_for != key:
        mind.drawn_for, mind.left_to_ask = key, bool(rng.random() < mind.style.waits)
    if not mind.left_to_ask or standing > AGAIN:
        return False
    return distance > TOO_LATE or goes_straight


def _ease(mind: ParticipantState, view: ParticipantView) -> bool:
    """Has the car slow down for a place that is easily missed: one missed before, or one right behind a manoeuvre."""
    assert mind.journey is not None
    if mind.eased or mind.journey.left(view.station) > NEAR or view.speed < SLOW_SPEED:
        return False
    if not mind.misses and not _hidden_behind(mind, view):
        return False
    mind.eased = True
    wording = Wording(faster=False, speed=CAREFUL)
    mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording))
    return True


def _hidden_behind(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether there is hardly time to stop the car between the next junction, or lane change, and the place."""
    assert mind.journey is not None
    left = mind.journey.left(view.station)
    crossing = mind.journey.next_crossing(mind.town, view.station)
    if crossing is None:
        manoeuvre = mind.journey.next_manoeuvre(view.station)
        return manoeuvre is not None and manoeuvre[0] is not Entry.U_TURN
    told = mind.guided is not None and mind.guided[0] == "turn"
    return told and crossing.distance < CORNER and left - crossing.distance < RIGHT_BEHIND


def _turning_distance(mind: ParticipantState, view: ParticipantView) -> float:
    """How far ahead turning round is told, so that the car turns about where it is planned."""
    assert mind.journey is not None
    if not mind.journey.turns_round_on(view.lane):
        return 1.5 * view.speed
    # what the car drives while it is being told, and while it slows down
    return 1.5 * view.speed + max(view.speed**2 - U_TURN_SPEED_SQUARED, 0.0) / (2 * BRAKING)


def _takes_a_run_up(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether to go on for now: a car that turned round here would be past the place before it could be stopped."""
    assert mind.journey is not None
    after = mind.journey.run_up()
    crosses = mind.journey.next_crossing(mind.town, view.station) is not None
    if after is None or crosses or not mind.journey.turns_round_on(view.lane):
        return False
    rest, changes = after
    room = mind.town.lanes[view.lane].length - view.station - _turning_distance(mind, view)
    missing = RUN_UP + changes * RUN_UP_FOR_LANE - rest
    if missing < 0.0 or room < END_ROOM + view.speed or not _turns_better(mind, view, min(missing, room - END_ROOM)):
        return False
    if mind.journey.next_manoeuvre(view.station) == (Entry.U_TURN, 0.0):
        mind.journey = mind.journey.replanned(mind.town, view.place, mind.blocked + mind.avoided)
    _send_on(mind, view)
    return True


def _turns_better(mind: ParticipantState, view: ParticipantView, farther: float) -> bool:
    """Whether a car that drives on a bit [m] can turn round there, too, and has more road for it before the place."""
    assert mind.journey is not None
    later = mind.journey.replanned(mind.town, (view.lane, view.station + farther), mind.blocked + mind.avoided)
    now, then = mind.journey.run_up(), later.run_up()
    return now is not None and then is not None and later.turns_round_on(view.lane) and then[0] > now[0] + farther / 2


def _send_on(mind: ParticipantState, view: ParticipantView) -> None:
    """Has a car that stands drive on, to turn round later."""
    waited = view.time - max(mind.guided_at, mind.heard_at, mind.voice.last_end)
    if view.standing and waited > READY and view.time > mind.excused_until:
        note_told(mind, view, ("on", view.lane, 0))
        mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW))


def note_told(mind: ParticipantState, view: ParticipantView, key: tuple[str, int, int]) -> None:
    """Remembers what the car has been told to do."""
    mind.repeats = mind.repeats + 1 if mind.guided == key else 0
    mind.rounds += key[0] == "round"
    if key[0] == "lane" and all(lane != key[1] or view.time - told > COMES_BACK for lane, told in mind.changes):
        mind.changes = (*mind.changes, (key[1], view.time))
    mind.guided, mind.guided_at = key, view.time


def next_step(
    mind: ParticipantState, view: ParticipantView, move: DialogueMove, rng: np.random.Generator
) -> tuple[tuple[str, int, int], float, Remark] | None:
    """What is to be done next: a key for it, how far ahead [m], and the words.

    Args:
        mind: of the participant.
        view: what it sees.
        move: an instruction, an answer to an open question, or a clarification.
        rng: for the words.
    """
    journey = mind.journey
    if journey is None:
        return None
    crossing = journey.next_crossing(mind.town, view.station)
    manoeuvre = journey.next_manoeuvre(view.station)
    if manoeuvre is not None and manoeuvre[0] is Entry.U_TURN:
        if crossing is None or manoeuvre[1] < crossing.distance:
            return ("round", 0, 0), manoeuvre[1], remark(move, ActionValue.U_TURN)
    switch = manoeuvre is not None and (
        crossing is None
        or (manoeuvre[1] < crossing.distance and journey.needs_switch(mind.town, view.lane, view.station, crossing))
    )
    if crossing is not None and not switch:
        key = ("turn", crossing.lane, crossing.exit.connector)
        return key, crossing.distance, _turn(mind, view, move, crossing, rng)
    if manoeuvre is not None:
        left = manoeuvre[0] is Entry.CHANGE_LEFT
        wording = Wording(direction=Direction.LEFT if left else Direction.RIGHT)
        return ("lane", view.lane, int(left)), manoeuvre[1], remark(move, ActionValue.LANE_SWITCH, wording=wording)
    return ("on", view.lane, 0), journey.left(view.station), remark(move, ActionValue.LANE_FOLLOW)


def _turn(
    mind: ParticipantState, view: ParticipantView, move: DialogueMove, crossing: RouteJunction, rng: np.random.Generator
) -> Remark:
    direction = crossing.direction
    action = ActionValue.J_TURN
    if direction is Direction.STRAIGHT and (move is not DialogueMove.INSTRUCT or rng.random() < 0.6):
        action = ActionValue.LANE_FOLLOW
    values: list[SlotValue] = [action]
    street = street_of(view.raw, mind.town, crossing.exit.lane)
    helps = street is not StreetName.UNKNOWN and direction is not Direction.STRAIGHT
    if helps and (_ambiguous(mind, view, crossing) or rng.random() < mind.style.names_street * 0.6):
        values.append(street)
    first = crossing.distance < 60.0 or rng.random() < 0.5
    ordinal = 1 if first and len(values) == 1 and action is ActionValue.J_TURN and rng.random() < 0.5 else None
    return remark(move, *values, wording=Wording(direction=direction, ordinal=ordinal))


def _ambiguous(mind: ParticipantState, view: ParticipantView, crossing: RouteJunction) -> bool:
    """Whether the direction alone means another exit."""
    choice = next_choice(mind.town, view.lane, view.station)
    own = choice is not None and choice.lane == crossing.lane
    asked = choice if own else Choice(lane=crossing.lane, distance=0.0, exits=mind.town.exits(crossing.lane))
    assert asked is not None
    meant = find_exit(mind.town, asked, crossing.direction)
    return meant is not None and mind.town.lanes[meant.lane].road_id != mind.town.lanes[crossing.exit.lane].road_id
