"""Sentences for the recogniser's language model: transcripts of played sessions, and samples of the grammar.

Transcripts have the frequencies of real sessions, and the grammar adds sentences that they lack. Names are exchanged in
both, because which of the streets is named is not a matter of language.
"""

from __future__ import annotations

import functools
import gzip
from collections.abc import Sequence
from importlib import resources
from typing import Final

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.grammar import load_grammar
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.nlg import word_act
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.dialogue.speaker_style import draw_style
from dorothie_gym.errors import SpeechError
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import SLOT_VALUES, LandmarkName, Slot, SlotValue, StreetName
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.tasks.parsing import load_template, template_names

TRANSCRIPTS_FILE: Final = "transcripts.txt.gz"
"""Utterances of sessions, one per line, spans separated by " | "; written by `benchmarks/speech_transcripts.py`."""

SAMPLES: Final = 300
"""Sentences of each move and role that are drawn from the grammar."""

_NAMED: Final = (LandmarkName, StreetName)


@functools.cache
def transcripts() -> tuple[tuple[str, ...], ...]:
    """Returns the spans of each utterance of the shipped transcripts.

    Raises:
        SpeechError: the file is damaged.
    """
    path = resources.files("dorothie_gym.speech").joinpath("data", TRANSCRIPTS_FILE)
    try:
        text = gzip.decompress(path.read_bytes()).decode("utf-8")
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise SpeechError(f"{TRANSCRIPTS_FILE}: is damaged ({error}); install the package again") from error
    return tuple(tuple(line.split(" | ")) for line in text.splitlines() if line)


@functools.cache
def grammar_sentences(seed: int = 0, samples: int = SAMPLES) -> tuple[str, ...]:
    """Returns sentences of the grammar, for each move and speaker, with drawn slot values, details and styles.

    Args:
        seed: seed of the draws.
        samples: number of sentences of each move and speaker.
    """
    rng = np.random.default_rng([seed, 7])
    sentences = []
    topics = sorted({t.topic for templates in load_grammar().templates.values() for t in templates if t.topic})
    for move in DialogueMove:
        for role in (Role.PARTICIPANT, Role.CO_WIZARD):
            for number in range(samples):
                if number % 20 == 0:
                    style = draw_style(role, rng)
                act = DialogueAct(move, frozenset(_values(move, rng)))
                scene = WordingContext(mentioned=frozenset(act.slots) if rng.random() < 0.3 else frozenset())
                sentences.append(word_act(act, role, rng, _wording(topics, rng), style=style, scene=scene))
    return tuple(sentences)


def _values(move: DialogueMove, rng: np.random.Generator) -> list[SlotValue]:
    if move in (DialogueMove.IRRELEVANT, DialogueMove.ALIGN, DialogueMove.CONFUSE):
        return []
    slots = (Slot.ACTION, Slot.LANDMARK, Slot.STREET, Slot.OBJECT, Slot.STATUS)
    wanted = [slot for slot, share in zip(slots, (0.45, 0.35, 0.3, 0.15, 0.1), strict=True) if rng.random() < share]
    return [SLOT_VALUES[slot][int(rng.integers(len(SLOT_VALUES[slot])))] for slot in wanted]


def _wording(topics: Sequence[str], rng: np.random.Generator) -> Wording:
    """Returns drawn details; without a proposition, so that topics that need one fall back to plain words."""
    ways = (Direction.LEFT, Direction.RIGHT, Direction.STRAIGHT)
    return Wording(
        direction=ways[int(rng.choice(3, p=[0.45, 0.45, 0.1]))],
        ordinal=int(rng.integers(1, 6)) if rng.random() < 0.3 else None,
        faster=bool(rng.random() < 0.5),
        speed=5.0 * int(rng.integers(2, 13)) if rng.random() < 0.3 else None,
        lights=bool(rng.random() < 0.7),
        distance=10.0 * int(rng.integers(2, 30)) if rng.random() < 0.1 else None,
        here=bool(rng.random() < 0.1),
        topic=topics[int(rng.integers(len(topics)))] if rng.random() < 0.4 else None,
    )


# --- Names ----------------------------------------------------------------------------------------------------------


@functools.cache
def spoken_names(slot: Slot) -> tuple[tuple[str, ...], ...]:
    """Returns the spoken words of the proper names of landmarks or streets, one per value ("k f c", "burger king")."""
    found = []
    for value in SLOT_VALUES[slot]:
        if value.label not in ("Unknown", "Queried"):
            name = next((each for each in load_lexicon().forms(value, "say") if each.split()[-1][0].isupper()), "")
            words = tuple(spoken_words(" ".join(word for word in name.split() if word[0] not in "at")))
            if words:
                found.append(words)
    return tuple(found)


def with_names_exchanged(words: Sequence[str], rng: np.random.Generator) -> list[str] | None:
    """Returns a sentence with each name of a street or landmark replaced by a drawn one; None without a name."""
    changed: list[str] = []
    place, found = 0, False
    while place < len(words):
        name, names = _name_at(words, place)
        if name:
            changed += names[int(rng.integers(len(names)))]
            found = True
        else:
            changed.append(words[place])
        place += len(name) or 1
    return changed if found else None


def _name_at(words: Sequence[str], place: int) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    for slot in (Slot.LANDMARK, Slot.STREET):
        for name in spoken_names(slot):
            if tuple(words[place : place + len(name)]) == name:
                return name, spoken_names(slot)
    return (), ()


@functools.cache
def known_words() -> frozenset[str]:
    """Returns the spoken words of the lexicon and of the storyboards, including names of people."""
    texts = [phrase for forms in load_lexicon().phrases.values() for listed in forms.values() for phrase in listed]
    for template in map(load_template, template_names()):
        for subgoal in template.subgoals:
            texts += [subgoal.description, subgoal.reason or ""]
    return frozenset(word for text in texts for word in spoken_words(text.replace("{", " ").replace("}", " ")))
