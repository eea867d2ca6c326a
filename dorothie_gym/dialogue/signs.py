"""Signs in front of what is said: interjections, calls, apologies, and the "yes" or "no" that answers nobody.

"Oh look, stop here" is an order and "sorry, left" as well, though an "oh" or a "sorry" alone only shows that something
was heard.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.lexicon import read_data, split_words
from dorothie_gym.dialogue.route_grammar import PhraseIndex, phrase_index

if TYPE_CHECKING:
    from dorothie_gym.ontology.dialogue_acts import DialogueMove

_FILE: Final = "signs.yaml"
_LEAST: Final = 2
"""Words that must be left."""

_DETERMINING: Final = frozenset(
    [
        "need",
        "more",
        "turning",
        "stopping",
        "parking",
        "faster",
        "quicker",
        "fast",
        "quick",
        "slower",
        "lights",
        "u",
        "idea",
    ]
)
"""Words behind which "no" belongs to what follows."""


@functools.cache
def _signs() -> dict[str, PhraseIndex]:
    data = read_data(_FILE)
    return {kind: phrase_index(_FILE, data, kind, adverbs=False) for kind in ("always", "opening")}


def is_mere_sign(text: str) -> bool:
    """Returns whether a text consists of interjections and calls for attention only: "oh look"."""
    words, place = [word for word in split_words(text) if word != ","], 0
    while place < len(words):
        found = _signs()["always"].longest(words, place)
        if found is None:
            return False
        place += found.length
    return bool(words)


def behind_signs(text: str, after: DialogueMove | None) -> str:
    """Returns what follows the signs at the beginning of a text; "" if it has none, or little else.

    Args:
        text: words of an utterance.
        after: move of the other speaker before it, to which a "yes" or "no" reacts.
    """
    words, place = split_words(text), 0
    while place < len(words):
        if words[place] == ",":
            place += 1
            continue
        kinds = ("always", "opening") if after is None else ("always",)
        lengths = [found.length for kind in kinds if (found := _signs()[kind].longest(words, place)) is not None]
        following = words[place + 1 : place + 2]
        answered = bool(lengths) and words[place + max(lengths) : place + max(lengths) + 1] == [","]
        if answered and _signs()["always"].longest(words, place) is None:
            break  # "no, don't stop" answers
        if not lengths or (words[place] == "no" and max(lengths) == 1 and not _DETERMINING.isdisjoint(following)):
            break
        place += max(lengths)
    return " ".join(words[place:]) if 0 < place <= len(words) - _LEAST else ""
