"""Catalogue of the ten landmark kinds: categories, and attributes such as items and actions."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources

import yaml

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.slots import LandmarkName, Slot
from dorothie_gym.ontology.spellings import parse_slot_value

DATA_FILE = "data/landmarks.yaml"
_NOT_A_PLACE = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)


@dataclass(frozen=True, kw_only=True)
class LandmarkKind:
    """Properties of a landmark of the ontology that stories may refer to.

    Attributes:
        name: landmark of the ontology.
        category: dotted category, such as "places.restaurants".
        label: name on maps.
        noun: name in stories ("Burger King", but "house").
        repeatable: whether a town may contain several instances.
        attributes: values for dependents, by attribute ("items", "menuitems", "actions").

    Raises:
        ValueError: if an attribute contains a value twice.
    """

    name: LandmarkName
    category: str
    label: str
    noun: str
    repeatable: bool
    attributes: Mapping[str, tuple[str, ...]]

    def __post_init__(self) -> None:
        for attribute, values in self.attributes.items():
            if len(set(values)) != len(values):
                raise ValueError(f"{DATA_FILE}: {self.name.label}.{attribute}: values must be distinct")


@functools.cache
def catalogue() -> Mapping[LandmarkName, LandmarkKind]:
    """Returns all kinds in the order of the ids of the ontology.

    Raises:
        OntologyError: if the data file does not describe every landmark of the ontology; names those.
    """
    text = (resources.files("dorothie_gym.tasks") / DATA_FILE).read_text(encoding="utf-8")
    rows = yaml.safe_load(text)
    names = [name for name in LandmarkName if name not in _NOT_A_PLACE]
    labels = [name.label for name in names]
    if missing := [label for label in labels if label not in rows]:
        raise OntologyError(f"dorothie_gym/tasks/{DATA_FILE}: describes no {', '.join(missing)}; add an entry for each")
    if unknown := [label for label in rows if label not in labels]:
        raise OntologyError(f"dorothie_gym/tasks/{DATA_FILE}: {unknown[0]} is no LandmarkName of the ontology")
    return {
        name: LandmarkKind(
            name=name,
            category=row["category"],
            label=row["label"],
            noun=row.get("noun", row["label"]),
            repeatable=row.get("repeatable", False),
            attributes={attribute: tuple(values) for attribute, values in row.get("attributes", {}).items()},
        )
        for name in names
        for row in (rows[name.label],)
    }


def map_label(name: LandmarkName) -> str:
    """Returns the name of a landmark on maps, such as "7-Eleven"; the ontology's name if it is not a place."""
    kind = catalogue().get(name)
    return name.label if kind is None else kind.label


def map_labels(names: Sequence[LandmarkName]) -> tuple[str, ...]:
    """Returns the names of landmarks on maps; those that occur more than once are numbered."""
    return _map_labels(tuple(names))


@functools.lru_cache(maxsize=256)
def _map_labels(names: tuple[LandmarkName, ...]) -> tuple[str, ...]:
    numbers: Counter[LandmarkName] = Counter()
    labels = []
    for name in names:
        numbers[name] += 1
        labels.append(map_label(name) if names.count(name) == 1 else f"{map_label(name)} {numbers[name]}")
    return tuple(labels)


@functools.cache
def categories() -> tuple[str, ...]:
    """Returns all categories of the catalogue, sorted."""
    return tuple(sorted({kind.category for kind in catalogue().values()}))


@functools.lru_cache(maxsize=256)
def kinds_in(category: str) -> tuple[LandmarkKind, ...]:
    """Returns the kinds whose category starts with `category`, in the order of the ids of the ontology."""
    return tuple(kind for kind in catalogue().values() if kind.category.startswith(category))


def find_kind(text: str) -> LandmarkKind | None:
    """Returns the kind for a landmark name, in any spelling of the ontology, or None."""
    try:
        name = parse_slot_value(Slot.LANDMARK, text)
    except OntologyError:
        return None
    return catalogue().get(name) if isinstance(name, LandmarkName) else None
