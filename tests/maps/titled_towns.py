"""Brookside as another program would write it, with names of streets of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from dorothie_gym.maps import Town, load_town, write_opendrive
from dorothie_gym.maps.opendrive import read_opendrive

TITLES: Final = ("Rue de l'Église", "Main St", "Marktstraße", "N Broadway", "Old Mill Lane", "1st Avenue")
"""Names for the first streets of the town."""


def renamed(folder: Path, names: Mapping[str, str]) -> Town:
    """Returns brookside as another program would write it, with other names of streets."""
    path = folder / "renamed.xodr"
    write_opendrive(load_town("brookside"), path)
    text = path.read_text(encoding="utf-8").replace('vendor="dorothie_gym"', 'vendor="somebody"')
    for old, new in names.items():
        text = text.replace(f'name="{old}"', f'name="{new}"')
    path.write_text(text, encoding="utf-8")
    return read_opendrive(path)


def titled(folder: Path) -> Town:
    """Returns brookside with the names of `TITLES`."""
    names = [street.name for street in load_town("brookside").streets]
    return renamed(folder, dict(zip(names, TITLES, strict=False)))
