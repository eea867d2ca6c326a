"""Mutated maps become towns, or are refused in one line; the long test of all kinds of files has more of them."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from lxml import etree

from dorothie_gym.errors import TownError
from dorothie_gym.maps.lint import check_town
from dorothie_gym.maps.opendrive import import_opendrive
from tests.malformed.map_mutation import mutate_map
from tests.malformed.map_pieces import make_ends, make_written, piece
from tests.malformed.map_use import use_map
from tests.malformed.subjects import check_message


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("written")
    make_written(folder)
    return (folder / "town.xodr").read_bytes()


def is_town(path: Path, content: bytes) -> bool:
    """Returns whether a file is read; a refusal must have one line."""
    path.write_bytes(content)
    try:
        town, notes = import_opendrive(path)
    except TownError as error:
        check_message(error)
        return False
    assert all("\n" not in note.message for note in notes.sorted())
    check_town(town)
    return True


@pytest.mark.parametrize("part", range(4))
def test_mutated_maps_are_read_or_refused_in_one_line(tmp_path: Path, part: int) -> None:
    make_ends(tmp_path)
    original = (tmp_path / "town.xodr").read_bytes()
    towns = sum(
        is_town(tmp_path / "mutated.xodr", mutate_map(original, Random(number)))
        for number in range(15 * part, 15 * part + 15)
    )
    assert towns > 5


def test_pieces_of_a_map_are_towns(tmp_path: Path, written: bytes) -> None:
    for seed, roads in enumerate((1, 3, 8, 20)):
        content = piece(written, roads, Random(seed))
        assert len(etree.fromstring(content).findall("road")) <= roads
        assert is_town(tmp_path / "piece.xodr", content) or roads == 1


def test_a_sound_map_is_used_whole(tmp_path: Path) -> None:
    make_ends(tmp_path)
    use_map(tmp_path / "town.xodr", Random(0))


def test_mutations_are_those_of_their_seed(written: bytes) -> None:
    first, again, other = (mutate_map(written, Random(seed)) for seed in (3, 3, 4))
    assert first == again != other
