"""Values that the words of an utterance name: those found in the lexicon, corrected by their context.

"The kids are starving" says nothing of people on the street, and "your vehicle" nothing of other cars.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.slots import (
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    SlotValue,
    StreetName,
)

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_parser import PlanParse

_VAGUE: Final = re.compile(r"\bsome ?thing (to|else|big|small|nice|for|back|quick|important|like|wrong|up|is wrong)\b")
_TICKED: Final = re.compile(r"\b(tick|check|cross) (?:\w+ ){0,4}off\b")
_PEOPLE: Final = re.compile(
    r"\b(pedestrians?|walkers?|joggers?|runners?|crowd|on foot|crossing|crosses|crossed|cross|street|road|roads"
    r"|sidewalk|pavement|walk\w*|running|runs|run out|steps?|stepping|standing|stood|stands|waving|waves"
    r"|playing|in front|ahead|over there|about|ladder|kerb|curb|corner|watch|mind|look|see"
    r"|that (?:guy|man|woman|lady|boy|girl|kid)"
    r"|those (?:people|kids|children)|there's|there are|there is|bus stop|waiting|across"
    r"|past us|pushchair|pram|in the way)\b"
)
"""Words of people outside the car."""

_INSIDE: Final = re.compile(
    r"\b(back here|in here|in the (?:back|car)|with us|with me|my mother|out(?:side)? (?:at|by)"
    r"|(?:got|have|with|bring|my|her|his|mum's|mom's) (?:the |a |my |her |his )?walker)\b"
)
_CAR_PEOPLE: Final = re.compile(r"\b(let|drop|set|put|get) (?:the |my |our )?\w+ (?:out|off|down)\b")
_OTHER_VEHICLES: Final = re.compile(
    r"\b(cars?|vehicles?|trucks?|lorry|lorries|vans?|bus|buses|cabs?|taxis?|bikes?|bicycles?|cyclists?|motorcycles?"
    r"|motorbikes?|motorcyclists?|bikers?|mopeds?|scooter|suv|pickup|ambulance|bicyclist|wagon|artic|tanker|minibus"
    r"|tram|tractor|trailer|caravan|jeep|hatchback|sedan|engine|rickshaw"
    r"|tractors|scooters|pickups|ambulances|trams|coaches|streetcar|trolley|minivans?|hearse|digger|bulldozer|slowpoke|slowcoach|hgv|semi|wheeler|ute|camper|rv"
    r"|convertible|limo|sunday driver|(?:much|heavy|any|oncoming|bunch of|lots of|lot of) traffic"
    r"|traffic (?:jam|ahead|like)|the traffic (?:ahead|in front)|how's the traffic)\b"
)
_SOUGHT: Final = re.compile(
    r"\b(?:my|our|his|her) (?:old |best |little |big |other )?(?:people|friends?|mate|mates|buddy|brother|sister|mum"
    r"|mom|mother|dad|father|gran|granny|grandma|grandpa|aunt|uncle|cousin|nephew|niece|son|daughter|wife|husband|boss"
    r"|coach|client|colleague|team|partner|girlfriend|boyfriend|grandson|granddaughter|kids|children|parents|passenger)"
    r"(?:'s| is| are| isn't| should be| will be|'ll be)? ?(?:still |already |just |right )?"
    r"(?:waiting(?! for (?:me|us))|standing|stood|waving|on (?:the|your)|at the|at #|over (?:on|at|there|by)|outside"
    r"|by the|next to|in front)"
)
"""Words of somebody who is looked for, at a place outside the car."""

_FETCHED: Final = re.compile(
    r"\b(?:to|gotta|must|should|and|then) (?:still )?(?:pick up|grab|fetch|collect|get) (?:my |our |his |her |the )?"
    r"(?:friends?|mate|buddy|brother|sister|mum|mom|mother|dad|father|gran|granny|grandma|grandpa|grandad|aunt|auntie"
    r"|uncle|cousin|nephew|niece|son|daughter|wife|husband|boss|girlfriend|boyfriend|grandson|granddaughter|partner"
    r"|kids|children|baby)(?: from| at| by| on| first| too| up| later| now| as well|$| ,)"
)
"""Words of somebody who is to be fetched."""

_LIVING: Final = re.compile(r"\b(?:lives?|living|lived|house|place|home|works?|working|worked)\b")
_DOING: Final = re.compile(r"\b(?:get|gets|getting) (?:\w+ ){1,4}done\b")
_ROAD: Final = re.compile(
    r"\b(?:this|that) (?:whole )?road(?:'s| is| has| was| looks)\b"
    r"|\bthe road(?:'s| is| was| looks) (?:all |very |so |really )?(?:clear|wet|icy|bumpy|narrow|rough|slippery|dug)\b"
)
_KERB: Final = re.compile(r"^(?!.*\b(?:pavement|sidewalks?|side walk|path|see)\b).*\b(?:kerb|curb)")
"""A kerb by which one stops, rather than one that is seen."""

_REMINDED: Final = re.compile(r"\b(?:don't|do not|never|mustn't|not) forget\b")
"""Reminder of an errand, which is not dropped."""

_WITHDRAWN: Final = re.compile(
    r"(?:(?:actually|no|oh|sorry|wait|hang on|hold on|um|uh|nah|right|okay|well|you know what) ,? ?)*"
    r"(?:scratch|strike|forget|never mind|cancel|scrap|ditch|drop|scrub|ignore|bin) (?:that|it|all that|the last one)"
    r"(?: one| last one| last bit)?(?: ,|$)"
)
"""Words that take back the last order, rather than the errand named behind them."""
_ONCE_DONE: Final = re.compile(
    r"\b(?:when|once|after|as soon as) (?:\w+(?:'\w+)? ){1,4}(?:done|finished|sorted|through)\b"
)
"""Condition of the errand that comes next."""

_ALREADY: Final = re.compile(
    r"\b(?:did|done|been(?! (?:past|by|over|down|along))|visited|finished|seen to|stopped at)\b(?: \w+){0,4} already\b"
    r"|\balready (?:did|done|been|went|visited|stopped|finished)\b"
)
"""Words of an errand that is done: "we did the Shell already"."""

_ARRIVING: Final = re.compile(
    r"\b(?:and|then|,) (?:then )?(?:we|you|i)(?:'re|'ll be| are| will be|'m) (?:home|done|finished)\b"
)
"""End of a way that is told: "two lefts and we're home"."""

_LEFT_OVER: Final = re.compile(
    r"\b(?:still|only|just|got|there's|what's|is|are|have)\b"
    r".*(?<!your )(?<!the )(?<!my )(?<!our )(?<!\ba )\bleft(?= now| to do| then|$)"
)


def meant_values(
    named: Sequence[SlotValue], actions: Sequence[ActionValue], parse: PlanParse, spoken: str
) -> list[SlotValue]:
    """Returns the values that the words mean.

    Args:
        named: values of the lexicon's phrases, in order.
        actions: actions that are named.
        parse: steps of the text.
        spoken: the words, in lower case.
    """
    found = [value for value in named if not _is_misled(value, spoken)]
    if parse.plan.steps and _ARRIVING.search(spoken):
        found = [value for value in found if value not in (GoalStatus.COMPLETE, LandmarkName.HOUSE)]
    if parse.person or _FETCHED.search(spoken):
        found = [value for value in found if value is not ObjectClass.PEDESTRIAN]
        found.append(LandmarkName.PERSON)
    if _SOUGHT.search(spoken) and LandmarkName.PERSON not in found and not _LIVING.search(spoken):
        found = [value for value in found if value is not ObjectClass.PEDESTRIAN]
        found.append(LandmarkName.PERSON)  # "my sister is waiting at the KFC"
    if _ROAD.search(spoken) and not parse.plan.steps and ObjectClass.ROAD not in found:
        found.append(ObjectClass.ROAD)
    return _with_status(found, actions, parse, spoken)


def _is_misled(value: SlotValue, spoken: str) -> bool:
    """Returns whether a phrase of the lexicon means something else here."""
    if value is ObjectClass.UNLABELED:
        return _VAGUE.search(spoken) is not None
    if value is ObjectClass.PEDESTRIAN:
        inside = _INSIDE.search(spoken) or _CAR_PEOPLE.search(spoken)
        return inside is not None or _PEOPLE.search(spoken) is None
    if value is ObjectClass.VEHICLES:
        return _OTHER_VEHICLES.search(spoken) is None
    if value is ObjectClass.SIDE_WALK:
        return _KERB.search(spoken) is not None
    return False


def _with_status(
    found: list[SlotValue], actions: Sequence[ActionValue], parse: PlanParse, spoken: str
) -> list[SlotValue]:
    """Returns the values with the status of the errands that they name, and without that of others."""
    landmarks = any(isinstance(value, LandmarkName) for value in found)
    if landmarks and _ALREADY.search(spoken) and not {GoalStatus.ABANDONED, GoalStatus.COMPLETE} & set(found):
        found = [GoalStatus.COMPLETE, *found]
    if parse.cancelled and _TICKED.search(spoken):
        found = [GoalStatus.COMPLETE, *(value for value in found if value is not GoalStatus.ABANDONED)]
    if _REMINDED.search(spoken):
        found = [value for value in found if value is not GoalStatus.ABANDONED]  # "don't forget the KFC"
    if parse.cancelled and not {GoalStatus.ABANDONED, GoalStatus.COMPLETE} & set(found):
        found.append(GoalStatus.ABANDONED)  # "drop the KFC"
    driving = bool(actions) or any(isinstance(value, StreetName) for value in found)
    if parse.repaired or (driving and not landmarks):
        found = [value for value in found if value is not GoalStatus.ABANDONED]  # "scratch that, Bishop"
    if _DOING.search(spoken):
        found = [value for value in found if value is not GoalStatus.COMPLETE]  # "let's get the KFC done first"
    if landmarks and not parse.cancelled and _WITHDRAWN.match(spoken):
        found = [value for value in found if value is not GoalStatus.ABANDONED]  # "scratch that, make it the KFC"
    if parse.plan.steps and _ONCE_DONE.search(spoken):
        found = [value for value in found if value is not GoalStatus.COMPLETE]  # "when we're done at the KFC, go home"
    if driving and not landmarks:
        found = [value for value in found if value is not GoalStatus.PENDING]  # "later on a left"
    if landmarks and not actions and _LEFT_OVER.search(spoken) and GoalStatus.PENDING not in found:
        if GoalStatus.COMPLETE not in found or "only" in spoken:
            found.append(GoalStatus.PENDING)
    return found
