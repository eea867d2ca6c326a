"""Trained tagger of spans and actions: exact on every processor, no worse than the rules, and small."""

from __future__ import annotations

import io
import itertools
import os
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest

from dorothie_gym.dialogue import guess_spans
from dorothie_gym.dialogue.dialogue_act_classifier import rule_spans
from dorothie_gym.dialogue.span_features import masked_words
from dorothie_gym.dialogue.span_inputs import ACTIONS, MARKS
from dorothie_gym.dialogue.span_tagger import (
    DILATIONS,
    WEIGHTS_FILE,
    SpanTagger,
    load_tagger,
    unpack,
    word_row,
)
from dorothie_gym.ontology import ActionValue, DialogueMove
from tests.dialogue.tagged_sentences import PEOPLE, SAID, features_of, fingerprint, sentences
from tests.portability.processors import SETTINGS, TOGETHER


def encoded(tagger: SpanTagger, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the values of the words and the summary, in whole numbers of 64 bits, a word and a layer at a time."""
    values = inputs.astype(np.int64)
    number = len(values)
    for layer, dilation in enumerate(DILATIONS):
        kernel, shift = tagger.convolutions[layer].astype(np.int64), tagger.shifts[layer]
        padded = np.pad(values, ((dilation, dilation), (0, 0)))
        total = tagger.biases[layer] + sum(
            np.einsum("nk,kh->nh", padded[tap * dilation : tap * dilation + number], kernel[tap]) for tap in range(3)
        )
        found = np.maximum(total + (1 << (shift - 1)), 0) >> shift
        values = found if layer == 0 else values + found
    everything = np.concatenate((values.max(axis=0), values[0]))
    summary = tagger.pooled_bias + np.einsum("k,kh->h", everything, tagger.pooled.astype(np.int64))
    return values, np.maximum(summary + (1 << (tagger.pooled_shift - 1)), 0) >> tagger.pooled_shift


def scores_of(tagger: SpanTagger, inputs: np.ndarray) -> np.ndarray:
    """Returns the scores of the labels, in whole numbers of 64 bits."""
    values, summary = encoded(tagger, inputs)
    both = np.concatenate((values, np.broadcast_to(summary, (len(values), len(summary)))), axis=1)
    return np.einsum("nk,km->nm", both, tagger.output.astype(np.int64)) + tagger.output_bias


def score_of(labels: tuple[int, ...], scores: np.ndarray, pairs: np.ndarray) -> int | None:
    """Returns the score of labels; None if they are no sequence of spans."""
    total, before = 0, -1
    for at, label in enumerate(labels):
        if label % 2 == 0:
            total += int(pairs[1 + before, label // 2])
        elif label // 2 != before:
            return None
        total += int(scores[at, label])
        before = label // 2
    return total


def test_spans_have_all_the_words_of_the_text() -> None:
    for text, _ in [*sentences(80), *((text, []) for text in SAID)]:
        assert " ".join(span.text for span in guess_spans(text)) == " ".join(text.split())
    assert guess_spans("  ") == ()


def test_tagger_mends_more_sentences_than_it_spoils() -> None:
    mended = spoilt = 0
    for text, moves in sentences(300):
        by_rules = [span.act.move.label for span in rule_spans(text)] == moves
        tagged = [span.act.move.label for span in guess_spans(text)] == moves
        mended += tagged and not by_rules
        spoilt += by_rules and not tagged
    assert mended > 1.2 * spoilt
    assert mended >= 8


def test_labels_are_the_best_of_all_by_independent_sums() -> None:
    tagger = load_tagger()
    for text, after in (("turn left then stop", None), ("yes please", DialogueMove.QUERY_YN), ("hm", None)):
        features = features_of(text, after)
        labels, best, said = tagger.tag(features, *tagger.encode(features))
        scores = scores_of(tagger, tagger.inputs(features))
        moves = np.argsort(-scores.reshape(len(scores), -1, 2).max(axis=(0, 2)), kind="stable")[:5]
        likely = [2 * int(move) + inside for move in moves for inside in (0, 1)]
        paths = itertools.product(likely, repeat=len(scores))
        found = [score for path in paths if (score := score_of(path, scores, tagger.pairs)) is not None]
        assert score_of(tuple(labels), scores, tagger.pairs) == best >= max(found)
        ruled = [
            2 * tagger.moves.index(move) + (not begins)
            for move, begins in zip(features.moves, features.begins, strict=True)
        ]
        assert score_of(tuple(ruled), scores, tagger.pairs) == said


def test_actions_are_those_of_independent_sums() -> None:
    tagger = load_tagger()
    for text in ("stop on the left by the wall", "that bus is turning left up there", "hm"):
        features = features_of(text)
        values, summary = tagger.encode(features)
        wide, whole = encoded(tagger, tagger.inputs(features))
        assert np.array_equal(values, wide) and np.array_equal(summary, whole)
        for move, ruled in itertools.product((DialogueMove.INSTRUCT, DialogueMove.EXPLAIN), ((), (ACTIONS[3],))):
            scores = np.concatenate((wide.max(axis=0), whole)) @ tagger.acted.astype(np.int64) + tagger.acted_bias
            scores = scores + tagger.acted_moves[tagger.moves.index(move)]
            scores = scores + sum(tagger.acted_rules[ACTIONS.index(action)] for action in ruled)
            wanted = {
                action
                for action, score in zip(ACTIONS, scores, strict=True)
                if score > (-tagger.sure if action in ruled else tagger.sure)
            }
            assert tagger.actions(values, summary, move, frozenset(ruled)) == wanted


def test_actions_that_the_tagger_does_not_know_are_kept() -> None:
    tagger = load_tagger()
    features = features_of("which way now")
    values, summary = tagger.encode(features)
    assert ActionValue.QUERIED in tagger.actions(
        values, summary, DialogueMove.QUERY_W, frozenset({ActionValue.QUERIED})
    )


def test_features_mask_names_and_numbers_and_keep_marks() -> None:
    assert masked_words(["the", "burger", "king's", "on", "baits", "at", "25"]) == [
        "the", "#landmark", "#+", "on", "#street", "at", "#number",
    ]  # fmt: skip
    features = features_of("Left, at the Shell!", DialogueMove.QUERY_W)
    assert features.words == ("left", "at", "the", "#landmark")
    assert [MARKS[mark] for mark in features.marks] == [",", "", "", "!"]
    assert features.begins[0]
    assert features_of("\u2014 \u2026").words == ("-", "-")


def test_unknown_words_are_looked_up_without_their_endings() -> None:
    rows = {"street": 0, "driving": 1}
    assert [word_row(word, rows) for word in ("streets", "street's", "drivin'")] == [0, 0, 1]
    assert word_row("#landmark", rows) == 2 != word_row("zyzzyva", rows)


def test_weights_are_small_whole_numbers_without_pickles() -> None:
    data = resources.files("dorothie_gym.dialogue").joinpath("data", WEIGHTS_FILE).read_bytes()
    assert len(data) <= 300_000
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        assert all(file[name].dtype.kind in "iu" for name in file.files)
    tagger = unpack(data)
    assert set(tagger.moves) == set(DialogueMove)
    # The largest sums stay far below 2^31.
    largest = max(int(np.abs(weights.astype(np.int64)).sum(axis=(0, 1)).max()) for weights in tagger.convolutions)
    assert largest * 4096 < 2**31


@pytest.mark.long
@pytest.mark.parametrize("name", [*TOGETHER, "machine code for any processor"])
def test_scores_are_equal_on_other_processors(name: str) -> None:
    command = [sys.executable, "-c", "from tests.dialogue.tagged_sentences import fingerprint; print(fingerprint())"]
    environment = {**os.environ, **SETTINGS[name], "PYTHONPATH": str(PEOPLE.parents[2])}
    done = subprocess.run(command, env=environment, cwd=PEOPLE.parents[2], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == fingerprint()
