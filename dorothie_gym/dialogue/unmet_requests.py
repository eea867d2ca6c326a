"""Requests that a car which only drives cannot carry out: off the road, against the law, or not about the drive."""

from __future__ import annotations

import functools
from typing import Final

from dorothie_gym.dialogue.lexicon import read_data, split_words
from dorothie_gym.dialogue.route_grammar import PhraseIndex, phrase_index

_FILE: Final = "unmet_requests.yaml"


@functools.cache
def _requests() -> PhraseIndex:
    return phrase_index(_FILE, read_data(_FILE), "requests", adverbs=False)


def unmet_request(text: str) -> str | None:
    """Returns why a request cannot be met: "off_road", "against_law" or "equipment"; None of other words.

    Args:
        text: words of an utterance.
    """
    words, requests = split_words(text), _requests()
    for place, word in enumerate(words):
        if requests.may_begin(word) and (found := requests.longest(words, place)) is not None:
            return found.kind
    return None
