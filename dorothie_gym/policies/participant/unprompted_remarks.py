"""Unprompted remarks of the participant: weather, obstacles, standstills, and small talk."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import ASKED, Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.ontology.dialogue_acts import SIGNS_OF_HEARING
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.notable_conditions import PARAMETER, notice, view_remark
from dorothie_gym.policies.observation_parser import (
    is_dark,
    is_foggy,
    is_rainy,
    nearest_landmark,
    street_of,
    weather,
)
from dorothie_gym.policies.participant.obstacles import obstacle_on_route
from dorothie_gym.policies.participant.order_history import last_given, turned_round_lately
from dorothie_gym.policies.participant.standstill import waits_for_road
from dorothie_gym.policies.participant.stories import picks_up, purpose_of_target
from dorothie_gym.policies.participant.subgoals import announcement
from dorothie_gym.policies.participant.trip_memory import UNDER_WAY
from dorothie_gym.policies.participant.trip_talk import note_told, trip_questions, trip_remarks
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.scripted_agent_limits import FOG_LIMIT, RAIN_LIMIT, usual_cruise
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.policies.view_range import FAR_SIGHT, Limit, camera_fault, limit_of, sight, suitable_speed

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.tasks.purposes import Purpose

_HANDLED = frozenset({WeatherParameter.FOG_DENSITY, WeatherParameter.PRECIPITATION})
"""Parameters of the weather that have a reaction of their own."""

_HASTE, _HURRIED = 5, 0.75
"""Speed that a hurried participant adds to the speed suitable for the sight [km/h], and the minimum value of the trait
`hurries` for this.
"""

_SPEEDING_UP = 130.0
"""Route length to the place below which the participant does not ask for more speed [m]."""

AGREED = 12.0
"""Time after a sign of hearing within which nobody asks why the car does what it has said [s]."""

CHAT_SILENCE = 4.0
"""Silence of the car after which a remark is made that is unrelated to the task [s]."""

LIGHTS_INTERVAL = 25.0
"""Time between remarks about the headlights [s]."""

WHY_INTERVAL = 40.0
"""Time between questions why the car stands [s]."""

LONG_STANDSTILL = 25.0
"""Standstill after which a guided car is asked why it stands [s]."""

WHY_DISTANCE = 45.0
"""Distance to the place within which the participant does not ask about a standstill [m]."""

_KNOWS_STREETS = 0.3
"""Share of places named with their street above which the participant knows the streets, and does not ask."""


def scene_of(state: ParticipantState, view: ParticipantView) -> WordingContext:
    """Returns the context that utterances may refer to: street, landmark nearby, and whether there is an exception."""
    landmark = nearest_landmark(view.raw, view.landmarks, *view.position)
    street = street_of(view.raw, state.town, view.lane)
    purpose, goal = purpose_of_target(state, view), state.task.goal
    target = None if goal is None else goal.name
    return WordingContext(
        street=street if street is not StreetName.UNKNOWN else None,
        landmark=landmark.name if landmark is not None else None,
        exception=is_foggy(view.raw) or is_rainy(view.raw),
        owner=purpose.owner if purpose is not None and target is LandmarkName.HOUSE else None,
        friend=_first_name(purpose.person) if purpose is not None and target is LandmarkName.PERSON else None,
        passenger=_passenger(purpose) if purpose is not None and target is LandmarkName.PERSON else None,
    )


def _passenger(purpose: Purpose) -> str | None:
    """Returns the person that is picked up on an errand, by a name that can follow "pick up"."""
    if not picks_up(purpose) or purpose.person is None:
        return None
    last = _last_name_of(purpose.person) if "'" in purpose.person else None
    return last or _with_capital(purpose.person)  # "Nilo" of "Rosa's brother Nilo", but "Ayumi's mother"


def _first_name(person: str | None) -> str | None:
    """Returns the name of a person that is called by one name: not "Aunt Mei" or "the children"."""
    return person if person is not None and person.isalpha() and person[0].isupper() else None


def _last_name_of(person: str) -> str | None:
    """Returns "Nilo" of "Rosa's brother Nilo", None of "Ayumi's mother"."""
    return _first_name(person.rpartition(" ")[2])


def _with_capital(person: str) -> str | None:
    return person if person[0].isupper() else None


def react(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Queues a remark about the surroundings, if no other is queued or being said."""
    note_blocked(state, view)
    state.conversation = state.conversation.with_view(view.time, blind=camera_fault(view.raw) is not None)
    if not state.speech.idle or view.speaking > 0.0 or not state.task.announced:
        return
    for consider in (
        _mention_view,
        _mention_weather,
        _mention_lights,
        _look_around,
        _ask_why_standing,
        _wonder,
        _chat,
    ):
        consider(state, view, rng)
        if not state.speech.idle:
            return


def note_blocked(state: ParticipantState, view: ParticipantView, near: bool = False) -> None:
    """Records an obstacle on the route and plans around it.

    Args:
        state: working copy of the state.
        view: observation.
        near: whether the car has reported an obstacle; it is then assumed ahead even if it is not in sight.
    """
    progress = state.route.progress
    if progress is None:
        return
    seen = obstacle_on_route(state.town, view, progress, state.config.roadblock_sight)
    found = None if seen is None else seen[0]
    if found is None and near:
        ahead = min(view.station + 12.0, state.town.lanes[view.lane].length)
        found = (view.lane, ahead)
    if found is None or state.route.knows_roadblock(found):
        return
    route = state.route.with_roadblock(state.town, found)
    progress = progress.replanned(state.town, view.place, route.blocked)
    state.feel(Happening.OBSTACLE, view.time)
    state.route = route.with_progress(progress)
    state.guidance = state.guidance.for_new_route(progress.left(view.station))
    if state.guidance.guiding and not near:
        obstacle = Proposition.of(
            Predicate.BLOCKED, object=ObjectClass.STATIC, prop=None if seen is None else seen[1].prop
        )
        state.say_only(intend(Function.INFORM, obstacle, urgent=True))


def _mention_view(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Remarks, with some probability, on a view poorer than the weather explains, if the car does not mention it."""
    conversation, config = state.conversation, state.config
    if conversation.asked_about_view or view.time - conversation.blind_since < config.weather_notice:
        return
    state.conversation = conversation.after_talking_about_view()
    if rng.random() > state.style.notices:
        return
    question = Proposition.of(Predicate.VISIBILITY) if rng.random() < 0.5 else Proposition.of(Predicate.FAILED)
    asked = intend(Function.PROPOSITIONAL_QUESTION, question, joined=True)
    state.say(view_remark(Limit.CAMERA, sight(view.raw), rng), asked)


def _mention_weather(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks the car to slow down in bad weather, to a speed suitable for the sight, and to speed up afterwards."""
    fog = weather(view.raw, WeatherParameter.FOG_DENSITY)
    rain = weather(view.raw, WeatherParameter.PRECIPITATION)
    config, limit = state.config, limit_of(view.raw)
    conversation = state.conversation = state.conversation.with_weather(
        view.time, bad=is_foggy(view.raw) or is_rainy(view.raw)
    )
    if not conversation.slowed and view.time - conversation.bad_weather_since > config.weather_notice:
        state.conversation = conversation.with_slowed(True)
        condition = Limit.FOG if is_foggy(view.raw) else Limit.RAIN
        parameter = PARAMETER[condition]
        mentioned = conversation.noticed.has_mentioned(parameter) or limit is Limit.CAMERA
        if mentioned or rng.random() > state.style.notices:
            return
        state.conversation = state.conversation.with_noticed(conversation.noticed.with_mention(parameter, high=True))
        said = view_remark(condition, sight(view.raw), rng)
        speed = suitable_speed(sight(view.raw)) + _HASTE * (state.style.hurries > _HURRIED)
        if view.speed > (speed + _HASTE) / 3.6:
            content, wording = (
                act_builders.action(ActionValue.SPEED_CHANGE, speed=speed),
                Wording(faster=False, speed=speed),
            )
            state.say(said, intend(Function.REQUEST, content, wording=wording, joined=True))
        elif rng.random() < state.style.curious:
            enough = Proposition.of(Predicate.VISIBILITY)
            state.say(said, intend(Function.PROPOSITIONAL_QUESTION, enough, joined=True))
        else:
            state.say(said)
    elif conversation.slowed and fog < FOG_LIMIT / 2 and rain < RAIN_LIMIT / 2:
        state.conversation = conversation.with_slowed(False)
        progress = state.route.progress
        arrives = progress is not None and progress.left(view.station) < _SPEEDING_UP
        if not arrives and rng.random() < 0.5:
            speed = _usual_speed(state, view)
            content, wording = (
                act_builders.action(ActionValue.SPEED_CHANGE, speed=speed),
                Wording(faster=True, speed=speed),
            )
            state.say(intend(Function.REQUEST, content, wording=wording))


def _usual_speed(state: ParticipantState, view: ParticipantView) -> int:
    """Returns the speed that the car is expected to drive at where nothing slows it down [km/h]."""
    if state.town.cruise is not None:
        return round(state.config.usual_speed)
    return usual_cruise(state.town, view.lane)


def _look_around(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Mentions, with some probability, a conspicuous change of the weather, or a crowd."""
    said, noticed = notice(
        state.conversation.noticed, view.raw, view.objects, rng, chance=state.style.notices, handled=_HANDLED
    )
    state.conversation = state.conversation.with_noticed(noticed)
    if said is not None:
        state.say(said)


def _mention_lights(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks for the headlights in the dark."""
    lit = bool(view.raw["lights"])
    if not is_dark(view.raw) or lit or view.time - state.conversation.lights_at < LIGHTS_INTERVAL:
        return
    conversation = state.conversation.after_mentioning_lights(view.time)
    told = conversation.noticed.has_mentioned(PARAMETER[Limit.NIGHT])
    state.conversation = conversation.with_noticed(conversation.noticed.with_mention(PARAMETER[Limit.NIGHT], high=True))
    wording = Wording(lights=True)
    if rng.random() < 0.4:
        on = Proposition.of(Predicate.LIGHTS_ON, action=ActionValue.LIGHT_CHANGE)
        state.say(intend(Function.PROPOSITIONAL_QUESTION, on, wording=replace(wording, topic="lights")))
        return
    dark = () if told else (view_remark(Limit.NIGHT, sight(view.raw), rng),)
    content = act_builders.action(ActionValue.LIGHT_CHANGE)
    state.say(*dark, intend(Function.REQUEST, content, wording=wording, joined=bool(dark)))


def _ask_why_standing(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    since, progress = state.motion.standing_since, state.route.progress
    if since is None or view.time < state.motion.excused_until or waits_for_road(state, view):
        return
    if state.guidance.guiding and state.motion.standstill(view.time) < LONG_STANDSTILL:
        return  # its next instruction makes it go on
    near = progress is not None and progress.left(view.station) < WHY_DISTANCE
    waited = view.time - max(since, state.conversation.heard_at, state.speech.last_end)
    asked_lately = view.time - state.conversation.asked_at <= WHY_INTERVAL
    if waited > state.style.patience and not near and not asked_lately:
        state.conversation = state.conversation.after_asking_why(view.time)
        if not _sends_on(state, view, rng):
            state.say(_why(Proposition.of(Predicate.STANDS, action=ActionValue.STOP)))


def _sends_on(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> bool:
    """Sends a car on that stands because of the participant; returns whether it does.

    A car that was told to stop is told to drive on, and one that has not left the last errand gets the next one again.
    """
    last = last_given(state)
    if last is not None and ActionValue.STOP in last.act.slots:
        state.say(intend(Function.REQUEST, act_builders.action(ActionValue.START)))
    elif state.task.finished[1] >= state.motion.moved_at:
        state.task = state.task.after_reminding(view.time)
        state.say(announcement(state, view, rng))
    else:
        return False
    return True


def _why(effect: Proposition) -> Remark:
    """Returns the question for the cause of an effect."""
    return intend(Function.SET_QUESTION, Proposition.of(Predicate.BECAUSE, effect=effect, cause=ASKED))


def _wonder(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks, with some probability, why the car turns round or stands for long on its own."""
    conversation, config = state.conversation, state.config
    if state.guidance.guiding or view.time - conversation.wondered_at < config.wonder_interval:
        return
    if view.time - conversation.heard_at < 4.0:
        return
    waited = view.time - max(state.motion.moved_at, state.task.announced_at, state.speech.last_end)
    long = waited > config.long_stop and view.time > state.motion.excused_until
    stands = state.motion.standing_since is not None and long and not waits_for_road(state, view)
    if not stands and not view.turning:
        return
    state.conversation = conversation.after_wondering(view.time)
    if view.turning and (turned_round_lately(state, view) or _has_just_agreed(state, view)):
        return
    if stands and _sends_on(state, view, rng):
        return
    if rng.random() < state.style.curious:
        turning = Proposition.of(Predicate.DOES, action=ActionValue.U_TURN)
        state.say(_why(turning if view.turning else Proposition.of(Predicate.STANDS, action=ActionValue.STOP)))


def _has_just_agreed(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the participant has taken note of what the car does a moment ago."""
    lately = state.speech.has_just_spoken(view.time, AGREED)
    return lately and any(item.act.move in SIGNS_OF_HEARING for item in state.speech.said[-2:])


def _chat(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Makes a remark unrelated to the task when no step of the guidance is near."""
    progress = state.route.progress
    if view.time < state.conversation.chat_at or view.standing or progress is None or state.task.goal is None:
        return
    crossing, manoeuvre = progress.next_crossing(state.town, view.station), progress.next_manoeuvre(view.station)
    steps = [
        crossing.distance if crossing is not None else math.inf,
        manoeuvre[1] if manoeuvre is not None else math.inf,
    ]
    if progress.left(view.station) < 130.0 or (state.guidance.guiding and min(steps) < 140.0):
        return
    if view.time - state.conversation.heard_at < CHAT_SILENCE:
        return  # the car may have more to say, or has just answered the question
    next_chat = view.time + float(rng.exponential(state.style.chat)) + 20.0
    state.conversation = state.conversation.with_next_chat(next_chat)
    asked = _said_lately(state)
    options = [each for each in _chat_options(state, view, rng) if asked.isdisjoint(each[-1].meaning)]
    chosen = options[int(rng.integers(len(options)))]  # a remark that is unrelated to the task is always possible
    note_told(state, chosen)
    state.say(*chosen)


def _said_lately(state: ParticipantState) -> set[Proposition]:
    return {content for item in state.speech.said for content in item.meaning}


def _knows_how_far(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car has said lately how far it is, or has only just been told where to go."""
    return view.time - max(state.conversation.how_far_at, state.task.announced_at) < UNDER_WAY


def _question(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> Remark:
    """Returns a general question: what the car knows, or how the drive is going."""
    asked = [Proposition.of(Predicate.RIGHT_WAY)]
    if sight(view.raw) < FAR_SIGHT:
        asked += [Proposition.of(Predicate.SAFE), Proposition.of(Predicate.VISIBILITY)]
    asked += [Proposition.of(Predicate.LOCALISED), Proposition.of(Predicate.LOCALISED, negated=True)]
    if state.task.goal is not None and not state.guidance.guiding:
        place = state.task.goal.name
        if not _knows_how_far(state, view):
            asked += [
                Proposition.of(Predicate.CLOSE, place=place),
                Proposition.of(Predicate.CLOSE, negated=True, place=place),
            ]
        asked.append(Proposition.of(Predicate.HAS_ROUTE, place=place))
    chosen = asked[int(rng.integers(len(asked)))]
    return intend(Function.PROPOSITIONAL_QUESTION, chosen, elided=("place",))


def _chat_options(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> list[tuple[Remark, ...]]:
    """Returns the remarks that are possible now; equal ones count several times."""
    goal, street = state.task.destination, street_of(view.raw, state.town, view.lane)
    asks, asks_open = Function.PROPOSITIONAL_QUESTION, Function.SET_QUESTION
    found: list[tuple[Remark, ...]] = [
        *((intend(Function.OTHER),),) * 3,
        (_question(state, view, rng),),
        *trip_remarks(state, view) * 3,
    ]
    if not state.guidance.guiding:
        if not _knows_how_far(state, view):
            arrival = Proposition.of(Predicate.ARRIVES_IN, place=goal.name, seconds=ASKED)
            found.append((intend(asks_open, arrival, elided=("place",)),))
        found.append((intend(asks_open, act_builders.action(ActionValue.QUERIED)),))
        found.append((intend(Function.CHECK_QUESTION, act_builders.destination(goal.name)),))
        found.append((intend(asks_open, Proposition.of(Predicate.DRIVES_AT, speed=ASKED)),))
        found.append((intend(asks, Proposition.of(Predicate.CROWDED, object=ObjectClass.VEHICLES)),))
        found += trip_questions(state, view)
        if street not in (StreetName.UNKNOWN, goal.street) and state.style.names_street < _KNOWS_STREETS:
            found.append((intend(asks_open, Proposition.of(Predicate.ON_STREET, street=StreetName.QUERIED)),))
        may_hurry = not state.conversation.hurried and not state.conversation.slowed and view.speed > 5.0
        if rng.random() < 0.15 and may_hurry and sight(view.raw) >= FAR_SIGHT:
            speed = _usual_speed(state, view) + 5 if rng.random() < 0.5 else None
            content = act_builders.action(ActionValue.SPEED_CHANGE, speed=speed)
            if content not in _said_lately(state):  # a speed that was just asked for is not changed again
                state.conversation = state.conversation.after_hurrying()
                return [(intend(Function.REQUEST, content, wording=Wording(faster=True, speed=speed)),)]
    if view.objects:
        near = view.objects[int(rng.integers(min(len(view.objects), 3)))].kind
        found += [(intend(asks, Proposition.of(Predicate.SEES, object=near)),)] * 2
        found.append((intend(asks_open, Proposition.of(Predicate.SEES, object=ObjectClass.QUERIED)),))
        found.append((intend(Function.INFORM, Proposition.of(Predicate.SEES, object=near)),))
    if street is not StreetName.UNKNOWN:
        found.append((intend(Function.CHECK_QUESTION, Proposition.of(Predicate.ON_STREET, street=street)),))
    return found
