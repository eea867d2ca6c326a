"""Training sentences of the tagger of spans: `people/train.jsonl`, variants of them, and the package's grammar."""

from __future__ import annotations

import itertools
import json
import random
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from dorothie_gym.dialogue import AsrChannel, Wording, draw_style, word_acts
from dorothie_gym.dialogue.dialogue_act_classifier import rule_spans, slots_of
from dorothie_gym.dialogue.span_features import action_signs, span_features
from dorothie_gym.dialogue.span_inputs import ACTIONS, SpanFeatures
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role
from dorothie_gym.ontology.slots import SLOT_VALUES, ActionValue, Slot, SlotValue
from dorothie_gym.ontology.spellings import parse_move

FOLDER: Final = Path(__file__).parent / "people"

WORD_ERRORS: Final = (0.1, 0.2, 0.3)
"""Word error rates of misheard variants."""

LONGEST: Final = 14
"""Longest span of which sentences are put together [words]."""

M = DialogueMove
ASKING: Final = frozenset({M.QUERY_YN, M.QUERY_W, M.CHECK, M.ALIGN, M.CONFUSE})
JOINTS: Final = {M.INSTRUCT: ("and", "then", "and then"), M.EXPLAIN: ("so", "but")}
"""Words by which a span may be joined to the one before, by its move."""

BEFORE: Final = {
    M.REPLY_Y: (M.QUERY_YN,), M.REPLY_N: (M.QUERY_YN, M.CHECK), M.REPLY_U: (M.QUERY_YN, M.QUERY_W),
    M.REPLY_W: (M.QUERY_W,), M.CONFIRM: (M.INSTRUCT, M.CHECK), M.CLARIFY: (M.CONFUSE, M.CONFIRM, M.EXPLAIN),
    M.ACKNOWLEDGE: (M.EXPLAIN, M.INSTRUCT, M.CONFIRM, M.REPLY_W), M.CONFUSE: (M.INSTRUCT, M.EXPLAIN),
}  # fmt: skip
"""Moves before the first span of a sampled sentence of the grammar."""

NEXT: Final = {
    M.REPLY_Y: (M.INSTRUCT,), M.REPLY_N: (M.INSTRUCT, M.EXPLAIN), M.EXPLAIN: (M.INSTRUCT, M.QUERY_YN, M.EXPLAIN),
    M.ACKNOWLEDGE: (M.EXPLAIN, M.QUERY_W, M.QUERY_YN), M.CONFIRM: (M.EXPLAIN,), M.INSTRUCT: (M.INSTRUCT, M.EXPLAIN),
    M.REPLY_W: (M.EXPLAIN,),
}  # fmt: skip
"""Moves of the second span of a sampled sentence of the grammar."""


class LabelledSpan(NamedTuple):
    """Span of a training sentence.

    Attributes:
        text: its words.
        move: its move.
        actions: actions of the car that it names; None if they are not labelled.
    """

    text: str
    move: DialogueMove
    actions: frozenset[ActionValue] | None = None


Spans = tuple[LabelledSpan, ...]


@dataclass(frozen=True)
class Sentence:
    """Sentence with its labelled spans.

    Attributes:
        spans: its spans.
        after: move of the other speaker before it.
    """

    spans: Spans
    after: DialogueMove | None = None

    @property
    def text(self) -> str:
        """The whole sentence."""
        return " ".join(span.text for span in self.spans)


class NamedActions(NamedTuple):
    """Actions of a span, each tuple with 0 or 1 for each of `ACTIONS`.

    Attributes:
        begin: number of its first word.
        end: number of the word behind its last one.
        move: its move.
        ruled: actions that the rules find.
        named: actions that it names.
    """

    begin: int
    end: int
    move: DialogueMove
    ruled: tuple[int, ...]
    named: tuple[int, ...]


@dataclass(frozen=True)
class Example:
    """Features and labels of a sentence.

    Attributes:
        features: features of its words.
        labels: label of each word: twice the number of its move, plus 1 inside of a span.
        actions: actions of the spans in which they are labelled.
    """

    features: SpanFeatures
    labels: tuple[int, ...]
    actions: tuple[NamedActions, ...] = ()


def read_training_sentences(path: Path = FOLDER / "train.jsonl", split: str | None = None) -> list[Sentence]:
    """Returns the sentences of a file with fields `before` and `acts` a line, of one split if there are several."""
    rows = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return [sentence_of(row) for row in rows if split is None or row["split"] == split]


def sentence_of(row: Mapping[str, object]) -> Sentence:
    """Returns the sentence of a row with fields `before` and `acts`."""
    acts, before = row["acts"], str(row["before"]).strip()
    if not isinstance(acts, list):
        raise TypeError("`acts` must be a list")
    spans = tuple(LabelledSpan(str(act["text"]), parse_move(act["move"]), _actions(act)) for act in acts)
    return Sentence(spans, rule_spans(before)[-1].act.move if before else None)


def _actions(act: Mapping[str, Mapping[str, Sequence[str]]]) -> frozenset[ActionValue] | None:
    """Returns the labelled actions of an act; None if it has no slots."""
    if "slots" not in act:
        return None
    labels = act["slots"].get("Action", ())
    return frozenset(value for value in ACTIONS if value.label in labels)


def example(sentence: Sentence) -> Example:
    """Returns the features and labels of a sentence."""
    labels: list[int] = []
    actions: list[NamedActions] = []
    moves = list(DialogueMove)
    for text, move, named in sentence.spans:
        label, begin = 2 * moves.index(move), len(labels)
        labels += [label, *[label + 1] * (len(text.split()) - 1)]
        if named is not None:
            ruled = action_signs(slots_of(text, move))
            actions.append(NamedActions(begin, len(labels), move, ruled, action_signs(named)))
    features = span_features(rule_spans(sentence.text, sentence.after), sentence.after)
    return Example(features, tuple(labels), tuple(actions))


def variants(sentence: Sentence, rng: random.Random, noise: np.random.Generator) -> list[Sentence]:
    """Returns a sentence without marks, with those of a writer, and misheard."""
    bare = tuple(span._replace(text=_unmarked(span.text)) for span in sentence.spans)
    found = [bare]
    if len(bare) > 1 or rng.random() < 0.5:
        joint = "," if rng.random() < 0.7 else "."
        ends = [joint] * (len(bare) - 1) + [_end(bare[-1].move, rng)]
        found.append(tuple(span._replace(text=span.text + end) for span, end in zip(bare, ends, strict=True)))
    channel = AsrChannel(rate=rng.choice(WORD_ERRORS))
    heard = tuple(span._replace(text=channel.transcribe(span.text, noise)) for span in sentence.spans)
    found.append(tuple(span for span in heard if span.text.strip()))
    return [Sentence(spans, sentence.after) for spans in found if spans]


def _end(move: DialogueMove, rng: random.Random) -> str:
    return "?" if move in ASKING else "." if rng.random() < 0.6 else ""


def _unmarked(text: str) -> str:
    return " ".join(word.rstrip(".?!,;:\u2026") for word in text.split()) or text


def compositions(sentences: Sequence[Sentence], number: int, rng: random.Random) -> Iterator[Sentence]:
    """Yields sentences put together of spans of others, in orders of moves that occur."""
    first: dict[DialogueMove, list[tuple[LabelledSpan, DialogueMove | None]]] = defaultdict(list)
    later: dict[DialogueMove, list[LabelledSpan]] = defaultdict(list)
    for sentence in sentences:
        for place, span in enumerate(sentence.spans):
            if len(span.text.split()) <= LONGEST:
                (first[span.move].append((span, sentence.after)) if place == 0 else later[span.move].append(span))
    orders = [tuple(span.move for span in sentence.spans) for sentence in sentences if len(sentence.spans) > 1]
    while number > 0:
        order = rng.choice(orders)
        if any(move is other and move is not M.INSTRUCT for move, other in itertools.pairwise(order)):
            continue  # neighbours with one move are one span
        if not first[order[0]]:
            continue
        span, after = rng.choice(first[order[0]])
        spans = [span._replace(text=_unmarked(span.text))]
        for move in order[1:]:
            pool = later[move] if later[move] and (rng.random() < 0.5 or not first[move]) else None
            spans.append(_joined(rng.choice(pool or [span for span, _ in first[move]]), rng))
        mark = rng.choice(("", "", ",", ",", ",", "."))
        marked = [span._replace(text=span.text + mark) for span in spans[:-1]]
        yield Sentence((*marked, spans[-1]), after)
        number -= 1


def _joined(span: LabelledSpan, rng: random.Random) -> LabelledSpan:
    text, joints = _unmarked(span.text), JOINTS.get(span.move, ())
    joined = bool(joints) and rng.random() < 0.3 and text.split()[0].lower() not in ("and", "then", "so", "but", "now")
    return span._replace(text=f"{rng.choice(joints)} {text}" if joined else text)


def grammar_sentences(number: int, seed: int) -> list[Sentence]:
    """Returns sampled sentences of the package's grammar, with their true moves."""
    rng = np.random.default_rng(seed)
    found: dict[Spans, Sentence] = {}
    moves = list(DialogueMove)
    while len(found) < number:
        role = (Role.PARTICIPANT, Role.CO_WIZARD)[int(rng.integers(2))]
        order = [moves[int(rng.integers(len(moves)))]]
        if order[0] in NEXT and rng.random() < 0.35:
            options = [move for move in NEXT[order[0]] if role is Role.PARTICIPANT or move is not M.INSTRUCT]
            order += [options[int(rng.integers(len(options)))]] if options else []
        acts = [DialogueAct.of(move, *_values(move, rng)) for move in order]
        said = word_acts(acts, role, rng, [Wording()] * len(acts), style=draw_style(role, rng))
        spans = tuple(LabelledSpan(span.text, span.act.move, _named(span.act)) for span in said)
        before = BEFORE.get(order[0], ())
        after = before[int(rng.integers(len(before)))] if before and rng.random() < 0.75 else None
        found.setdefault(spans, Sentence(spans, after))
    return list(found.values())


def _named(act: DialogueAct) -> frozenset[ActionValue]:
    return frozenset(value for value in act.slots if isinstance(value, ActionValue) and value in ACTIONS)


def _values(move: DialogueMove, rng: np.random.Generator) -> list[SlotValue]:
    """Draws slot values of an act."""
    if move in (M.IRRELEVANT, M.ALIGN, M.CONFUSE) or rng.random() < (0.12 if move is M.INSTRUCT else 0.6):
        return []
    drawn = rng.random()
    slots = [Slot.ACTION] if drawn < 0.5 else [Slot.LANDMARK] if drawn < 0.75 else [Slot.STREET]
    if drawn >= 0.92:
        slots = [Slot.OBJECT]
    elif rng.random() < 0.2:
        slots.append(Slot.STREET if slots != [Slot.STREET] else Slot.LANDMARK)
    listed = [[value for value in SLOT_VALUES[slot] if value.label not in ("Unknown", "Queried")] for slot in slots]
    return [values[int(rng.integers(len(values)))] for values in listed]
