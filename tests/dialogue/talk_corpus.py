"""Corpus of utterances generated from sampled acts, with the figures that compare it with human dialogue.

Run `python -m tests.dialogue.talk_corpus` for the figures (needs nltk for the perplexity).
"""

from __future__ import annotations

import functools
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.dialogue import (
    Direction,
    Predicate,
    Proposition,
    Span,
    SpeakerStyle,
    Wording,
    WordingContext,
    draw_style,
    word_acts,
)
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Role,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies.participant.messages import LONGEST_REASON
from dorothie_gym.tasks import load_template, template_names
from dorothie_gym.tasks.catalogue import catalogue
from dorothie_gym.tasks.purposes import in_first_person, read_purpose
from dorothie_gym.tasks.storyboard import fill

M = DialogueMove
HUMAN = {
    M.INSTRUCT: 38, M.EXPLAIN: 12, M.IRRELEVANT: 6, M.ALIGN: 2, M.CHECK: 3, M.QUERY_YN: 5, M.QUERY_W: 5,
    M.ACKNOWLEDGE: 6, M.CONFUSE: 2, M.CLARIFY: 3, M.CONFIRM: 4, M.REPLY_Y: 6, M.REPLY_N: 3, M.REPLY_U: 1.5,
    M.REPLY_W: 4.5,
}  # fmt: skip
CAR = {
    M.INSTRUCT: 0.5, M.EXPLAIN: 19, M.IRRELEVANT: 2, M.ALIGN: 1.5, M.CHECK: 6, M.QUERY_YN: 8, M.QUERY_W: 8,
    M.ACKNOWLEDGE: 25, M.CONFUSE: 3, M.CLARIFY: 2, M.CONFIRM: 11, M.REPLY_Y: 6, M.REPLY_N: 3, M.REPLY_U: 1,
    M.REPLY_W: 3,
}  # fmt: skip
NEXT = {
    M.REPLY_Y: [M.INSTRUCT],
    M.REPLY_N: [M.INSTRUCT, M.EXPLAIN],
    M.EXPLAIN: [M.INSTRUCT, M.QUERY_YN, M.EXPLAIN],
    M.ACKNOWLEDGE: [M.EXPLAIN, M.QUERY_W, M.QUERY_YN],
    M.CONFIRM: [M.EXPLAIN],
    M.INSTRUCT: [M.INSTRUCT, M.EXPLAIN],
    M.REPLY_W: [M.EXPLAIN],
}
ACTIONS = {
    ActionValue.J_TURN: 40, ActionValue.LANE_FOLLOW: 18, ActionValue.STOP: 14, ActionValue.LANE_SWITCH: 7,
    ActionValue.U_TURN: 6, ActionValue.SPEED_CHANGE: 7, ActionValue.LIGHT_CHANGE: 3, ActionValue.START: 5,
}  # fmt: skip
# From the commonest on; the draw is skewed.
COMMON = [ObjectClass.STATIC, ObjectClass.PEDESTRIAN, ObjectClass.VEHICLES, ObjectClass.TRAFFIC_LIGHT]
OBJECTS = [*COMMON, *(value for value in ObjectClass if value not in COMMON)]
TOPICS = ["fog", "rain", "night", "blocked", "wrong_way", "arrived", "plan", "refused", "failed"]


@functools.cache
def errands() -> tuple[Wording, ...]:
    """What participants tell of the errands of the shipped storyboards."""
    rng = np.random.default_rng(0)
    found = []
    for template in map(load_template, template_names()):
        values = {row.name: "the place" for row in template.variables}
        for row in template.dependents:
            listed = [value for kind in catalogue().values() for value in kind.attributes.get(row.attribute, ())]
            values[row.name] = listed[int(rng.integers(len(listed)))]
        for subgoal in template.subgoals:
            told = read_purpose(fill(subgoal.description, values))
            for topic, text in (("purpose", told.action), ("reason", subgoal.reason)):
                if text is not None and len(text) <= LONGEST_REASON:
                    content = Proposition.of(Predicate.PURPOSE, **{topic: in_first_person(fill(text, values))})
                    found.append(Wording(topic=topic, content=content))
    return tuple(found)


class Sampler:
    """Sampler of dialogue acts with the details of their wording."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.streets = [StreetName(int(n)) for n in rng.choice(np.arange(1, 15), 6, replace=False)]
        self.places = [LandmarkName(int(n)) for n in rng.choice(np.arange(1, 11), 4, replace=False)]

    def one_of(self, options: Sequence) -> object:
        return options[int(self.rng.integers(len(options)))]

    def weighted(self, weights: dict) -> object:
        shares = np.array(list(weights.values()), float)
        return list(weights)[int(self.rng.choice(len(shares), p=shares / shares.sum()))]

    def act(self, move: DialogueMove, human: bool) -> tuple[DialogueAct, Wording]:
        rng = self.rng
        values: list[SlotValue] = []
        bare = 0.12 if move is M.INSTRUCT else 0.62
        if move in (M.IRRELEVANT, M.ALIGN, M.CONFUSE) or rng.random() < bare:
            if move is M.EXPLAIN and human and rng.random() < 0.25:
                return DialogueAct.of(move), self.one_of(errands())
            heard = ["why", "seen", None] if human else ["ordered", "ordered", "told", "answered", "done", "chat"]
            topic = {
                M.ACKNOWLEDGE: [*heard, "sorry", "align"],
                M.CONFIRM: ["taken"],
                M.EXPLAIN: [None, *TOPICS],
                M.IRRELEVANT: [None, "reply"],
            }.get(move, [None])
            return DialogueAct.of(move), Wording(topic=self.one_of(topic) if rng.random() < 0.5 else None)
        drawn = rng.random()
        action = self.weighted(ACTIONS)
        if drawn < 0.6:
            values.append(action)
            if rng.random() < 0.15:
                values.append(self.one_of(self.streets if rng.random() < 0.6 else self.places))
        elif drawn < 0.82:
            values.append(self.one_of(self.places))
            if rng.random() < 0.4:
                values.append(self.one_of(self.streets))
            elif rng.random() < 0.3:
                values.append(GoalStatus(int(rng.integers(1, 5))))
        elif drawn < 0.9:
            values.append(self.one_of(self.streets))
        else:
            values.append(OBJECTS[int(rng.random() ** 3 * len(OBJECTS))])
        if move is M.QUERY_W and rng.random() < 0.7:
            values = [ActionValue.QUERIED if rng.random() < 0.6 else LandmarkName.QUERIED]
        return DialogueAct.of(move, *values), self.wording(action)

    def wording(self, action: ActionValue) -> Wording:
        rng = self.rng
        straight = rng.random() < 0.1 and action is ActionValue.J_TURN
        way = Direction.STRAIGHT if straight else self.one_of([Direction.LEFT, Direction.RIGHT])
        return Wording(
            direction=way,
            ordinal=int(rng.choice([1, 2, 3], p=[0.6, 0.3, 0.1])) if rng.random() < 0.3 else None,
            faster=bool(rng.random() < 0.4),
            speed=5.0 * int(rng.integers(3, 11)) if rng.random() < 0.3 else None,
            lights=bool(rng.random() < 0.8),
            distance=10.0 * int(rng.integers(2, 12)) if rng.random() < 0.05 else None,
            here=bool(rng.random() < 0.1),
        )


@dataclass(frozen=True)
class Said:
    speaker: Role
    spans: tuple[Span, ...]

    @property
    def text(self) -> str:
        return " ".join(span.text for span in self.spans)


def session(seed: int, utterances: int = 46, styled: bool = True) -> list[Said]:
    rng = np.random.default_rng(seed)
    sampler = Sampler(rng)
    styles: dict[Role, SpeakerStyle | None] = dict.fromkeys((Role.PARTICIPANT, Role.CO_WIZARD))
    if styled:
        styles = {role: draw_style(role, rng) for role in styles}
    said: list[Said] = []
    mentioned: frozenset[SlotValue] = frozenset()
    for number in range(utterances):
        role = Role.PARTICIPANT if number % 2 == 0 else Role.CO_WIZARD
        moves = [sampler.weighted(HUMAN if role is Role.PARTICIPANT else CAR)]
        more = 1 + (rng.random() < 0.32) + (rng.random() < 0.06)
        while len(moves) < more:
            options = NEXT.get(moves[-1], [M.EXPLAIN])
            human = role is Role.PARTICIPANT
            fitting = [move for move in options if human or move is not M.INSTRUCT]
            moves.append(sampler.one_of(fitting or [M.EXPLAIN]))
        drawn = [sampler.act(move, role is Role.PARTICIPANT) for move in moves]
        scene = WordingContext(mentioned=mentioned, exception=bool(rng.random() < 0.2), street=sampler.streets[0])
        acts, wordings = [act for act, _ in drawn], [wording for _, wording in drawn]
        said.append(Said(role, word_acts(acts, role, rng, wordings, style=styles[role], scene=scene)))
        mentioned = frozenset(value for act in acts for value in act.slots)
    return said


@dataclass(frozen=True)
class Figures:
    utterances: int
    words: float
    acts: float
    vocabulary: int
    distinct: float
    commonest: tuple[str, float]


def plain(text: str) -> str:
    return " ".join(tokens(text))


def tokens(text: str) -> list[str]:
    return [word for word in "".join(c if c.isalnum() or c in "' " else " " for c in text.lower()).split()]


def figures(said: Sequence[Said]) -> Figures:
    """Returns the figures of a corpus; texts are compared in lower case and without punctuation."""
    texts = [plain(item.text) for item in said]
    words = [word for text in texts for word in text.split()]
    (text, times), *_ = Counter(texts).most_common(1)
    return Figures(
        len(said),
        len(words) / len(said),
        sum(len(item.spans) for item in said) / len(said),
        len(set(words)),
        len(set(texts)) / len(texts),
        (text, times / len(texts)),
    )


def perplexity(train: Sequence[Said], test: Sequence[Said]) -> float:
    """Returns the perplexity of Kneser-Ney trigrams (nltk): lower case, words that occur once as unknown."""
    from nltk.lm import KneserNeyInterpolated, Vocabulary
    from nltk.lm.preprocessing import padded_everygram_pipeline
    from nltk.util import ngrams, pad_sequence

    class Remembering(KneserNeyInterpolated):
        @functools.cache  # noqa: B019
        def score(self, word: str, context: tuple[str, ...] | None = None) -> float:
            return super().score(word, context)

        @functools.cache  # noqa: B019
        def unmasked_score(self, word: str, context: tuple[str, ...] | None = None) -> float:
            return super().unmasked_score(word, context)

    sentences = [tokens(item.text) for item in train]
    counts = Counter(word for sentence in sentences for word in sentence)
    known = {word for word, count in counts.items() if count > 1}
    mapped = [[word if word in known else "<UNK>" for word in sentence] for sentence in sentences]
    grams, padded = padded_everygram_pipeline(3, mapped)
    model = Remembering(3, vocabulary=Vocabulary(padded, unk_cutoff=1))
    model.fit(grams)
    held = [[word if word in known else "<UNK>" for word in tokens(item.text)] for item in test]
    found = [
        gram
        for sentence in held
        for gram in ngrams(pad_sequence(sentence, 3, True, True, left_pad_symbol="<s>", right_pad_symbol="</s>"), 3)
    ]
    return float(model.perplexity(found))


def main() -> None:
    """Prints the figures of 183 sessions."""
    start = time.perf_counter()
    sessions = [session(seed) for seed in range(183)]
    seconds = time.perf_counter() - start
    said = [item for one in sessions for item in one]
    print(figures(said), f"{seconds:.1f} s")
    train = [item for one in sessions[:122] for item in one]
    test = [item for one in sessions[122:] for item in one]
    print("perplexity", round(perplexity(train, test[::4]), 1))


if __name__ == "__main__":
    main()
