"""What the participant says about weather, obstacles and a car that stands, and what it says besides."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.dialogue import Wording, WordingContext
from dorothie_gym.maps.routing import Place
from dorothie_gym.ontology import ActionValue, DialogueMove, ObjectClass, StreetName, WeatherParameter
from dorothie_gym.policies.observation_parser import nearest_landmark, place_on_lanes, street_of, weather
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.speech import Remark, remark

THICK_FOG = 35.0
"""Fog density from which one cannot see far (percent)."""

HEAVY_RAIN = 55.0
"""Precipitation from which one should slow down (percent)."""

SLOW, USUAL = 25.0, 40.0
"""Speeds in bad weather and else [km/h]."""

NOTICES = 3.0
"""The car is left this long to remark on fog or rain [s]."""

LONG_STOP = 8.0
"""A car that stands for longer than this may be asked why [s]."""

WONDERS_AGAIN = 25.0
"""Nothing is wondered about again within this time [s]."""

UNSEEN = 0.4
"""Chance that a question about what the car sees is about something that is not to be seen."""

SIGHT = 80.0
"""How far ahead an obstacle is noticed [m]."""


def scene_of(mind: ParticipantState, view: ParticipantView) -> WordingContext:
    """What is in view as the participant speaks: the street, a place close by, and whether something is wrong."""
    landmark = nearest_landmark(view.landmarks, *view.position)
    street = street_of(view.raw, mind.town, view.lane)
    fog, rain = (weather(view.raw, name) for name in (WeatherParameter.FOG_DENSITY, WeatherParameter.PRECIPITATION))
    return WordingContext(
        street=street if street is not StreetName.UNKNOWN else None,
        landmark=landmark.name if landmark is not None else None,
        exception=fog > THICK_FOG or rain > HEAVY_RAIN,
    )


def react(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Talks about what is going on outside, if there is nothing else to say."""
    note_blocked(mind, view)
    if not mind.voice.idle or view.speaking > 0.0 or not mind.told:
        return
    for consider in (_mind_weather, _mind_light, _ask_why, _wonder, _chat):
        consider(mind, view, rng)
        if not mind.voice.idle:
            return


def note_blocked(mind: ParticipantState, view: ParticipantView, near: bool = False) -> None:
    """Remembers an obstacle on the way and plans round it.

    Args:
        mind: of the participant.
        view: what it sees.
        near: whether the car has told of one: it is ahead even if it is not in sight.
    """
    if mind.journey is None:
        return
    lanes = [leg.lane for leg in mind.journey.legs[:6]]
    found: Place | None = None
    for thing in view.objects:
        if thing.kind is ObjectClass.STATIC and thing.distance < SIGHT and found is None:
            found = place_on_lanes(mind.town, lanes, thing.x, thing.y)
            if found is not None and found[0] == view.lane and found[1] < view.station:
                found = None
    if found is None and near:
        ahead = min(view.station + 12.0, mind.town.lanes[view.lane].length)
        found = (view.lane, ahead)
    if found is None or any(place[0] == found[0] and abs(place[1] - found[1]) < 10.0 for place in mind.blocked):
        return
    # the cell behind the obstacle as well: the car's own cell counts as free
    mind.blocked = (*mind.blocked, found, (found[0], min(found[1] + 8.0, mind.town.lanes[found[0]].length)))
    mind.journey = mind.journey.replanned(mind.town, view.place, mind.blocked)
    mind.best = mind.journey.left(view.station)
    mind.guided = None
    if mind.guiding and not near:
        mind.voice = mind.voice.cleared().plan(
            remark(DialogueMove.EXPLAIN, ObjectClass.STATIC, wording=Wording(topic="blocked"), urgent=True)
        )


def _mind_weather(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    fog = weather(view.raw, WeatherParameter.FOG_DENSITY)
    rain = weather(view.raw, WeatherParameter.PRECIPITATION)
    bad = fog > THICK_FOG or rain > HEAVY_RAIN
    mind.dim_since = min(mind.dim_since, view.time) if bad else math.inf
    if not mind.slowed and view.time - mind.dim_since > NOTICES:
        mind.slowed = True
        if view.speed < SLOW / 3.6 or view.time - mind.heard_at < NOTICES + 2.0:
            return  # the car goes slowly anyway, or talks of it
        topic = "fog" if fog > THICK_FOG else "rain"
        wording = Wording(faster=False, speed=SLOW)
        slower = remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording, joined=True)
        mind.voice = mind.voice.plan(weather_remark(topic, rng), slower)
    elif mind.slowed and fog < THICK_FOG / 2 and rain < HEAVY_RAIN / 2:
        mind.slowed = False
        if rng.random() < 0.5:
            wording = Wording(faster=True, speed=USUAL)
            mind.voice = mind.voice.plan(remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=wording))


def weather_remark(topic: str, rng: np.random.Generator) -> Remark:
    """A remark on fog, rain or night, now and then on what one sees of it, or does not see any more."""
    things = _SEEN_OF_WEATHER[topic]
    draw = rng.random() * (len(things) + 1)
    values = (things[int(draw)],) if draw < len(things) else ()
    return remark(DialogueMove.EXPLAIN, *values, wording=Wording(topic=topic))


_SEEN_OF_WEATHER = {
    "fog": (ObjectClass.ROAD_LINE,),
    "rain": (ObjectClass.WATER, ObjectClass.GROUND),
    "night": (ObjectClass.SKY,),
}


def _mind_light(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    dark = weather(view.raw, WeatherParameter.SUN_ALTITUDE_ANGLE) < 0.0
    if not dark or bool(view.raw["lights"]) or view.time - mind.lights_at < 25.0:
        return
    mind.lights_at = view.time
    if rng.random() < 0.5:
        mind.voice = mind.voice.plan(
            remark(DialogueMove.QUERY_YN, ActionValue.LIGHT_CHANGE, wording=Wording(lights=True))
        )
        return
    mind.voice = mind.voice.plan(
        weather_remark("night", rng),
        remark(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE, wording=Wording(lights=True), joined=True),
    )


def _ask_why(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    if mind.standing_since is None or mind.guiding or view.time < mind.excused_until:
        return
    near = mind.journey is not None and mind.journey.left(view.station) < 45.0
    waited = view.time - max(mind.standing_since, mind.heard_at, mind.voice.last_end)
    if waited > mind.style.patience and not near and view.time - mind.asked_at > 40.0:
        mind.asked_at = view.time
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, ActionValue.STOP))


def _wonder(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Asks, once for each time, why the car turns round, or stands so long, by itself."""
    if mind.guiding or view.time - mind.wondered_at < WONDERS_AGAIN or view.time - mind.heard_at < 4.0:
        return
    stands = mind.standing_since is not None and view.time - mind.stood_since > LONG_STOP
    if not stands and not view.turning:
        return
    mind.wondered_at = view.time
    if rng.random() < mind.style.curious:
        action = ActionValue.U_TURN if view.turning else ActionValue.STOP
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, action))


def _chat(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    if view.time < mind.chat_at or view.standing or mind.journey is None or mind.goal is None:
        return
    crossing, manoeuvre = mind.journey.next_crossing(mind.town, view.station), mind.journey.next_manoeuvre(view.station)
    steps = [
        crossing.distance if crossing is not None else math.inf,
        manoeuvre[1] if manoeuvre is not None else math.inf,
    ]
    if mind.journey.left(view.station) < 130.0 or (mind.guiding and min(steps) < 140.0):
        return
    mind.chat_at = view.time + float(rng.exponential(mind.style.chat)) + 20.0
    options = _topics(mind, view, rng)
    mind.voice = mind.voice.plan(*options[int(rng.integers(len(options)))])


_BY_THE_ROAD = (
    ObjectClass.BRIDGE, ObjectClass.BUILDING, ObjectClass.DYNAMIC, ObjectClass.FENCE, ObjectClass.POLE,
    ObjectClass.ROAD, ObjectClass.SIDE_WALK, ObjectClass.UNLABELED, ObjectClass.VEGETATION, ObjectClass.WALL,
    ObjectClass.TRAFFIC_SIGN, ObjectClass.STATIC,
)  # fmt: skip
"""What somebody may look for by the side of the road."""


def _topics(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> list[tuple[Remark, ...]]:
    """What could be talked about now."""
    assert mind.goal is not None
    found: list[tuple[Remark, ...]] = [
        *((remark(DialogueMove.IRRELEVANT),),) * 2,
        (remark(DialogueMove.IRRELEVANT), remark(DialogueMove.IRRELEVANT, joined=True)),
        (remark(DialogueMove.QUERY_YN),),
    ]
    if not mind.guiding:
        found.append((remark(DialogueMove.QUERY_W, ActionValue.QUERIED),))
        found.append((remark(DialogueMove.CHECK, mind.goal.name),))
        found.append((remark(DialogueMove.QUERY_W, StreetName.QUERIED),))
        found.append((remark(DialogueMove.QUERY_YN, mind.goal.name),))
        if rng.random() < 0.15 and not mind.hurried and not mind.slowed and view.speed > 5.0:
            faster = Wording(faster=True, speed=USUAL + 5.0 if rng.random() < 0.5 else None)
            mind.hurried = True
            return [(remark(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=faster),)]
    if view.objects:
        near = view.objects[int(rng.integers(min(len(view.objects), 3)))].kind
        thing = _BY_THE_ROAD[int(rng.integers(len(_BY_THE_ROAD)))] if rng.random() < UNSEEN else near
        found += [(remark(DialogueMove.QUERY_YN, thing),)] * 2
        found.append((remark(DialogueMove.QUERY_W, ObjectClass.QUERIED),))
        found.append((remark(DialogueMove.EXPLAIN, near),))
    street = street_of(view.raw, mind.town, view.lane)
    if street is not StreetName.UNKNOWN:
        found.append((remark(DialogueMove.CHECK, street),))
    return found
