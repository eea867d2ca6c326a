"""Natural language generation (NLG): short spoken English utterances from dialogue acts, speaker and context.

The template that covers most of the given information is used; ties are broken at random and by the style of the
speaker. Slots without coverage are appended as afterthoughts.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.disfluency import hesitating
from dorothie_gym.dialogue.grammar import SPOKEN_SLOTS, Template, load_grammar
from dorothie_gym.dialogue.phrases import Register, open_to
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.dialogue.slot_realizer import Draw, SlotRealizer, draws_of
from dorothie_gym.dialogue.speaker_style import SpeakerStyle, default_style
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import Slot, SlotValue

MAX_CHARACTERS = 160
"""Longest text [characters]."""

_AN = re.compile(r"\ba(?= [aei]| o(?!ne\b|nce\b))")
_ASKS = re.compile(
    r"(?:(?:so|and|then|now|well|okay|ok|oh|hey|yo|next|also|but|after that|(?:and )?afterwards|um|uh|er|hmm),? )*"
    r"(?:(?:can|could|would|will|did|have|are|shall|should|am|do) (?:you|we|I|they|ya)\b"
    r"|(?:would|is|was|does|did) (?:it|that|this|there)\b|how about\b)(?!.*[.?])",
    re.IGNORECASE,
)
"""Questions and requests in the form of a question."""
_PARTICIPLE = re.compile(r"[a-z]+ing\b")
_PLAIN = re.compile(r"[^a-z' ]+")
_PLAIN_WORDING = Wording()
_NO_CONTEXT = WordingContext()

_TRIES = 8
"""Number of terse sentences generated under a tight length limit; the shortest is used."""

# Enum members are bound once: each look-up through the class costs as much as a random draw.
_HUMAN, _CAR = Role.PARTICIPANT, Role.CO_WIZARD
_HUMANS = (Role.PARTICIPANT, Role.AD_WIZARD)
_IRRELEVANT = DialogueMove.IRRELEVANT

_Templates = tuple[Template, ...]
_ByManner = tuple[_Templates, ...]


def word_act(
    act: DialogueAct,
    speaker: Role,
    rng: np.random.Generator,
    context: Wording | None = None,
    *,
    style: SpeakerStyle | None = None,
    scene: WordingContext | None = None,
) -> str:
    """Generates the text of one act.

    Every act gets a text. Acts with many slot values are realized in part: at most three names per slot, and
    afterthoughts up to `MAX_CHARACTERS`. A text that is too long is worded again without optional words.

    Args:
        act: move and slot values.
        speaker: role of the speaker; the Ad-Wizard shares the templates of the participant, the car those of the
            Co-Wizard.
        rng: source of randomness for the choice among equivalent templates.
        context: details that the slots do not represent.
        style: style of the speaker; the average style if None.
        scene: dialogue history and objects in view.

    Returns:
        Text of 1 to `MAX_CHARACTERS` characters.
    """
    return _word(act, speaker, rng, context, style, scene, MAX_CHARACTERS)


def word_acts(
    acts: Sequence[DialogueAct],
    speaker: Role,
    rng: np.random.Generator,
    contexts: Sequence[Wording | None] | None = None,
    *,
    style: SpeakerStyle | None = None,
    scene: WordingContext | None = None,
) -> tuple[Span, ...]:
    """Generates the spans of one utterance, each linked to the previous one ("Yes, and then left at the light").

    Args:
        acts: acts in order.
        speaker: as in `word_act`.
        rng: as in `word_act`.
        contexts: details of each act, one entry per act.
        style: as in `word_act`.
        scene: as in `word_act`, for the first act.

    Returns:
        One span per act, each with at most `MAX_CHARACTERS` characters. Optional words are left out where all of them
        together would be longer.

    Raises:
        ValueError: if the numbers of contexts and acts differ.
    """
    wordings = list(contexts) if contexts is not None else [None] * len(acts)
    if len(wordings) != len(acts):
        raise ValueError(f"contexts: {len(wordings)} for {len(acts)} acts; pass one per act, None for no details")
    scene = _NO_CONTEXT if scene is None else scene
    texts: list[str] = []
    room = MAX_CHARACTERS
    for number, (act, wording) in enumerate(zip(acts, wordings, strict=True)):
        # Each remaining act gets an equal share of the remaining characters.
        limit = room // (len(acts) - number) - 1
        text = _word(act, speaker, rng, wording, style, scene, limit)
        if style is not None and style.address and style.address in text.lower():
            style = replace(style, addressing=0.0)  # once is enough
        if texts:
            texts[-1] = _linked(texts[-1], text)
        texts.append(text)
        room -= len(text) + 2
        scene = replace(scene, joined=act.move)
    return tuple(Span(text, act) for text, act in zip(texts, acts, strict=True))


def _linked(before: str, text: str) -> str:
    """Returns the text of an act with the comma before the next act, unless it ends with punctuation."""
    goes_on = text[0].islower() and before[-1] in ".?"
    stem = before[:-1] if goes_on else before
    return stem if stem[-1] in "?.," else f"{stem},"


def _word(
    act: DialogueAct,
    speaker: Role,
    rng: np.random.Generator,
    context: Wording | None,
    style: SpeakerStyle | None,
    scene: WordingContext | None,
    limit: int,
) -> str:
    voice = _HUMAN if speaker in _HUMANS else _CAR
    draw = draws_of(rng)
    own = default_style(voice) if style is None else style
    scene = _NO_CONTEXT if scene is None else scene
    wording = _PLAIN_WORDING if context is None else context
    for names in (3, 1):
        text = _Sentence(act, voice, draw, wording, own, scene, names, limit).text()
        if len(text) <= limit:
            return text
        own = replace(own, chattiness=0.0, disfluency=0.0, repairs=0.0, addressing=0.0)
    # Optional words should not decide: the tersest of the sentences with equal content.
    own = replace(own, register=Register.BLUNT, indirectness=0.0, habit=0.0)
    tries = (_Sentence(act, voice, draw, wording, own, scene, 1, MAX_CHARACTERS).text() for _ in range(_TRIES))
    shortest = min(tries, key=len)
    return shortest if len(shortest) <= MAX_CHARACTERS else shortest[:MAX_CHARACTERS].rsplit(" ", 1)[0].rstrip(",")


class _Sentence:
    """Sentence of one act, under generation."""

    def __init__(
        self,
        act: DialogueAct,
        voice: Role,
        draw: Draw,
        wording: Wording,
        style: SpeakerStyle,
        scene: WordingContext,
        names: int,
        limit: int,
    ) -> None:
        self._act = act
        self._voice = voice
        self._wording = wording
        self._style = style
        self._scene = scene
        self._limit = limit
        self._realizer = SlotRealizer(act, draw, wording, style, scene, names, of_rider=voice is _HUMAN)

    def text(self) -> str:
        realizer, act = self._realizer, self._act
        particulars = self._wording.known
        options = fitting_templates(act.move, act.slots, self._voice, self._wording.topic, particulars)
        template = realizer.pick(options[realizer.manner])
        realizer.exclude_dropped("dropped" in template.needs)
        body = template.body.phrase.say(realizer)
        body = self._decorated(body, template)
        close = template.close.say(realizer)
        # a cause, and a plan, say all that the act names
        whole = act.move is _IRRELEVANT or not template.needs.isdisjoint(("cause", "plan"))
        missing = () if whole else realizer.values.keys() - template.covers
        for slot in SPOKEN_SLOTS if missing else ():
            if slot in missing:
                tail = self._tail(slot)
                if len(body) + len(tail) + len(close) < self._limit:
                    body = f"{body} {tail}"
        return self._finished(body, close)

    def _tail(self, slot: Slot) -> str:
        tails = load_grammar().tails[slot]
        return (tails.get(self._act.move) or tails[None]).say(self._realizer)

    def _decorated(self, body: str, template: Template) -> str:
        """Returns the body with discourse markers, hesitations and an address."""
        realizer, style, scene = self._realizer, self._style, self._scene
        markers, move = load_grammar().markers, self._act.move
        if style.disfluency and realizer.random() < style.disfluency:
            body = hesitating(body, load_grammar().fillers.say(realizer), realizer.random)
        front = None
        if scene.joined is not None:
            joint = load_grammar().joints.get((scene.joined, move))
            front = joint.say(realizer) if joint is not None else None
        else:
            kind = "alarm" if scene.exception else "opener"
            marker = markers.get((kind, self._voice, move)) or markers.get(("opener", self._voice, move))
            if marker is not None and realizer.random() < marker.rate * style.chattiness:
                front = marker.phrase.say(realizer)
        if front and (_repeats(front, body) or (scene.joined is not None and _PARTICIPLE.match(body))):
            front = None  # nor "my camera is out, and slowing down"
        realizer.fronted = bool(front)
        if front:
            body = f"{front} {body}"
        closer = markers.get(("closer", self._voice, move))
        # Fixed phrases get no closing marker; questions and sentences with content may.
        if closer is not None and template.covers and realizer.random() < closer.rate * style.chattiness:
            end = closer.phrase.say(realizer)
            body = body if _words(end)[0] in _words(body) else f"{body}{'' if end[0] == ',' else ' '}{end}"
        amid = (self._wording.topic or "").startswith("way_")  # the listener would look for "my friend" on the way
        if style.address and not amid and realizer.random() < style.addressing and style.address not in body.lower():
            body = f"{body}, {style.address}"
        return body

    def _finished(self, body: str, close: str) -> str:
        text = self._realizer.agreed(" ".join(f"{body}{close}".split()))
        if " ," in text or " ?" in text:
            text = text.replace(" ,", ",").replace(",,", ",").replace(" ?", "?").replace(",?", "?")
        text = text.strip(", ")
        if " a " in text:
            text = _AN.sub("an", text)
        if not self._style.proper:
            return text
        joined_on = self._scene.joined is not None and text[0].islower() and self._realizer.fronted
        start = text if joined_on else text[0].upper() + text[1:]
        if text[-1] in "?.":
            return start
        return start + ("?" if _ASKS.match(text) else ".")


_EXCLAIMS: Final = re.compile(
    r"(okay|all right|alright|great|good|nice|perfect|wonderful|awesome|excellent|lovely|cool|fantastic|well done"
    r"|good job|brilliant|superb|splendid|terrific|marvelous|sorry|oh|well|we made it)\b"
)
"""Beginnings of remarks that need no discourse marker in front: not "so perfect, we're done"."""


def _words(text: str) -> list[str]:
    return _PLAIN.sub("", text.lower()).split()


def _repeats(front: str, body: str) -> bool:
    """Returns whether the body begins with a word of the discourse marker ("so so"), or with a marker of its own.

    A second "now" is a repetition as well: "now slow down now".
    """
    start, lead = _words(body), _words(front)
    if not start or start[0] in lead or start[0] == "because" or ("now" in lead and "now" in start):
        return True
    return _EXCLAIMS.match(body.lower()) is not None


@functools.lru_cache(maxsize=8192)
def fitting_templates(
    move: DialogueMove, slots: frozenset[SlotValue], voice: Role, topic: str | None, particulars: frozenset[str]
) -> _ByManner:
    """Returns the templates with the best coverage of an act, per manner (see `phrases.manner_of`), by weight.

    Args:
        move: move of the act.
        slots: slot values of the act.
        voice: participant or Co-Wizard.
        topic: topic of the wording.
        particulars: names of the details that the wording provides.
    """
    labels: dict[Slot, set[str]] = {}
    for value in slots:
        labels.setdefault(value.slot, set()).add(value.label)
    fitting = [
        template
        for template in load_grammar().templates[move]
        if template.speaker in (None, voice)
        and template.topic in (None, topic)
        and template.covers <= labels.keys()
        and template.needs <= particulars
        and all(labels[slot] <= wanted for slot, wanted in template.when.items())
    ]
    best = max(map(_merit, fitting))
    chosen = [template for template in fitting if _merit(template) == best]
    bodies = [template.body for template in chosen]
    return tuple(tuple(chosen[place] for place in open_to(bodies, manner)) for manner in range(2 * len(Register)))


def _merit(template: Template) -> tuple[bool, int, int, int]:
    return template.topic is not None, len(template.covers), len(template.needs), len(template.when)
