"""Dialogue move of a span by its form: formulas, orders and corrections that the parser has read.

The questions are those of the annotators' decision tree (`ontology.DECISION_TREE`). Where the parse does not settle
them, the cues of `dialogue_act_classifier` do.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.clause_moods import ORDERED, ClauseMood
from dorothie_gym.dialogue.formulas import OPENING_YES, first_answer, formula_move, leading_answer
from dorothie_gym.dialogue.lexicon import split_words
from dorothie_gym.dialogue.nlu import ParsedText, understand
from dorothie_gym.dialogue.numerals import NUMBER_WORDS
from dorothie_gym.dialogue.plan_reading import read_plan
from dorothie_gym.dialogue.reactions import corrects, denials, insists, is_greeting, short_answer
from dorothie_gym.dialogue.route_grammar import route_grammar
from dorothie_gym.dialogue.routes import StepAction
from dorothie_gym.dialogue.signs import is_mere_sign
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus

if TYPE_CHECKING:
    from dorothie_gym.dialogue.plan_parser import PlanParse

_SHORT_NO: Final = 8
"""Letters of a "not yet" that answers."""

_SHORT: Final = 4
"""Words of an utterance that can be a mere sign of hearing."""

_NEWS: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.CONFIRM, DialogueMove.ACKNOWLEDGE})
"""Moves of the car that a listener takes note of, or sets right."""

_VAGUE: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.IRRELEVANT, DialogueMove.ACKNOWLEDGE})
"""Moves that the cues give to an answer of unknown form."""

_UNSURE: Final = frozenset({DialogueMove.EXPLAIN, DialogueMove.IRRELEVANT})
"""Moves that the cues give to an order of unknown form."""

_COMMA_ANSWERS: Final = ("no ,", "nope ,", "nah ,")
_WHAT_TO_DO: Final = ("what you", "what we", "okay so what you", "so what you", "right so what you", "all you")
_CONDITIONS: Final = re.compile(r"(?:(?:and|so|then|but|okay|now|well|right|,) )*(?:where|when)(?:ever)? ")
"""First words of a condition of an order: "where the wall ends, make a left"."""
_ASKED: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.QUERY_W, DialogueMove.CONFUSE})
_OFFERS: Final = (
    "may i",
    "shall i",
    "should i",
    "shall we go to",
    "shall we try",
    "should we",
    "like me",
    "want me",
    "would you like",
    "do you want",
    "if i",
    "can i take",
    "do i",
    "will i",
    "would i",
)
"""Words by which the car offers what it asks: "would you like me to turn?"."""

_FOR_PASSENGERS: Final = frozenset({StepAction.STOP, StepAction.VISIT, StepAction.WAIT})
"""Actions that a passenger asks for with "can I"; others the car offers."""

_NEWS_OF_TASKS: Final = frozenset({GoalStatus.COMPLETE, GoalStatus.PENDING})
_FEELING: Final = (["love"], ["like"], ["hate"], ["adore"])
"""Verbs of small talk of the first person."""

_CHARGING: Final = (["never"], ["always"], ["keep"], ["don't"])
"""Words behind "you" of a complaint about the car."""

_ALERTS: Final = ("tell me when", "tell us when", "let me know when", "let us know when")
_ANSWERED: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.CHECK})
"""Moves that yes and no answer."""
_SPEAKERS: Final = frozenset({"i", "we", "you", "he", "she", "they"})
_PAST: Final = frozenset(
    {
        "lost",
        "missed",
        "passed",
        "saw",
        "went",
        "left",
        "#left",
        "forgot",
        "overshot",
        "ran",
        "took",
        "came",
        "found",
        "drove",
    }
)
_HESITATIONS: Final = frozenset({"um", "uh", "er", "erm", "hm", "hmm", "mm", "mmm", "ehm", "wha", "th", "so", "and"})
_CALLS: Final = frozenset(
    {"whoa", "woah", "oh", "ooh", "hey", "oi", "look", "listen", "hang", "hold", "goodness", "gosh", "god", "blimey"}
)
_SOFT_OPENERS: Final = frozenset({"and", "so", "okay", "ok", "then", "but", "well", "right", ","})
"""Words in front of a condition that opens an order: "and where the wall ends, turn left"."""

_REPAIRING: Final = frozenset(
    {
        "no",
        "nope",
        "nah",
        "wait",
        "mean",
        "meant",
        "sorry",
        "rather",
        "actually",
        "scratch",
        "correction",
        "mistake",
        "oops",
        "whoops",
        "strike",
        "forget",
        "make",
        "saying",
        "not",
    }
)
"""Words of which a correction has one; others need not be tried."""
_PERHAPS: Final = ("perhaps ", "maybe ", "possibly ")
_NO_DOING: Final = ("no turning", "no more", "no stopping", "no parking", "no u turn", "no overtaking", "no speeding")
_FORBIDDEN_LATER: Final = (["do", "not"], ["don't"], ["please", "don't"], ["never"])
_FORBIDDING: Final = frozenset({"never", "don't", "dont", "please"})
_SIGNS_FIRST: Final = frozenset({DialogueMove.REPLY_Y, DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM})
_ASKING: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.CHECK, DialogueMove.QUERY_W, DialogueMove.ALIGN})
"""Moves of the other speaker behind which a yes is an answer, or what was asked for."""

_SIGHS: Final = frozenset({"aw", "aww", "oh", "ah", "well"})
_NO_ORDERS: Final = frozenset({DialogueMove.REPLY_N, DialogueMove.REPLY_Y, DialogueMove.QUERY_YN})
_SUPPOSING: Final = ("isn't ", "wasn't ", "aren't ", "weren't ", "didn't ", "haven't ", "hasn't ")
_OPEN_QUESTIONS: Final = ("whereabouts ", "how long ", "how far ", "how fast ", "what are ", "what am ")
"""First words of open questions that recognisers write without a mark."""

_CHOICE: Final = re.compile(
    r"\w or (?!not\b|what\b|something|anything|so\b|did|do\b|are\b|is\b|have|should|shall|was|can\b|will\b|two\b"
    r"|three\b)"
)
"""A question for one of two answers."""

_STATE: Final = re.compile(
    r"\b(?:i'm|i am|i feel|i'm feeling|we're|we are|he's|she's|they're|my \w+(?:'s| is| are| feels?)?"
    r"|the \w+(?:'s| is| are)|kids are|baby's) (?:\w+ ){0,3}"
    r"(?:sick|faint|dizzy|poorly|starving|freezing|boiling|asleep|sleeping|bursting"
    r"|nervous|scared|unwell|killing me|aching|hurting|crying|late for|nauseous|carsick|exhausted)\b"
)
"""State of somebody in the car."""

_HEARD_NAME: Final = re.compile(r"[\w #']+ , (?:the )?#(?:landmark|street)( on #street)? ?")
_DENYING: Final = (
    "it is not",
    "it's not",
    "it isn't",
    "that isn't",
    "that is not",
    "that's not",
    "we're not",
    "i'm not",
)
_OWN_REPAIR: Final = re.compile(r"^(?!no\b|nope\b|i\b|not\b).+\bi (?:mean|meant) (?!$)")
"""Words by which a speaker corrects, or explains, what he has just said himself."""

_RULED_OUT: Final = re.compile(r"\bwe (can|could)\b")
"""Words by which a speaker tells rather than orders that an errand is off."""
_SIDE_ONLY: Final = re.compile(r"(just |over |there |up )*(on|to) (the|your|our|my) (left|right)([ -]hand side| side)?")


def decide(parsed: ParsedText, move: DialogueMove, after: DialogueMove | None) -> DialogueMove:
    """Returns the move of a span.

    Args:
        parsed: the span.
        move: move by the cues.
        after: move of the other speaker before it.
    """
    parse = parsed.parse
    if parse is None:
        return move
    answer = first_answer(parsed) or leading_answer(parsed) if after in _ANSWERED else None
    if answer is not None and move is not DialogueMove.CLARIFY:
        return answer
    if after in _NEWS and corrects(parsed):
        return DialogueMove.CLARIFY
    if after is DialogueMove.QUERY_YN and move in _VAGUE and (short := short_answer(parsed)) is not None:
        return short
    if after is DialogueMove.CHECK and insists(parsed):
        return DialogueMove.CLARIFY  # "first right, I told you"
    if after in _ANSWERED and parsed.masked.startswith("not ") and move is not DialogueMove.REPLY_U:
        return DialogueMove.REPLY_N  # "not the second, the third"
    if after not in _ANSWERED and _forbids(parsed, move):
        return DialogueMove.INSTRUCT
    if after is None and _refuses(parsed, move):
        return DialogueMove.INSTRUCT  # "not this one, the next"
    requested = ClauseMood.REQUEST in parse.moods
    ordered = bool(parse.plan.steps or parse.contingent) or bool(parse.denied and requested)
    if ordered:
        return _order(parsed, move, after, requested=requested)
    return _unordered(parsed, parse, move, after)


def _refuses(parsed: ParsedText, move: DialogueMove) -> bool:
    """Returns whether words with a "not" refuse something that nobody has offered in words."""
    unnamed = move is DialogueMove.CLARIFY and not (parsed.landmarks or parsed.streets)
    denying = move is DialogueMove.REPLY_N or unnamed
    return denying and parsed.masked.startswith("not ") and len(parsed.masked) > _SHORT_NO


def _unordered(parsed: ParsedText, parse: PlanParse, move: DialogueMove, after: DialogueMove | None) -> DialogueMove:
    """Returns the move of words that order no step."""
    opened = parsed.masked.startswith(_OPEN_QUESTIONS)
    if parsed.asked is not None and move in _UNSURE and (parsed.question or opened):
        asks = opened or bool(parsed.asked.asks)  # "much traffic about?"
        return DialogueMove.QUERY_W if asks else DialogueMove.QUERY_YN
    if move is DialogueMove.EXPLAIN and parse.cancelled and not _RULED_OUT.search(parsed.masked):
        return DialogueMove.INSTRUCT
    if move is DialogueMove.INSTRUCT and set(parse.moods) == {ClauseMood.QUESTION}:
        return DialogueMove.QUERY_YN  # "can we make it by six"
    if move is DialogueMove.QUERY_YN and parsed.masked.startswith(_SUPPOSING):
        return DialogueMove.CHECK  # "isn't that the KFC?"
    if move is DialogueMove.QUERY_YN and _CHOICE.search(parsed.masked):
        return DialogueMove.QUERY_W  # "on our side or across the road?"
    if move is DialogueMove.QUERY_W and not parsed.question and parsed.masked.startswith(_ALERTS):
        return DialogueMove.INSTRUCT
    if move is DialogueMove.IRRELEVANT and (parsed.told is not None or _STATE.search(parsed.masked)):
        return DialogueMove.EXPLAIN
    return _stated(parsed, parse, move, after)


def _stated(parsed: ParsedText, parse: PlanParse, move: DialogueMove, after: DialogueMove | None) -> DialogueMove:
    """Returns the move of words that may state something."""
    words = parsed.masked.split()
    denied = parsed.masked.startswith(_DENYING) or words[:1] in (["not"], ["ain't"])
    if after in _ANSWERED and denied and move is not DialogueMove.REPLY_U:
        return DialogueMove.REPLY_N
    words = words[2:] if words[1:2] == [","] and words[0] in _SIGHS else words
    if move is DialogueMove.IRRELEVANT and words[:1] == ["you"] and words[1:2] in _CHARGING:
        return DialogueMove.EXPLAIN  # "you never listen"
    if words[1:3] == ["used", "to"] and not (parsed.landmarks or parsed.streets or parsed.actions or parsed.turns):
        return DialogueMove.IRRELEVANT if move is DialogueMove.EXPLAIN else move
    if words[:1] == ["i"] and words[1:2] in _FEELING and not parsed.values and words[2:3] != ["to"]:
        return DialogueMove.IRRELEVANT if move is DialogueMove.EXPLAIN else move
    stated = set(parse.moods) == {ClauseMood.STATEMENT} and not any(
        words in parsed.masked for words in (" if i were you", " plenty", " enough")
    )
    past = len(words) > 1 and words[0] in _SPEAKERS and words[1] in _PAST  # "we lost him at the KFC"
    if move is DialogueMove.INSTRUCT and (stated or past):
        return DialogueMove.EXPLAIN
    return move


def _order(parsed: ParsedText, move: DialogueMove, after: DialogueMove | None, *, requested: bool) -> DialogueMove:
    """Returns the move of words that order something."""
    parse = parsed.parse
    if after in _NEWS and _HEARD_NAME.fullmatch(parsed.masked) and _acknowledges(parsed):
        return DialogueMove.ACKNOWLEDGE  # "all right, the KFC"
    named = parse is not None and parse.bare and any(step.action is StepAction.FOLLOW for step in parse.plan)
    news = not _NEWS_OF_TASKS.isdisjoint(parsed.statuses) and "can wait" not in parsed.text.lower()
    named = named and parse is not None and len(parse.plan.steps) < 2 and not requested
    unsure = requested or (parsed.masked.startswith(_PERHAPS) and parse is not None and not parse.bare)
    alone = move is DialogueMove.REPLY_N or (move is DialogueMove.REPLY_U and unsure)
    if after is None and alone and not parsed.question and not parsed.masked.startswith(_COMMA_ANSWERS):
        return DialogueMove.INSTRUCT  # there is nothing that it reacts to
    if move in _UNSURE and not named and not news:
        return DialogueMove.INSTRUCT
    goes_on = _runs_on(parsed) or (after is None and _sends_on(parsed))
    if after not in _ASKING and move in _SIGNS_FIRST and goes_on:
        return DialogueMove.INSTRUCT  # "aye nip up the lane on the left"
    commanded = parse is not None and set(parse.moods) == {ClauseMood.COMMAND}
    confirms_nothing = move is DialogueMove.CONFIRM and after is None and _begins_with_order(parsed)
    if commanded and not parsed.question and (move is DialogueMove.QUERY_YN or confirms_nothing):
        return DialogueMove.INSTRUCT  # "do the Shell first"; "stop by the Shell on the way to the KFC"
    if move in _ASKED and requested and not (move is DialogueMove.QUERY_W and parsed.question):
        offered = any(f"{words} " in f"{parsed.masked} " for words in _OFFERS)
        mine = any(f"{words} " in parsed.masked for words in ("can i", "could i", "may i", "might i"))
        offered = offered or (mine and not all(step.action in _FOR_PASSENGERS for step in parsed.plan))
        return move if offered else DialogueMove.INSTRUCT
    told = move is DialogueMove.QUERY_W and (
        parsed.masked.startswith(_WHAT_TO_DO) or (_ends_in_order(parse) and _CONDITIONS.match(parsed.masked))
    )
    if (move is DialogueMove.CHECK or told) and not parsed.question:
        return DialogueMove.INSTRUCT
    if (
        move is DialogueMove.REPLY_N
        and after not in _ANSWERED
        and parsed.masked.startswith(("no #", "no lights", "no head"))
    ):
        return DialogueMove.INSTRUCT
    leaving = requested and all(step.action is StepAction.STOP for step in parsed.plan) and after is None
    if move is DialogueMove.ACKNOWLEDGE and (
        leaving or parsed.masked.startswith(("sorry", "oops", "whoops", "whoa", "woah"))
    ):
        return DialogueMove.INSTRUCT  # "sorry, left"; "okay, that's me"
    if move is DialogueMove.CLARIFY and after is DialogueMove.QUERY_W:
        return DialogueMove.REPLY_W
    own = _OWN_REPAIR.search(parsed.masked) is not None or (parsed.parse is not None and parsed.parse.repaired)
    if move is DialogueMove.CLARIFY and own and after is None:
        return DialogueMove.INSTRUCT
    return move


def _begins_with_order(parsed: ParsedText) -> bool:
    """Returns whether the first words are an imperative."""
    words = parsed.masked.split()
    match = route_grammar().terminals.longest(words, 0)
    return match is not None and match.group in ("actions", "verbs") and not words[0].endswith("ing")


def _ends_in_order(parse: PlanParse | None) -> bool:
    """Returns whether the last clause is an order, with a step."""
    return parse is not None and bool(parse.plan.steps) and parse.moods[-1] in ORDERED


def _acknowledges(parsed: ParsedText) -> bool:
    """Returns whether the words before the first comma show that something was heard."""
    words = split_words(parsed.text)
    return "," in words and formula_move(words[: words.index(",")]) is DialogueMove.ACKNOWLEDGE


def _runs_on(parsed: ParsedText) -> bool:
    """Returns whether no comma stands behind the yes with which an order begins."""
    words = split_words(parsed.text)
    return len(words) > 3 and words[0] in OPENING_YES and words[1] != ","


def _sends_on(parsed: ParsedText) -> bool:
    """Returns whether words that begin like a sign order something: "please do not stop", "okay, off we go again"."""
    goes = len(parsed.plan) == 1 and parsed.plan.steps[0].action is StepAction.GO and len(parsed.masked.split()) > 4
    return goes or parsed.masked.startswith("please do not")


def _forbids(parsed: ParsedText, move: DialogueMove) -> bool:
    """Returns whether what looks like a "no" or a question forbids or corrects: "never stop on a bridge"."""
    if parsed.question or parsed.parse is None or move not in _NO_ORDERS:
        return False
    words = parsed.masked.split()
    corrected = bool(parsed.plan.steps) and words[:3] == ["no", ",", "not"]
    repaired = corrected or (parsed.parse.repaired and bool(parsed.plan.steps))
    denied = bool(parsed.parse.denied) and (words[0] in _FORBIDDING or words[1:2] == ["#acting"])
    return (repaired and move is DialogueMove.REPLY_N) or denied or parsed.masked.startswith(_NO_DOING)


def sign_of_hearing(parsed: ParsedText, move: DialogueMove, after: DialogueMove | None) -> bool:
    """Returns whether unknown words that follow news are a mere sign of having heard them."""
    short = len([word for word in parsed.masked.split() if word != ","]) <= _SHORT
    empty = not parsed.values and not parsed.plan.steps and not parsed.question
    return move is DialogueMove.IRRELEVANT and after in _NEWS and short and empty


def in_context(
    act: DialogueAct, parsed: ParsedText, before: Sequence[DialogueMove], after: DialogueMove | None
) -> DialogueAct:
    """Returns the act of a span among the others of its utterance.

    An answer, or a correction, goes on over the orders that follow it; without a question, "the second left" is none.
    A greeting answers no question.

    Args:
        act: act of the span alone.
        parsed: the span.
        before: moves of the earlier spans of the utterance.
        after: move of the other speaker before the utterance.
    """
    move, ordered = act.move, bool(parsed.plan.steps)
    if move is DialogueMove.REPLY_W and not ordered and not act.slots and is_greeting(parsed.text):
        move = DialogueMove.IRRELEVANT  # "hello, how are you?" after "where to?"
    answers = after is DialogueMove.QUERY_W or "i'd say" in parsed.masked
    if move is DialogueMove.REPLY_W and ordered and not answers:
        move = DialogueMove.INSTRUCT
    goes_on = after is DialogueMove.QUERY_W and set(before) == {DialogueMove.REPLY_W}
    if move is DialogueMove.INSTRUCT and before and goes_on and ordered:
        move = DialogueMove.REPLY_W
    stops = parsed.parse is not None and StepAction.STOP in parsed.parse.implied and ordered
    return act if move is act.move else DialogueAct(move, act.slots | ({ActionValue.STOP} if stops else set()))


def belong_together(head: str, rest: str) -> bool:
    """Returns whether the words before and after a comma are one span: a condition and its order, or a correction."""
    first, second = read_plan(head), read_plan(rest)
    if split_words(head)[-2:] in _FORBIDDEN_LATER and second.plan.steps:
        return True  # "do not, whatever happens, go faster than thirty"
    if split_words(head)[:1] == ["not"] and first.turned and not first.plan.steps and second.plan.steps:
        return True  # "not this one, the one after"
    if (first.conditional and not first.described) or (second.conditional and not second.described):
        return True  # "if the road is blocked, take Murfin"
    if _SIDE_ONLY.fullmatch(rest.strip(" .,!?").lower()) and not first.plan.steps:
        return True  # "it has a red door, on the right"
    opening = list(itertools.dropwhile(_SOFT_OPENERS.__contains__, split_words(head)))
    opens = route_grammar().terminals.longest(opening, 0) if opening else None
    when = opens is not None and opens.group == "relations"
    if (
        (first.waiting or when)
        and not first.plan.steps
        and second.plan.steps
        and ClauseMood.STATEMENT not in first.moods[:1]
    ):
        return True
    if _REPAIRING.isdisjoint(split_words(rest)[:4]) and _REPAIRING.isdisjoint(split_words(head)[-4:]):
        return False
    return read_plan(f"{head} {rest}").repaired and not first.repaired and not second.repaired


def stand_apart(head: str, rest: str) -> bool:
    """Returns whether a comma separates a statement from an order, or an order from a statement."""
    first, second = read_plan(head), read_plan(rest)
    if formula_move(split_words(rest)) is not None:
        return False
    states, orders = {ClauseMood.STATEMENT}, bool(second.plan.steps)
    if set(first.moods) == states and orders and second.moods[0] in ORDERED:
        return bool(read_plan(f"{head}, {rest}").plan.steps)  # not in "here we are, the KFC"
    return bool(first.plan.steps) and set(second.moods) == states and not second.repaired


def joined(segments: Sequence[str], after: DialogueMove | None) -> list[tuple[str, str]]:
    """Returns the segments of an utterance with those joined to the next one that are no act of their own.

    These are hesitations, counts ("one, straight on"), conditions that wait for their order, and, behind news, the "no"
    of a correction.

    Returns:
        The segments, each with its words that tell the act: without hesitations and counts.
    """
    found: list[tuple[str, str]] = []
    for segment in segments:
        if found and (_is_noise(found[-1][1]) or (len(found) == 1 and _opens(found[-1][1], segment, after))):
            full = f"{found[-1][0]} {segment}"
            found[-1] = full, segment if understand(segment).plan.steps or len(split_words(segment)) > 2 else full
        elif found and _is_unfinished(found[-1][1], segment, after if len(found) == 1 else None):
            found[-1] = f"{found[-1][0]} {segment}", f"{found[-1][1]} {segment}"
        else:
            found.append((segment, segment))
    return found


def _opens(segment: str, following: str, after: DialogueMove | None) -> bool:
    """Returns whether a "right," opens a statement rather than tells a side: "right, that's the shopping done"."""
    answers = after in (DialogueMove.QUERY_W, DialogueMove.CONFIRM)
    return split_words(segment) == ["right", ","] and not answers and not read_plan(following).plan.steps


def _is_noise(segment: str) -> bool:
    words = [word for word in split_words(segment) if word != ","]
    if words and words[0] in _CALLS and is_mere_sign(segment):
        return True  # "oh look, ..."
    return bool(words) and all(word in _HESITATIONS or word in NUMBER_WORDS for word in words)


def _is_unfinished(segment: str, following: str, after: DialogueMove | None) -> bool:
    words = [word for word in split_words(segment) if word != ","]
    parse, rest = read_plan(segment), read_plan(following)
    if parse.waiting and not parse.described and rest.plan.steps and len(rest.plan) == 1:
        return True
    reacts = after in _NEWS or (after is None and split_words(following)[:1] == ["not"])
    denial = reacts and formula_move(words) is DialogueMove.REPLY_N
    return denial and bool(rest.plan.steps or not denials().isdisjoint(split_words(following)))
