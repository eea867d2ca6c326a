"""Briefs: what a client says in a session whose outcome depends on talk, written so that people can play it too.

A brief is the story of a storyboard. It contains the request, replies to questions and statements, and nothing that the
participant cannot know.
"""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from typing import Final


class TalkFamily(enum.StrEnum):
    """Family of scenarios whose outcome depends on talk."""

    ASK_FIRST = "ask-first"
    """Requests of which some must be settled by a question or a statement before anything is done."""
    ADMIT_IT = "admit-it"
    """Requests of which some cannot or must not be fulfilled."""


class Cue(enum.StrEnum):
    """Utterance of the Co-Wizard that a reply answers."""

    ASKED = "asks"
    """A question that contains one of the words."""
    TOLD = "says"
    """An utterance that contains one of the words."""


@dataclass(frozen=True, kw_only=True)
class Reply:
    """Reply of the client.

    Attributes:
        cue: kind of the utterance that it answers.
        words: words of which the utterance contains at least one.
        text: the reply.
    """

    cue: Cue
    words: tuple[str, ...]
    text: str


@dataclass(frozen=True, kw_only=True)
class Brief:
    """Words of a client.

    Attributes:
        request: first utterance.
        replies: replies in the order in which they are given; the last one settles the question of the request.
        declined: reply to a refusal.
        otherwise: reply to any other question.
    """

    request: str
    replies: tuple[Reply, ...] = ()
    declined: str = "All right, then do that."
    otherwise: str = "I have said all I know."

    @property
    def settling(self) -> str:
        """Reply that settles the question; empty if there is none."""
        return self.replies[-1].text if self.replies else ""

    def __str__(self) -> str:
        """Returns the story that `read_brief` reads."""
        lines = [f'Say to the car: "{self.request}"']
        lines += [f'If it {reply.cue} ({", ".join(reply.words)}): "{reply.text}"' for reply in self.replies]
        lines += [f'If it declines: "{self.declined}"', f'If it asks anything else: "{self.otherwise}"']
        return "\n".join(lines)


_REQUEST: Final = re.compile(r'^Say to the car: "(.*)"$', re.MULTILINE)
_REPLY: Final = re.compile(r'^If it (asks|says) \((.*)\): "(.*)"$', re.MULTILINE)
_DECLINED: Final = re.compile(r'^If it declines: "(.*)"$', re.MULTILINE)
_OTHERWISE: Final = re.compile(r'^If it asks anything else: "(.*)"$', re.MULTILINE)


def read_brief(story: str) -> Brief | None:
    """Returns the brief of a story, the inverse of `str`; None for any other story."""
    request, declined, otherwise = (found.search(story) for found in (_REQUEST, _DECLINED, _OTHERWISE))
    if request is None or declined is None or otherwise is None:
        return None
    replies = tuple(
        Reply(cue=Cue(cue), words=tuple(words.split(", ")), text=text) for cue, words, text in _REPLY.findall(story)
    )
    return Brief(request=request[1], replies=replies, declined=declined[1], otherwise=otherwise[1])
