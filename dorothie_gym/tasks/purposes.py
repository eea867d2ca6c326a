"""Purposes of errands, read from the texts that a participant observes: task, beneficiary and reason.

The readers know English clauses, not templates: they read the storyboards of the package and of others. Unreadable
parts are None or empty; the text is not changed except from "you" to "I".
"""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from importlib import resources

import yaml

from dorothie_gym.ontology.slots import LandmarkName, StreetName
from dorothie_gym.tasks.catalogue import catalogue
from dorothie_gym.tasks.storyboard import Channel

WORDS_FILE = "data/words.yaml"


@dataclass(frozen=True, kw_only=True)
class Purpose:
    """Purpose of an errand, in the words of the participant ("my sister", where the text says "your sister").

    Attributes:
        text: description of the errand, as read.
        action: verb phrase, "buy a newspaper for Mateo's mother"; None if none is found. It names the place only where
            the verb needs it: "take lunch to Mrs. Silva's", "bring the child to Coco".
        place: place with its preposition, "at Ikea", "from Anton's"; None if the text names none.
        person: person that the errand is for or leads to: "Mateo's mother", "Yusuf"; None if the text names none.
        owner: person whose house it leads to: "Samuel" of "Samuel's house", "my sister"; None if the text names none.
        items: items that are bought, fetched or brought: "a newspaper", "the spare key".
        reason: clause as it follows "because": "the buses are on strike"; None if the text gives none.
    """

    text: str
    action: str | None = None
    place: str | None = None
    person: str | None = None
    owner: str | None = None
    items: tuple[str, ...] = ()
    reason: str | None = None


@dataclass(frozen=True, kw_only=True)
class ReadMessage:
    """Message to the participant about its tasks.

    Attributes:
        sender: person or device that sent it, in the words of the participant; None if unknown.
        channel: medium of the message; None if unknown.
        text: words of the sender.
        reason: clause to follow "because"; None if the text gives none that the participant can repeat.
    """

    sender: str | None
    channel: Channel | None
    text: str
    reason: str | None


def read_purposes(tasks: str) -> tuple[Purpose, ...]:
    """Returns the purposes of the errands in an observed text, one for each line."""
    return tuple(read_purpose(line) for line in tasks.split("\n")) if tasks else ()


@functools.lru_cache(maxsize=512)
def read_purpose(line: str) -> Purpose:
    """Returns the purpose of an errand.

    Args:
        line: its description, with or without a reason: "Pick up Lin, because the buses are on strike".
    """
    text = " ".join(line.split())
    clause, reason = _split_reason(text)
    imperative = _imperative(clause)
    reason = None if reason is None else in_first_person(reason)
    items = find_items(clause)
    if imperative is None:
        owner = _HOUSE.search(clause)
        person = None if owner is None else _owner(owner)
        return Purpose(text=text, person=person, owner=_named_owner(person), items=items, reason=reason)
    action, place, owner_name = _without_place(imperative)
    spoken = in_first_person(action) if action is not None else None
    person = _person(imperative if action is None else action) or owner_name
    if owner_name is None and place is not None and _HER_HOUSE.search(place):
        owner_name = person  # "visit Mrs. Adeyemi at her house"
    return Purpose(
        text=text,
        action=spoken,
        place=None if place is None else in_first_person(place),
        person=None if person is None else in_first_person(person),
        owner=_named_owner(owner_name),
        items=items or _object(action),
        reason=reason,
    )


def _named_owner(owner: str | None) -> str | None:
    """Returns the owner of a house as the participant names it; None for "the bride" and the like."""
    if owner is None or owner.lower().startswith(("the ", "a ", "an ")):
        return None
    return in_first_person(owner)


@functools.lru_cache(maxsize=256)
def read_message(message: str, people: Collection[str] = ()) -> ReadMessage:
    """Returns the parts of a message of the Ad-Wizard, in the form of `TaskMessage` or "Your friend texts: ...".

    Args:
        message: the message.
        people: known names, as `read_people` returns them (hashable); other names are recognised by their form.
    """
    text = " ".join(message.split())
    sender: str | None = None
    channel: Channel | None = None
    if found := _SENT.match(text):
        channel, sender, body = Channel(found["channel"].lower()), found["sender"], found["text"]
    elif found := _SAID.match(text):
        sender, body = found["sender"], found["text"]
    else:
        body = text.partition(": ")[2] if text.startswith(_OPENINGS) else text
    reason = _reason_in(body)
    if reason is not None:
        reason = None if _OF_SPEAKER.search(reason) else in_first_person(_uncapitalised(reason, people))
    sender = None if sender is None else in_first_person(_uncapitalised(sender, people))
    return ReadMessage(sender=sender, channel=channel, text=body, reason=reason)


def find_items(text: str) -> tuple[str, ...]:
    """Returns the items of the catalogue that a text mentions, in order: "a newspaper", "three chicken wraps"."""
    return tuple(dict.fromkeys(found[0].lower() for found in _items().finditer(text)))


def read_people(*texts: str) -> tuple[str, ...]:
    """Returns the names of people and animals in texts, with their titles, in order: "Mateo", "Dr. Okafor".

    A capitalised word in the middle of a sentence is a name, unless it is a landmark, a street, a day, or the place in
    "from Kyoto"; at the beginning of a sentence it is a name if it is one elsewhere, or in "Priya's train".
    """
    joined = "\n".join(texts)
    sure = {found["name"] for found in _names().finditer(joined) if _is_name(joined, found)}
    # "Mila" is the same as in "Mila, a terrier"; and "Aunt Mei" is not "Mei" beside her
    names = [found["full"] for found in _names().finditer(joined) if found["name"] in sure]
    longest = {name.split()[-1]: name for name in sorted(names, key=len)}
    return tuple(dict.fromkeys(longest[name.split()[-1]] for name in names))


def in_first_person(text: str) -> str:
    """Returns a text about "you" as that person says it: "my sister", "I have earned a break", "without me"."""
    for pattern, replacement in _FIRST_PERSON:
        text = pattern.sub(replacement, text)
    return text


@functools.cache
def _words(kind: str) -> frozenset[str]:
    """Returns words of a kind of the data file."""
    text = (resources.files("dorothie_gym.tasks") / WORDS_FILE).read_text(encoding="utf-8")
    return frozenset(yaml.safe_load(text)[kind])


# --- clauses ----------------------------------------------------------------------------------------------------------

_OPENINGS = ("New on your list: ", "Off your list: ", "Change of plan: ")
_SENT = re.compile(rf"(?P<channel>{'|'.join(Channel)}) from (?P<sender>[^:]+): (?P<text>.+)", re.IGNORECASE)
_SAID = re.compile(r"(?P<sender>[^:.,]+?) (?:calls|texts|writes|says|asks|phones|rings)\b[^:.]*: (?P<text>.+)")

_FIRST_PERSON = tuple(
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        (r"\b[Yy]ou all\b", "we all"),
        (r"\byourself\b", "myself"),
        (r"\byours\b", "mine"),
        (r"\byour\b", "my"),
        (r"\bYour\b", "My"),
        (r"\b[Yy]ou're\b", "I'm"),
        (r"\b[Yy]ou are\b", "I am"),
        (r"\b[Yy]ou were\b", "I was"),
        (r"\b(are|Are) you\b", "am I"),
        (r"\b(have|do|did|can|will|would|should|could) you\b", r"\1 I"),
        (r"\bYou\b", "I"),
        # an object: after a preposition, or where no verb can follow
        (r"\b(without|for|with|to|from|of|at|see|sees|let|lets|tell|tells|give|gives|meet|join|joins) you\b", r"\1 me"),
        (r"\byou\b(?=$|[.,;:!?])", "me"),
        (r"\byou\b", "I"),
    )
)
_OF_SPEAKER = re.compile(r"\b(?:I|I'm|I've|I'll|me|my|mine|we|we're|we've|us|our|ours)\b", re.IGNORECASE)

_LEADS = re.compile(
    r"(?:please|now|then|first(?: of all)?|finally|also|next|after that|and"
    r"|(?:you|we) (?:still |also |now )?(?:need|have|ought|are asked|are supposed) to"
    r"|(?:you|we) (?:must|should|can|will|may)|(?:could|can|would|will) you"
    r"|remember to|do not forget to|don't forget to|try to|be sure to|make sure to|go and|it is time to),? ",
    re.IGNORECASE,
)


def _split_reason(text: str) -> tuple[str, str | None]:
    """Returns the clause of an errand, and its reason."""
    clause, _, reason = text.partition(" because ")
    if reason:
        return clause.rstrip(" ,."), _tidy(reason)
    before, mark, after = text.partition(": ")
    if mark and _imperative(after) is not None and _imperative(before) is None:
        return after, _tidy(_uncapitalised(before, ()))
    before, mark, after = text.partition(", so ")
    if mark and _imperative(after) is not None and _imperative(before) is None:
        return after, _tidy(_uncapitalised(before, ()))
    clause, mark, reason = text.partition(", since ")
    if not mark:
        clause, mark, reason = text.partition(", as ")
    if mark and len(reason.split()) > 2:
        return clause, _tidy(reason)
    return text, None


def _tidy(clause: str) -> str:
    return clause.strip(" ,.;:!?")


def _imperative(clause: str) -> str | None:
    """Returns the clause starting at its verb, "buy a newspaper at Ikea"; None if it is not an instruction."""
    text = _tidy(clause)
    while found := _LEADS.match(text):
        text = text[found.end() :]
    text = re.sub(r",? instead$", "", text)
    verb, _, rest = text.partition(" ")
    named = verb[:1].isupper() and re.match(r"(is|has|was|will)\b", rest) is not None
    if named or verb.lower().rstrip(",") not in _words("verbs"):
        return None
    return verb.lower() + text[len(verb) :]


_PREPOSITIONS = r"at|from|to|in|into|outside|near|by|behind"


@functools.cache
def _named_place() -> re.Pattern[str]:
    """Returns a pattern of a preposition and a landmark with a name of its own."""
    kinds = [kind for kind in catalogue().values() if not kind.repeatable]
    names = {text for kind in kinds for text in (kind.noun, kind.label, kind.name.label)}
    listed = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    return re.compile(rf",? \b(?P<place>(?P<prep>{_PREPOSITIONS}) (?:the )?(?:{listed}))(?![\w-])", re.IGNORECASE)


_ADJECTIVE = r"(?:(?:new|own|old|little|other) )?"
_OWNER = rf"(?:(?!(?:{_PREPOSITIONS}|of|and|for) )[\w.-]+ ){{0,3}}[\w.-]+(?:'s|s')"
_DESCRIBED = (
    r"(?:the|an?|my|your|his|her|their)"
    rf"(?: (?!(?:{_PREPOSITIONS}|on|of|and|for|who|where|that|because)\b)[a-z][\w-]*){{1,3}}"
)  # "the pianist", "your old teacher"
_PERSON_PHRASE = rf"(?:{_OWNER} )?(?:{_DESCRIBED}|[\w.-]+)(?: [A-Z][\w.-]+)*"
_HOUSE = re.compile(
    rf",? ?\b(?P<place>(?P<prep>{_PREPOSITIONS}) "
    rf"(?:(?:the (?:garden|garage|door|gate) of )?(?P<owner>{_OWNER}) {_ADJECTIVE}(?:house|home|flat)"
    rf"|the {_ADJECTIVE}(?:house|home|flat) of (?P<of>{_PERSON_PHRASE})"
    rf"|(?:the|his|her|their|your|my) {_ADJECTIVE}(?:house|home|flat)))(?![\w-])"
)


_HER_HOUSE = re.compile(rf"\b(?:his|her|their) {_ADJECTIVE}(?:house|home|flat)$")


def _owner(found: re.Match[str]) -> str | None:
    """Returns the person whose house is found; None if the text does not name it."""
    if found["of"]:
        return found["of"]
    return re.sub(r"(?:'s|(?<=s)')$", "", found["owner"]) if found["owner"] else None


def _without_place(imperative: str) -> tuple[str | None, str | None, str | None]:
    """Returns an instruction without its place, the place, and the person who lives there."""
    found = _named_place().search(imperative)
    house = _HOUSE.search(imperative)
    if house is not None and (found is None or house.start() < found.start()):
        found, owner = house, _owner(house)
    elif found is not None:
        house, owner = None, None
    else:
        return (None if imperative in _words("motion") else imperative), None, None
    place = found["place"]
    if house is not None and house["owner"]:
        place = f"{house['prep']} {house['owner']}"  # "at Yusuf's"
    before, after = imperative[: found.start()], imperative[found.end() :]
    verb = imperative.partition(" ")[0].rstrip(",")
    if before in _words("motion"):
        return _after_motion(after), place, owner
    if verb in _words("needs_place") and found["prep"].lower() != "from":
        before = f"{before} {place}"
    return _tidy(" ".join((before + after).split())), place, owner


def _after_motion(rest: str) -> str | None:
    """Returns the task at a place: "to buy bread" or "and buy bread" after "stop at Ikea"."""
    found = re.match(r",? (?:to|and|for) (?P<rest>.+)", rest)
    return None if found is None else _imperative(found["rest"])


# --- people and items -------------------------------------------------------------------------------------------------

_FOR = re.compile(r"\b(?:for|with|to) (?P<person>(?:(?!for |with |to |at |from |and |over )[\w.'-]+ ?){1,5})$")
_WHOM = re.compile(
    r"^(?:pick up|meet|visit|interview|join|take|bring|drive|fetch|collect|drop|see|help|welcome|talk to|let"
    r"|look in on) (?P<person>(?:(?!for |with |to |at |from |off |try |outside)[\w.'-]+ ?){1,5})"
)


def _person(action: str) -> str | None:
    """Returns the person that an instruction is for, or that it names as its object."""
    for pattern in (_FOR, _WHOM):
        found = pattern.search(action)
        if found is not None and (person := _human(found["person"].strip())) is not None:
            return person
    return None


def _human(phrase: str) -> str | None:
    """Returns the phrase if it is one of a person, without "house" or an item after a possessive."""
    words = phrase.split()
    if not words or phrase.lower() in _places() or find_items(phrase):
        return None
    last = words[-1]
    if last.endswith(("'s", "s'")):
        return re.sub(r"(?:'s|')$", "", phrase)
    named = last[:1].isupper() and last not in _not_names()
    return phrase if named or last.lower() in _words("humans") else None


_GETTING = re.compile(
    r"^(?:buy|get|fetch|collect|bring|borrow|pick up|deliver|hand in|hand over|unload|return|drop off|take|give) "
    r"(?P<object>(?:the|a|an|some|two|three|four|her|his|their) "
    r"(?:(?!for |with |to |at |from |in |of |along|off)[\w'-]+ ?){1,3})"
)


def _object(action: str | None) -> tuple[str, ...]:
    """Returns the item that an instruction is about if it is not in the catalogue: "the spare key"."""
    found = None if action is None else _GETTING.match(action)
    if found is None:
        return ()
    thing = found["object"].strip()
    return () if _human(thing) is not None else (thing,)


@functools.cache
def _items() -> re.Pattern[str]:
    things = {
        value
        for kind in catalogue().values()
        for attribute, values in kind.attributes.items()
        if attribute != "actions"
        for value in values
    }
    listed = "|".join(re.escape(thing) for thing in sorted(things, key=len, reverse=True))
    return re.compile(rf"(?<![\w-])(?:{listed})(?![\w-])", re.IGNORECASE)


@functools.cache
def _places() -> frozenset[str]:
    """Returns the names of landmarks in lower case."""
    return frozenset(text.lower() for kind in catalogue().values() for text in (kind.noun, kind.label, kind.name.label))


@functools.cache
def _not_names() -> frozenset[str]:
    """Returns capitalised words other than names of people."""
    places = {word for name in _places() for word in name.title().split()}
    labels = {word for kind in catalogue().values() for text in (kind.label, kind.name.label) for word in text.split()}
    labels |= {label for name in LandmarkName for label in name.label.split()}
    streets = {name.label for name in StreetName}
    return frozenset(places | labels | streets | _words("no_names"))


@functools.cache
def _names() -> re.Pattern[str]:
    """Returns a pattern of a capitalised word with its title."""
    titles = "|".join(re.escape(title) for title in sorted(_words("titles"), key=len, reverse=True))
    return re.compile(
        rf"(?P<full>(?:(?P<title>{titles}) )?(?<![\w'-])(?P<name>[A-Z][^\W\d_]+(?:-[A-Z][^\W\d_]+)?))(?![\w-])"
    )


def _is_name(text: str, found: re.Match[str]) -> bool:
    """Returns whether a capitalised word is a name by the words around it."""
    if found["name"] in _not_names() or found["full"] in _words("titles") or f"{found['name']}." in _words("titles"):
        return False
    if found["title"]:
        return True
    if re.match(r"'s? \w", text[found.end() :]) and found["name"] not in _words("no_owners"):
        return True
    before = text[: found.start()]
    ends = before.rstrip(" \"'(")[-1:] in (*".!?:\n", "") and not before.rstrip().endswith(tuple(_words("titles")))
    return not ends and re.search(r"(?:\bfrom|\bin|\bto the|\bleaves? for|\boff to) $", before) is None


# --- reasons in messages ----------------------------------------------------------------------------------------------


def _reason_in(text: str) -> str | None:
    """Returns the clause that gives the reason for a request; None if none is marked as such."""
    for sentence in _sentences(text):
        if found := re.search(r"(?:\bbecause|, since) (?P<reason>[^.!?]+)", sentence):
            return _tidy(found["reason"])
        before, mark, _ = sentence.partition(", so ")
        if mark:
            return _tidy(before)
        before, mark, after = sentence.partition(": ")
        if mark and _imperative(after) is not None:
            return _tidy(before)
    return None


def _sentences(text: str) -> Iterator[str]:
    """Yields the sentences of a text; the full stop of a title ends none."""
    titles = tuple(_words("titles"))
    marks = [found.end() for found in re.finditer(r"[.!?](?= |$)", text)]
    ends = [end for end in marks if not text[:end].endswith(titles)]
    begin = 0
    for end in [*ends, len(text)]:
        if text[begin:end].strip():
            yield text[begin:end].strip()
        begin = end


def _uncapitalised(clause: str, people: Collection[str]) -> str:
    """Returns a clause as it follows other words: "the train was early", but "Priya is early"."""
    first, _, rest = clause.partition(" ")
    if any(first in name.split() for name in people):
        return clause
    plural = first.endswith("s") and re.match(r"(?:have|are|were|do)\b", rest) is not None
    return clause[:1].lower() + clause[1:] if first.lower() in _words("common") or plural else clause
