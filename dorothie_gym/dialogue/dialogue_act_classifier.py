"""The act behind words that come without one: a rule-based guess for partners who only talk."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.directions import word_lists
from dorothie_gym.dialogue.lexicon import LexiconError, read_data, strings
from dorothie_gym.dialogue.nlu import ParsedText, understand
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    ObjectClass,
    OntologyError,
    Slot,
    SlotValue,
    parse_move,
)

_SENTENCE_END = re.compile(r"(?<=[.?!])\s+")
_DOMAIN_RULE = "%domain"
_WORD_LISTS = ("domain", "small_talk", "reports")

_HEADS = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.EXPLAIN})
"""Moves behind which a command stands on its own: "no, stop"; "I can hardly see, slow down"."""

_QUESTIONS = frozenset({DialogueMove.QUERY_YN, DialogueMove.QUERY_W})
_BEFORE_QUESTIONS = frozenset(
    {DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.REPLY_N}
)
_BEFORE_REASONS = frozenset(
    {
        DialogueMove.ACKNOWLEDGE,
        DialogueMove.CONFIRM,
        DialogueMove.REPLY_Y,
        DialogueMove.REPLY_N,
        DialogueMove.REPLY_U,
        DialogueMove.CONFUSE,
    }
)
_MOST_CLAUSES = 6
"""Commas that are looked at for another act."""

_BARE_NAME = re.compile(r"(and |but |or )?(the )?#\w+( on #street)?(later|#status)?$|#status$")
_GOING_ON = re.compile(r"(and |after that|afterwards|next|then)", re.IGNORECASE)
_ASKS_ANEW = re.compile(r"(so|but|and|now|okay|should|shall|do|does|can|is|are|what|which|where|how|why|when)\b")
_STATEMENT = re.compile(
    r"(well|actually|because|also|but|so|now i see it)\b(?! (am|do|is|are|can)\b)"
    r"|(there's|there is|there are|i can't|i cannot|i have to|we can't|we have to|the (road|way)|my (gps|map))\b"
)
"""The beginning of a statement of its own; others behind "okay," or "yes," only say what is okay."""

_CLAUSE = re.compile(
    r"(so |and |but |also |now |then |, )*(also )?"
    r"((i|we|you|it|this|that|there|he|she|they|every(body|one)|some(body|one)|nobody|who)\b"
    r"(?! (one|place|stop|street|road|way|side|#\w+))('s|'m|'re|'ve|'ll|'d| )"
    r"|(the |my |our |your )?(#landmark|#street|#object|road|way|map|gps|car) (is|has|was|comes|can|will|#status)\b)"
)
"""The beginning of a clause that has a subject of its own."""

_JOINTS = re.compile(r"(?<=\w) (?=(also |but |and )?(we|i|you|they|it|there)('ll| will| still| also| should)\b)", re.I)
"""Behind a name, "we passed" tells which one is meant; "we still" begins anew."""

_ALSO = re.compile(r"(?<=\w) (?=also (we|i|you|they|it|there|that)\b)", re.I)
_OF_OTHERS = re.compile(r"(so |and |but |also |now |, )*(we|you|it|this|that|they|he|she|these|those|the \w+)\b( |'\w)")
_VERB = re.compile(
    r"\b(is|are|was|were|am|be|been|has|have|had|do|does|did|can|could|will|would|should|must|may|might|\w{3,}(ing|ed)|"
    r"\w+'(s|m|re|ve|ll|d)|\w+n't|\w+ (it|him|her|them|us|me)|went|got|took|saw|made|told|said)\b|#act|#status"
)
"""What a sentence with a verb of its own has."""

_SUBORDINATE = re.compile(
    r"(and |so |then |, )*(when|if|once|after|before|because|as|while|since|until|till|unless|where)\b"
)
_SO = re.compile(r"(so|now|and now|so now)\b,? ?(?!that\b|far\b|much\b)", re.IGNORECASE)
_TOLD = frozenset({DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.IRRELEVANT})
_ANSWERED = frozenset({DialogueMove.CONFIRM, DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_W})
_AIMED = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})

_ASKED_FOR = (ActionValue.QUERIED, ObjectClass.QUERIED)

_MOVING = frozenset({ActionValue.STOP, ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_SWITCH})
"""Actions whose denial is a command to drive on: "don't stop here"."""


@dataclass(frozen=True)
class MoveRule:
    """Expressions that betray a move.

    Attributes:
        move: the move.
        masked: found in masked words.
        acted: found in words with actions masked, too.
        domain: whether any word of rides betrays it.
        words: words of which one must be there for the rest to be tried; empty for no such condition.
    """

    move: DialogueMove
    masked: re.Pattern[str] | None
    acted: re.Pattern[str] | None
    domain: bool
    words: frozenset[str]


@dataclass(frozen=True)
class MoveCues:
    """What betrays moves.

    Attributes:
        rules: in order; the first that is found decides.
        answers: for the move before, what the guess becomes in its light.
        domain: words of rides.
        small_talk: words of other things.
        reports: words by which somebody's wish is told, which is no small talk.
    """

    rules: tuple[MoveRule, ...]
    answers: Mapping[DialogueMove, Mapping[DialogueMove, DialogueMove]]
    domain: frozenset[str]
    small_talk: frozenset[str]
    reports: frozenset[str]


@functools.lru_cache(maxsize=4096)
def guess_act(text: str, after: DialogueMove | None = None) -> DialogueAct:
    """Guesses move and slots from words.

    Args:
        text: free English, see `understand`.
        after: the other speaker's last move, if it still stands open: "left" after a QueryW is a ReplyW.

    Returns:
        The act; Irrelevant without slots if nothing is recognised.
    """
    return act_of(understand(text), after)


def act_of(heard: ParsedText, after: DialogueMove | None = None) -> DialogueAct:
    """Returns the act that fits what was heard; see `guess_act`."""
    move = _move_of(heard)
    if move is DialogueMove.INSTRUCT and GoalStatus.COMPLETE in heard.statuses and heard.masked.startswith("#status"):
        move = DialogueMove.EXPLAIN  # "skip the Ikea" is a command, "made it to the Ikea" is none
    elif move is DialogueMove.EXPLAIN and _is_bare_place(heard):
        move = DialogueMove.INSTRUCT  # "first things first, the Ikea"
    if after is not None:
        changes = _cues().answers.get(after)
        # Small talk stays small talk, unless it is a bare answer: "the blue one".
        if changes is not None and (move is not DialogueMove.IRRELEVANT or not _is_small_talk(heard)):
            move = changes.get(move, move)
    return DialogueAct(move, _slots(heard, move))


def _is_bare_place(heard: ParsedText) -> bool:
    """Returns whether words only name a place to go to: there is no verb, and nothing else is named."""
    return bool(heard.landmarks) and not heard.objects and not heard.question and not _VERB.search(heard.acted)


def _move_of(heard: ParsedText) -> DialogueMove:
    sentence, acted = heard.masked.strip(" ,"), heard.acted.strip(" ,")
    if _is_small_talk(heard):
        return DialogueMove.IRRELEVANT
    words = set(sentence.split())
    for rule in _cues().rules:
        if rule.words and words.isdisjoint(rule.words):
            continue
        if rule.masked is not None and rule.masked.search(sentence):
            return rule.move
        if rule.acted is not None and rule.acted.search(acted):
            return rule.move
        if rule.domain and not words.isdisjoint(_cues().domain):
            return rule.move
    return _by_form(heard, sentence)


def _by_form(heard: ParsedText, sentence: str) -> DialogueMove:
    """Returns the move of words without any cue, by their form alone."""
    if heard.actions:
        return DialogueMove.INSTRUCT  # a bare command: "lights on"
    if _OF_OTHERS.match(sentence):
        return DialogueMove.EXPLAIN  # a statement that is not about the speaker
    return DialogueMove.ACKNOWLEDGE if sentence.isalpha() else DialogueMove.IRRELEVANT


def _is_small_talk(heard: ParsedText) -> bool:
    """Returns whether there is a word of small talk, and nothing that has to do with the ride or somebody's wishes."""
    if heard.actions or heard.streets or heard.objects or heard.landmarks:
        return False
    if any(status is not GoalStatus.PENDING for status in heard.statuses):  # "later" is said of anything
        return False
    words = set(heard.masked.split())
    return not words.isdisjoint(_cues().small_talk) and words.isdisjoint(_cues().reports)


def _slots(heard: ParsedText, move: DialogueMove) -> frozenset[SlotValue]:
    if move is DialogueMove.IRRELEVANT:
        return frozenset()
    values = set(heard.values)
    if move is DialogueMove.CONFUSE:
        values -= set(_ASKED_FOR)  # "what was that?" asks for words, not for what there is
    if heard.denied and move is DialogueMove.INSTRUCT:
        values -= set(heard.denied)
        if not any(isinstance(value, ActionValue) for value in values) and not _MOVING.isdisjoint(heard.denied):
            values.add(ActionValue.LANE_FOLLOW)
    # Something is given up for something else.
    if GoalStatus.ABANDONED in values and len(heard.landmarks) > 1:
        values.add(GoalStatus.ONGOING)
    return frozenset(values)


def guess_spans(text: str, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Parts free English into acts: at the ends of sentences, and where another act begins behind a comma.

    Args:
        text: free English; blank text gives no span.
        after: as in `guess_act`, for the first span.

    Returns:
        Spans whose texts joined by spaces are the text (but for runs of spaces).
    """
    pieces = [piece for sentence in _SENTENCE_END.split(text.strip()) for piece in _pieces(sentence)]
    return tuple(
        Span(piece, guess_act(piece, after if place == 0 else None)) for place, piece in enumerate(pieces) if piece
    )


def _pieces(sentence: str) -> list[str]:
    """Returns a sentence parted at the first comma behind which another act begins, and so on with the rest."""
    clauses = sentence.strip().split(",")
    for number in range(1, min(len(clauses), _MOST_CLAUSES)):
        head, rest = ",".join(clauses[:number]).strip(), ",".join(clauses[number:]).strip()
        if head and rest and _parts(head, rest):
            return [f"{head},", *_pieces(rest)]
    return _run_on(sentence.strip())


def _run_on(sentence: str) -> list[str]:
    """Returns a sentence parted where a clause begins without a comma, as in what a recogniser writes.

    "to the Ikea we still have the KFC for later" names two places in two clauses; "also we ..." goes on from anything.
    """
    joints = _JOINTS.finditer(sentence) if len(understand(sentence).landmarks) > 1 else _ALSO.finditer(sentence)
    for joint in joints:
        head, rest = sentence[: joint.start()], sentence[joint.end() :]
        about, other = understand(head).landmarks, understand(rest).landmarks
        if joint.re is _ALSO or (about and other and not set(about) & set(other)):
            return [head, *_run_on(rest)]
    return [sentence]


def _parts(head: str, rest: str) -> bool:
    """Returns whether what stands before and behind a comma are two acts."""
    if rest.lower().strip(" .?!,") in word_lists().vocatives:
        return False
    first, second = guess_act(head), guess_act(rest)
    if second.move is DialogueMove.ALIGN:
        # "turn left, did you get that?"; but "hello, can you hear me?" asks one thing.
        return bool(first.slots) and first.move not in _QUESTIONS
    if second.move is DialogueMove.INSTRUCT:
        return _commands_anew(head, rest, first)
    if second.move in _QUESTIONS:
        return first.move in _BEFORE_QUESTIONS and _ASKS_ANEW.match(rest.lower()) is not None
    if second.move is DialogueMove.EXPLAIN:
        return _tells_anew(head, rest, first, second)
    return False


def _commands_anew(head: str, rest: str, first: DialogueAct) -> bool:
    """Returns whether what follows the comma is a command of its own."""
    if _is_clause(head) and first.move in _TOLD and _SO.match(rest):
        return True  # "we are done here, so the Ikea next"
    heard = understand(rest)
    if _BARE_NAME.match(heard.masked):
        return False
    if first.move is DialogueMove.INSTRUCT:
        # "turn left, then right"; but "stop here, at the light" is one command.
        return _GOING_ON.match(rest) is not None
    return first.move in _HEADS and heard.affirms is not False


def _tells_anew(head: str, rest: str, first: DialogueAct, second: DialogueAct) -> bool:
    """Returns whether what follows the comma is a statement of its own."""
    if first.move in _BEFORE_REASONS and not first.slots and _STATEMENT.match(rest.lower()) is not None:
        return True
    if not _is_clause(rest) or _SUBORDINATE.match(understand(head).masked):
        return False
    if first.move in _AIMED or first.move in _ANSWERED:
        return True
    # Two statements are told apart by what they are about.
    about, other = first.values(Slot.LANDMARK), second.values(Slot.LANDMARK)
    return bool(about) and bool(other) and not set(about) & set(other)


def _is_clause(text: str) -> bool:
    return _CLAUSE.match(understand(text).masked) is not None


@functools.cache
def _cues() -> MoveCues:
    data = read_data("cues.yaml")
    terms = {
        "{soft}": data.get("soft", ""),
        "{verb}": f"(?:{'|'.join(strings('cues.yaml: verbs', data.get('verbs')))})",
    }
    rules = tuple(_rule(f"cues.yaml: moves[{n}]", rule, terms) for n, rule in enumerate(data.get("moves", [])))
    answers = {
        parse_move(before): {parse_move(guess): parse_move(move) for guess, move in changes.items()}
        for before, changes in data.get("answers", {}).items()
    }
    words = {name: frozenset(strings(f"cues.yaml: {name}", data.get(name))) for name in _WORD_LISTS}
    return MoveCues(rules, answers, **words)


def _rule(where: str, rule: Mapping[str, Any], terms: Mapping[str, str]) -> MoveRule:
    texts = list(strings(f"{where}.cues", rule.get("cues")))
    for name, expression in terms.items():
        texts = [text.replace(name, expression) for text in texts]
    try:
        move = parse_move(rule["move"])
        acted = _either([text[1:] for text in texts if text.startswith("@")])
        masked = _either([text for text in texts if text[0] not in "@%"])
    except (re.error, OntologyError) as error:
        raise LexiconError(f"{where}: {error}") from error
    words = frozenset(strings(f"{where}.words", rule.get("words", [])))
    return MoveRule(move, masked, acted, _DOMAIN_RULE in texts, words)


def _either(patterns: list[str]) -> re.Pattern[str] | None:
    for pattern in patterns:
        re.compile(pattern)  # on its own, so that a faulty one is found by its own message
    return re.compile("|".join(f"(?:{pattern})" for pattern in patterns)) if patterns else None
