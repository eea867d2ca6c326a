"""Trained tagger of spans: cuts an utterance into spans, finds their moves and actions, where surer than the rules.

Convolutions over the words (Kim, EMNLP 2014), with the reading of the rules among their inputs, score the labels of
each word: begin or inside of a span, for each move. A chain of labels (a linear-chain conditional random field;
Lafferty et al., ICML 2001) with scores of move pairs finds the best sequence. A second layer scores the actions of the
car that each span names. Words have vectors of a table and of their letter groups (Bojanowski et al., TACL 2017).

All weights and sums are whole numbers, so that results are equal on every processor. `benchmarks/span_training.py`
trains the weights.
"""

from __future__ import annotations

import functools
import io
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.span_inputs import ACTIONS, MASKS, SpanFeatures
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.ontology.spellings import parse_move
from dorothie_gym.support.compilation import compiled

if TYPE_CHECKING:
    from collections.abc import Set as AbstractSet

WEIGHTS_FILE: Final = "span_tagger.npz"
"""Data file of the shipped weights."""

INPUT_BITS: Final = 5
"""Binary places of the inputs."""

HIDDEN_BITS: Final = 6
"""Binary places of the hidden values."""

KERNEL: Final = 3
"""Words under a convolution."""

DILATIONS: Final = (1, 2, 4)
"""Distances between the words of each convolution."""

BUCKETS: Final = 1024
"""Number of vectors for letter groups; a group's is chosen by its CRC-32."""

_GROUPS: Final = (3, 4)
"""Lengths of letter groups [letters]."""

_ENDINGS: Final = ("'s", "'ll", "'re", "'ve", "'d", "'m", "'", "s")
"""Endings without which an unknown word is looked up again."""

_NIBBLE: Final = 4
_CENTRE: Final = 8
"""Nibble that stands for zero."""

_STEP: Final = 12
"""Value of one nibble step, with INPUT_BITS binary places."""

_MARGIN: Final = 2.0
"""Lead in log odds with which the tagger overrules the rules; chosen by cross-validation (benchmarks/people)."""

_SURE: Final = 2.0
"""Log odds with which an action is added to those of the rules, or taken from them."""

_LOWEST: Final = -(2**30)

Whole = NDArray[np.int32]


@dataclass(frozen=True, kw_only=True, eq=False)
class SpanTagger:
    """Weights of the tagger, all whole numbers; h is the number of hidden values, m that of moves.

    Attributes:
        moves: the moves, in the order of the labels.
        words: row of each word in `vectors`; masks come behind the words, and then unknown words.
        vectors: vectors of words (n, d), int32.
        groups: vectors of letter groups (BUCKETS, g).
        marks, begins, rules, places, befores: vectors of marks, of the begin of a rules' span, of the rules' moves, of
            places (inner, first, last), and of the move before the utterance (none, or a move).
        convolutions: weights (KERNEL, inputs, h) of each convolution.
        biases: their biases (h,).
        shifts: binary places by which their sums are too long.
        pooled: weights (2 h + a, h) of the summary of the utterance.
        pooled_bias: its biases (h,).
        pooled_shift: binary places by which its sums are too long.
        output: weights (2 h, 2 m) of the labels: begin and inside of each move in turn.
        output_bias: their biases (2 m,).
        pairs: scores (1 + m, m) of a move behind the start, and behind each move.
        margin: lead by which the tagger overrules the rules.
        acted: weights (2 h, a) of the actions: of the largest values of a span, and of the summary.
        acted_bias: their biases (a,).
        acted_moves: scores (m, a) of the actions by the span's move.
        acted_rules: scores (a, a) of the actions by those of the rules.
        sure: score by which the tagger overrules the actions of the rules.
    """

    moves: tuple[DialogueMove, ...]
    words: Mapping[str, int]
    vectors: Whole
    groups: Whole
    marks: Whole
    begins: Whole
    rules: Whole
    places: Whole
    befores: Whole
    convolutions: tuple[Whole, ...]
    biases: tuple[Whole, ...]
    shifts: tuple[int, ...]
    pooled: Whole
    pooled_bias: Whole
    pooled_shift: int
    output: Whole
    output_bias: Whole
    pairs: Whole
    margin: int
    acted: Whole
    acted_bias: Whole
    acted_moves: Whole
    acted_rules: Whole
    sure: int

    def encode(self, features: SpanFeatures) -> tuple[Whole, Whole]:
        """Returns values (n, h) of the words, and a summary (h,) of the utterance."""
        inputs = self.inputs(features)
        number, hidden = len(features.words), len(self.pooled_bias)
        values = np.empty((len(DILATIONS) + 1, number, hidden), np.int32)
        before, held = inputs, values[0]
        for layer, dilation in enumerate(DILATIONS):
            _convolve(
                before, self.convolutions[layer], self.biases[layer], dilation, self.shifts[layer], layer > 0, held
            )
            before, held = held, values[layer + 1]
        summary = np.empty(hidden, np.int32)
        _summarise(before, self.pooled, self.pooled_bias, self.pooled_shift, summary)
        return before, summary

    def tag(self, features: SpanFeatures, values: Whole, summary: Whole) -> tuple[list[int], int, int]:
        """Returns the best labels of encoded words, their score, and that of the rules' labels."""
        number = len(values)
        scores = np.empty((number, 2 * len(self.moves)), np.int32)
        _score(values, summary, self.output, self.output_bias, scores)
        labels, rules = np.empty(number, np.int32), self._rules_labels(features)
        best, said = _decode(scores, self.pairs, rules, np.empty((number, len(self.moves)), np.int32), labels)
        return labels.tolist(), int(best), int(said)

    def actions(
        self, values: Whole, summary: Whole, move: DialogueMove, ruled: AbstractSet[ActionValue]
    ) -> frozenset[ActionValue]:
        """Returns the actions that a span names: those of the rules, except where the tagger is sure.

        Args:
            values: values (k, h) of the words of the span.
            summary: summary of the utterance.
            move: move of the span.
            ruled: actions that the rules find in it; others than `ACTIONS` are kept.
        """
        scores = self.acted_bias + self.acted_moves[self.moves.index(move)]
        both = np.concatenate((values.max(axis=0), summary))
        scores = scores + (both[:, None] * self.acted).sum(axis=0)
        signs = [action in ruled for action in ACTIONS]
        scores = scores + self.acted_rules[signs].sum(axis=0)
        found = zip(ACTIONS, signs, scores.tolist(), strict=True)
        named = {action for action, sign, score in found if score > (-self.sure if sign else self.sure)}
        return frozenset(named | (set(ruled) - set(ACTIONS)))

    def _rules_labels(self, features: SpanFeatures) -> Whole:
        pairs = zip(features.moves, features.begins, strict=True)
        return np.array([2 * self.moves.index(move) + (not begins) for move, begins in pairs], np.int32)

    def inputs(self, features: SpanFeatures) -> Whole:
        """Returns the input vectors (n, inputs) of the words."""
        number = len(features.words)
        places = np.zeros(number, np.int64)
        places[0], places[-1] = 1, 2
        before = 0 if features.after is None else 1 + self.moves.index(features.after)
        return np.concatenate(
            (
                np.array([_word_vector(self, word) for word in features.words]),
                self.marks[list(features.marks)],
                self.begins[[int(begins) for begins in features.begins]],
                self.rules[[self.moves.index(move) for move in features.moves]],
                self.places[places],
                np.broadcast_to(self.befores[before], (number, self.befores.shape[1])),
                np.array([_sign_vector(signs) for signs in features.signs]),
            ),
            axis=1,
        )


@functools.lru_cache(maxsize=1024)
def _sign_vector(signs: tuple[int, ...]) -> Whole:
    """Returns the vector of the signs of a span."""
    return np.array(signs, np.int32) << INPUT_BITS


@functools.lru_cache(maxsize=16384)
def _word_vector(tagger: SpanTagger, word: str) -> Whole:
    """Returns the vector of a word, and behind it the mean vector of its letter groups, rounded."""
    rows = letter_groups(word)
    total = tagger.groups[list(rows)].sum(axis=0)
    mean = (2 * total + len(rows)) // (2 * len(rows))
    return np.concatenate((tagger.vectors[word_row(word, tagger.words)], mean)).astype(np.int32)


def word_row(word: str, rows: Mapping[str, int]) -> int:
    """Returns the row of a word, of its mask, or that of unknown words.

    Args:
        word: masked word.
        rows: rows of the known words, from 0 on.
    """
    if word in MASKS:
        return len(rows) + MASKS.index(word)
    found = rows.get(word)
    if found is None:
        found = next((rows[bare] for bare in _bare_forms(word) if bare in rows), len(rows) + len(MASKS))
    return found


def _bare_forms(word: str) -> list[str]:
    forms = [word.replace("'", "")]
    forms += [word.removesuffix(ending) for ending in _ENDINGS if word.endswith(ending)]
    return [*forms, f"{word[:-1]}g"] if word.endswith("in'") else forms


@functools.lru_cache(maxsize=16384)
def letter_groups(word: str) -> tuple[int, ...]:
    """Returns the rows of the vectors of a word's letter groups, and of the word as a whole."""
    bounded = f"<{word}>"
    groups = [bounded[at : at + length] for length in _GROUPS for at in range(len(bounded) - length + 1)]
    return tuple(zlib.crc32(group.encode()) % BUCKETS for group in (word, *groups))


@functools.cache
def load_tagger() -> SpanTagger:
    """Returns the shipped tagger."""
    data = resources.files("dorothie_gym.dialogue").joinpath("data", WEIGHTS_FILE).read_bytes()
    return unpack(data)


def unpack(data: bytes) -> SpanTagger:
    """Returns the tagger of a weights file (`numpy.savez`)."""
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        stored = {name: file[name] for name in file.files}
    text = {name: stored[name].tobytes().decode().split("\n") for name in ("words", "moves")}
    whole = {name: np.ascontiguousarray(value, np.int32) for name, value in stored.items() if name not in text}
    nibbles = np.stack((stored["vectors"] % (1 << _NIBBLE), stored["vectors"] >> _NIBBLE), axis=-1).astype(np.int32)
    shifts, scale = whole["shifts"].tolist(), int(whole["scale"][0])
    return SpanTagger(
        moves=tuple(map(parse_move, text["moves"])),
        words={word: row for row, word in enumerate(text["words"])},
        vectors=(nibbles.reshape(len(nibbles), -1) - _CENTRE) * _STEP,
        groups=whole["groups"],
        marks=whole["marks"],
        begins=whole["begins"],
        rules=whole["rules"],
        places=whole["places"],
        befores=whole["befores"],
        convolutions=tuple(whole[f"convolution{number}"] for number in range(len(DILATIONS))),
        biases=tuple(whole[f"bias{number}"] for number in range(len(DILATIONS))),
        shifts=tuple(shifts[: len(DILATIONS)]),
        pooled=whole["pooled"],
        pooled_bias=whole["pooled_bias"],
        pooled_shift=shifts[len(DILATIONS)],
        output=whole["output"],
        output_bias=whole["output_bias"],
        pairs=whole["pairs"],
        margin=round(_MARGIN * (1 << scale)),
        acted=whole["acted"],
        acted_bias=whole["acted_bias"],
        acted_moves=whole["acted_moves"],
        acted_rules=whole["acted_rules"],
        sure=round(_SURE * (1 << int(whole["scale"][1]))),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class TaggedUtterance:
    """Utterance that the tagger has read.

    Attributes:
        spans: words and moves of its spans where the tagger is surer than the rules, and None elsewhere.
        values: values (n, h) of its words.
        summary: its summary (h,).
    """

    spans: tuple[tuple[str, DialogueMove], ...] | None
    values: Whole
    summary: Whole

    def with_actions(self, spans: Sequence[Span]) -> tuple[Span, ...]:
        """Returns spans with the actions that they name.

        Args:
            spans: spans of the utterance, which have all of its words.
        """
        tagger, place, found = load_tagger(), 0, []
        for span in spans:
            end = place + len(span.text.split())
            ruled = frozenset(value for value in span.act.slots if isinstance(value, ActionValue))
            named = tagger.actions(self.values[place:end], self.summary, span.act.move, ruled)
            act = span.act if named == ruled else DialogueAct(span.act.move, (span.act.slots - ruled) | named)
            found.append(span if act is span.act else Span(span.text, act))
            place = end
        return tuple(found)


def tagged(spans: Sequence[Span], features: SpanFeatures) -> TaggedUtterance:
    """Returns what the tagger reads in an utterance.

    Args:
        spans: spans of the rules, at least one.
        features: features of the utterance.
    """
    tagger = load_tagger()
    values, summary = tagger.encode(features)
    labels, best, rules = tagger.tag(features, values, summary)
    if best - rules <= tagger.margin:
        return TaggedUtterance(spans=None, values=values, summary=summary)
    found: list[tuple[str, DialogueMove]] = []
    for token, label in zip(" ".join(span.text for span in spans).split(), labels, strict=True):
        if label % 2 == 0:
            found.append((token, tagger.moves[label // 2]))
        else:
            found[-1] = f"{found[-1][0]} {token}", found[-1][1]
    return TaggedUtterance(spans=tuple(found), values=values, summary=summary)


@compiled
def _convolve(
    values: Whole, weights: Whole, bias: Whole, dilation: int, shift: int, residual: bool, found: Whole
) -> None:
    """Writes the rectified convolution (n, h) of values (n, k) to `found`, with the values themselves if `residual`."""
    for at in range(len(values)):
        for j in range(len(bias)):
            found[at, j] = bias[j]
        for tap in range(KERNEL):
            source = at + (tap - KERNEL // 2) * dilation
            if 0 <= source < len(values):
                for i in range(values.shape[1]):
                    value = values[source, i]
                    if value != 0:
                        for j in range(len(bias)):
                            found[at, j] += value * weights[tap, i, j]
        for j in range(len(bias)):
            found[at, j] = max(found[at, j] + (1 << (shift - 1)), 0) >> shift
            if residual:
                found[at, j] += values[at, j]


@compiled
def _summarise(values: Whole, weights: Whole, bias: Whole, shift: int, found: Whole) -> None:
    """Writes a rectified summary (h,) of values (n, h), of their maxima and the first ones."""
    width = values.shape[1]
    for j in range(len(bias)):
        found[j] = bias[j]
    for i in range(width):
        largest = values[0, i]
        for at in range(1, len(values)):
            largest = max(largest, values[at, i])
        for j in range(len(bias)):
            found[j] += largest * weights[i, j] + values[0, i] * weights[width + i, j]
    for j in range(len(bias)):
        found[j] = max(found[j] + (1 << (shift - 1)), 0) >> shift


@compiled
def _score(values: Whole, summary: Whole, weights: Whole, bias: Whole, found: Whole) -> None:
    """Writes the scores (n, 2 m) of the labels of all words, from values (n, h) and the summary (h,)."""
    width = values.shape[1]
    for at in range(len(values)):
        for j in range(len(bias)):
            found[at, j] = bias[j]
        for i in range(width):
            for j in range(len(bias)):
                found[at, j] += values[at, i] * weights[i, j] + summary[i] * weights[width + i, j]


@compiled
def _decode(scores: Whole, pairs: Whole, rules: Whole, before: Whole, labels: Whole) -> tuple[int, int]:
    """Writes the best labels (n,) and returns their score and that of given ones (n,).

    Args:
        scores: scores (n, 2 m) of the labels.
        pairs: scores (1 + m, m) of neighbouring spans' moves.
        rules: labels whose score is returned as well.
        before: room (n, m) for the label before each begin of a span.
        labels: room for the best labels; while they are sought, that of the label m before a word is in `before`.
    """
    number, moves = len(scores), pairs.shape[1]
    # The best score of a path that ends inside a span of each move is kept in the columns of the inside labels,
    # with the begin of that span in `before`; `scores` is overwritten.
    said = pairs[0, rules[0] // 2] + scores[0, rules[0]]
    for at in range(1, number):
        said += scores[at, rules[at]]
        if rules[at] % 2 == 0:
            said += pairs[1 + rules[at - 1] // 2, rules[at] // 2]
    for move in range(moves):
        scores[0, 2 * move + 1] = _LOWEST
        scores[0, 2 * move] += pairs[0, move]
    for at in range(1, number):
        for move in range(moves):
            inside = max(scores[at - 1, 2 * move], scores[at - 1, 2 * move + 1])
            scores[at, 2 * move + 1] += inside
            best, chosen = _LOWEST, 0
            for last in range(moves):
                ended = max(scores[at - 1, 2 * last], scores[at - 1, 2 * last + 1]) + pairs[1 + last, move]
                if ended > best:
                    best, chosen = ended, last
            scores[at, 2 * move] += best
            before[at, move] = chosen
    label = 0
    for other in range(1, 2 * moves):
        if scores[number - 1, other] > scores[number - 1, label]:
            label = other
    top = scores[number - 1, label]
    for at in range(number - 1, -1, -1):
        labels[at] = label
        if at > 0:
            move = label // 2 if label % 2 == 1 else before[at, label // 2]
            label = 2 * move + (1 if scores[at - 1, 2 * move + 1] > scores[at - 1, 2 * move] else 0)
    return top, said
