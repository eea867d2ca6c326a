"""Talking the car up to the very place: slower, stop, a bit further."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.dialogue import SpeakerStyle, Wording, speech_seconds, word_act
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.route_progress import stopping_distance
from dorothie_gym.policies.speech import Remark, remark

DECISION = 0.5
"""Time between decisions [s]."""

FASTEST = 11.0
"""The car is not expected to get faster than this [m/s]."""

NEAR = 95.0
"""A place is announced when it is this near [m]."""

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

LATE_STOP = 1.0
"""Who would stop the car further behind the place than this says less [m]."""

LAST_STRETCH = 60.0
"""With no junction and no manoeuvre before the place, nothing else is talked about from here on [m]."""

WITHIN = 1.9
"""A car that stands this close to the place has arrived [m]."""


def approach(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> bool:
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


def about_to_arrive(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether nothing but the last stretch to the place is left."""
    journey = mind.journey
    if journey is None or journey.left(view.station) > LAST_STRETCH:
        return False
    return journey.next_crossing(mind.town, view.station) is None and journey.next_manoeuvre(view.station) is None


def _time_to_stop(mind: ParticipantState, view: ParticipantView, left: float) -> bool:
    """Whether the words, begun now, stop the car closer to the place than if begun at the next decision."""
    if mind.announced and left > SLOW_WITHIN:
        return False  # it is about to slow down
    room, after = _room_to_stop(mind, view, left, mind.stop_text)
    return room <= (TOO_SHORT if mind.misses else 0.0) or room < -after


def _room_to_stop(mind: ParticipantState, view: ParticipantView, left: float, text: str) -> tuple[float, float]:
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


def _from_standing(mind: ParticipantState, view: ParticipantView, left: float) -> bool:
    if mind.standing_since is None or left > 45.0:
        return False
    waited = view.time - max(mind.standing_since, mind.nudged_at, mind.voice.last_end, mind.heard_at)
    if waited > 6.0 if abs(left) <= WITHIN or not mind.guiding else waited > READY:
        mind.voice = mind.voice.plan(inch_on(mind, view))
    return True


def inch_on(mind: ParticipantState, view: ParticipantView) -> Remark:
    """What to say to a car that stands a little before the place."""
    assert mind.journey is not None
    mind.nudged_at = view.time
    left = mind.journey.left(view.station)
    if left > 30.0:
        mind.announced = False
    wording = Wording(distance=max(left - SHORTER, 10.0)) if left > 9.0 else Wording(topic="further")
    return remark(DialogueMove.INSTRUCT, ActionValue.LANE_FOLLOW, wording=wording)
