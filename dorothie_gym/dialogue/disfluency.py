"""Disfluencies: hesitations and restarts of a speaker, and their removal from a text.

Filled pauses mostly occur at the beginning of a phrase, and restarts repeat its first words (Shriberg, Preliminaries to
a Theory of Speech Disfluencies, 1994; Clark and Fox Tree, Cognition 84, 2002). A withdrawn name ("the KFC, no, the
Ikea") is also a disfluency.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable

from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.ontology.slots import SLOT_VALUES, Slot

FILLED_PAUSES = ("uh", "um", "er", "erm", "hmm", "hm")
"""Filled pauses."""

_AT_FRONT = 0.5
"""Share of hesitations at the beginning of the sentence; the others follow its first words."""

_LEAST_WORDS = 5
"""Minimum number of words of a sentence that a hesitation may interrupt."""

TITLES = frozenset({"mr.", "mrs.", "ms.", "dr.", "señora", "senora", "aunt", "uncle", "head", "teacher", "grandpa"})
"""Words in front of a name that no pause parts from it."""

_FILLER = rf"(?:{'|'.join(FILLED_PAUSES)})"
_RESTART = re.compile(rf"\b((?:[\w'-]+ ){{0,2}}[\w'-]+),? {_FILLER},? (?=\1\b)", re.IGNORECASE)
_PAUSE = re.compile(rf"(?:^|,? ){_FILLER}\b,?(?= |$)|^{_FILLER},? ", re.IGNORECASE)


def hesitating(body: str, filler: str, draw: Callable[[], float]) -> str:
    """Returns a sentence with a filled pause and, with some probability, a restart of its first words.

    Args:
        body: the sentence, without a full stop.
        filler: the filled pause, one of `FILLED_PAUSES`.
        draw: source of random numbers in [0, 1).
    """
    words = body.split()
    if len(words) < _LEAST_WORDS or draw() < _AT_FRONT:
        return f"{filler}, {body}"
    place = 1 + int(draw() * min(3, len(words) - 3))
    if words[place - 1].lower() in TITLES:
        place += 1  # "Mrs. Tamm" is one name
    said, rest = words[:place], words[place:]
    if said[-1].endswith(","):
        return " ".join([*said, f"{filler},", *rest])
    said[-1] += ","
    again = words[:place] if place <= 2 and draw() < 0.5 else []
    return " ".join([*said, f"{filler},", *again, *rest])


def fluent(text: str) -> str:
    """Returns a text without filled pauses, restarts and withdrawn names; the text itself if it has none.

    A text that consists of a filled pause only is left as it is.
    """
    kept = _withdrawn().sub("", _RESTART.sub("", text))
    kept = " ".join(_PAUSE.sub("", kept).split()).lstrip(", ")
    if not any(letter.isalnum() for letter in kept):
        return text
    return kept if kept == text or not text[0].isupper() else kept[0].upper() + kept[1:]


@functools.cache
def _withdrawn() -> re.Pattern[str]:
    """Returns the pattern of a name that another one corrects."""
    lexicon = load_lexicon()
    forms = {
        name
        for slot in (Slot.LANDMARK, Slot.STREET)
        for value in SLOT_VALUES[slot]
        for form in ("say", "also")
        for name in lexicon.phrases[value].get(form, ())
    }
    names = "|".join(re.escape(name) for name in sorted(forms, key=lambda name: (-len(name), name)))
    repairs = "|".join(re.escape(words) for words in lexicon.repairs)
    return re.compile(rf"\b(?:{names}), (?:{repairs}) (?:{_FILLER}, )?(?=(?:{names})\b)", re.IGNORECASE)
