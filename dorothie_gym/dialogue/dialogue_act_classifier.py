"""Rule-based dialogue act classifier for text without annotated acts."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

from dorothie_gym.dialogue.answered_sides import answering_act, asked_about, plain_answer
from dorothie_gym.dialogue.clause_breaks import with_breaks
from dorothie_gym.dialogue.clause_moods import ClauseMood
from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.directions import word_lists
from dorothie_gym.dialogue.formulas import formula_move, formula_moves
from dorothie_gym.dialogue.lexicon import split_words
from dorothie_gym.dialogue.move_cues import move_cues
from dorothie_gym.dialogue.move_decision import (
    belong_together,
    decide,
    in_context,
    joined,
    sign_of_hearing,
    stand_apart,
)
from dorothie_gym.dialogue.nlu import ParsedText, understand
from dorothie_gym.dialogue.pattern_index import bits
from dorothie_gym.dialogue.routes import StepAction
from dorothie_gym.dialogue.signs import behind_signs
from dorothie_gym.dialogue.span_features import span_features
from dorothie_gym.dialogue.span_tagger import tagged
from dorothie_gym.dialogue.vocatives import is_endearment, without_asides, without_vocative
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, ObjectClass, Slot, SlotValue

_SENTENCE_END = re.compile(r"(?<=[.?!])(?<!\b(?:Mr|Ms|Dr)\.)(?<!\bMrs\.)\s+")

_MARKS = re.compile(r"[,.;:?!]+")

_COMMA = re.compile(r",(?=\s|$)")
"""Comma between words; one inside of a word, as in a number, separates nothing."""

_HEADS = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.EXPLAIN})
"""Moves after which a command is a separate act: "no, stop"; "I can hardly see, slow down"."""

_ANSWERING = frozenset(
    {
        DialogueMove.REPLY_Y,
        DialogueMove.REPLY_N,
        DialogueMove.REPLY_U,
        DialogueMove.REPLY_W,
        DialogueMove.CLARIFY,
    }
)
"""Moves that need an utterance of the other speaker before them."""

_OTHER_SIDE = re.compile(r"\b(other|opposite|wrong) (side|kerb|curb)\b")
"""Sides by which a place to stop is corrected."""

_NO_ORDERS = frozenset({DialogueMove.REPLY_N, DialogueMove.ACKNOWLEDGE, DialogueMove.IRRELEVANT})
"""Moves that the words of an order do not have."""

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
"""Number of clauses of a sentence up to which commas are tested as act boundaries."""

_BARE_NAME = re.compile(r"(and |but |or )?(the )?#\w+( on #street)?(later|#status)?$|#status$")
_GOING_ON = re.compile(r"(and |after that|afterwards|next|then)", re.IGNORECASE)
_STARTS_QUESTION = re.compile(r"(so|but|and|now|okay|should|shall|do|does|can|is|are|what|which|where|how|why|when)\b")
_STATEMENT = re.compile(
    r"(well|actually|because|also|but|so|now i see it)\b(?! (am|do|is|are|can)\b)"
    r"|(there's|there is|there are|i can't|i cannot|i have to|we can't|we have to|the (road|way)|my (gps|map))\b"
)
"""Start of a separate statement; other clauses after "okay," or "yes," elaborate on it."""

_CLAUSE = re.compile(
    r"(so |and |but |also |now |then |, )*(also )?"
    r"((i|we|you|it|this|that|there|he|she|they|every(body|one)|some(body|one)|nobody|who)\b"
    r"(?! (one|place|stop|street|road|way|side|#\w+))('s|'m|'re|'ve|'ll|'d| )"
    r"|(the |my |our |your )?(#landmark|#street|#object|road|way|map|gps|car) (is|has|was|comes|can|will|#status)\b)"
)
"""Start of a clause with its own subject."""

_JOINTS = re.compile(r"(?<=\w) (?=(also |but |and )?(we|i|you|they|it|there)('ll| will| still| also| should)\b)", re.I)
"""Boundaries before a new clause; after a name, "we passed" modifies the name and "we still" starts a clause."""

_ALSO = re.compile(r"(?<=\w) (?=also (we|i|you|they|it|there|that)\b)", re.I)
_OF_OTHERS = re.compile(r"(so |and |but |also |now |, )*(we|you|it|this|that|they|he|she|these|those|the \w+)\b( |'\w)")
_VERB = re.compile(
    r"\b(is|are|was|were|am|be|been|has|have|had|do|does|did|can|could|will|would|should|must|may|might|\w{3,}(ing|ed)|"
    r"\w+'(s|m|re|ve|ll|d)|\w+n't|\w+ (it|him|her|them|us|me)|went|got|took|saw|made|told|said)\b|#act|#status"
)
"""Finite verbs and actions in masked words."""

_SUBORDINATE = re.compile(
    r"(and |so |then |, )*(when|if|once|after|before|because|as|while|since|until|till|unless|where)\b"
)
_SO = re.compile(r"(so|now|and now|so now)\b,? ?(?!that\b|far\b|much\b)", re.IGNORECASE)
_STATEMENT_MOVES = frozenset(
    {DialogueMove.EXPLAIN, DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.IRRELEVANT}
)
_ANSWERED = frozenset({DialogueMove.CONFIRM, DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_W})
_AIMED = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})

_ASKED_FOR = (ActionValue.QUERIED, ObjectClass.QUERIED)

_HUMS = frozenset({"mm hm", "mm hmm", "mhm", "mmhm", "uh huh", "aha"})
"""Words that answer yes, or show that something was heard, if the other speaker has just spoken."""

_OVERRULED = frozenset(
    {
        DialogueMove.INSTRUCT,
        DialogueMove.EXPLAIN,
        DialogueMove.CHECK,
        DialogueMove.QUERY_YN,
        DialogueMove.QUERY_W,
        DialogueMove.CLARIFY,
        DialogueMove.REPLY_W,
    }
)
"""Moves of the cues that give way to a formula, besides those that formulas have."""

_OF_SIGNS = frozenset(
    {
        DialogueMove.ACKNOWLEDGE,
        DialogueMove.IRRELEVANT,
        DialogueMove.REPLY_N,
        DialogueMove.REPLY_Y,
    }
)
"""Moves of interjections, apologies and answers."""

_SIGNS = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.REPLY_Y})
"""Moves whose formulas ask with a question mark."""

_IN_FAVOUR = re.compile(r"\b(instead|rather than|not)\b")
"""Words by which one errand takes the place of another."""

_ROADS = frozenset({"lane", "lanes", "road", "junction", "traffic", "jam", "turning"})
"""Words that no small talk holds."""


@functools.lru_cache(maxsize=4096)
def guess_act(text: str, after: DialogueMove | None = None) -> DialogueAct:
    """Classifies move and slots of a text.

    Args:
        text: free English, see `understand`.
        after: last move of the other speaker if it awaits an answer: "left" after a QueryW is a ReplyW.

    Returns:
        The dialogue act; Irrelevant without slots if nothing is recognised.
    """
    return act_of(understand(text), after)


def act_of(parsed: ParsedText, after: DialogueMove | None = None) -> DialogueAct:
    """Returns the dialogue act of a parsed text; see `guess_act`."""
    words = _plain_words(parsed.text)
    formula = formula_move(words)
    if parsed.question and formula in _SIGNS:
        formula = None  # "got it?"
    goes_on = formula is DialogueMove.REPLY_Y and after is None
    corrects = formula is DialogueMove.REPLY_N and after in (DialogueMove.EXPLAIN, DialogueMove.CONFIRM)
    if (goes_on or corrects) and parsed.plan.steps:
        formula = None  # "go on then"; "no, right"
    if after is None and parsed.masked.strip(" ,") in _HUMS:
        formula = DialogueMove.REPLY_Y
    move = _move_of(parsed)
    if formula is not None and (move in _OVERRULED or move in formula_moves()):
        move = formula
    elif formula is None:
        move = decide(parsed, move, after)
        move = _behind_signs(parsed, move, after)
    if move is DialogueMove.INSTRUCT and GoalStatus.COMPLETE in parsed.statuses and parsed.masked.startswith("#status"):
        move = DialogueMove.EXPLAIN  # "skip the Ikea" is a command, "made it to the Ikea" a statement
    elif move is DialogueMove.EXPLAIN and _is_bare_place(parsed):
        move = DialogueMove.INSTRUCT  # "first things first, the Ikea"
    if after is not None:
        changes = move_cues().answers.get(after)
        # Small talk remains irrelevant, unless it is a bare answer: "the blue one".
        if changes is not None and (move is not DialogueMove.IRRELEVANT or not _is_small_talk(parsed)):
            move = changes.get(move, move)
    if formula is not DialogueMove.IRRELEVANT and sign_of_hearing(parsed, move, after):
        move = DialogueMove.ACKNOWLEDGE
    return DialogueAct(move, _slots(parsed, move))


def _behind_signs(parsed: ParsedText, move: DialogueMove, after: DialogueMove | None) -> DialogueMove:
    """Returns the move of what follows the signs at the beginning of a text; `move` if that tells nothing more."""
    rest = behind_signs(parsed.text, after) if move in _OF_SIGNS else ""
    if not rest:
        return move
    found = act_of(understand(rest), after).move
    return move if found in _OF_SIGNS else found


@functools.lru_cache(maxsize=2048)
def _plain_words(text: str) -> Sequence[str]:
    lists = word_lists()
    return tuple(without_asides(without_vocative(split_words(text), lists), lists))


def _is_bare_place(parsed: ParsedText) -> bool:
    """Returns whether the text only names a destination: no verb, no object, no question."""
    if parsed.parse is not None and set(parsed.parse.moods) == {ClauseMood.STATEMENT}:
        return False  # "I used to live near the KFC"
    return bool(parsed.landmarks) and not parsed.objects and not parsed.question and not _VERB.search(parsed.acted)


def _move_of(parsed: ParsedText) -> DialogueMove:
    sentence, acted = parsed.masked.strip(" ,"), parsed.acted.strip(" ,")
    if _is_small_talk(parsed):
        return DialogueMove.IRRELEVANT
    words, cues = set(sentence.split()), move_cues()
    masked_cues, acted_cues = cues.masked.possible(words), cues.acted.possible(acted.split())
    for number in bits(masked_cues | acted_cues | cues.by_domain):
        rule = cues.rules[number]
        if rule.words and words.isdisjoint(rule.words):
            continue
        if rule.masked is not None and masked_cues >> number & 1 and rule.masked.search(sentence):
            return rule.move
        if rule.acted is not None and acted_cues >> number & 1 and rule.acted.search(acted):
            return rule.move
        if rule.domain and not words.isdisjoint(cues.domain):
            return rule.move
    return _by_form(parsed, sentence)


def _by_form(parsed: ParsedText, sentence: str) -> DialogueMove:
    """Returns the move of a text without any cue, by form alone."""
    if parsed.actions:
        return DialogueMove.INSTRUCT  # a bare command: "lights on"
    if _OF_OTHERS.match(sentence):
        return DialogueMove.EXPLAIN  # a statement with a subject other than the speaker
    return DialogueMove.ACKNOWLEDGE if sentence.isalpha() else DialogueMove.IRRELEVANT


def _is_small_talk(parsed: ParsedText) -> bool:
    """Returns whether the text contains small talk, but neither driving-domain words nor a reported wish."""
    if parsed.actions or parsed.streets or parsed.objects or parsed.landmarks:
        return False
    if any(status is not GoalStatus.PENDING for status in parsed.statuses):  # "later" is unspecific
        return False
    words = set(parsed.masked.split())
    if not {word.removesuffix("'s") for word in words}.isdisjoint(_ROADS):
        return False
    return not words.isdisjoint(move_cues().small_talk) and words.isdisjoint(move_cues().reports)


def slots_of(text: str, move: DialogueMove) -> frozenset[SlotValue]:
    """Returns the slot values that the rules find in a span of a known move."""
    return _slots(understand(text), move)


def _slots(parsed: ParsedText, move: DialogueMove) -> frozenset[SlotValue]:
    if move is DialogueMove.IRRELEVANT:
        return frozenset()
    values = set(parsed.values)
    if move is DialogueMove.CONFUSE:
        values -= set(_ASKED_FOR)  # "what was that?" asks for a repetition, not for an object
    if parsed.parse is not None and parsed.parse.forbidding and move is DialogueMove.INSTRUCT:
        values.discard(ActionValue.LANE_FOLLOW)  # "no lane changing" names a lane change
    elif parsed.denied and move is DialogueMove.INSTRUCT:
        if {value for value in values if isinstance(value, ActionValue)} - set(parsed.denied):
            values -= set(parsed.denied)  # "don't turn, keep going"
    implied = parsed.parse is not None and StepAction.STOP in parsed.parse.implied
    if move is DialogueMove.CLARIFY and not parsed.actions and _OTHER_SIDE.search(parsed.masked):
        values.add(ActionValue.STOP)
    if implied and move in _QUESTIONS:
        values.discard(ActionValue.STOP)  # "what is that on the right?"
    if implied and move is DialogueMove.REPLY_W and not parsed.objects and not parsed.landmarks:
        values.discard(ActionValue.STOP)  # "on the left": a side, where the question has named the action
    if move is DialogueMove.INSTRUCT and not parsed.landmarks:
        values.discard(GoalStatus.COMPLETE)  # "right, then left, done"
    # One goal is abandoned in favour of another.
    if GoalStatus.ABANDONED in values and len(parsed.landmarks) > 1 and _IN_FAVOUR.search(parsed.text.lower()):
        values.add(GoalStatus.ONGOING)
    return frozenset(values)


@functools.lru_cache(maxsize=2048)
def guess_spans(text: str, after: DialogueMove | None = None, question: str = "") -> tuple[Span, ...]:
    """Segments free English into spans with one act each: by the rules, or by the trained tagger where it is surer.

    Args:
        text: free English; blank text gives no span.
        after: as in `guess_act`, for the first span.
        question: words of the other speaker's last remark, see `understand`.

    Returns:
        Spans whose texts, joined by spaces, equal the text except for repeated spaces.
    """
    if question:
        return _answering_spans(text, after, question)
    spans = rule_spans(text, after)
    if not spans or all(formula_move(_plain_words(span.text)) is not None for span in spans):
        return spans  # formulas have no other move
    read = tagged(spans, span_features(spans, after))
    return read.with_actions(_retagged(text, after, spans, read.spans))


def _answering_spans(text: str, after: DialogueMove | None, question: str) -> tuple[Span, ...]:
    """Returns the spans of what may answer a question with a mere side."""
    plain = plain_answer(text, question)
    spans = guess_spans(plain, after)
    if not spans:
        return spans
    act = answering_act(spans[0].act, understand(spans[0].text), asked_about(question))
    behind = sum(len(span.text.split()) for span in spans[1:])
    said = text.split()
    return (Span(" ".join(said[: len(said) - behind]), act), *spans[1:])


def _retagged(
    text: str, after: DialogueMove | None, spans: tuple[Span, ...], tags: Sequence[tuple[str, DialogueMove]] | None
) -> tuple[Span, ...]:
    """Returns the spans of a text: those of the tagger, unless there are none or they make no sense here."""
    if tags is None or (all(move in _NO_ORDERS for _, move in tags) and understand(text).plan):
        return spans  # "no, not right, left!" orders something, and "okay, drive on" as well
    if after is None and {move for _, move in tags} & _ANSWERING - {span.act.move for span in spans}:
        return spans  # nothing was said that could be answered or corrected
    if any(_joins_sentences(part, spans) for part, _ in tags):
        return spans
    answers = {move for _, move in tags} <= {DialogueMove.REPLY_W, DialogueMove.EXPLAIN}
    if answers and len(spans) == 1 and spans[0].act.move in _QUESTIONS and understand(text).asked is not None:
        return spans  # "much traffic about?" answers no question
    found = list(tags)
    changes = move_cues().answers.get(after) if after is not None else None
    if changes is not None and found[0][1] is not DialogueMove.IRRELEVANT:
        found[0] = found[0][0], changes.get(found[0][1], found[0][1])
    ruled = {(span.text, span.act.move): span for span in spans}
    return tuple(ruled.get((part, move)) or Span(part, DialogueAct(move, slots_of(part, move))) for part, move in found)


def _joins_sentences(part: str, spans: Sequence[Span]) -> bool:
    """Returns whether a part has sentences to which the rules give different moves: "Left. Is that the KFC?"."""
    moves = {span.act.move for span in spans if span.text in part}
    return len(moves) > 1 and _SENTENCE_END.search(part) is not None


@functools.lru_cache(maxsize=2048)
def rule_spans(text: str, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Segments free English as `guess_spans`, by the rules alone: at sentence ends and where a new act begins."""
    words = _tokens(text)
    broken = with_breaks(" ".join(word.replace(" ", "") for word in words), answering=after is not None)
    segments = [segment for sentence in _SENTENCE_END.split(broken) for segment in _segments(sentence)]
    spans: list[Span] = []
    place = 0
    for marked, core in joined([segment for segment in segments if segment], after):
        begin, place = place, place + len(marked.split())
        segment = " ".join(words[begin:place])
        act = guess_act(core, after if not spans else None)
        spans.append(Span(segment, in_context(act, understand(core), [span.act.move for span in spans], after)))
    return tuple(spans)


def _tokens(text: str) -> list[str]:
    """Returns the words of a text, each with the marks that stand alone behind it: "wait ," of "wait , stop"."""
    found: list[str] = []
    for token in text.split():
        if found and _MARKS.fullmatch(token):
            found[-1] += f" {token}"
        else:
            found.append(token)
    return found


def _segments(sentence: str) -> list[str]:
    """Returns the segments of a sentence, split recursively at the first comma before a new act."""
    clauses = _COMMA.split(sentence.strip())
    for number in range(1, min(len(clauses), _MOST_CLAUSES)):
        head, rest = ",".join(clauses[:number]).strip(), ",".join(clauses[number:]).strip()
        if head and rest and _is_boundary(head, rest):
            return [f"{head},", *_segments(rest)]
    return _split_run_on(sentence.strip())


def _split_run_on(sentence: str) -> list[str]:
    """Returns the segments of a sentence, split at clauses without a comma, as in speech recognition output.

    "to the Ikea we still have the KFC for later" names two places in two clauses; "also we ..." always starts a clause.
    """
    joints = _JOINTS.finditer(sentence) if len(understand(sentence).landmarks) > 1 else _ALSO.finditer(sentence)
    for joint in joints:
        head, rest = sentence[: joint.start()], sentence[joint.end() :]
        about, other = understand(head).landmarks, understand(rest).landmarks
        if joint.re is _ALSO or (about and other and not set(about) & set(other)):
            return [head, *_split_run_on(rest)]
    return [sentence]


def _is_boundary(head: str, rest: str) -> bool:
    """Returns whether the texts before and after a comma are separate acts."""
    if any(part.lower().strip(" .?!,") in word_lists().vocatives for part in (head, rest)):
        return False
    if any(is_endearment([word for word in split_words(part) if word != ","]) for part in (head, rest)):
        return False
    if belong_together(head, rest):
        return False
    if stand_apart(head, rest):
        return True
    first, second = guess_act(head), guess_act(rest)
    if second.move is DialogueMove.ALIGN:
        # "turn left, did you get that?" has two acts, "hello, can you hear me?" has one.
        return bool(first.slots) and first.move not in _QUESTIONS
    if second.move is DialogueMove.INSTRUCT:
        return _starts_command(head, rest, first)
    if second.move in _QUESTIONS:
        return first.move in _BEFORE_QUESTIONS and _STARTS_QUESTION.match(rest.lower()) is not None
    if second.move is DialogueMove.EXPLAIN:
        return _starts_statement(head, rest, first, second)
    if second.move is DialogueMove.REPLY_W and first.move in (DialogueMove.REPLY_N, DialogueMove.REPLY_Y):
        return not first.slots and not second.slots - {ActionValue.J_TURN} and bool(second.slots)  # "nope, right"
    return False


def _starts_command(head: str, rest: str, first: DialogueAct) -> bool:
    """Returns whether the text after a comma is a separate command."""
    if _is_clause(head) and first.move in _STATEMENT_MOVES and _SO.match(rest):
        return True  # "we are done here, so the Ikea next"
    parsed = understand(rest)
    if _BARE_NAME.match(parsed.masked):
        return False
    if first.move is DialogueMove.INSTRUCT:
        # "turn left, then right" has two commands, "stop here, at the light" has one.
        return _GOING_ON.match(rest) is not None
    return first.move in _HEADS and parsed.affirms is not False


def _starts_statement(head: str, rest: str, first: DialogueAct, second: DialogueAct) -> bool:
    """Returns whether the text after a comma is a separate statement."""
    if first.move in _BEFORE_REASONS and not first.slots and _STATEMENT.match(rest.lower()) is not None:
        return True
    if not _is_clause(rest) or _SUBORDINATE.match(understand(head).masked):
        return False
    if first.move in _AIMED or first.move in _ANSWERED:
        return True
    # Two statements are separate if they name different landmarks.
    about, other = first.values(Slot.LANDMARK), second.values(Slot.LANDMARK)
    return bool(about) and bool(other) and not set(about) & set(other)


def _is_clause(text: str) -> bool:
    return _CLAUSE.match(understand(text).masked) is not None
