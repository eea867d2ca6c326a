"""Repairs: how long they last, whether they vary their words, and whether a "what?" is answered by a "what?"."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case, judged, plain_words
from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import UtteranceRecord
    from dorothie_gym.session.recording.session import Session

LONGEST_RUN: Final = 4
"""Largest number of successive turns that may be spent on a repair."""

PAUSE: Final = 15.0
"""Silence that ends a run of repair [s]."""

_REPAIRS: Final = frozenset({DialogueMove.CONFUSE, DialogueMove.CLARIFY})


def runs_of_repair(session: Session) -> Iterator[tuple[UtteranceRecord, ...]]:
    """Yields the runs of successive utterances that repair the dialogue.

    An utterance repairs if it asks for a repetition, clarifies, or repeats an act that the other speaker has not
    understood.
    """
    run: list[UtteranceRecord] = []
    before: list[UtteranceRecord] = []
    for said in session.utterances():
        if run and (not _repairs(said, before) or said.start - run[-1].end > PAUSE):
            yield tuple(run)
            run = []
        if _repairs(said, before):
            run.append(said)
        before = [*before[-5:], said]
    if run:
        yield tuple(run)


def asks_to_repeat(said: UtteranceRecord) -> bool:
    """Returns whether an utterance only says that the other speaker was not understood."""
    return all(move.act.move is DialogueMove.CONFUSE for move in said.moves)


def _repairs(said: UtteranceRecord, before: list[UtteranceRecord]) -> bool:
    if any(move.act.move in _REPAIRS for move in said.moves):
        return True
    if not before or before[-1].speaker is said.speaker or not asks_to_repeat(before[-1]):
        return False
    own = [move.act for earlier in before if earlier.speaker is said.speaker for move in earlier.moves]
    return any(move.act in own for move in said.moves)


def lengths(session: Session) -> Iterator[Case]:
    """Yields the runs of repair; right are those of at most `LONGEST_RUN` turns."""
    for run in runs_of_repair(session):
        yield judged(len(run) <= LONGEST_RUN, *run)


def wordings(session: Session) -> Iterator[Case]:
    """Yields the successive turns of one speaker in a run of repair; right are those with other words."""
    for run in runs_of_repair(session):
        for number, said in enumerate(run):
            former = next((other for other in reversed(run[:number]) if other.speaker is said.speaker), None)
            if former is not None:
                yield judged(plain_words(former.text) != plain_words(said.text), former, said)


def replies_to_repairs(session: Session) -> Iterator[Case]:
    """Yields the requests to repeat that are answered; right are those not answered by another such request."""
    utterances = session.utterances()
    for said, reply in itertools.pairwise(utterances):
        if asks_to_repeat(said) and reply.speaker is not said.speaker and reply.start - said.end < PAUSE:
            yield judged(not asks_to_repeat(reply), said, reply)
