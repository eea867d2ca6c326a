"""The spans of an utterance of which only the words are heard, or the words and the acts."""

from __future__ import annotations

from collections.abc import Sequence

from dorothie_gym.dialogue import Span, guess_spans
from dorothie_gym.ontology import DialogueAct, DialogueMove


def spans_of(text: str, acts: Sequence[DialogueAct] | None, after: DialogueMove | None = None) -> tuple[Span, ...]:
    """Returns the spans of an utterance.

    The words are parted by the rules of `guess_spans`. Where there are more pieces than acts, the last act has all that
    are left; where there are fewer, the words of the last piece are shared out.

    Args:
        text: the words; blank where nothing was said.
        acts: what they do, in order; None where that is not known: then the rules guess it.
        after: move of what the listener said last, for the guess.
    """
    guessed = guess_spans(text, after)
    if acts is None or not guessed:
        return guessed
    pieces = [span.text for span in guessed]
    if not acts:
        return ()
    while len(pieces) < len(acts):
        words = pieces.pop().split()
        share = max(1, len(words) // (len(acts) - len(pieces)))
        pieces += [" ".join(words[:share]), " ".join(words[share:]) or words[-1]]
    last = len(acts) - 1
    pieces = [*pieces[:last], " ".join(pieces[last:])]
    return tuple(Span(piece, act) for piece, act in zip(pieces, acts, strict=True))
