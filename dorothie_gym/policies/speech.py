"""What a speaker means to say next, and when it is its turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from dorothie_gym.dialogue import Wording, word_act
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role, SlotValue
from dorothie_gym.spaces import Speech

PAUSE = 0.8
"""Silence left between an utterance and the next one of the same speaker [s]."""

ANSWER_TIME = 3.0
"""Silence left after something that wants an answer [s]."""

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
class Voice:
    """A speaker's intentions; frozen, so every change gives a new one.

    Attributes:
        role: who speaks.
        queue: remarks to come, the next first.
        quiet_until: nothing that is not urgent is said before this time [s].
        last: what was said last, None at first.
        last_end: when that was over [s].
    """

    role: Role
    queue: tuple[Remark, ...] = ()
    quiet_until: float = 0.0
    last: Remark | None = None
    last_end: float = -math.inf

    @property
    def idle(self) -> bool:
        """Whether nothing waits to be said."""
        return not self.queue

    def plan(self, *remarks: Remark) -> Voice:
        """The same with remarks added at the end."""
        return replace(self, queue=(*self.queue, *remarks))

    def plan_first(self, *remarks: Remark) -> Voice:
        """The same with remarks added in front: an answer comes before what one wanted to say anyway."""
        return replace(self, queue=(*remarks, *self.queue))

    def cleared(self) -> Voice:
        """The same with nothing left to say."""
        return replace(self, queue=())

    def hold(self, until: float) -> Voice:
        """The same, silent until a time [s] at least."""
        return replace(self, quiet_until=max(self.quiet_until, until))

    def heard_other(self, now: float) -> Voice:
        """The same after the other has spoken: one need not wait for an answer any more."""
        return replace(self, quiet_until=min(self.quiet_until, now))

    def speak(self, now: float, speaking: float, rng: np.random.Generator) -> tuple[Speech | None, Voice]:
        """Takes the next remark if it is its turn.

        Args:
            now: time [s].
            speaking: how long the own words still go on [s].
            rng: for the words.

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
        text = first.text or word_act(first.act, self.role, rng, first.wording)
        end = now + speaking + max(0.6, len(text.split()) / 2.5)
        pause = ANSWER_TIME if first.act.move in _WANTS_ANSWER else PAUSE
        said = replace(first, text=text)
        return Speech(act=first.act, text=text), replace(
            self, queue=queue[1:], quiet_until=end + pause, last=said, last_end=end
        )


def _alive(queue: tuple[Remark, ...], now: float) -> tuple[Remark, ...]:
    kept: list[Remark] = []
    dropped = False
    for item in queue:
        # what goes on from a remark that is no longer said is not said either
        dropped = item.expires < now or (item.joined and dropped)
        if not dropped:
            kept.append(item)
    return tuple(kept)
