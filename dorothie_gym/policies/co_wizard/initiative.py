"""Remarks on the initiative of the Co-Wizard: questions, reasons, arrivals, weather and localization."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import Direction, Wording, WordingContext
from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology import (
    ActionValue,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    SlotValue,
    StreetName,
    WeatherParameter,
)
from dorothie_gym.policies.co_wizard.acknowledgement import musing
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.state import CoWizardState, Directive, Wish
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import nearest_landmark, street_of, weather
from dorothie_gym.policies.route_progress import Choice, direction_of
from dorothie_gym.policies.speech import remark
from dorothie_gym.spaces import Motion, Physical

ASK_DISTANCE = 75.0
"""A way is asked for when the junction is this near [m]."""

ASK_AGAIN = 8.0
"""A question about the way that has no answer is put again after this time [s]."""

NO_ANSWER = 10.0
"""So is one about what comes next, which takes longer to answer [s]."""

REASON = 5.0
"""A hazard is explained when it holds the car for longer than this [s]."""

FIRST_WORD = 5.0
"""The human is left to speak first until this time [s]."""

TOLD_AGAIN = 20.0
"""A hazard is not explained again within this time, even if the car has inched on [s]."""

NEXT = 4.0
"""Silence after which it asks what comes next [s]."""

START = 7.0
"""Silence at the beginning after which it asks where to go [s]."""


def speak_up(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Plans at most one remark, if it has nothing to say yet."""
    if not mind.voice.idle or view.speaking > 0.0:
        return
    for consider in (_give_up_wish, _ask_way, _say_arrived, _ask_goal, _explain_hazard, mind_weather, mind_place):
        consider(mind, view, rng)
        if not mind.voice.idle:
            return


def scene_of(mind: CoWizardState, view: CoWizardView) -> WordingContext:
    """What is in view as it speaks: its street, a place on the map close ahead, and whether something is wrong."""
    landmark = nearest_landmark(view.landmarks, *view.position)
    street = street_of(view.raw, mind.town, view.lane)
    return WordingContext(
        street=street if street is not StreetName.UNKNOWN else None,
        landmark=landmark.name if landmark is not None else None,
        exception=mind.detour_at is not None or (view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC),
    )


def _give_up_wish(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    if mind.wish is not None and view.time > mind.wish_until:
        mind.wish = None
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, wording=Wording(topic="refused")))


def _ask_way(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    choice = view.choice
    if choice is None or mind.halted or mind.creeping or mind.nudge is not None or view.time < FIRST_WORD:
        return
    if mind.wish is Wish.U_TURN or view.manoeuvring:
        return
    waiting = view.motion is Motion.WAITING or (mind.pausing and view.motion is Motion.STOPPED)
    if not (waiting or choice.distance < ASK_DISTANCE) or wanted_exit(mind, view) is not None:
        return
    if mind.journey is not None:
        crossing = mind.journey.next_crossing(mind.town, view.station)
        if crossing is None or mind.journey.changes_before(crossing):
            return  # the goal, or the place to turn round, comes first
    if view.manoeuvre is PhysicalAction.J_TURN and not waiting:
        return
    asked = mind.asked == choice.lane
    if (asked and not waiting) or view.time - max(mind.asked_at, mind.heard_at) < ASK_AGAIN * asked:
        return
    guided = mind.goal is not None and mind.journey is None
    straight = any(way.type is LinkType.STRAIGHT for way in choice.exits)
    if guided and straight and not waiting and mind.considered == choice.lane:
        return
    mind.considered = choice.lane
    if guided and straight and not waiting and rng.random() > mind.style.asks:
        return  # it goes straight on if it is not told otherwise
    mind.asked, mind.asked_at = choice.lane, view.time
    mind.pausing = mind.pausing or (mind.journey is None and bool(rng.random() < mind.style.careful))
    if not asked and rng.random() < mind.style.proposes:
        _propose_way(mind, view, choice, rng)
    else:
        mind.proposed = None
        first = musing(mind, rng)
        mind.voice = mind.voice.plan(*first, remark(DialogueMove.QUERY_W, ActionValue.QUERIED, joined=bool(first)))


def _propose_way(mind: CoWizardState, view: CoWizardView, choice: Choice, rng: np.random.Generator) -> None:
    """Asks whether one of the ways is meant."""
    way = choice.exits[int(rng.integers(len(choice.exits)))]
    direction = direction_of(way)
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    street = street_of(view.raw, mind.town, way.lane)
    values: list[SlotValue] = [action]
    if action is ActionValue.J_TURN and street is not StreetName.UNKNOWN and rng.random() < 0.3:
        values.append(street)
    move = DialogueMove.QUERY_YN if rng.random() < 0.7 else DialogueMove.CHECK
    mind.proposed = Directive(direction=direction, junction=choice.junction)
    first = musing(mind, rng)
    question = remark(move, *values, wording=Wording(direction=direction), joined=bool(first))
    mind.voice = mind.voice.plan(*first, question)


def _say_arrived(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    if not (mind.arrived and mind.halted and view.standing) or mind.goal is None:
        return
    if mind.asked_at > mind.stop_sent_at:
        return
    mind.asked_at = view.time
    arrived = Wording(topic="arrived")
    if mind.exact and rng.random() < mind.style.echoes + 0.15:
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, mind.goal, wording=arrived))
    elif not mind.exact:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_YN, wording=arrived))


def _ask_goal(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    idle = mind.goal is None and mind.directive is None and mind.wish is None and mind.nudge is None
    if not idle or mind.creeping:
        mind.idle_since = view.time
        return
    if view.time - mind.idle_since < (NEXT if mind.halted else START):
        return
    silent = view.time - max(mind.asked_at, mind.voice.last_end)
    if silent < NO_ANSWER and mind.asked_at > mind.heard_at or not (mind.halted or view.standing):
        return
    again = view.time - mind.asked_at < 2.0 * NO_ANSWER
    mind.asked_at = view.time
    draw = rng.random()
    if again and draw < 0.5:
        mind.voice = mind.voice.plan(remark(DialogueMove.ALIGN))
    elif mind.statuses and draw < 0.25:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, GoalStatus.QUERIED))
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, LandmarkName.QUERIED))


def _explain_hazard(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    resting = view.time < mind.rest_until
    hazard = mind.rest_for if resting else view.hazard
    if not (resting or view.motion is Motion.HAZARD) or mind.standing_since is None:
        return
    if hazard is ObjectClass.UNLABELED:
        return
    if view.time - mind.standing_since < REASON or view.time - mind.hazard_told < TOLD_AGAIN:
        return
    mind.hazard_told = view.time
    if rng.random() < (0.85 if hazard is ObjectClass.TRAFFIC_LIGHT else 0.4):
        return  # everybody sees a red light
    values: tuple[SlotValue, ...] = (hazard,)
    if resting or rng.random() < 0.3:
        values = (ActionValue.STOP, hazard)
    mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, *values), *musing(mind, rng, joined=True))


def tell_action(mind: CoWizardState, view: CoWizardView, physical: Physical | None, rng: np.random.Generator) -> None:
    """Says now and then what it does by its own plan."""
    if physical is None or not mind.voice.idle or view.speaking > 0.0 or mind.directive is not None:
        return
    told = {
        PhysicalAction.J_TURN: ActionValue.J_TURN,
        PhysicalAction.U_TURN: ActionValue.U_TURN,
        PhysicalAction.LANE_SWITCH: ActionValue.LANE_SWITCH,
    }
    action = told.get(physical.action)
    if action is None or mind.wish is not None or rng.random() > mind.style.tells:
        return
    values: list[SlotValue] = [action]
    direction = Direction.LEFT if physical.angle > 0 else Direction.RIGHT
    if action is ActionValue.J_TURN:
        way = wanted_exit(mind, view)
        if way is None or direction_of(way) is Direction.STRAIGHT:
            return
        direction = direction_of(way)
        street = street_of(view.raw, mind.town, way.lane)
        if street is not StreetName.UNKNOWN and rng.random() < 0.6:
            values.append(street)
    mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, *values, wording=Wording(direction=direction)))


THICK_FOG = 35.0
"""Fog density from which one cannot see far (percent)."""

HEAVY_RAIN = 55.0
"""Precipitation from which one should slow down (percent)."""

SLOW = 25
"""Speed that it proposes in bad weather [km/h]."""

LOST = 36.0
"""Variance of the position from which it says that it is lost [m^2]."""

FOUND = 9.0
"""Variance below which it knows again where it is [m^2]."""


LEAVES_IT = 0.45
"""Chance that the human is left to remark on the weather."""

_SEEN_OF_WEATHER = {
    "fog": (ObjectClass.ROAD_LINE, ObjectClass.ROAD),
    "rain": (ObjectClass.WATER, ObjectClass.GROUND, ObjectClass.ROAD),
    "night": (ObjectClass.SKY,),
}
"""What one sees of it, or does not see any more."""


def dim_topic(view: CoWizardView) -> str | None:
    """What keeps it from seeing far: "fog", "rain" or "night"; None for clear weather by day."""
    if weather(view.raw, WeatherParameter.FOG_DENSITY) > THICK_FOG:
        return "fog"
    if weather(view.raw, WeatherParameter.PRECIPITATION) > HEAVY_RAIN:
        return "rain"
    return "night" if weather(view.raw, WeatherParameter.SUN_ALTITUDE_ANGLE) < 0.0 else None


def mind_weather(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Remarks on fog, rain or darkness, and asks whether to slow down or switch on the lights."""
    topic = dim_topic(view)
    bad = topic in ("fog", "rain")
    dark = weather(view.raw, WeatherParameter.SUN_ALTITUDE_ANGLE) < 0.0 and not view.lights
    if not bad and not dark:
        mind.weather_told = False
        return
    if mind.weather_told or view.standing:
        return
    mind.weather_told = True
    if rng.random() < LEAVES_IT:
        return  # the human may remark on it
    things = _SEEN_OF_WEATHER[topic or "night"]
    draw = int(rng.random() * (len(things) + 1))
    values = (things[draw],) if draw < len(things) else ()
    mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, *values, wording=Wording(topic=topic)))
    if bad and mind.speed > SLOW:
        mind.slower_asked = True
        wording = Wording(faster=False, speed=SLOW)
        question = remark(DialogueMove.QUERY_YN, ActionValue.SPEED_CHANGE, wording=wording, joined=True)
        mind.voice = mind.voice.plan(question)
    elif dark:
        mind.lights = True
        wording = Wording(lights=True)
        mind.voice = mind.voice.plan(
            remark(DialogueMove.EXPLAIN, ActionValue.LIGHT_CHANGE, wording=wording, joined=True)
        )


def mind_place(mind: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Says so when it does not know any more where it is."""
    covariance = view.raw["pose_covariance"]
    variance = float(covariance[0][0]) + float(covariance[1][1])
    if variance < FOUND:
        mind.lost_told = False
    elif variance > LOST and not mind.lost_told:
        mind.lost_told = True
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, wording=Wording(topic="no_gps")))
