"""Speech of a scripted agent: remarks queued and said, the time when it may speak, and the base of its state."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, Protocol, Self, TypeVar

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction, Intention
from dorothie_gym.dialogue.nlg import word_acts
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.dialogue.speaker_style import SpeakerStyle
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import SlotValue
from dorothie_gym.policies.decision_random import decision_random
from dorothie_gym.policies.mood import Happening, Mood
from dorothie_gym.policies.persona import Persona
from dorothie_gym.policies.policy import DECISION_INTERVAL, DecisionClock, replace
from dorothie_gym.policies.speech_timing import Delivery
from dorothie_gym.session.spaces.actions import Speech

if TYPE_CHECKING:
    from dorothie_gym.dialogue.conversation import Span

LONGEST_BREATH = 3
"""Maximum number of acts that are worded together."""

MEMORY = 6
"""Number of the latest remarks that are remembered."""

IN_A_ROW = 15.0
"""Silence after which a repair is over [s]."""

IN_REPLY = 6.0
"""Time within which an utterance is a reaction to the last remark [s]."""

REWORDINGS = 4
"""Number of draws of other words for a remark whose words have just been said."""

_REPAIRS = frozenset({DialogueMove.CONFUSE, DialogueMove.CLARIFY})

_UNCHANGED = frozenset(
    {DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U}
)
"""Moves that may be said twice in the same words."""

_NARROWS = frozenset(
    {
        DialogueMove.CHECK,
        DialogueMove.CLARIFY,
        DialogueMove.INSTRUCT,
        DialogueMove.QUERY_W,
        DialogueMove.QUERY_YN,
        DialogueMove.REPLY_U,
    }
)
"""Moves after which a repair may still go on."""

_WANTS_ANSWER = frozenset(
    {DialogueMove.INSTRUCT, DialogueMove.ALIGN, DialogueMove.CHECK, DialogueMove.QUERY_YN, DialogueMove.QUERY_W}
)


@dataclass(frozen=True, kw_only=True)
class Remark:
    """Dialogue act to be spoken.

    Attributes:
        act: move and slots.
        wording: particulars for the words.
        meaning: propositions that are stated, asked or requested.
        text: the words, if they are chosen already.
        joined: whether it is said in the same breath as the remark before.
        urgent: whether it may be said without leaving the other speaker time to answer.
        expires: time after which it is no longer said [s].
    """

    act: DialogueAct
    wording: Wording = field(default_factory=Wording)
    meaning: tuple[Proposition, ...] = ()
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
    """Returns a remark with a move and its slot values; other arguments as in `Remark`."""
    return Remark(
        act=DialogueAct.of(move, *values),
        wording=wording if wording is not None else Wording(),
        joined=joined,
        urgent=urgent,
        expires=expires,
    )


def intend(
    function: CommunicativeFunction,
    content: Proposition | None = None,
    *also: Proposition,
    elided: Collection[str] = (),
    wording: Wording | None = None,
    joined: bool = False,
    urgent: bool = False,
    expires: float = math.inf,
) -> Remark:
    """Returns the remark that carries out an intention.

    Args:
        function: communicative function of the content.
        content: proposition that is stated, asked, requested or answered; None without content.
        also: further contents of the same span: "forget KFC, go to Ikea".
        elided: arguments of the contents that are left out of the words.
        wording: further particulars for the words; where no topic is given it is the predicate of the content, with
            "not_" in front if it is negated.
        joined: as in `Remark`.
        urgent: as in `Remark`.
        expires: as in `Remark`.
    """
    intention = Intention(function=function, content=content, elided=frozenset(elided))
    particulars = Wording() if wording is None else wording
    if content is not None:
        topic = particulars.topic or f"{'not_' * content.negated}{content.predicate}"
        particulars = dataclasses.replace(particulars, content=intention.spoken, topic=topic)
    slots = intention.slots.union(*(further.without(*elided).slots() for further in also))
    return Remark(
        act=DialogueAct(intention.function.move, slots),
        wording=particulars,
        meaning=also if content is None else (content, *also),
        joined=joined,
        urgent=urgent,
        expires=expires,
    )


def repeated(item: Remark, function: CommunicativeFunction) -> Remark:
    """Returns a remark that repeats the content of `item` with another function: "I said the second left"."""
    return Remark(act=DialogueAct(function.move, item.act.slots), wording=item.wording, meaning=item.meaning)


@dataclass(frozen=True, kw_only=True)
class SpeechState:
    """Remarks queued and said; frozen, so every change returns a new state.

    Attributes:
        role: speaker.
        queue: remarks to be said, the next first.
        quiet_until: time before which only urgent remarks are said [s].
        last: last remark said, None at first.
        last_end: end of its utterance [s].
        style: traits of the wording; None for an average speaker.
        said: latest remarks said, the last one at the end.
        heard: slot values that the other speaker has just named, which may be referred to by "that one".
        other: last move of the other speaker, None at first.
        delivery: timing of the speech.
        reply_at: time before which no reply begins, unless it is urgent [s].
        asked_back: number of times that the speaker has said in the present repair that the other was not understood.
        repairs: number of the speaker's turns in the present repair: requests to repeat, clarifications, repetitions.
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
    delivery: Delivery = field(default_factory=Delivery)
    reply_at: float = -math.inf
    asked_back: int = 0
    repairs: int = 0

    @property
    def idle(self) -> bool:
        """Returns whether no remark is queued."""
        return not self.queue

    @property
    def first(self) -> Remark | None:
        """Returns the remark to be said next; None if no remark is queued."""
        return self.queue[0] if self.queue else None

    @property
    def has_just_asked_back(self) -> bool:
        """Returns whether the last remark said that the other speaker was not understood."""
        return self.last is not None and self.last.act.move is DialogueMove.CONFUSE

    def may_ask_back(self, now: float) -> bool:
        """Returns whether the speaker may say that the other was not understood.

        This is said once in a repair, and never in reply to the same from the other speaker.

        Args:
            now: time [s].
        """
        again = self.asked_back > 0 and self.has_just_spoken(now, IN_A_ROW)
        return not again and self.other is not DialogueMove.CONFUSE

    def turns_of_repair(self, now: float) -> int:
        """Returns the number of turns that the speaker has spent on the present repair at a time [s]."""
        return self.repairs if self.has_just_spoken(now, IN_A_ROW) else 0

    def may_be_asked_for(self, now: float) -> bool:
        """Returns whether the last remark was just made and not repeated yet, so that the other may not know it [s]."""
        return self.has_just_spoken(now, IN_REPLY) and not self.turns_of_repair(now)

    @property
    def last_content(self) -> Remark | None:
        """Last remark said that is no request to repeat; None if there is none."""
        return next((item for item in reversed(self.said) if item.act.move is not DialogueMove.CONFUSE), None)

    def has_just_spoken(self, now: float, within: float) -> bool:
        """Returns whether the last utterance ended no longer than `within` ago [s], or has not ended yet."""
        return now - self.last_end < within

    def plan(self, *remarks: Remark) -> SpeechState:
        """Queues remarks at the end."""
        return replace(self, queue=(*self.queue, *remarks))

    def plan_first(self, *remarks: Remark) -> SpeechState:
        """Queues remarks in front, as for an answer."""
        return replace(self, queue=(*remarks, *self.queue))

    def with_second(self, item: Remark) -> SpeechState:
        """Inserts a remark after the first one."""
        return replace(self, queue=(self.queue[0], item, *self.queue[1:]))

    def led_by(self, item: Remark) -> SpeechState:
        """Queues a remark in front and joins the first one to it."""
        return replace(self, queue=(item, replace(self.queue[0], joined=True), *self.queue[1:]))

    def cleared(self) -> SpeechState:
        """Drops the queued remarks."""
        return replace(self, queue=())

    def without_told(self, told: Proposition | None) -> SpeechState:
        """Drops queued statements that the other speaker has just made; keeps remarks joined to them."""
        if told is None:
            return self
        return self._without(
            lambda item: item.act.move is DialogueMove.EXPLAIN and any(said.contains(told) for said in item.meaning)
        )

    def without_statements(self, predicates: Collection[Predicate]) -> SpeechState:
        """Drops the queued remarks about the given predicates; keeps remarks joined to them."""
        return self._without(lambda item: any(said.predicate in predicates for said in item.meaning))

    def _without(self, drops: Callable[[Remark], bool]) -> SpeechState:
        """Drops queued remarks; a remark that was joined to one of them begins an utterance of its own."""
        kept, dropped = [], False
        for item in self.queue:
            former, dropped = dropped, drops(item)
            if not dropped:
                kept.append(replace(item, joined=False) if former and item.joined else item)
        return replace(self, queue=tuple(kept))

    def hold(self, until: float) -> SpeechState:
        """Extends the silence to a time [s]."""
        return replace(self, quiet_until=max(self.quiet_until, until))

    def heard_other(
        self, now: float, acts: Sequence[DialogueAct] = (), rng: np.random.Generator | None = None, late: float = 0.0
    ) -> SpeechState:
        """Records an utterance of the other speaker, which ends the silence left for an answer.

        Args:
            now: time [s].
            acts: acts of the utterance.
            rng: generator of the gap before a reply; None for no gap.
            late: time since the utterance ended, if known [s].
        """
        gap = self.delivery.draw_gap(rng) if rng is not None else 0.0
        values = frozenset(value for act in acts for value in act.slots)
        move = acts[-1].move if acts else self.other
        until = min(self.quiet_until, now)
        return replace(self, quiet_until=until, heard=values, other=move, reply_at=now + max(gap - late, 0.0))

    def speak(
        self,
        now: float,
        speaking: float,
        rng: np.random.Generator,
        scene: WordingContext | None = None,
        *,
        interval: float = DECISION_INTERVAL,
        other_speaking: bool = False,
    ) -> tuple[Speech | None, SpeechState]:
        """Says the next remark if it is due.

        Remarks that are joined to it are worded together with it, so that their words connect.

        Args:
            now: time [s].
            speaking: remaining duration of its own utterance [s].
            rng: random generator for the words.
            scene: context that the words may refer to; the latest acts are added.
            interval: time to the next decision [s].
            other_speaking: whether the other speaker is talking; only urgent remarks interrupt.

        Returns:
            The utterance, or None, and the new state.
        """
        if not self.queue:
            return None, self
        queue = _alive(self.queue, now)
        if not queue:
            return None, replace(self, queue=())
        first = queue[0]
        continues = first.joined and speaking > 0.0
        waits = (now < self.quiet_until or other_speaking) and not first.urgent
        if not continues and (speaking > 0.0 or waits):
            return None, replace(self, queue=queue)
        onset = 0.0 if continues or first.urgent else self._onset(now, interval, rng)
        if onset >= interval:
            return None, replace(self, queue=queue)
        if not first.text:
            queue = self._worded(queue, rng, scene or WordingContext(), continues)
            first = queue[0]
        first = replace(first, text=self._punctuated(queue, continues))
        end = now + onset + speaking + self.delivery.seconds(first.text)
        pause = self.delivery.draw_pause(rng, wants_answer=first.act.move in _WANTS_ANSWER)
        pace = self.delivery.pace_of(first.text)
        return Speech(act=first.act, text=first.text, meaning=first.meaning, onset=onset, pace=pace), replace(
            self,
            queue=queue[1:],
            quiet_until=end + pause,
            last=first,
            last_end=end,
            said=(*self.said[1 - MEMORY :], first),
            asked_back=self._count_asking_back(first, now),
            repairs=self._count_repairs(first, now, continues=continues or first.joined),
        )

    def _count_asking_back(self, said: Remark, now: float) -> int:
        lately = self.asked_back if self.has_just_spoken(now, IN_A_ROW) else 0
        if said.act.move is DialogueMove.CONFUSE:
            return lately + 1
        return lately if said.act.move in _NARROWS else 0

    def _count_repairs(self, said: Remark, now: float, *, continues: bool) -> int:
        lately = self.turns_of_repair(now)
        if continues:
            return lately
        return lately + 1 if said.act.move in _REPAIRS or self.other is DialogueMove.CONFUSE else 0

    def _punctuated(self, queue: Sequence[Remark], continues: bool) -> str:
        """Returns the words of the next remark with the capital and the comma that its neighbours require."""
        text = queue[0].text
        begins = not continues or (self.last is not None and self.last.text.endswith((".", "?")))
        if begins and self.style is not None and self.style.proper:
            text = text[0].upper() + text[1:]
        goes_on = len(queue) > 1 and queue[1].joined
        return f"{text}," if goes_on and text[-1].isalnum() else text

    def _onset(self, now: float, interval: float, rng: np.random.Generator) -> float:
        """Returns the time to the first word [s]: the rest of the gap before a reply; otherwise it begins any time."""
        if self.reply_at > now or now - self.reply_at < interval or self.delivery.gap == 0.0:
            return max(round(self.reply_at - now, 2), 0.0)
        return round(float(rng.uniform(0.0, 0.9 * interval)), 2)

    def _newest(self, move: DialogueMove, options: Iterator[Sequence[Span]]) -> Sequence[Span]:
        """Returns the first wording that differs from those of the latest remarks, or from that of the last one.

        Signs of attention and short answers may be repeated.
        """
        spans = next(options)
        said = [_plain(item.text) for item in self.said] if move not in _UNCHANGED else []
        while said and _plain(spans[0].text) in said:
            other = next(options, None)
            if other is None:
                break
            spans = other if _plain(other[0].text) != said[-1] else spans
        return spans

    def _worded(
        self, queue: tuple[Remark, ...], rng: np.random.Generator, scene: WordingContext, continues: bool
    ) -> tuple[Remark, ...]:
        """Chooses the words of the next remark and of those joined to it."""
        count = 1 + len(list(itertools.takewhile(lambda item: item.joined and not item.text, queue[1:])))
        breath = queue[: min(count, LONGEST_BREATH)]
        joined = self.last.act.move if continues and self.last is not None else None
        context = replace(scene, joined=joined, last=self.other, mentioned=self.heard)
        acts, wordings = [item.act for item in breath], [item.wording for item in breath]
        options = (
            word_acts(acts, self.role, rng, wordings, style=self.style, scene=context) for _ in range(REWORDINGS)
        )
        spans = self._newest(acts[0].move, options)
        worded = tuple(replace(item, text=span.text) for item, span in zip(breath, spans, strict=True))
        return (*worded, *queue[len(breath) :])


def _plain(text: str) -> str:
    return text.lower().strip(" .,?!")


def _alive(queue: tuple[Remark, ...], now: float) -> tuple[Remark, ...]:
    """Drops expired remarks, and those joined to them."""
    kept: list[Remark] = []
    dropped = False
    for item in queue:
        dropped = item.expires < now or (item.joined and dropped)
        if not dropped:
            kept.append(item)
    return queue if len(kept) == len(queue) else tuple(kept)


# --- state of a speaking agent ----------------------------------------------------------------------------------------


class Style(Protocol):
    """Traits of a speaker in a session."""

    def in_mood(self, mood: Mood) -> Self:
        """Returns the traits as a mood changes them."""
        ...


StyleT = TypeVar("StyleT", bound=Style)
ConfigT = TypeVar("ConfigT")


@dataclass(kw_only=True)
class SpeakingState(Generic[StyleT, ConfigT]):
    """State that the scripted participant and Co-Wizard have in common; a step works on a shallow copy.

    Attributes:
        seed: seed of all random draws.
        town: the map.
        style: traits drawn for the session.
        config: tunable numbers.
        speech: remarks queued and said.
        persona: lasting traits; None where the style was given.
        temper: style in the usual mood; None before the first event that moves the mood.
        mood: state of mind.
        count: number of decisions taken.
        clock: time between decisions.
    """

    seed: int
    town: Town
    style: StyleT
    config: ConfigT
    speech: SpeechState
    persona: Persona | None = None
    temper: StyleT | None = None
    mood: Mood = field(default_factory=Mood)
    count: int = 0
    clock: DecisionClock = field(default_factory=DecisionClock)

    def next_decision(self) -> tuple[Self, np.random.Generator]:
        """Returns a copy of the state that counts another decision, and the random generator of that decision."""
        updated = object.__new__(type(self))
        updated.__dict__.update(self.__dict__)
        updated.count += 1
        return updated, decision_random(updated.seed, updated.count)

    def feel(self, happening: Happening, now: float) -> None:
        """Moves the mood by an event at a time [s], and with it the style."""
        self.temper = self.style if self.temper is None else self.temper
        self.mood = self.mood.after(happening, now)
        self.style = self.temper.in_mood(self.mood)

    def say(self, *remarks: Remark) -> None:
        """Queues remarks at the end."""
        self.speech = self.speech.plan(*remarks)

    def say_first(self, *remarks: Remark) -> None:
        """Queues remarks in front."""
        self.speech = self.speech.plan_first(*remarks)
