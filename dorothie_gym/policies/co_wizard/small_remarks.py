"""Remarks of the participant about the trip that need no "okay": how it goes, and how far it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.dialogue.reactions import is_in_passing, is_praise, says_missed
from dorothie_gym.ontology.slots import GoalStatus, ObjectClass, Slot
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import sign_of_hearing
from dorothie_gym.policies.co_wizard.answers import switch_lights_on
from dorothie_gym.policies.co_wizard.repairs import hear_wrong_way
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.view_range import camera_fault

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView
    from dorothie_gym.policies.speech import Remark

IN_SIGHT: Final = frozenset(
    {Predicate.WEATHER, Predicate.CROWDED, Predicate.SEES, Predicate.BLOCKED, Predicate.VISIBILITY, Predicate.LIGHTS_ON}
)
"""Remarks on something that the car sees as well."""

_ANSWERED: Final = 0.5  # probability that praise is answered


def take_statement(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Reacts to a statement that changes no destination.

    Args:
        state: working copy of the state.
        view: observation.
        act: the statement.
        words: its words.
        rng: random generator of the decision.
    """
    landmarks, statuses = act_builders.named_landmarks(act), act.values(Slot.STATUS)
    name = landmarks[0] if landmarks else None
    if "wrong" in words.text.lower():
        state.feel(Happening.WRONG_WAY, view.time)
        hear_wrong_way(state, view)
    elif is_called_dark(words) and not view.lights:
        switch_lights_on(state)
    elif GoalStatus.PENDING in statuses and name is not None:
        state.beliefs = state.beliefs.with_status(name, GoalStatus.PENDING)
        state.say(sign_of_hearing("told"))
    elif passes_over(state, words, rng):
        return
    elif ObjectClass.STATIC in act.values(Slot.OBJECT) or rng.random() < 0.55:
        state.say(sign_of_statement(words, sees=camera_fault(view.raw) is None))


def passes_over(state: CoWizardState, words: ParsedText, rng: np.random.Generator) -> bool:
    """Returns whether a statement is a remark in passing; answers praise, with some probability.

    Args:
        state: working copy of the state.
        words: the statement.
        rng: random generator of the decision.
    """
    last = state.speech.last
    if words.told is not None and last is not None and any(said.contains(words.told) for said in last.meaning):
        return True  # both have said the same
    if is_in_passing(words.text):
        return True
    praises = is_praise(words.text)
    if praises and rng.random() < _ANSWERED:
        state.say(sign_of_hearing("praise"))
    return praises


def sign_of_statement(words: ParsedText, *, sees: bool) -> Remark:
    """Returns the acknowledgement of a statement: of an apology, a miss, something visible, or news.

    Args:
        words: the statement.
        sees: whether the car sees what is around it.
    """
    visible = sees and words.told is not None and words.told.predicate in IN_SIGHT
    if "sorry" in words.text.lower().replace(",", " ").split():
        return sign_of_hearing("ordered")
    return sign_of_hearing("sorry" if says_missed(words.text) else "seen" if visible else "told")


def is_called_dark(words: ParsedText) -> bool:
    """Returns whether a statement says that it is dark."""
    told = words.told
    if told is None or told.get("parameter") is not WeatherParameter.SUN_ALTITUDE_ANGLE:
        return False
    return told.get("high") is True
