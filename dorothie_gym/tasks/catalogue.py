"""The ten kinds of landmark: their categories, and the things that one gets or does there."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources

import yaml

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import LandmarkName, Slot, parse_slot_value

DATA_FILE = "data/landmarks.yaml"
_NOT_A_PLACE = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)


@dataclass(frozen=True, kw_only=True)
class LandmarkKind:
    """What stories may say about one landmark of the ontology.

    Attributes:
        name: the landmark.
        category: dotted category, such as "places.restaurants".
        label: how a map names it.
        noun: how a story names it ("Burger King", but "house").
        repeatable: whether a town may have several of it.
        attributes: values that dependents draw from, by attribute ("items", "menuitems", "actions").
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
                raise ValueError(f"{DATA_FILE}: {self.name.label}.{attribute}: every value must be given once only")


@functools.cache
def catalogue() -> Mapping[LandmarkName, LandmarkKind]:
    """The ten kinds in the order of the ontology's ids.

    Raises:
        ValueError: the data file does not describe every landmark of the ontology.
    """
    text = (resources.files("dorothie_gym.tasks") / DATA_FILE).read_text(encoding="utf-8")
    rows = yaml.safe_load(text)
    names = [name for name in LandmarkName if name not in _NOT_A_PLACE]
    labels = [name.label for name in names]
    if sorted(rows) != sorted(labels):
        raise ValueError(f"{DATA_FILE}: has {sorted(rows)}, but the ontology has {sorted(labels)}")
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


def categories() -> tuple[str, ...]:
    """All categories of the catalogue, sorted."""
    return tuple(sorted({kind.category for kind in catalogue().values()}))


def kinds_in(category: str) -> tuple[LandmarkKind, ...]:
    """Kinds whose category starts with the given one, in the order of the ontology's ids."""
    return tuple(kind for kind in catalogue().values() if kind.category.startswith(category))


def find_kind(text: str) -> LandmarkKind | None:
    """The kind that a landmark's name stands for, in any spelling that the ontology reads; None if there is none."""
    try:
        name = parse_slot_value(Slot.LANDMARK, text)
    except OntologyError:
        return None
    return catalogue().get(name) if isinstance(name, LandmarkName) else None
