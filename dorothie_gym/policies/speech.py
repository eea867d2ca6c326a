"""What a speaker means to say next, and when it is its turn."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dorothie_gym.dialogue import SpeakerStyle, Wording, WordingContext, speech_seconds, word_acts
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role, SlotValue
from dorothie_gym.spaces import Speech

PAUSE = 0.8
"""Silence left between an utterance and the next one of the same speaker [s]."""

ANSWER_TIME = 3.0
"""Silence left after something that wants an answer [s]."""

LONGEST_BREATH = 3
"""Most acts that are worded together."""

MEMORY = 6
"""So many of its latest remarks a speaker remembers."""

_WANTS_ANSWER = frozenset(
    {DialogueMove.INSTRUCT, DialogueMove.ALIGN, DialogueMove.CHECK, DialogueMove.QUERY_YN, DialogueMove.QUERY_W}
)


@dataclass(frozen=True, kw_only=True)
class Remark:
    """Something to be said.

    Attributes:
        act: what it does.
        wording: particulars for the words.
        text: the words, where they are settled already.
        joined: whether it is said in the same breath as the remark before.
        urgent: whether it may be said without leaving the other time to answer.
        expires: not said after this time [s].
    """

    act: DialogueAct
    wording: Wording = field(default_factory=Wording)
    text: str = ""
    joined: bool = False
    urgent: bool = False
    expires: float = math.inf


def remark(
    move: DialogueMove,
    *values: SlotValue,
    wording: Wording | None = None,
    joined: bool = False,
    urgent: bool = False,
    expires: float = math.inf,
) -> Remark:
    """A remark from a move and its slot values."""
    return Remark(
        act=DialogueAct.of(move, *values),
        wording=wording if wording is not None else Wording(),
        joined=joined,
        urgent=urgent,
        expires=expires,
    )


@dataclass(frozen=True, kw_only=True)
class SpeechState:
    """A speaker's intentions; frozen, so every change gives a new one.

    Attributes:
        role: who speaks.
        queue: remarks to come, the next first.
        quiet_until: nothing that is not urgent is said before this time [s].
        last: what was said last, None at first.
        last_end: when that was over [s].
        style: how the speaker puts things; None for the middle of all.
        said: the latest remarks, the last one at the end.
        heard: values that the other has just named: they may be referred to by "that one".
        other: the other's last move, None at first.
    """

    role: Role
    queue: tuple[Remark, ...] = ()
    quiet_until: float = 0.0
    last: Remark | None = None
    last_end: float = -math.inf
    style: SpeakerStyle | None = None
    said: tuple[Remark, ...] = ()
    heard: frozenset[SlotValue] = frozenset()
    other: DialogueMove | None = None

    @property
    def idle(self) -> bool:
        """Whether nothing waits to be said."""
        return not self.queue

    def has_just_spoken(self, now: float, within: float) -> bool:
        """Whether the last words were over no longer than `within` ago [s], or are still being said."""
        return now - self.last_end < within

    def plan(self, *remarks: Remark) -> SpeechState:
        """The same with remarks added at the end."""
        return replace(self, queue=(*self.queue, *remarks))

    def plan_first(self, *remarks: Remark) -> SpeechState:
        """The same with remarks added in front: an answer comes before what one wanted to say anyway."""
        return replace(self, queue=(*remarks, *self.queue))

    def cleared(self) -> SpeechState:
        """The same with nothing left to say."""
        return replace(self, queue=())

    def hold(self, until: float) -> SpeechState:
        """The same, silent until a time [s] at least."""
        return replace(self, quiet_until=max(self.quiet_until, until))

    def heard_other(self, now: float, acts: Sequence[DialogueAct] = ()) -> SpeechState:
        """The same after the other has said `acts`: one need not wait for an answer any more."""
        values = frozenset(value for act in acts for value in act.slots)
        move = acts[-1].move if acts else self.other
        return replace(self, quiet_until=min(self.quiet_until, now), heard=values, other=move)

    def speak(
        self, now: float, speaking: float, rng: np.random.Generator, scene: WordingContext | None = None
    ) -> tuple[Speech | None, SpeechState]:
        """Takes the next remark if it is its turn.

        Remarks that are joined to it are worded with it, so that one leads over to the next.

        Args:
            now: time [s].
            speaking: how long the own words still go on [s].
            rng: for the words.
            scene: what is in view; what has been said is added.

        Returns:
            What is said now, or None, and what remains.
        """
        queue = _alive(self.queue, now)
        if not queue:
            return None, replace(self, queue=())
        first = queue[0]
        goes_on = first.joined and speaking > 0.0
        if not goes_on and (speaking > 0.0 or (now < self.quiet_until and not first.urgent)):
            return None, replace(self, queue=queue)
        if not first.text:
            queue = self._worded(queue, rng, scene or WordingContext(), goes_on)
            first = queue[0]
        end = now + speaking + speech_seconds(first.text)
        pause = ANSWER_TIME if first.act.move in _WANTS_ANSWER else PAUSE
        return Speech(act=first.act, text=first.text), replace(
            self,
            queue=queue[1:],
            quiet_until=end + pause,
            last=first,
            last_end=end,
            said=(*self.said[1 - MEMORY :], first),
        )

    def _worded(
        self, queue: tuple[Remark, ...], rng: np.random.Generator, scene: WordingContext, goes_on: bool
    ) -> tuple[Remark, ...]:
        """The queue with words for the next remark and those joined to it."""
        count = 1 + len(list(itertools.takewhile(lambda item: item.joined and not item.text, queue[1:])))
        breath = queue[: min(count, LONGEST_BREATH)]
        joined = self.last.act.move if goes_on and self.last is not None else None
        spans = word_acts(
            [item.act for item in breath],
            self.role,
            rng,
            [item.wording for item in breath],
            style=self.style,
            scene=replace(scene, joined=joined, last=self.other, mentioned=self.heard),
        )
        worded = tuple(replace(item, text=span.text) for item, span in zip(breath, spans, strict=True))
        return (*worded, *queue[len(breath) :])


def _alive(queue: tuple[Remark, ...], now: float) -> tuple[Remark, ...]:
    kept: list[Remark] = []
    dropped = False
    for item in queue:
        # what goes on from a remark that is no longer said is not said either
        dropped = item.expires < now or (item.joined and dropped)
        if not dropped:
            kept.append(item)
    return tuple(kept)
