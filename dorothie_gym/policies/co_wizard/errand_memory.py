"""Memory of the Co-Wizard for the errands that the participant mentions, and later remarks about them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.nlu import understand
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName, Slot
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend
from dorothie_gym.tasks.purposes import read_purpose

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.heard_utterance import HeardUtterance

_TELLING = frozenset({DialogueMove.INSTRUCT, DialogueMove.EXPLAIN, DialogueMove.REPLY_W})
_CLAUSE = re.compile(
    r"\bI(?:'m| am)? (?:have to|need to|want to|supposed to) (?P<errand>(?:[^,.?]|(?<=\b(?:Mr|Ms|Dr))\.|(?<=\bMrs)\.)+)"
)
_OF_SPEAKER = re.compile(r"\b(?:my|our) ")
_OWNER = re.compile(
    r"\b(?P<owner>(?:(?:Mr|Mrs|Ms|Dr|Se.ora)\.? )?(?:[A-Z]\w+ ){0,2}[A-Z]\w+(?:'s [a-z]+)?|my \w+)'s "
    r"(?:house|home|place)\b"
)
_FRIEND = re.compile(
    r"\b(?:my friend|our passenger|[Pp]ick(?:ing)? up)"
    r" (?P<friend>(?:(?:Mr|Mrs|Ms|Dr)\.? |Aunt |Uncle |Grandpa |Grandma )?[A-Z][\w-]+)(?!\w|'s)"
)
_DRIVES = re.compile(
    r"(turn|stop|go|get|be|drive|head|pull|park|take (me|us|the|a|that|this)|bring (me|us)|switch|change|slow|speed"
    r"|keep|make|move|merge|follow|stay|continue|wait|find|swing|flip|double)\b"
)
"""Needs of a passenger that concern the driver; other business is the passenger's own."""

_CUT_OFF = re.compile(r"\b(of|for|to|and|a|an|the|with|some|his|her|their)$")
_BEFORE_NAMES = frozenset({"to", "at", "for", "so", "and", "now", "then", "next", "yes", "no", "okay", "well", "oh"})
_FUNCTION_WORD = re.compile(
    r"(an?|the|this|that|these|those|or|but|on|in|of|with|from|by|up|down|it|is|are|was|be|been|has|have|had|you|me|we"
    r"|he|she|they|him|her|us|them|my|your|our|who|what|where|when|how|there|here|please|just)",
    re.I,
)
"""Words that the recogniser may put in the place of a name, with its capital."""

_OVER = frozenset({GoalStatus.ABANDONED, GoalStatus.COMPLETE})


def remember(state: CoWizardState, heard: HeardUtterance, rng: np.random.Generator) -> None:
    """Records the item or person of an errand that the participant has mentioned, and perhaps repeats it.

    Args:
        state: working copy of the state, after the reaction to the utterance.
        heard: the utterance.
        rng: random generator of the decision.
    """
    told = _told(state, heard)
    if told is None or told in state.beliefs.told:
        return
    state.beliefs = state.beliefs.with_told(told)
    if rng.random() < state.style.recalls and len(state.speech.queue) < 2:
        wording = None if state.speech.idle else Wording(topic="purpose_too")
        joined = not state.speech.idle
        state.say(intend(Function.POSITIVE_FEEDBACK, told, elided=("place",), wording=wording, joined=joined))


def note_owner(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> None:
    """Records the owner of the house that the participant wants to go to: "Mateo" of "go to Mateo's house"."""
    about = [act.slots for act in heard.acts if LandmarkName.HOUSE in act.slots]
    if not any(GoalStatus.PENDING not in slots and not _OVER & slots for slots in about):
        return
    done = any(_OVER & act.slots for act in heard.acts)
    found = _OWNER.search(heard.words.text)
    if found is not None:
        first, _, rest = found["owner"].partition(" ")
        name = rest if rest and first.lower() in _BEFORE_NAMES else found["owner"]
        owner = _OF_SPEAKER.sub("your ", name)
        if state.beliefs.owner is not None and owner != state.beliefs.owner:
            state.beliefs = state.beliefs.without_look()
        state.beliefs = state.beliefs.with_owner(owner)
    elif done or state.beliefs.goal is not LandmarkName.HOUSE or _names_another_street(state, view, heard):
        state.beliefs = state.beliefs.with_owner(None)  # another house than the last one


def _names_another_street(state: CoWizardState, view: CoWizardView, heard: HeardUtterance) -> bool:
    """Returns whether a house is said to be on another street than the one that the car is on its way to."""
    place, known = state.beliefs.place, set(state.beliefs.streets)
    if state.beliefs.exact and place is not None:
        known = {street_of(view.raw, state.town, place[0])}
    named = {street for act in heard.acts if LandmarkName.HOUSE in act.slots for street in act.values(Slot.STREET)}
    return bool(named and known) and named.isdisjoint(known)


def note_friend(state: CoWizardState, heard: HeardUtterance) -> None:
    """Records the name of the person that the participant wants to go to: "Priya" of "go to my friend Priya"."""
    about = [act.slots for act in heard.acts if LandmarkName.PERSON in act.slots]
    if not any(GoalStatus.PENDING not in slots and not _OVER & slots for slots in about):
        return
    found = _FRIEND.search(heard.words.text)
    if found is not None and not _is_no_name(found["friend"]):
        if state.beliefs.friend is not None and found["friend"] != state.beliefs.friend:
            state.beliefs = state.beliefs.without_look()
        state.beliefs = state.beliefs.with_friend(found["friend"])
    elif any(_OVER & act.slots for act in heard.acts) or state.beliefs.goal is not LandmarkName.PERSON:
        state.beliefs = state.beliefs.with_friend(None)  # somebody else than the last one


def _is_no_name(word: str) -> bool:
    """Returns whether a capital word is no name, but a word that the recogniser has put in the place of one."""
    return word.lower() in _BEFORE_NAMES or _FUNCTION_WORD.fullmatch(word) is not None


def without_purposes(heard: HeardUtterance) -> HeardUtterance:
    """Returns an utterance without the steps that a purpose seems to ask for: "I have to collect Mila"."""
    tells = any(act.move is DialogueMove.EXPLAIN and not act.slots for act in heard.acts)
    clause = _CLAUSE.search(heard.words.text) if heard.words.plan else None
    if clause is None or (not tells and _DRIVES.match(clause["errand"]) is not None):
        return heard
    rest = f"{heard.words.text[: clause.start()]} {heard.words.text[clause.end() :]}"
    return replace(heard, words=replace(heard.words, plan=understand(rest.strip(" ,.")).plan))


def _told(state: CoWizardState, heard: HeardUtterance) -> Proposition | None:
    """Returns the item or person of an errand that an utterance mentions; None if it mentions neither."""
    if not any(act.move in _TELLING for act in heard.acts) or any(_OVER & act.slots for act in heard.acts):
        return None
    named = [value for act in heard.acts for value in act.values(Slot.LANDMARK)]
    place = act_builders.first_name(named) or state.beliefs.goal
    clause = _CLAUSE.search(heard.words.text)
    if place is None or clause is None or understand(clause["errand"]).actions:
        return None  # "I need you to take the next right" does not describe an errand
    purpose = read_purpose(clause["errand"])
    item = _OF_SPEAKER.sub("your ", purpose.items[0]) if purpose.items else None
    if item is not None and _CUT_OFF.search(item) is not None:
        item = None  # its end was not heard
    person = None if purpose.person is None else _OF_SPEAKER.sub("your ", purpose.person)
    return None if item is person is None else Proposition.of(Predicate.PURPOSE, place=place, item=item, person=person)


def told_of(state: CoWizardState, place: LandmarkName | None) -> Proposition | None:
    """Returns the participant's last statement about the errand at a place; None if there is none."""
    return next((told for told in reversed(state.beliefs.told) if told.get("place") is place), None)


def arrival_reminder(state: CoWizardState, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns, with some probability, a remark about the purpose of the stop."""
    told = told_of(state, state.beliefs.goal)
    stands_for_person = state.beliefs.goal is LandmarkName.PERSON and told is not None and told.get("item") is None
    if told is None or stands_for_person or rng.random() >= state.style.recalls:
        return ()
    return (intend(Function.INFORM, told, elided=("place",), wording=Wording(topic="come_for"), joined=True),)


def kept_for_later(state: CoWizardState, place: LandmarkName) -> Remark:
    """Returns the acceptance of a task for later; mentions its item if that is known."""
    later, told = act_builders.errand(place, GoalStatus.PENDING), told_of(state, place)
    if told is None or told.get("item") is None:
        return intend(Function.ACCEPT, later)
    return intend(Function.ACCEPT, told.without("person"), later, wording=Wording(topic="later_purpose"))
