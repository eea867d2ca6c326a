"""Landmarks of SDN's files: names, and the assets from which the published loader derives them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.ontology.spellings import parse_landmark

_WALKER: Final = "walker."
_PREFIXES: Final = ("static.prop.", "null.")
_NUMBER: Final = re.compile(r"[\s_.-]*\d+$")

_ASSETS: Final[Mapping[LandmarkName, str]] = MappingProxyType(
    {
        LandmarkName.HOUSE: "null.house",
        LandmarkName.SHELL: "null.shell",
        LandmarkName.PERSON: "walker.pedestrian.0001",
    }
)
"""Assets that are not props; the published loader looks up each asset by its exact spelling."""

_FIELDS: Final = ("asset", "name", "landmark")


def landmark_name(value: object) -> LandmarkName:
    """Returns the landmark for a name, an asset ("static.prop.kfc"), or an object with such fields.

    The asset of an object decides, as in the published loader; its name is read only where the asset names none.

    Raises:
        OntologyError: it names no landmark of the ontology.
    """
    if isinstance(value, Mapping):
        given = [value[field] for field in _FIELDS if isinstance(value.get(field), str)]
        for text in given[:-1]:
            try:
                return _parse(text)
            except OntologyError:
                continue
        return _parse(given[-1] if given else "")
    return _parse(value if isinstance(value, str) else "")


def asset_of(name: str) -> str:
    """Returns the asset for a landmark of the ontology; a name outside the ontology becomes a prop."""
    try:
        landmark = parse_landmark(name)
    except OntologyError:
        return _PREFIXES[0] + re.sub(r"\W+", "", name.casefold())
    return _ASSETS.get(landmark, _PREFIXES[0] + landmark.label.casefold())


def _parse(text: str) -> LandmarkName:
    """Returns the landmark for a name or an asset; raises `OntologyError` for unknown ones."""
    asset = text.strip().rpartition("/")[2].casefold()
    if asset.startswith(_WALKER):
        return LandmarkName.PERSON
    for prefix in _PREFIXES:
        if asset.startswith(prefix):
            text = asset.removeprefix(prefix)
            break
    try:
        return parse_landmark(text)
    except OntologyError:
        numbered = _NUMBER.sub("", text)
        if numbered in ("", text):
            raise
        return parse_landmark(numbered)  # "null.house.02"
