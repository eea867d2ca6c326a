"""Remarks of the participant about the trip that need no "okay": how it goes, and how far it is."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.policies.co_wizard.acknowledgement import sign_of_hearing

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState

_PLEASED: Final = re.compile(
    r"\b(so far so good|going (well|smoothly|great|fine)|getting on nicely|doing (great|well|fine)"
    r"|(great|nice|good),? we)\b"
)
_IN_PASSING: Final = re.compile(
    r"\b(took (a while|its time|forever)|off again|(one|stop) more (to go )?after|last (one|stop)|the right way"
    r"|nearly there|almost there|getting close|all day|losing my patience|taking forever|wasting time"
    r"|let me (see|check)|my (map|list))\b"
)
_MISSED: Final = re.compile(r"\b(too far|gone past|went past|drove past|passed it|missed it)\b")
IN_SIGHT: Final = frozenset(
    {Predicate.WEATHER, Predicate.CROWDED, Predicate.SEES, Predicate.BLOCKED, Predicate.VISIBILITY, Predicate.LIGHTS_ON}
)
"""Remarks on something that the car sees as well."""

_ANSWERED: Final = 0.5  # probability that praise is answered


def passes_over(state: CoWizardState, words: ParsedText, rng: np.random.Generator) -> bool:
    """Returns whether a statement is a remark in passing; answers praise, with some probability.

    Args:
        state: working copy of the state.
        words: the statement.
        rng: random generator of the decision.
    """
    text, last = words.text.lower(), state.speech.last
    if words.told is not None and last is not None and any(said.contains(words.told) for said in last.meaning):
        return True  # both have said the same
    if _IN_PASSING.search(text) is not None:
        return True
    praises = _PLEASED.search(text) is not None
    if praises and rng.random() < _ANSWERED:
        state.say(sign_of_hearing("praise"))
    return praises


def says_missed(words: ParsedText) -> bool:
    """Returns whether a statement says that the car has driven past the place."""
    return _MISSED.search(words.text.lower()) is not None


def is_called_dark(words: ParsedText) -> bool:
    """Returns whether a statement says that it is dark."""
    told = words.told
    if told is None or told.get("parameter") is not WeatherParameter.SUN_ALTITUDE_ANGLE:
        return False
    return told.get("high") is True
