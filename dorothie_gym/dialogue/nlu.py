"""Rule-based natural language understanding (NLU): directions, ordinals, speeds, names and more from text."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from dorothie_gym.dialogue.answered_sides import answering, asked_about, plain_answer
from dorothie_gym.dialogue.clause_breaks import with_breaks
from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.directions import RouteTurn, WordLists, find_ordinal, find_turns, mask_directions, word_lists
from dorothie_gym.dialogue.entity_recognition import Mention, find_names
from dorothie_gym.dialogue.lexicon import load_lexicon, read_data, split_words, strings
from dorothie_gym.dialogue.named_values import meant_values
from dorothie_gym.dialogue.numerals import NUMBER_WORDS, may_be_speed, read_cardinals
from dorothie_gym.dialogue.pattern_index import PatternIndex, bits
from dorothie_gym.dialogue.plan_fields import named_actions, planned_change, planned_number, planned_turns
from dorothie_gym.dialogue.plan_parser import PlanParse
from dorothie_gym.dialogue.plan_reading import read_plan, with_plain_lights
from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.dialogue.routes import DrivingPlan
from dorothie_gym.dialogue.turn_phrases import plain_orders
from dorothie_gym.dialogue.vocatives import without_asides, without_vocative
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.slots import (
    SLOT_VALUES,
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    SlotValue,
    StreetName,
)
from dorothie_gym.ontology.spellings import parse_slot

if TYPE_CHECKING:
    from dorothie_gym.dialogue.direction import Direction

_Value = TypeVar("_Value")

_LEAST_NUMBER = 5
"""Smallest number that is read as a speed without a unit; smaller ones are rarely quantities."""

_UP = re.compile(
    r"\b(speed(ing)? (it )?up|fast(er|ly)?|hurry|step on (it|the gas)|floor it|accelerat\w+|quick(er|ly)?|up to #number"
    r"|pick(ing)? (it )?up|hit the gas|give it some gas|move it)\b"
)
_DOWN = re.compile(
    r"\b(slow\w*|brak\w+|decelerat\w+|(too|so) fast|eas\w+ off|down to #number|drop it|easy|reduc\w+|lower)\b"
)
_LIGHTS = re.compile(r"\blights?\b|\bbeams?\b|\bheadlights?\b|\bheadlamps?\b|\blamps?\b")
_ORDER = re.compile(r"\b(before|after)(?= that\b| it\b| (?:the )?#landmark| or | ,| \?|$)")
_BIT = r"(a|just a|a wee|another) (bit|little|touch|tad|hair)"
_HEARING = re.compile(r"\b(hear me|(there|listening|with me|come through) \?)")
_MISHEARD = (
    (re.compile(r"^(?:so |to |due |dew |too |the |and )?(?=you\b)"), "do "),
    (re.compile(r"^(?:or|our|her|hour) (?=(?:we|you|they)\b)"), "are "),
    (re.compile(r"^(?:his|as|ease|it's) (?=(?:it|this|that|there|the)\b)"), "is "),
)
"""First words of questions as recognisers hear them, and what was said."""

_FURTHER = re.compile(
    rf"\b({_BIT} (more|further|farther|forward|closer|ahead|longer)|(some|few) more"
    rf"|(going|go|roll|rolling|move|forward|up|ahead|on|inch|creep) {_BIT}(?! \w+er\b)"
    r"|(inch|edge|creep|crawl|nudge|scoot) (it )?(up|forward|ahead|along|closer)"
    r"|(further|farther)(?! (straight|down|along|than|up|away|from)))\b"
)
# First four letters of the words of the patterns above; other texts skip the patterns.
_SPEED_STEMS = frozenset(
    [
        "spee",
        "fast",
        "hurr",
        "step",
        "floo",
        "acce",
        "quic",
        "up",
        "pick",
        "hit",
        "give",
        "move",
        "slow",
        "brak",
        "dece",
        "easi",
        "ease",
        "down",
        "drop",
        "easy",
        "redu",
        "lowe",
    ]
)
_LIGHT_STEMS = frozenset({"ligh", "beam", "head", "lamp"})
_ORDER_WORDS = frozenset({"before", "after"})
_PAST = frozenset({"past", "behind", "beyond"})
_ARTICLES = frozenset({"the", "a", "an", "about", "of", "to"})
_SPEED_UNITS = frozenset({"km", "kmh", "kilometers", "kilometres", "kph", "mph", "miles"})
_DISTANCE_UNITS = frozenset({"m", "meter", "meters", "metre", "metres", "feet", "yards"})
_OPENING = frozenset({",", "oh", "well", "hmm", "um", "uh", "er", "ah", "hm", "like", "okay", "ok"})
_DENIAL = re.compile(
    r"(don't|do not|dont|never|not|instead of|rather than|without)"
    r"( even| yet| be| try to| go| take| make| a| the| to| that)* $"
)
# "the KFC, I mean the Ikea": the first name is retracted.
_REPAIR = re.compile(
    r"#(landmark|street) (?:, )?(?:uh |um |er )?"
    r"(?:no wait|no no|no|i mean|i meant|wait no|sorry|sorry i meant|or rather)"
    r" (?:, )?(?:the |on |to |take |it's )*#\1\b"
)


@dataclass(frozen=True, kw_only=True)
class ParsedText:
    """Result of the NLU of one text; absent information is None, False or empty. Names follow the order of the text.

    Attributes:
        text: the text.
        masked: words in lower case with names masked (see data/cues.yaml).
        acted: `masked` with actions masked as "#action", those in the -ing form as "#acting".
        turns: directions in order; a route may have several.
        ordinal: number of the opportunity, 1 is the next.
        actions: actions named, in the order of the lexicon.
        denied: actions named only in negated form: "don't turn".
        landmarks: landmarks named.
        streets: streets named.
        objects: objects named.
        statuses: goal statuses expressed.
        guessed: landmarks and streets matched only approximately.
        past: landmarks named as reference points to drive past.
        dropped: landmarks that are abandoned or negated.
        order: "before" or "after" if the text contains one.
        faster: True to speed up, False to slow down.
        lights: True for on, False for off.
        speed: a speed [km/h].
        distance: a distance [m].
        here: whether the text refers to the current position ("here").
        further: whether the car should continue for a short distance.
        affirms: True for an initial yes, False for an initial no.
        question: whether the text contains a question mark.
        asked: proposition of a question, if the words determine it; slot values identify other questions.
        about_hearing: whether the words ask if the listener hears, rather than understands: "can you hear me?".
        plan: steps of driving that the text asks for; empty for a question or a statement.
        parse: what the parser of plans made of the text.
        told: proposition of a statement about weather, crowds, sensors or the view, if the words determine it.
    """

    text: str
    masked: str
    acted: str = ""
    turns: tuple[RouteTurn, ...] = ()
    ordinal: int | None = None
    actions: tuple[ActionValue, ...] = ()
    denied: tuple[ActionValue, ...] = ()
    landmarks: tuple[LandmarkName, ...] = ()
    streets: tuple[StreetName, ...] = ()
    objects: tuple[ObjectClass, ...] = ()
    statuses: tuple[GoalStatus, ...] = ()
    guessed: tuple[SlotValue, ...] = ()
    past: tuple[LandmarkName, ...] = ()
    dropped: tuple[LandmarkName, ...] = ()
    order: str | None = None
    faster: bool | None = None
    lights: bool | None = None
    speed: int | None = None
    distance: int | None = None
    here: bool = False
    further: bool = False
    affirms: bool | None = None
    question: bool = False
    asked: Proposition | None = None
    about_hearing: bool = False
    told: Proposition | None = None
    plan: DrivingPlan = DrivingPlan()
    parse: PlanParse | None = None

    @property
    def direction(self) -> Direction | None:
        """First direction in the text, or None."""
        return self.turns[0].direction if self.turns else None

    @property
    def values(self) -> frozenset[SlotValue]:
        """All slot values in the text."""
        return frozenset((*self.actions, *self.landmarks, *self.streets, *self.objects, *self.statuses))


@functools.lru_cache(maxsize=2048)
def understand(text: str, question: str = "") -> ParsedText:
    """Parses free English text, in any case and with typographic or plain apostrophes.

    Args:
        text: the text; may be empty.
        question: words of the other speaker's last remark, which tell what a mere "left" answers; "" for none.

    Returns:
        The parsed text. Every text is accepted.
    """
    if question:
        parsed = understand(plain_answer(text, question))
        return answering(replace(parsed, text=text), asked_about(question))
    lists = word_lists()
    parse = read_plan(text)
    said = without_asides(
        with_plain_lights(plain_orders(without_vocative(split_words(with_breaks(text)), lists))), lists, machines=True
    )
    spoken = " ".join(said)
    mentions, words = find_names(said)
    words = mask_directions(words, lists)
    joined = " ".join(words)
    numbered = not NUMBER_WORDS.isdisjoint(words) or any(word[0].isdigit() for word in words)
    speed, distance = _quantities(words) if numbered else (None, None)
    masked = _mask_numbers(words) if numbered else joined
    mentions = _unretracted(mentions, words, joined)
    stems = {word[:4] for word in words}
    acted, actions, denied = _actions(masked, stems)
    actions = named_actions(actions, parse)
    named = _distinct([*(mention.value for mention in mentions), *_queried_values(masked, words)])
    named = meant_values(named, actions, parse, spoken)
    landmarks = [mention for mention in mentions if isinstance(mention.value, LandmarkName)]
    turns = planned_turns(find_turns(words, lists), parse)
    return ParsedText(
        text=text,
        masked=masked,
        acted=acted,
        turns=turns,
        ordinal=next((turn.ordinal for turn in turns if turn.ordinal is not None), find_ordinal(words, lists)),
        actions=actions,
        denied=denied,
        landmarks=_unique(value for value in named if isinstance(value, LandmarkName)),
        streets=tuple(value for value in named if isinstance(value, StreetName)),
        objects=tuple(value for value in named if isinstance(value, ObjectClass)),
        statuses=tuple(value for value in named if isinstance(value, GoalStatus)),
        guessed=tuple(mention.value for mention in mentions if mention.guessed),
        past=_following(landmarks, words, _PAST) if landmarks else (),
        dropped=_following(landmarks, words, lists.dropping) if landmarks else (),
        order=order[1] if not _ORDER_WORDS.isdisjoint(words) and (order := _ORDER.search(joined)) else None,
        faster=planned_change(parse, None if stems.isdisjoint(_SPEED_STEMS) else _faster(masked)),
        lights=None if stems.isdisjoint(_LIGHT_STEMS) else _lights(words, joined),
        speed=planned_number(parse, "speed", speed),
        distance=planned_number(parse, "distance", distance),
        here="here" in words,
        further=_FURTHER.search(joined) is not None,
        affirms=_affirms(words, lists),
        question="?" in words,
        asked=_asked(masked),
        about_hearing="?" in words and _HEARING.search(spoken) is not None,
        told=_first("statements", "says", _stated(masked))
        or (None if masked == spoken else _first("statements", "says", _stated(spoken))),
        plan=parse.plan,
        parse=parse,
    )


def _stated(text: str) -> str:
    """Returns the words before a question in the same breath: "it's foggy" of "it's foggy, shall I slow down?"."""
    head, mark, _ = text.rpartition("?")
    return head[: max(head.rfind(","), head.rfind("."), 0)] if mark else text


def _asked(masked: str) -> Proposition | None:
    """Returns the proposition of a question; also with its first word misheard: "so you see anything?"."""
    found = _first("questions", "asks", masked)
    if found is not None or "?" not in masked:
        return found
    return next(
        (
            _first("questions", "asks", words.sub(begin, masked, count=1))
            for words, begin in _MISHEARD
            if words.match(masked)
        ),
        None,
    )


def _unretracted(mentions: list[Mention], words: Sequence[str], joined: str) -> list[Mention]:
    """Returns the mentions that the speaker does not retract."""
    found = _REPAIR.search(joined) if len(mentions) > 1 else None
    if found is None:
        return mentions
    place = joined.count(" ", 0, found.start())
    return [mention for mention in mentions if mention.start != place]


def _mask_numbers(words: Sequence[str]) -> str:
    masked: list[str] = []
    for word in words:
        number = any(value >= _LEAST_NUMBER for value in read_cardinals([word]))
        if not number:
            masked.append(word)
        elif masked[-1:] != ["#number"]:
            masked.append("#number")
    return " ".join(masked)


def _quantities(words: Sequence[str]) -> tuple[int | None, int | None]:
    """Returns a speed [km/h] and a distance [m], each None if absent."""
    speed = distance = None
    for place in range(len(words)):
        run = _number_run(words, place)
        if not run:
            continue
        number = read_cardinals(run)[0]
        unit = words[place + len(run)] if place + len(run) < len(words) else ""
        if unit in _DISTANCE_UNITS:
            distance = number if distance is None else distance
        elif unit in _SPEED_UNITS or (
            number >= _LEAST_NUMBER and may_be_speed(words[place - 1] if place else "", unit)
        ):
            speed = number if speed is None else speed
    return speed, distance


def _number_run(words: Sequence[str], place: int) -> list[str]:
    """Returns the words of the number that starts at `place`; empty inside a number that started earlier."""
    if not read_cardinals([words[place]]) or (place and _number_run(words[place - 1 : place + 1], 0)[1:]):
        return []
    length = 1
    while place + length < len(words) and len(read_cardinals(words[place : place + length + 1])) == 1:
        if not read_cardinals([words[place + length]]) and words[place + length] != "hundred":
            break
        length += 1
    return list(words[place : place + length])


def _actions(masked: str, stems: set[str]) -> tuple[str, tuple[ActionValue, ...], tuple[ActionValue, ...]]:
    """Returns the words with actions masked, all actions, and the actions that occur only in negated form."""
    if "#number" in masked:
        stems = stems | {"#num"}
    found: list[ActionValue] = []
    denied: list[ActionValue] = []
    for action, cues in load_lexicon().actions.items():
        if stems.isdisjoint(cues.stems):
            continue
        heard: list[bool] = []

        def mask(match: re.Match[str], heard: list[bool] = heard) -> str:
            heard.append(_DENIAL.search(match.string, 0, match.start()) is None)
            return "#acting" if match[0].split(" ", 1)[0].endswith("ing") else "#action"

        masked = cues.pattern.sub(mask, masked)
        if heard:
            found.append(action)
            if not any(heard):
                denied.append(action)
    return masked, tuple(found), tuple(denied)


@functools.cache
def _question_patterns() -> tuple[tuple[SlotValue, re.Pattern[str]], ...]:
    """Returns the patterns of questions for the value of a slot."""
    data: Mapping[str, object] = read_data("cues.yaml").get("asked", {})
    patterns = []
    for name, listed in data.items():
        queried = next(value for value in SLOT_VALUES[parse_slot(name)] if value.label == "Queried")
        pattern = "|".join(strings(f"cues.yaml: asked.{name}", listed))
        try:
            patterns.append((queried, re.compile(pattern)))
        except re.error as error:
            raise PhraseFileError(f"cues.yaml: asked.{name}: {error}") from error
    return tuple(patterns)


@functools.cache
def _propositions(table: str, key: str) -> tuple[Sequence[tuple[re.Pattern[str], Proposition]], PatternIndex]:
    """Returns the patterns of a table of cues.yaml with their propositions, of which the first that fits decides."""
    found = []
    for number, row in enumerate(read_data("cues.yaml").get(table, [])):
        where = f"cues.yaml: {table}[{number}]"
        try:
            pattern = re.compile("|".join(strings(f"{where}.cues", row["cues"])))
            found.append((pattern, Proposition.from_json(row[key], f"{where}.{key}")))
        except (re.error, ValueError) as error:
            raise PhraseFileError(f"{where}: {error}") from error
    return found, PatternIndex([pattern for pattern, _ in found])


def _first(table: str, key: str, masked: str) -> Proposition | None:
    sentence = masked.strip(" ,?")
    rows, index = _propositions(table, key)
    possible = (rows[number] for number in bits(index.possible(sentence.split())))
    return next((said for pattern, said in possible if pattern.search(sentence)), None)


_QUESTION_WORDS = frozenset({"what", "which", "where", "what's", "where's", "how", "wheres", "whats", "where'd"})


def _queried_values(masked: str, words: Sequence[str]) -> list[SlotValue]:
    if _QUESTION_WORDS.isdisjoint(words):
        return []
    return [value for value, pattern in _question_patterns() if pattern.search(masked)]


def _following(landmarks: Sequence[Mention], words: Sequence[str], heads: frozenset[str]) -> tuple[LandmarkName, ...]:
    """Returns the landmarks that follow one of the words `heads`, ignoring articles."""
    found = []
    for mention in landmarks:
        place = mention.start - 1
        while place >= 0 and words[place] in _ARTICLES and words[place] not in heads:
            place -= 1
        if place >= 0 and words[place] in heads and isinstance(mention.value, LandmarkName):
            found.append(mention.value)
    return _unique(found)


def _faster(masked: str) -> bool | None:
    if _DOWN.search(masked):
        return False
    return True if _UP.search(masked) else None


def _lights(words: Sequence[str], joined: str) -> bool | None:
    if not _LIGHTS.search(joined):
        return None
    if "off" in words or "kill" in words:
        return False
    return True if "on" in words else None


def _affirms(words: Sequence[str], lists: WordLists) -> bool | None:
    said = [word for word in words if word not in _OPENING] or list(words)
    if said[:2] == ["not", "sure"]:
        return None
    first = said[0] if said else ""
    if first in lists.denying:
        return False
    return True if first in lists.affirming or (words and words[0] in ("okay", "ok")) else None


def _distinct(values: Sequence[SlotValue]) -> list[SlotValue]:
    """Returns the distinct values in the order of the text."""
    return list(dict.fromkeys(values)) if values else []


def _unique(values: Iterable[_Value]) -> tuple[_Value, ...]:
    return tuple(dict.fromkeys(values))
