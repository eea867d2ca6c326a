"""Training of the tagger of spans: its sentences, and weights that are equal for equal seeds."""

from __future__ import annotations

import itertools
import json
import random
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.span_sentences import (
    FOLDER,
    LabelledSpan,
    Sentence,
    compositions,
    example,
    grammar_sentences,
    read_training_sentences,
    variants,
)
from dorothie_gym.dialogue.span_tagger import unpack
from dorothie_gym.ontology import ActionValue, DialogueMove
from dorothie_gym.ontology.spellings import parse_move

SENTENCE = Sentence(
    (
        LabelledSpan("the road's closed,", DialogueMove.EXPLAIN, frozenset()),
        LabelledSpan("turn left instead.", DialogueMove.INSTRUCT, frozenset({ActionValue.J_TURN})),
    ),
    DialogueMove.CONFIRM,
)


def test_no_training_sentence_is_one_of_the_test_set() -> None:
    tested = {_plain(json.loads(line)["text"]) for line in (FOLDER / "sentences.jsonl").read_text().splitlines()}
    rows = [json.loads(line) for line in (FOLDER / "train.jsonl").read_text(encoding="utf-8").splitlines()]
    trained = [_plain(" ".join(act["text"] for act in row["acts"])) for row in rows]
    assert len(trained) > 2000
    assert not [text for text in trained if text in tested and len(text.split()) > 2]
    assert len({row["id"] for row in rows}) == len(rows)


def _plain(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum() or letter == " ").strip()


def test_every_move_has_training_sentences() -> None:
    rows = map(json.loads, (FOLDER / "train.jsonl").read_text(encoding="utf-8").splitlines())
    assert {parse_move(act["move"]) for row in rows for act in row["acts"]} == set(DialogueMove)


def test_labels_begin_where_spans_begin() -> None:
    found = example(SENTENCE)
    explain, instruct = 2 * DialogueMove.EXPLAIN, 2 * DialogueMove.INSTRUCT
    assert found.labels == (explain, explain + 1, explain + 1, instruct, instruct + 1, instruct + 1)
    assert len(found.features.words) == len(found.labels)
    assert found.features.after is DialogueMove.CONFIRM
    assert [(span.begin, span.end, sum(span.named)) for span in found.actions] == [(0, 3, 0), (3, 6, 1)]
    unlabelled = Sentence(tuple(span._replace(actions=None) for span in SENTENCE.spans))
    assert example(unlabelled).actions == ()


def test_variants_keep_the_moves_and_compositions_join_no_equal_neighbours() -> None:
    rng, noise = random.Random(3), np.random.default_rng(3)
    found = variants(SENTENCE, rng, noise)
    assert [span[1:] for span in found[0].spans] == [span[1:] for span in SENTENCE.spans]
    assert found[0].text == "the road's closed turn left instead"
    others = grammar_sentences(60, 1)
    made = list(compositions([SENTENCE, *others], 50, rng))
    assert len(made) == 50
    for sentence in made:
        moves = [span.move for span in sentence.spans]
        assert len(moves) > 1
        assert all(move is not other or move is DialogueMove.INSTRUCT for move, other in itertools.pairwise(moves))


def test_grammar_sentences_are_equal_for_equal_seeds() -> None:
    assert grammar_sentences(12, 5) == grammar_sentences(12, 5) != grammar_sentences(12, 6)


@pytest.mark.long
def test_weights_are_reproducible_and_learn() -> None:
    training = pytest.importorskip("benchmarks.span_training")
    config = replace(training.TrainingConfig(), epochs=8, composed=10, sampled=10, seed=4)
    sentences = grammar_sentences(60, 2)
    examples, weights = training.training_examples(sentences, config)
    table = training.shipped_vectors()
    first, again = (training.packed(training.train(examples, weights, table, config)) for _ in range(2))
    assert first == again
    tagger = unpack(first)
    right = [tagger.tag(row.features, *tagger.encode(row.features))[0][0] == row.labels[0] for row in examples]
    assert sum(right) > 0.6 * len(right)


@pytest.mark.slow
def test_script_gives_weights_as_good_as_the_shipped_ones() -> None:
    training = pytest.importorskip("benchmarks.span_training")
    config = training.TrainingConfig()
    examples, weights = training.training_examples(read_training_sentences(), config)
    data = training.packed(training.train(examples, weights, training.shipped_vectors(), config))
    people = [example(sentence) for sentence in read_training_sentences(FOLDER / "sentences.jsonl", split="dev")]
    _, new = training.compare(data, people)
    _, shipped = training.compare(training.TARGET.read_bytes(), people)
    assert max(abs(a - b) for a, b in zip(new, shipped, strict=True)) < 0.03
