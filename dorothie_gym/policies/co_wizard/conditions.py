"""What the Co-Wizard says about the conditions it drives in: weather, darkness, and not knowing where it is."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.ontology import ActionValue, DialogueMove, ObjectClass, WeatherParameter
from dorothie_gym.policies.co_wizard.mind import CoWizardMind, View
from dorothie_gym.policies.scenery import weather
from dorothie_gym.policies.speech import remark

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


def dim_topic(view: View) -> str | None:
    """What keeps it from seeing far: "fog", "rain" or "night"; None for clear weather by day."""
    if weather(view.raw, WeatherParameter.FOG_DENSITY) > THICK_FOG:
        return "fog"
    if weather(view.raw, WeatherParameter.PRECIPITATION) > HEAVY_RAIN:
        return "rain"
    return "night" if weather(view.raw, WeatherParameter.SUN_ALTITUDE_ANGLE) < 0.0 else None


def mind_weather(mind: CoWizardMind, view: View, rng: np.random.Generator) -> None:
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


def mind_place(mind: CoWizardMind, view: View, rng: np.random.Generator) -> None:
    """Says so when it does not know any more where it is."""
    covariance = view.raw["pose_covariance"]
    variance = float(covariance[0][0]) + float(covariance[1][1])
    if variance < FOUND:
        mind.lost_told = False
    elif variance > LOST and not mind.lost_told:
        mind.lost_told = True
        mind.voice = mind.voice.plan(remark(DialogueMove.EXPLAIN, wording=Wording(topic="no_gps")))
