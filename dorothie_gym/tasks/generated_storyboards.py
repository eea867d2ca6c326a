"""Generated storyboards: errands, people, backgrounds, order and changes drawn from a seed, for any town.

A name such as `generated:7,stops=5` determines a template; the same one on every processor, since only whole numbers
are drawn. The words are in `data/generated_storyboards.yaml`.
"""

from __future__ import annotations

import functools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
import yaml

from dorothie_gym.tasks.storyboard import (
    Channel,
    Dependent,
    StoryboardTemplate,
    SubgoalTemplate,
    TaskMessage,
    TaskMessages,
    Variable,
)
from dorothie_gym.tasks.storyboard_specification import STOPS, StoryboardSpecification

WORDS_FILE: Final = "data/generated_storyboards.yaml"

_BRANCH: Final = 11  # branch of the seed, so that no other draw of the package has the same stream

_CAPACITY: Final[Mapping[str, int]] = MappingProxyType(
    {
        "places.restaurants": 4,
        "places.cafe": 1,
        "places.stores": 2,
        "places.gasstation": 1,
        "places.residential": 5,
        "people": 2,
    }
)
"""Number of landmarks of each category in a storyboard: the kinds of the catalogue, and few houses and people."""

_HIDDEN_PERCENT: Final = 80  # share of the storyboards with a hidden house or person, as of those shipped
_TITLED_PERCENT: Final = 30  # share of the people with a title
_MOST_CHANGES: Final = 2  # triggers, deletions and changes of a storyboard, of which there is at least one


@functools.lru_cache(maxsize=256)
def generate_template(specification: StoryboardSpecification) -> StoryboardTemplate:
    """Returns the template of a specification; equal ones give equal templates."""
    rng = np.random.default_rng(np.random.SeedSequence([specification.seed, specification.stops or 0, _BRANCH]))
    stops = specification.stops or int(rng.integers(STOPS[0], STOPS[1] + 1))
    return _Draft(rng).template(str(specification), stops)


# --- Words ------------------------------------------------------------------------------------------------------------


@functools.cache
def _words() -> Mapping[str, Any]:
    """Returns the content of the data file."""
    text = (resources.files("dorothie_gym.tasks") / WORDS_FILE).read_text(encoding="utf-8")
    words: Mapping[str, Any] = yaml.safe_load(text)
    return words


class _Person(NamedTuple):
    """Person or group of a story, with the pronouns."""

    name: str
    they: str
    them: str
    their: str

    def values(self, number: str = "") -> dict[str, str]:
        """Returns the values of the names in braces."""
        owner = f"{self.name}'" if self.name.endswith("s") and self.they == "they" else f"{self.name}'s"
        return {
            f"name{number}": self.name,
            f"names{number}": owner,
            f"they{number}": self.they,
            f"them{number}": self.them,
            f"their{number}": self.their,
        }


_PRONOUNS: Final[Mapping[str, tuple[str, str, str]]] = MappingProxyType(
    {"she": ("she", "her", "her"), "he": ("he", "him", "his")}
)
_MENTION: Final = re.compile(r"\{(names?|they|them|their)\}")
_SENTENCE: Final = re.compile(r"(^|[.!?] )([a-z])")


def _fill(text: str, values: Mapping[str, str]) -> str:
    return text.format_map(values)


def _sentence(text: str, values: Mapping[str, str]) -> str:
    """Returns a text with its names and with capitals at the beginnings of sentences."""
    return _SENTENCE.sub(lambda found: found[1] + found[2].upper(), _fill(text, values))


def _introduced(text: str) -> str:
    """Returns a text in which the first mention of a person is the name, not a pronoun."""
    found = _MENTION.search(text)
    if found is None or found[1] in ("name", "names"):
        return text
    return f"{text[: found.start()]}{{{'names' if found[1] == 'their' else 'name'}}}{text[found.end() :]}"


# --- Drafts -----------------------------------------------------------------------------------------------------------


@dataclass(kw_only=True)
class _Errand:
    """Errand in the making.

    Attributes:
        kind: kind of the data file.
        told: its words in the story.
        reason: its reason, with braces.
        sender: sender of messages about it.
        values: values of the names in braces.
        subgoal: the subgoal.
    """

    kind: str
    told: str
    reason: str
    sender: str
    values: dict[str, str]
    subgoal: SubgoalTemplate

    @property
    def words(self) -> Mapping[str, Any]:
        """Texts of its kind."""
        words: Mapping[str, Any] = _words()["errands"][self.kind]
        return words


class _Draft:
    """Template in the making; each draw takes a whole number from `rng`."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self._left = Counter(_CAPACITY)
        self._variables: list[Variable] = []
        self._dependents: list[Dependent] = []
        self._named: set[str] = set()
        self._things: set[str] = set()
        self._occasion: Mapping[str, Any] = self._one_of(_words()["occasions"])
        self._cast = {"host": self._person(), "group": _Person(self._occasion["group"], "they", "them", "their")}

    def template(self, name: str, stops: int) -> StoryboardTemplate:
        """Draws a template with a number of stops."""
        occasion, host = self._occasion, self._cast["host"].values()
        place = self._place([occasion.get("place", "places.residential")])
        values = {**host, "host": host["name"], "hosts": host["names"], "house": place, "place": place}
        errands: list[_Errand] = []
        for _ in range(stops - 1):
            errands.append(self._errand(self._one_of(self._kinds(errands)), errands))
        order = self._order(errands)
        added = self._mark(errands)
        last = SubgoalTemplate(
            destination=place,
            description=_fill(occasion["description"], values),
            reason=_fill(occasion["reason"], values),
        )
        told = (_sentence(errand.told, errand.values) for errand in errands)
        story = (_sentence(occasion["opening"], values), *told, *order, _sentence(occasion["ending"], values))
        return StoryboardTemplate(
            name=name,
            story=" ".join(story),
            subgoals=(*(errand.subgoal for errand in (*errands, *added)), last),
            variables=tuple(self._variables),
            dependents=tuple(self._dependents),
            hidden=self._hidden(),
        )

    # --- draws --------------------------------------------------------------------------------------------------------

    def _one_of(self, options: Sequence[Any]) -> Any:
        return options[int(self.rng.integers(len(options)))]

    def _chance(self, percent: int) -> bool:
        return int(self.rng.integers(100)) < percent

    def _person(self) -> _Person:
        """Draws a person whom the story does not mention yet."""
        pronoun = self._one_of(tuple(_PRONOUNS))
        names = _words()["titled" if self._chance(_TITLED_PERCENT) else "people"][pronoun]
        name = self._one_of([name for name in names if name not in self._named])
        self._named.add(name)
        return _Person(name, *_PRONOUNS[pronoun])

    def _place(self, categories: Sequence[str]) -> str:
        """Draws a category that has landmarks left, and returns the reference of a new variable of it."""
        category = self._one_of([each for each in categories if self._left[each]])
        self._left[category] -= 1
        variable = Variable(name=f"P{len(self._variables) + 1}", category=category)
        self._variables.append(variable)
        return f"${variable.name}"

    def _item(self, place: str, attribute: str) -> str:
        """Returns the reference of a new dependent of a variable."""
        name = f"I{len(self._dependents) + 1}"
        self._dependents.append(Dependent(name=name, variable=place.removeprefix("$"), attribute=attribute))
        return f"${name}"

    def _thing(self) -> str:
        thing = str(self._one_of([each for each in _words()["things"] if each not in self._things]))
        self._things.add(thing)
        return thing

    # --- errands ------------------------------------------------------------------------------------------------------

    def _kinds(self, errands: Sequence[_Errand]) -> list[str]:
        """Returns the kinds of errands for which landmarks are left."""
        numbers = Counter(errand.kind for errand in errands)
        return [
            kind
            for kind, words in _words()["errands"].items()
            if numbers[kind] < words["most"] and any(self._left[category] for category in words["place"])
        ]

    def _errand(self, kind: str, others: Sequence[_Errand]) -> _Errand:
        """Draws an errand of a kind, told in words that no other has, if there are any left."""
        words = _words()["errands"][kind]
        spared = () if self._occasion.get("errands", True) else ("host",)
        role = self._one_of([role for role in words["with"] if role not in spared] or words["with"])
        person = self._cast[role] if role in self._cast else self._person()
        place = self._place(words["place"])
        values = {**person.values(), "place": place, "house": place}
        if "attribute" in words:
            values["item"] = self._item(place, words["attribute"])
        if "thing" in words:
            values["thing"] = self._thing()
        told = {errand.told for errand in others}
        reason = self._one_of(words["group_reasons" if role == "group" else "reasons"])
        subgoal = SubgoalTemplate(
            destination=place,
            description=_fill(words["description"], values),
            reason=_fill(reason, values),
            leaves=bool(words.get("leaves")),
        )
        return _Errand(
            kind=kind,
            told=self._one_of([text for text in words["story"] if text not in told] or words["story"]),
            reason=reason,
            sender=self._cast["host"].name if role == "group" else f"{values['names']} {self._relative()}",
            values=values,
            subgoal=subgoal,
        )

    def _relative(self) -> str:
        return str(self._one_of(_words()["relatives"]))

    def _order(self, errands: Sequence[_Errand]) -> list[str]:
        """Draws whether an errand comes after others; returns the sentence of the story that says so."""
        possible = [
            (order, later, earlier)
            for order in _words()["orders"]
            for later, errand in enumerate(errands)
            if errand.kind == order["errand"] and (earlier := _before(errands, later, order["after"]))
        ]
        if not possible or self._chance(50):
            return []
        order, later, earlier = self._one_of(possible)
        errands[later].subgoal = replace(errands[later].subgoal, after=earlier)
        values = errands[later].values
        if order["after"] != "others":
            first = errands[earlier[0]].values
            values = {**values, **first, "visited": values["name"]}
            values["place"] = first["place"] if errands[later].kind == "visit" else errands[later].values["place"]
        return [_sentence(order["text"], values)]

    # --- changes ------------------------------------------------------------------------------------------------------

    def _mark(self, errands: Sequence[_Errand]) -> list[_Errand]:
        """Draws one or two of: an errand that is added later, one that may be dropped, one that may change.

        Returns:
            The errands that are added later.
        """
        wanted, added = 1 + int(self.rng.integers(_MOST_CHANGES)), list[_Errand]()
        for k in self.rng.permutation(3).tolist():
            if not wanted:
                break
            free = [errand for errand in errands if self._may(errand, ("add", "dropped", "closed")[k])]
            if k == 0:
                new = self._added(errands)
                added, wanted = [*added, *new], wanted - len(new)
            elif free:
                (self._drop if k == 1 else self._change)(self._one_of(free), errands)
                wanted -= 1
        return added

    def _may(self, errand: _Errand, needed: str) -> bool:
        """Returns whether an unchanged errand has the words for a change, and its new place is left."""
        unchanged = not errand.subgoal.delete and errand.subgoal.change is None
        room = needed != "closed" or self._left[self._category(errand)] > 0
        return unchanged and needed in errand.words and room

    def _added(self, errands: Sequence[_Errand]) -> list[_Errand]:
        """Draws an errand that the Ad-Wizard may add; none if no kind is left."""
        kinds = [kind for kind in self._kinds(errands) if "request" in _words()["errands"][kind]]
        if not kinds:
            return []
        errand = self._errand(self._one_of(kinds), errands)
        message = self._message(errand, f"{errand.reason}, so {errand.words['request']}.")
        errand.subgoal = replace(errand.subgoal, trigger=True, messages=TaskMessages(trigger=message))
        return [errand]

    def _drop(self, errand: _Errand, errands: Sequence[_Errand]) -> None:
        """Lets the Ad-Wizard delete an errand, sometimes not before another one is done."""
        words = errand.words
        message = self._message(errand, f"{self._one_of(words['dropped'])}, so {self._one_of(words['skip'])}.")
        before = [k for k, other in enumerate(errands) if other is not errand and not other.subgoal.after]
        until = self._one_of(before) if before and self._chance(25) else None
        errand.subgoal = replace(
            errand.subgoal, delete=True, delete_after_subgoal=until, messages=TaskMessages(delete=message)
        )

    def _change(self, errand: _Errand, errands: Sequence[_Errand]) -> None:
        """Lets the Ad-Wizard move an errand to another place of its category."""
        words, place = errand.words, self._place([self._category(errand)])
        errand.values |= {"place2": place, "house2": place}
        if "attribute" in words:
            errand.values["item2"] = self._item(place, words["attribute"])
        else:
            errand.values |= self._person().values("2")
        because = self._one_of(words["closed"])
        errand.subgoal = replace(
            errand.subgoal,
            change=_fill(f"{words['change']}, because {because}", errand.values),
            change_destination=place,
            messages=TaskMessages(change=self._message(errand, f"{because}, so {words['change_request']}.")),
        )

    def _category(self, errand: _Errand) -> str:
        """Returns the category of the place of an errand."""
        return next(row.category for row in self._variables if f"${row.name}" == errand.subgoal.destination)

    def _message(self, errand: _Errand, text: str) -> TaskMessage:
        by = (Channel.CALL, Channel.TEXT_MESSAGE, Channel.VOICE_MESSAGE)
        words = _sentence(_introduced(text), errand.values)
        return TaskMessage(sender=errand.sender, channel=self._one_of(by), text=words)

    def _hidden(self) -> tuple[str, ...]:
        """Draws a house or a person that the Co-Wizard's map lacks."""
        names = [row.name for row in self._variables if row.category in ("places.residential", "people")]
        return (self._one_of(names),) if names and self._chance(_HIDDEN_PERCENT) else ()


def _before(errands: Sequence[_Errand], later: int, kind: str) -> tuple[int, ...]:
    """Returns the errands that come before one: all others, or the first of a kind."""
    others = [k for k in range(len(errands)) if k != later]
    if kind == "others":
        return tuple(others)
    return tuple(k for k in others if errands[k].kind == kind)[:1]
