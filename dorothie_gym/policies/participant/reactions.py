"""Remarks of the participant about weather, obstacles, standstills, and beside the task."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.dialogue import ASKED, CommunicativeFunction, Predicate, Proposition, Wording, WordingContext
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import ActionValue, DialogueMove, ObjectClass, PropKind, StreetName, WeatherParameter
from dorothie_gym.policies.guidance_config import FOG_LIMIT, RAIN_LIMIT
from dorothie_gym.policies.noticing import notice
from dorothie_gym.policies.observation_parser import (
    is_dark,
    is_foggy,
    is_rainy,
    nearest_landmark,
    place_on_lanes,
    street_of,
    weather,
)
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.speech import Remark, intend, remark

_HANDLED = frozenset({WeatherParameter.FOG_DENSITY, WeatherParameter.PRECIPITATION})
"""Parameters of the weather that have a reaction of their own."""

LIGHTS_INTERVAL = 25.0
"""Time between remarks about the head lights [s]."""

WHY_INTERVAL = 40.0
"""Time between questions why the car stands [s]."""

WHY_DISTANCE = 45.0
"""Distance to the place within which a standstill is not asked about [m]."""

_WEATHER_OBJECTS = {
    "fog": (ObjectClass.ROAD_LINE,),
    "rain": (ObjectClass.WATER, ObjectClass.GROUND),
    "night": (ObjectClass.SKY,),
}
"""Objects that become visible or invisible with each condition."""

_ROADSIDE_OBJECTS = (
    ObjectClass.BRIDGE, ObjectClass.BUILDING, ObjectClass.DYNAMIC, ObjectClass.FENCE, ObjectClass.POLE,
    ObjectClass.ROAD, ObjectClass.SIDE_WALK, ObjectClass.UNLABELED, ObjectClass.VEGETATION, ObjectClass.WALL,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.STATIC,
)  # fmt: skip
"""Objects that the participant may ask about."""


def scene_of(state: ParticipantState, view: ParticipantView) -> WordingContext:
    """Returns the context that utterances may refer to: street, landmark nearby, and whether there is an exception."""
    landmark = nearest_landmark(view.raw, view.landmarks, *view.position)
    street = street_of(view.raw, state.town, view.lane)
    return WordingContext(
        street=street if street is not StreetName.UNKNOWN else None,
        landmark=landmark.name if landmark is not None else None,
        exception=is_foggy(view.raw) or is_rainy(view.raw),
    )


def react(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Queues a remark about the surroundings, if no other is queued or being said."""
    note_blocked(state, view)
    if not state.speech.idle or view.speaking > 0.0 or not state.task.announced:
        return
    for consider in (
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
    found, prop = _obstacle_on_route(state, view)
    if found is None and near:
        ahead = min(view.station + 12.0, state.town.lanes[view.lane].length)
        found = (view.lane, ahead)
    if found is None or state.route.knows_roadblock(found):
        return
    route = state.route.with_roadblock(state.town, found)
    progress = progress.replanned(state.town, view.place, route.blocked)
    state.route = route.with_progress(progress)
    state.guidance = state.guidance.for_new_route(progress.left(view.station))
    if state.guidance.guiding and not near:
        obstacle = Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC, prop=prop)
        state.say_only(intend(CommunicativeFunction.INFORM, obstacle, urgent=True))


def _obstacle_on_route(state: ParticipantState, view: ParticipantView) -> tuple[Place | None, PropKind | None]:
    """Returns the place of the first obstacle in sight on the next lanes of the route, and its kind."""
    assert state.route.progress is not None
    lanes = [leg.lane for leg in state.route.progress.legs[:6]]
    for thing in view.objects:
        if thing.kind is ObjectClass.STATIC and thing.distance < state.config.roadblock_sight:
            found = place_on_lanes(state.town, lanes, thing.x, thing.y)
            behind = found is not None and found[0] == view.lane and found[1] < view.station
            if found is not None and not behind:
                return found, thing.prop
    return None, None


def _mention_weather(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks the car to slow down in bad weather, and to speed up afterwards."""
    fog = weather(view.raw, WeatherParameter.FOG_DENSITY)
    rain = weather(view.raw, WeatherParameter.PRECIPITATION)
    config = state.config
    conversation = state.conversation = state.conversation.with_weather(
        view.time, bad=is_foggy(view.raw) or is_rainy(view.raw)
    )
    if not conversation.slowed and view.time - conversation.bad_weather_since > config.weather_notice:
        state.conversation = conversation.with_slowed(True)
        mentioned = view.time - conversation.heard_at < config.weather_notice + 2.0
        if mentioned:
            return
        topic = "fog" if is_foggy(view.raw) else "rain"
        if view.speed < config.bad_weather_speed / 3.6:  # the car is slow already
            if rng.random() < state.style.notices:
                state.say(weather_remark(topic, rng))
            return
        wording = Wording(faster=False, speed=config.bad_weather_speed)
        slower = remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording, joined=True)
        state.say(weather_remark(topic, rng), slower)
    elif conversation.slowed and fog < FOG_LIMIT / 2 and rain < RAIN_LIMIT / 2:
        state.conversation = conversation.with_slowed(False)
        if rng.random() < 0.5:
            wording = Wording(faster=True, speed=config.usual_speed)
            state.say(remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording))


def weather_remark(topic: str, rng: np.random.Generator) -> Remark:
    """Returns a remark about fog, rain or night, by chance with an object that it hides or shows."""
    things = _WEATHER_OBJECTS[topic]
    draw = rng.random() * (len(things) + 1)
    values = (things[int(draw)],) if draw < len(things) else ()
    return remark(DialogueMove.EXPLAIN, *values, wording=Wording(topic=topic))


def _look_around(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Mentions, by chance, a conspicuous change of the weather, or a crowd."""
    said, noticed = notice(
        state.conversation.noticed, view.raw, view.objects, rng, chance=state.style.notices, handled=_HANDLED
    )
    state.conversation = state.conversation.with_noticed(noticed)
    if said is not None:
        state.say(said)


def _mention_lights(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks for the head lights in the dark."""
    lit = bool(view.raw["lights"])
    if not is_dark(view.raw) or lit or view.time - state.conversation.lights_at < LIGHTS_INTERVAL:
        return
    state.conversation = state.conversation.after_mentioning_lights(view.time)
    wording = Wording(lights=True)
    if rng.random() < 0.5:
        state.say(remark(DialogueMove.QUERY_YN, ActionValue.LIGHT_CHANGE, wording=wording))
        return
    request = remark(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE, wording=wording, joined=True)
    state.say(weather_remark("night", rng), request)


def _ask_why_standing(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    since, progress = state.motion.standing_since, state.route.progress
    if since is None or state.guidance.guiding or view.time < state.motion.excused_until:
        return
    near = progress is not None and progress.left(view.station) < WHY_DISTANCE
    waited = view.time - max(since, state.conversation.heard_at, state.speech.last_end)
    asked_lately = view.time - state.conversation.asked_at <= WHY_INTERVAL
    if waited > state.style.patience and not near and not asked_lately:
        state.conversation = state.conversation.after_asking_why(view.time)
        state.say(remark(DialogueMove.QUERY_W, ActionValue.STOP))


def _wonder(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks, by chance, why the car turns round or stands for long on its own."""
    conversation, config = state.conversation, state.config
    if state.guidance.guiding or view.time - conversation.wondered_at < config.wonder_interval:
        return
    if view.time - conversation.heard_at < 4.0:
        return
    stands = state.motion.standing_since is not None and view.time - state.motion.moved_at > config.long_stop
    if not stands and not view.turning:
        return
    state.conversation = conversation.after_wondering(view.time)
    if rng.random() < state.style.curious:
        action = ActionValue.U_TURN if view.turning else ActionValue.STOP
        state.say(remark(DialogueMove.QUERY_W, action))


def _chat(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Says something beside the task when no step of the guidance is near."""
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
    next_chat = view.time + float(rng.exponential(state.style.chat)) + 20.0
    state.conversation = state.conversation.with_next_chat(next_chat)
    options = _chat_options(state, view, rng)
    state.say(*options[int(rng.integers(len(options)))])


def _question(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> Remark:
    """Returns a question about the drive that names nothing: what the car knows, or how it gets on."""
    asked = [Proposition.of(predicate) for predicate in (Predicate.SAFE, Predicate.VISIBILITY, Predicate.RIGHT_WAY)]
    asked += [Proposition.of(Predicate.LOCALISED), Proposition.of(Predicate.LOCALISED, negated=True)]
    if state.task.goal is not None and not state.guidance.guiding:
        place = state.task.goal.name
        asked += [
            Proposition.of(Predicate.CLOSE, place=place),
            Proposition.of(Predicate.CLOSE, negated=True, place=place),
        ]
        asked.append(Proposition.of(Predicate.HAS_ROUTE, place=place))
    chosen = asked[int(rng.integers(len(asked)))]
    return intend(CommunicativeFunction.PROPOSITIONAL_QUESTION, chosen, elided=("place",))


def _chat_options(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> list[tuple[Remark, ...]]:
    """Returns the remarks that are possible now; equal ones count several times."""
    goal = state.task.goal
    assert goal is not None
    found: list[tuple[Remark, ...]] = [
        *((remark(DialogueMove.IRRELEVANT),),) * 2,
        (remark(DialogueMove.IRRELEVANT), remark(DialogueMove.IRRELEVANT, joined=True)),
        (_question(state, view, rng),),
    ]
    if not state.guidance.guiding:
        arrival = Proposition.of(Predicate.ARRIVES_IN, place=goal.name, seconds=ASKED)
        found.append((intend(CommunicativeFunction.SET_QUESTION, arrival, elided=("place",)),))
        found.append((remark(DialogueMove.QUERY_W, ActionValue.QUERIED),))
        found.append((remark(DialogueMove.CHECK, goal.name),))
        found.append((remark(DialogueMove.QUERY_W, StreetName.QUERIED),))
        found.append((remark(DialogueMove.QUERY_YN, goal.name),))
        may_hurry = not state.conversation.hurried and not state.conversation.slowed and view.speed > 5.0
        if rng.random() < 0.15 and may_hurry:
            speed = state.config.usual_speed + 5.0 if rng.random() < 0.5 else None
            state.conversation = state.conversation.after_hurrying()
            wording = Wording(faster=True, speed=speed)
            return [(remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording),)]
    if view.objects:
        near = view.objects[int(rng.integers(min(len(view.objects), 3)))].kind
        random_object = rng.random() < state.config.asks_unseen
        thing = _ROADSIDE_OBJECTS[int(rng.integers(len(_ROADSIDE_OBJECTS)))] if random_object else near
        found += [(remark(DialogueMove.QUERY_YN, thing),)] * 2
        found.append((remark(DialogueMove.QUERY_W, ObjectClass.QUERIED),))
        found.append((remark(DialogueMove.EXPLAIN, near),))
    street = street_of(view.raw, state.town, view.lane)
    if street is not StreetName.UNKNOWN:
        found.append((remark(DialogueMove.CHECK, street),))
    return found
