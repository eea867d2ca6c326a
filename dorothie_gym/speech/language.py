"""Language of the sessions for recognition: trigrams, pronunciations and punctuation, in the user's cache."""

from __future__ import annotations

import functools
import gzip
import hashlib
import json
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from dorothie_gym.dialogue.lexicon import read_data
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.speech.grammar_sentences import grammar_sentences, known_words, transcripts, with_names_exchanged
from dorothie_gym.speech.pronunciation import dictionary_text, pronunciations, read_dictionary
from dorothie_gym.speech.punctuation import PunctuationModel
from dorothie_gym.speech.spoken_form import spoken_tokens, spoken_words
from dorothie_gym.speech.trigrams import estimate
from dorothie_gym.support.user_cache import cache_folder, read_signed, write_signed

TRANSCRIPT_WEIGHT: Final = 3.0
"""Weight of a transcript relative to a sentence of the grammar, whose frequencies are not those of talk."""

EXCHANGED: Final = (4, 0.25)
"""Number and weight of the copies of a transcript in which names are exchanged."""

VERSION: Final = 2
"""Version of the cached files; changes with the code that makes them."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SpokenLanguage:
    """Language model and dictionary of a recogniser.

    Attributes:
        arpa: trigrams in the ARPA format.
        dictionary: pronunciations in CMU's format.
    """

    arpa: str
    dictionary: str


def weighted_sentences() -> Iterator[tuple[list[str], float]]:
    """Yields the spoken words of the sentences that the language model is made of, with their weights."""
    rng = np.random.default_rng(11)
    copies, weight = EXCHANGED
    for spans in transcripts():
        for span in spans:
            words = spoken_words(span)
            yield words, TRANSCRIPT_WEIGHT
            for _ in range(copies):
                changed = with_names_exchanged(words, rng)
                if changed is not None:
                    yield changed, weight * TRANSCRIPT_WEIGHT
    for sentence in grammar_sentences():
        yield spoken_words(sentence), 1.0


def build_language(dictionary: Path, phonemes: Callable[[str], str]) -> SpokenLanguage:
    """Returns the language model and dictionary; takes a few seconds.

    Args:
        dictionary: CMU's dictionary.
        phonemes: phonemes of a text, as in `HibariSynthesizer.phonemes`.
    """
    sentences = [(words, weight) for words, weight in weighted_sentences() if words]
    vocabulary = {word for words, _ in sentences for word in words} | known_words()
    sounds = pronunciations(sorted(vocabulary), read_dictionary(dictionary), phonemes)
    kept = [(words, weight) for words, weight in sentences if all(word in sounds for word in words)]
    return SpokenLanguage(estimate(kept, sounds).arpa(), dictionary_text(sounds))


def load_language(dictionary: Path, phonemes: Callable[[str], str]) -> SpokenLanguage:
    """Returns the language as `build_language`, from the user's cache if it was built before of equal content."""
    made = _cached("language", _content(), lambda: _as_dict(build_language(dictionary, phonemes)))
    return SpokenLanguage(made["arpa"], made["dictionary"])


@functools.cache
def punctuation_model() -> PunctuationModel:
    """Returns the model of punctuation, from transcripts and grammar; cached as `load_language`."""
    return PunctuationModel.from_texts(_cached("punctuation", _content(), _punctuation))


def _punctuation() -> dict[str, str]:
    sentences = [(spoken_tokens(span), TRANSCRIPT_WEIGHT) for spans in transcripts() for span in spans]
    sentences += [(spoken_tokens(sentence), 1.0) for sentence in grammar_sentences()]
    return PunctuationModel.learn(sentences).texts()


def _content() -> str:
    """Returns the text that the models are built from: transcripts, grammar and lexicon."""
    data = (read_data(name) for name in ("lexicon.yaml", "styles.yaml"))
    return json.dumps([*read_talk_files().values(), *data, transcripts()])


def _as_dict(language: SpokenLanguage) -> dict[str, str]:
    return {"arpa": language.arpa, "dictionary": language.dictionary}


def _cached(kind: str, content: str, build: Callable[[], dict[str, str]]) -> dict[str, str]:
    """Returns texts by name from the cache, or builds and caches them; `content` determines them."""
    folder = cache_folder()
    if folder is None:
        return build()
    name = hashlib.sha256(f"{VERSION}\n{content}".encode()).hexdigest()[:32]
    path = folder / "speech" / f"{kind}-{name}"
    found = read_signed(path)
    if found is not None:
        texts: dict[str, str] = json.loads(gzip.decompress(found))
        return texts
    made = build()
    try:
        write_signed(path, gzip.compress(json.dumps(made).encode(), compresslevel=3, mtime=0))
    except OSError as error:
        _log.warning("%s: cannot be written (%s); it will be built in each process", path, error)
    return made
