"""Surface text: acts, their speaker and what else is known become a short spoken English utterance.

The template of the grammar that says most of what is known is used, several equally good ones by chance and by the
speaker's style; what it leaves out is appended as an afterthought.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue.conversation import Span
from dorothie_gym.dialogue.grammar import SPOKEN_SLOTS, Template, load_grammar
from dorothie_gym.dialogue.phrases import Register, open_to
from dorothie_gym.dialogue.realization_context import Wording, WordingContext
from dorothie_gym.dialogue.slot_realizer import Draw, SlotRealizer, draws_of
from dorothie_gym.dialogue.speaker_style import SpeakerStyle, default_style
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role, Slot, SlotValue

MAX_CHARACTERS = 160
"""Longest text [characters]."""

_AN = re.compile(r"\ba(?= [aei]| o(?!ne\b|nce\b))")
_PLAIN_WORDING = Wording()
_NO_CONTEXT = WordingContext()

_TRIES = 8
"""Bare sentences of which the shortest is taken where there is hardly room."""

# Enum members are looked up once: each look-up through the class costs as much as a drawn number.
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
    """Words one act.

    Every act gets a text. One that carries more than can be said in a breath is said in part: at most three names of a
    kind, and afterthoughts only as far as `MAX_CHARACTERS` allows.

    Args:
        act: move and slot values.
        speaker: who speaks; the Ad-Wizard speaks as the participant does, the car itself as the Co-Wizard.
        rng: chooses among equally good wordings.
        context: particulars that the slots do not carry.
        style: how the speaker talks; without it, as the middle of all does.
        scene: what has been said and what is in view.

    Returns:
        A text of 1 to `MAX_CHARACTERS` characters.
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
    """Words the acts of one utterance, each joined to the one before it ("Yes, and then left at the light").

    Args:
        acts: in order.
        speaker: as for `word_act`.
        rng: as for `word_act`.
        contexts: particulars of each act, as many as there are acts.
        style: as for `word_act`.
        scene: as for `word_act`, for the first act; what an act mentions is known to the next.

    Returns:
        A span for each act; their texts joined by spaces have at most `MAX_CHARACTERS` characters.

    Raises:
        ValueError: if there are not as many contexts as acts.
    """
    wordings = list(contexts) if contexts is not None else [None] * len(acts)
    if len(wordings) != len(acts):
        raise ValueError(f"contexts: {len(wordings)} for {len(acts)} acts; give one for each, None for no particulars")
    scene = _NO_CONTEXT if scene is None else scene
    texts: list[str] = []
    room = MAX_CHARACTERS
    for number, (act, wording) in enumerate(zip(acts, wordings, strict=True)):
        # Each of the acts to come is left its share of the room.
        limit = room // (len(acts) - number) - 1
        text = _word(act, speaker, rng, wording, style, scene, limit)
        if texts:
            texts[-1] = _linked(texts[-1], text)
        texts.append(text)
        room -= len(text) + 2
        scene = replace(scene, joined=act.move)
    return tuple(Span(text, act) for text, act in zip(texts, acts, strict=True))


def _linked(before: str, text: str) -> str:
    """Returns an act's words with the comma that leads over to the next act's, if it ends without a stop."""
    goes_on = text[0].islower() and before[-1] == "."
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
    # Not even the bare template fits: what a speaker says who has no time for particulars.
    bare = DialogueAct(act.move)
    own = replace(own, register=Register.BLUNT, indirectness=0.0, habit=0.0)
    tries = (_Sentence(bare, voice, draw, _PLAIN_WORDING, own, scene, 1, limit).text() for _ in range(_TRIES))
    shortest = min(tries, key=len)
    return shortest if len(shortest) <= limit else shortest[:limit].rsplit(" ", 1)[0].rstrip(",")


class _Sentence:
    """Writes one sentence."""

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
        self._teller = SlotRealizer(act, draw, wording, style, scene, names)

    def text(self) -> str:
        teller, act = self._teller, self._act
        particulars = self._wording.known
        options = fitting_templates(act.move, act.slots, self._voice, self._wording.topic, particulars)
        template = teller.pick(options[teller.manner])
        teller.settle("dropped" in template.needs)
        body = template.body.phrase.say(teller)
        body = self._mannered(body, template)
        close = template.close.say(teller)
        missing = teller.values.keys() - template.covers if act.move is not _IRRELEVANT else ()
        for slot in SPOKEN_SLOTS if missing else ():
            if slot in missing:
                tail = self._tail(slot)
                if len(body) + len(tail) + len(close) < self._limit:
                    body = f"{body} {tail}"
        return self._finished(body, close)

    def _tail(self, slot: Slot) -> str:
        tails = load_grammar().tails[slot]
        return (tails.get(self._act.move) or tails[None]).say(self._teller)

    def _mannered(self, body: str, template: Template) -> str:
        """Returns the body with words around it and with slips."""
        teller, style, scene = self._teller, self._style, self._scene
        manners, move = load_grammar().manners, self._act.move
        if style.disfluency and teller.random() < style.disfluency:
            body = _hesitating(body, teller)
        front = None
        if scene.joined is not None:
            joint = load_grammar().joints.get((scene.joined, move))
            front = joint.say(teller) if joint is not None else None
        else:
            kind = "alarm" if scene.exception else "opener"
            manner = manners.get((kind, self._voice, move)) or manners.get(("opener", self._voice, move))
            if manner is not None and teller.random() < manner.rate * style.chattiness:
                front = manner.phrase.say(teller)
        teller.fronted = bool(front)
        if front:
            body = f"{front} {body}"
        closer = manners.get(("closer", self._voice, move))
        # A set phrase stands as it is; what asks or has content may be rounded off.
        if closer is not None and template.covers and teller.random() < closer.rate * style.chattiness:
            body = f"{body} {closer.phrase.say(teller)}"
        if style.address and teller.random() < style.addressing:
            body = f"{body}, {style.address}"
        return body

    def _finished(self, body: str, close: str) -> str:
        text = " ".join(f"{body}{close}".split())
        if " ," in text or " ?" in text:
            text = text.replace(" ,", ",").replace(",,", ",").replace(" ?", "?").replace(",?", "?")
        text = text.strip(", ")
        if " a " in text:
            text = _AN.sub("an", text)
        if not self._style.proper:
            return text
        joined_on = self._scene.joined is not None and text[0].islower() and self._teller.fronted
        start = text if joined_on else text[0].upper() + text[1:]
        return start if text[-1] in "?." else start + "."


def _hesitating(body: str, teller: SlotRealizer) -> str:
    """Returns the sentence with a filled pause, or begun twice."""
    words = body.split()
    filler = load_grammar().fillers.say(teller)
    if len(words) < 3:
        return f"{filler}, {body}"
    place = 1 + int(teller.random() * (len(words) - 2))
    if place <= 2 and teller.random() < 0.5:
        return " ".join([*words[:place], filler + ",", *words])
    return " ".join([*words[:place], filler + ",", *words[place:]])


@functools.lru_cache(maxsize=8192)
def fitting_templates(
    move: DialogueMove, slots: frozenset[SlotValue], voice: Role, topic: str | None, particulars: frozenset[str]
) -> _ByManner:
    """Returns the templates that say most of an act, for each manner (see `phrases.manner_of`), by weight.

    Args:
        move: of the act.
        slots: of the act.
        voice: the participant or the Co-Wizard.
        topic: of the wording.
        particulars: names of what the wording knows.
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
