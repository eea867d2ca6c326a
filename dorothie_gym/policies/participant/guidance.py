"""Telling the way: turns, turning round, lanes, and stopping at the very place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import Direction, SpeakerStyle, Wording, speech_seconds, word_act
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role, Slot, SlotValue, StreetName
from dorothie_gym.policies.journey import (
    BRAKING,
    END_ROOM,
    U_TURN_SPEED_SQUARED,
    Choice,
    Crossing,
    find_exit,
    next_choice,
    stopping_distance,
)
from dorothie_gym.policies.participant.mind import ParticipantMind, View
from dorothie_gym.policies.scenery import street_of
from dorothie_gym.policies.speech import Remark, remark
from dorothie_gym.world.town.routing import Entry

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

DECISION = 0.5
"""Time between decisions [s]."""

FASTEST = 11.0
"""The car is not expected to get faster than this [m/s]."""

TAKES_OVER = 130.0
"""A car that looks for a place by itself is guided from here on [m]."""

NEAR = 95.0
"""A place is announced when it is this near [m]."""

CORNER, RIGHT_BEHIND = 50.0, 55.0
"""At a junction nearer than the first, a place no further behind it than the second is easily missed [m]."""

CAREFUL = 15.0
"""Speed that the car is told to go at when it has missed a place before [km/h]."""

SLOW_WITHIN = 20.0
"""A car that has been told of the place is slow from here on [m]."""

SLOW_SPEED = 5.0
"""A car that is this slow need not be told to come up slowly [m/s]."""

SOON_AT = 8.0
"""A car that has just set off or turned will soon be this fast [m/s]."""

TOO_SHORT = 4.0
"""Who has missed a place before rather stops the car up to this much before it [m]."""

SETS_OFF, PULL = 0.6, 3.0
"""A car that gains more speed than the first has just set off, and goes on gaining as much as the second [m/s^2]."""

READY = 1.6
"""A car that has been standing for longer than this is told how to go on [s]."""

SHORTER = 8.0
"""A distance is said to be this much less than it is, for it is said in tens, and the car rolls on [m]."""

INCHES_ON = 7.0
"""A car that has been told to go a bit further is left alone for this long [s]."""

RUN_UP, RUN_UP_FOR_LANE = 45.0, 50.0
"""A place is to be so far behind a U-turn that leads to it, and so much farther for each lane change between [m]."""

CIRCLES = 3
"""After having the car turned round so often for a place, the participant leads it there some other way."""

LATE_STOP = 1.0
"""Who would stop the car further behind the place than this says less [m]."""

LAST_STRETCH = 60.0
"""With no junction and no manoeuvre before the place, nothing else is talked about from here on [m]."""

WITHIN = 1.9
"""A car that stands this close to the place has arrived [m]."""


def follow_journey(mind: ParticipantMind, view: View) -> None:
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


def watch(mind: ParticipantMind, view: View) -> None:
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


def guide(mind: ParticipantMind, view: View, rng: np.random.Generator) -> None:
    """Says what is to be done next, if it is time to."""
    if mind.journey is None or not mind.told or view.turning or mind.journey.astray:
        return
    _stop_circling(mind, view)
    if not _may_speak(mind, view):
        return
    if _approach(mind, view, rng) or not mind.guiding:
        return
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    if step is None:
        return
    key, distance, words = step
    if _ease(mind, view):
        return
    if key[0] == "round" and _takes_a_run_up(mind, view):
        _send_on(mind, view)
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


def _stop_circling(mind: ParticipantMind, view: View) -> None:
    """Leads the car another way to a place that it was turned round for again and again."""
    if mind.rounds < CIRCLES or mind.journey is None:
        return
    mind.rounds = 0
    way_in = mind.journey.way_in()
    if way_in is not None:
        mind.avoided = (*mind.avoided, way_in)
        mind.journey = mind.journey.replanned(mind.town, view.place, mind.blocked + mind.avoided)


def _may_speak(mind: ParticipantMind, view: View) -> bool:
    """Whether it is free to say a step: close to the place there is no time for anything else."""
    if mind.guiding and about_to_arrive(mind, view):
        mind.voice = mind.voice.cleared()
    return mind.voice.idle and view.speaking <= 0.0


def _rounded_off(mind: ParticipantMind, words: Remark, again: bool, rng: np.random.Generator) -> tuple[Remark, ...]:
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
    mind: ParticipantMind,
    view: View,
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


def _ease(mind: ParticipantMind, view: View) -> bool:
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


def _hidden_behind(mind: ParticipantMind, view: View) -> bool:
    """Whether there is hardly time to stop the car between the next junction, or lane change, and the place."""
    assert mind.journey is not None
    left = mind.journey.left(view.station)
    crossing = mind.journey.next_crossing(mind.town, view.station)
    if crossing is None:
        manoeuvre = mind.journey.next_manoeuvre(view.station)
        return manoeuvre is not None and manoeuvre[0] is not Entry.U_TURN
    told = mind.guided is not None and mind.guided[0] == "turn"
    return told and crossing.distance < CORNER and left - crossing.distance < RIGHT_BEHIND


def _turning_distance(mind: ParticipantMind, view: View) -> float:
    """How far ahead turning round is told, so that the car turns about where it is planned."""
    assert mind.journey is not None
    if not mind.journey.turns_round_on(view.lane):
        return 1.5 * view.speed
    # what the car drives while it is being told, and while it slows down
    return 1.5 * view.speed + max(view.speed**2 - U_TURN_SPEED_SQUARED, 0.0) / (2 * BRAKING)


def _takes_a_run_up(mind: ParticipantMind, view: View) -> bool:
    """Whether to go on for now: a car that turned round here would be past the place before it could be stopped."""
    assert mind.journey is not None
    after = mind.journey.run_up()
    if after is None or not mind.journey.turns_round_on(view.lane):
        return False
    if mind.journey.next_crossing(mind.town, view.station) is not None:
        return False  # the place is not right behind the U-turn
    rest, changes = after
    room = mind.town.lanes[view.lane].length - view.station - _turning_distance(mind, view)
    if rest > RUN_UP + changes * RUN_UP_FOR_LANE or room < END_ROOM + view.speed:
        return False
    if mind.journey.next_manoeuvre(view.station) == (Entry.U_TURN, 0.0):
        mind.journey = mind.journey.replanned(mind.town, view.place, mind.blocked + mind.avoided)
    return True


def _send_on(mind: ParticipantMind, view: View) -> None:
    """Has a car that stands drive on, to turn round later."""
    waited = view.time - max(mind.guided_at, mind.heard_at, mind.voice.last_end)
    if view.standing and waited > READY and view.time > mind.excused_until:
        note_told(mind, view, ("on", view.lane, 0))
        mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW))


def note_told(mind: ParticipantMind, view: View, key: tuple[str, int, int]) -> None:
    """Remembers what the car has been told to do."""
    mind.repeats = mind.repeats + 1 if mind.guided == key else 0
    mind.rounds += key[0] == "round"
    mind.guided, mind.guided_at = key, view.time


def next_step(
    mind: ParticipantMind, view: View, move: DialogueMove, rng: np.random.Generator
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
    mind: ParticipantMind, view: View, move: DialogueMove, crossing: Crossing, rng: np.random.Generator
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


def _ambiguous(mind: ParticipantMind, view: View, crossing: Crossing) -> bool:
    """Whether the direction alone means another exit."""
    choice = next_choice(mind.town, view.lane, view.station)
    own = choice is not None and choice.lane == crossing.lane
    asked = choice if own else Choice(lane=crossing.lane, distance=0.0, exits=mind.town.exits(crossing.lane))
    assert asked is not None
    meant = find_exit(mind.town, asked, crossing.direction)
    return meant is not None and mind.town.lanes[meant.lane].road_id != mind.town.lanes[crossing.exit.lane].road_id


def _approach(mind: ParticipantMind, view: View, rng: np.random.Generator) -> bool:
    """Talks the car up to the place when nothing but the last stretch is left; tells whether that is so."""
    journey = mind.journey
    assert journey is not None
    if journey.next_crossing(mind.town, view.station) is not None or journey.next_manoeuvre(view.station) is not None:
        return False
    left = journey.left(view.station)
    if view.standing:
        return _from_standing(mind, view, left)
    if not mind.guiding or view.time - mind.nudged_at < INCHES_ON:
        return left < NEAR  # a car that is told to go on a bit stops by itself
    if not mind.stop_text:
        mind.stop_text = word_act(_STOP, Role.PARTICIPANT, rng, Wording(here=True), style=mind.voice.style)
    if _room_to_stop(mind, view, left, mind.stop_text)[0] < -LATE_STOP:
        # there is only time for a shout
        shouts = [word_act(_STOP, Role.PARTICIPANT, rng, Wording(), style=_SHOUTING) for _ in range(3)]
        mind.stop_text = min(*shouts, mind.stop_text, key=speech_seconds)
    if _time_to_stop(mind, view, left):
        if view.time - mind.stopped_at > 5.0 and left > 0.0:
            mind.stopped_at = view.time
            mind.voice = mind.voice.plan(Remark(act=_STOP, text=mind.stop_text, urgent=True))
        return True
    if not mind.announced and left < NEAR and view.speed > SLOW_SPEED and mind.goal is not None:
        if left > 3.5 * max(view.speed, SOON_AT) + 20.0:
            wording = Wording(distance=max(left - view.speed * 3.0, 10.0))
            words = remark(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, mind.goal.name, wording=wording, urgent=True)
            mind.announced, mind.voice = True, mind.voice.plan(words)
        elif left > 3.0 * max(view.speed, SOON_AT) + 12.0:
            slower = remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=Wording(faster=False), urgent=True)
            mind.announced, mind.voice = True, mind.voice.plan(slower)
    return left < NEAR


_STOP = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.STOP)
_SHOUTING = SpeakerStyle(register=Register.BLUNT, chattiness=0.0, indirectness=0.0)


def about_to_arrive(mind: ParticipantMind, view: View) -> bool:
    """Whether nothing but the last stretch to the place is left."""
    journey = mind.journey
    if journey is None or journey.left(view.station) > LAST_STRETCH:
        return False
    return journey.next_crossing(mind.town, view.station) is None and journey.next_manoeuvre(view.station) is None


def _time_to_stop(mind: ParticipantMind, view: View, left: float) -> bool:
    """Whether the words, begun now, stop the car closer to the place than if begun at the next decision."""
    if mind.announced and left > SLOW_WITHIN:
        return False  # it is about to slow down
    room, after = _room_to_stop(mind, view, left, mind.stop_text)
    return room <= (TOO_SHORT if mind.misses else 0.0) or room < -after


def _room_to_stop(mind: ParticipantMind, view: View, left: float, text: str) -> tuple[float, float]:
    """How far before the place the car stands if told so now, and at the next decision [m]; negative: behind it."""
    delay = math.ceil(speech_seconds(text) / DECISION - 1e-6) * DECISION
    gain = min(max((view.speed - mind.speed_before) / DECISION, -2.0), 2.0)
    if gain > SETS_OFF:
        gain = PULL
    now, top = view.speed, max(FASTEST, view.speed)
    soon = min(max(now + gain * DECISION, 0.0), top)
    rooms = []
    for speed, ahead in ((now, left), (soon, left - (now + soon) / 2 * DECISION)):
        then = min(max(speed + gain * delay, 0.0), top)
        rooms.append(ahead - (speed + then) / 2 * delay - stopping_distance(then))
    return rooms[0], rooms[1]


def _from_standing(mind: ParticipantMind, view: View, left: float) -> bool:
    if mind.standing_since is None or left > 45.0:
        return False
    waited = view.time - max(mind.standing_since, mind.nudged_at, mind.voice.last_end, mind.heard_at)
    if waited > 6.0 if abs(left) <= WITHIN or not mind.guiding else waited > READY:
        mind.nudged_at = view.time
        distance = max(left - SHORTER, 10.0) if left > 9.0 else None
        wording = Wording(distance=distance) if distance else Wording(topic="further")
        mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, wording=wording))
        if left > 30.0:
            mind.announced = False
    return True
