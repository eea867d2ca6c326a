"""The parsed form of a storyboard template, and its `$NAME` references."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

_REFERENCE = re.compile(r"\$([A-Za-z_]\w*)")


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A name that is bound to a landmark whose category starts with `category`."""

    name: str
    category: str


@dataclass(frozen=True, kw_only=True)
class Dependent:
    """A name that is bound to one value of an attribute of a variable's landmark."""

    name: str
    variable: str
    attribute: str


@dataclass(frozen=True, kw_only=True)
class SubgoalTemplate:
    """One thing to do, as the template words it.

    Attributes:
        destination: "$VARIABLE", or the ontology's label of a landmark.
        description: text with `$NAME` references.
        after: subgoals that must be reached before, as indices in the template.
        trigger: not part of the task until the Ad-Wizard adds it.
        delete: the Ad-Wizard may delete it.
        change: what the description becomes when the Ad-Wizard changes it; None where it may not.
        change_destination: where it then is; None where it stays.
        delete_after_subgoal: it may be deleted only when this subgoal has been reached.
        leaves: whoever stands at the destination is gone once the subgoal is reached.
    """

    destination: str
    description: str
    after: tuple[int, ...] = ()
    trigger: bool = False
    delete: bool = False
    change: str | None = None
    change_destination: str | None = None
    delete_after_subgoal: int | None = None
    leaves: bool = False


@dataclass(frozen=True, kw_only=True)
class StoryboardTemplate:
    """A story with open places (paper, appendix "Task Configuration"); made by `parse_template`, which checks it.

    Attributes:
        name: what it is called in errors and listings.
        story: text with `$NAME` references.
        subgoals: in the template's order; the last live one is the destination.
        variables: names for landmarks.
        dependents: names for values.
        hidden: variables whose place the Co-Wizard does not know, in the order of `variables`.
    """

    name: str
    story: str
    subgoals: tuple[SubgoalTemplate, ...]
    variables: tuple[Variable, ...] = ()
    dependents: tuple[Dependent, ...] = ()
    hidden: tuple[str, ...] = ()

    def destinations(self) -> tuple[str, ...]:
        """All destinations that the subgoals name, those of changes too, each once."""
        both = ((subgoal.destination, subgoal.change_destination) for subgoal in self.subgoals)
        return tuple(dict.fromkeys(ref for pair in both for ref in pair if ref is not None))

    def texts(self) -> Iterator[tuple[str, str]]:
        """Every (field, text) with references in it."""
        yield "story", self.story
        for index, subgoal in enumerate(self.subgoals):
            yield f"subgoals[{index}].description", subgoal.description
            if subgoal.change is not None:
                yield f"subgoals[{index}].change", subgoal.change


def variable_of(destination: str) -> str | None:
    """The variable that a destination refers to; None if it names a landmark."""
    return destination[1:] if destination.startswith("$") else None


def references(text: str) -> tuple[str, ...]:
    """Names that a text refers to as `$NAME`, in order."""
    return tuple(_REFERENCE.findall(text))


def fill(text: str, values: Mapping[str, str]) -> str:
    """The text with each `$NAME` replaced by its value."""
    return _REFERENCE.sub(lambda match: values[match[1]], text)
