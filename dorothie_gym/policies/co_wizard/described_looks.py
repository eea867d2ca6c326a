"""Looks of the goal as the participant describes them: taken up, repeated, and compared with what is in view."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.looks import Appearance, read_look
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.routes import DrivingPlan, PlanStep, StepAction
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, Slot
from dorothie_gym.policies.co_wizard.acknowledgement import sign_of_hearing
from dorothie_gym.policies.co_wizard.destinations import aim
from dorothie_gym.policies.place_looks import look_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.heard_utterance import HeardUtterance

_MOVES: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.INSTRUCT, DialogueMove.REPLY_W, DialogueMove.CLARIFY})
_SOMEBODY: Final = re.compile(r"\blook (?:out )?for (?:somebody|someone|a person)\b", re.IGNORECASE)
"""Beginning of a description of a person, also where its colours were misheard."""

_SEEKING: Final = frozenset({StepAction.VISIT, StepAction.STRAIGHT, StepAction.STOP})
_DESCRIBED: Final = frozenset({LandmarkName.HOUSE, LandmarkName.PERSON, ObjectClass.PEDESTRIAN})

_ORDERS: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.STOP, ActionValue.LANE_SWITCH})


def looks_heard(state: CoWizardState, heard: HeardUtterance) -> dict[int, Appearance]:
    """Returns the looks of the goal that acts of an utterance describe, by the numbers of the acts.

    What identifies the goal is no order, also where it is put as one: "look for the yellow house".
    """
    found: dict[int, Appearance] = {}
    for number, act in enumerate(heard.acts):
        orders = _ORDERS & set(act.values(Slot.ACTION)) or act.values(Slot.STREET) or act.values(Slot.STATUS)
        words = heard.words_of(number)
        if act.move in _MOVES and not orders and words.distance is None:
            text = words.text
            look = read_look(text)
            person = state.beliefs.goal is LandmarkName.PERSON
            if (look.stated and _kind_of(look) is state.beliefs.goal) or (person and _SOMEBODY.search(text)):
                found[number] = look
    return found


def without_looks(heard: HeardUtterance, looks: dict[int, Appearance]) -> HeardUtterance:
    """Returns an utterance without the steps that some of its acts seem to ask for, because they describe a look."""
    steps = tuple(step for step in heard.words.plan if not (looks and _only_identifies(step)))
    return replace(heard, words=replace(heard.words, plan=DrivingPlan(steps)))


def _only_identifies(step: PlanStep) -> bool:
    """Returns whether a step only names the house or the person that is described: "look for somebody in red"."""
    places = {place.landmark for place in step.places} | {place.object for place in step.places}
    return step.action in _SEEKING and not places.isdisjoint(_DESCRIBED)


def take_up_look(state: CoWizardState, look: Appearance, rng: np.random.Generator) -> None:
    """Remembers a look of the goal, and repeats it or shows that it was heard."""
    state.beliefs = state.beliefs.with_look(look)
    state.intentions = state.intentions if state.intentions.arrived else state.intentions.resumed()
    if look.stated and rng.random() < state.style.echoes:
        seen = Proposition.of(Predicate.LOOKS, place=state.beliefs.goal, feature=look.listed)
        state.say(intend(Function.POSITIVE_FEEDBACK, seen, elided=("place",), wording=Wording(topic="look")))
    elif rng.random() > state.style.silent:
        state.say(sign_of_hearing("told"))


def compare_looks(state: CoWizardState, view: CoWizardView) -> None:
    """Compares the houses or people of the map that are in view with the description of the goal."""
    beliefs, described = state.beliefs, state.beliefs.look
    if described is None or not described.stated or state.intentions.arrived:
        return
    seen = [
        (mark, look)
        for mark in view.landmarks_in_view
        if mark.name is beliefs.goal and mark.place not in beliefs.ruled_out and (look := look_of(state.town, mark))
    ]
    wrong = tuple(mark.place for mark, look in seen if described.contradicts(look))
    if wrong:
        state.beliefs = beliefs = replace(beliefs, ruled_out=(*beliefs.ruled_out, *wrong))
    if beliefs.exact and beliefs.place in wrong:
        state.beliefs = beliefs.without_place()
        state.route = state.route.with_progress(None)
        other = Proposition.of(Predicate.LOOKS, place=beliefs.goal, feature=described.listed, negated=True)
        state.say(intend(Function.INFORM, other, elided=("place",), wording=Wording(topic="other_look")))
        return
    fitting = [mark for mark, look in seen if described.fits(look)]
    if len(fitting) == 1 and not beliefs.exact:
        aim(state, view, fitting[0])


def _kind_of(look: Appearance) -> LandmarkName:
    return LandmarkName.PERSON if look.coat is not None or look.trousers is not None else LandmarkName.HOUSE
