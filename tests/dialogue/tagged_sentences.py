"""Sentences of people, and what the tagger of spans makes of them; a process that needs no more imports no more."""

from __future__ import annotations

import json
from pathlib import Path

from dorothie_gym.dialogue import guess_spans
from dorothie_gym.dialogue.dialogue_act_classifier import rule_spans
from dorothie_gym.dialogue.span_features import span_features
from dorothie_gym.dialogue.span_inputs import SpanFeatures
from dorothie_gym.dialogue.span_tagger import load_tagger
from dorothie_gym.ontology import DialogueMove

PEOPLE = Path(__file__).parents[2] / "benchmarks" / "people" / "sentences.jsonl"
SAID = [
    "Turn left.",
    "it's so dark out here put your lights on would you",
    "no not that one the next one",
    "we take the second right and then my house is by the pond",
    "well hello there, could you run me over to the Burger King?",
    "hm",
    "\u2014 \u2026 ?",
    "I said Hubbard, not Beal!",
]


def features_of(text: str, after: DialogueMove | None = None) -> SpanFeatures:
    return span_features(rule_spans(text, after), after)


def sentences(number: int) -> list[tuple[str, list[str]]]:
    """Returns sentences of the development half with their moves."""
    rows = [json.loads(line) for line in PEOPLE.read_text(encoding="utf-8").splitlines()]
    return [
        (row["text"], [act["move"] for act in row["acts"]])
        for row in rows
        if row["split"] == "dev" and not row["before"]
    ][:number]


def fingerprint() -> str:
    """Returns the scores of sentences as text."""
    tagger = load_tagger()
    texts = [text for text, _ in sentences(120)] + SAID
    features = [features_of(text) for text in texts]
    tags = [tagger.tag(each, *tagger.encode(each)) for each in features]
    return json.dumps([tags, [[str(span.act) for span in guess_spans(text)] for text in texts]])
