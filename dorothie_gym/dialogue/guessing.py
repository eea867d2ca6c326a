"""The act behind words that come without one: a rule-based guess for partners who only talk."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass

from dorothie_gym.dialogue.lexicon import LexiconError, read_data, strings
from dorothie_gym.dialogue.understanding import Heard, understand
from dorothie_gym.dialogue.utterances import Span
from dorothie_gym.ontology import DialogueAct, DialogueMove, OntologyError, parse_move

_SENTENCE_END = re.compile(r"(?<=[.?!])\s+")

_HEADS = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.EXPLAIN})
"""Moves behind which a command stands on its own: "no, stop"; "I can hardly see, slow down"."""


@dataclass(frozen=True)
class Cues:
    """Expressions that betray a move.

    Attributes:
        moves: pairs of an expression over masked words and its move; the first that is found decides.
        answers: for the move before, what the guess becomes in its light.
    """

    moves: tuple[tuple[re.Pattern[str], DialogueMove], ...]
    answers: Mapping[DialogueMove, Mapping[DialogueMove, DialogueMove]]


def guess_act(text: str, after: DialogueMove | None = None) -> DialogueAct:
    """Guesses move and slots from words.

    Args:
        text: free English, see `understand`.
        after: the other speaker's last move, if it still stands open: "left" after a QueryW is a ReplyW.

    Returns:
        The act; Irrelevant without slots if nothing is recognised.
    """
    return act_of(understand(text), after)


def act_of(heard: Heard, after: DialogueMove | None = None) -> DialogueAct:
    """Returns the act that fits what was heard; see `guess_act`."""
    cues = _cues()
    sentence = heard.masked.strip(" ,")
    move = next((move for pattern, move in cues.moves if pattern.search(sentence)), None)
    if move is None:
        # No cue at all: a bare command ("lights on") if something is to be done, else nothing we understand.
        move = DialogueMove.INSTRUCT if heard.actions else DialogueMove.IRRELEVANT
    if after is not None:
        move = cues.answers.get(after, {}).get(move, move)
    return DialogueAct(move, frozenset() if move is DialogueMove.IRRELEVANT else heard.values)


def guess_spans(text: str, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Parts free English into acts: at the ends of sentences, and where a command follows an answer or a reason.

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
    head, comma, rest = sentence.partition(",")
    command = guess_act(rest).move is DialogueMove.INSTRUCT and understand(rest).affirms is not False
    if comma and command and guess_act(head).move in _HEADS:
        return [head.strip() + comma, rest.strip()]
    return [sentence.strip()]


@functools.cache
def _cues() -> Cues:
    data = read_data("cues.yaml")
    moves = []
    for number, rule in enumerate(data.get("moves", [])):
        where = f"cues.yaml: moves[{number}]"
        for text in strings(f"{where}.cues", rule.get("cues")):
            try:
                moves.append((re.compile(text), parse_move(rule["move"])))
            except (re.error, OntologyError) as error:
                raise LexiconError(f"{where}: {text!r}: {error}") from error
    answers = {
        parse_move(before): {parse_move(guess): parse_move(move) for guess, move in changes.items()}
        for before, changes in data.get("answers", {}).items()
    }
    return Cues(tuple(moves), answers)
