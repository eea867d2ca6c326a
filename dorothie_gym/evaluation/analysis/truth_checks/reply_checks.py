"""Replies: questions that are answered, and in the form that they ask for."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case, judged
from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import UtteranceRecord
    from dorothie_gym.session.recording.session import Session

ANSWERED_WITHIN: Final = 12.0
"""Time within which a question is answered [s]."""

_QUESTIONS: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.QUERY_W, DialogueMove.CHECK})
_BARE: Final = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.CONFIRM})


def answers_given(session: Session) -> Iterator[Case]:
    """Yields the utterances that end with a question; right are those after which the other speaker says something.

    An utterance does not count if the session ends, or the same speaker goes on, before an answer is due.
    """
    utterances = session.utterances()
    for number, said in enumerate(utterances):
        if said.moves[-1].act.move not in _QUESTIONS or said.end + ANSWERED_WITHIN > session.duration:
            continue
        following = utterances[number + 1] if number + 1 < len(utterances) else None
        if following is not None and following.start - said.end <= ANSWERED_WITHIN:
            if following.speaker is not said.speaker:
                yield judged(True, said, following)
        else:
            yield judged(False, said)


def forms_of_answers(session: Session) -> Iterator[Case]:
    """Yields answers to open questions; wrong are those that are only a yes or a no."""
    for said, reply in _exchanges(session):
        if said.moves[-1].act.move is DialogueMove.QUERY_W:
            yield judged(not _is_bare(reply), said, reply)


def refusals(session: Session) -> Iterator[Case]:
    """Yields the replies to utterances that end with a request; wrong are those that are only a no."""
    for said, reply in _exchanges(session):
        if said.moves[-1].act.move is DialogueMove.INSTRUCT:
            bare = all(move.act.move is DialogueMove.REPLY_N and not move.act.slots for move in reply.moves)
            yield judged(not bare, said, reply)


def _exchanges(session: Session) -> Iterator[tuple[UtteranceRecord, UtteranceRecord]]:
    """Yields the utterances that the other speaker replies to at once, with the reply."""
    utterances = session.utterances()
    for said, reply in itertools.pairwise(utterances):
        if reply.speaker is not said.speaker and 0.0 <= reply.start - said.end <= ANSWERED_WITHIN:
            yield said, reply


def _is_bare(reply: UtteranceRecord) -> bool:
    return all(move.act.move in _BARE and not move.act.slots for move in reply.moves)
