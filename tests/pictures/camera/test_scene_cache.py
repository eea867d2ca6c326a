"""Scenes of towns are built once and kept in the user's cache, by their content."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import Town, load_town
from dorothie_gym.pictures.camera import scene_building
from dorothie_gym.pictures.camera.scene_building import build_town_scene
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.town_scene import TownScene


@pytest.fixture
def town() -> Town:
    return load_town("brookside")


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Names of the towns whose scenes were built, with an empty cache folder."""
    built: list[str] = []

    def build(town: Town) -> TownScene:
        built.append(town.name)
        return build_town_scene(town)

    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(scene_building, "build_town_scene", build)
    town_scene.cache_clear()
    return built


def test_a_scene_is_built_once_and_read_again_in_equal_bytes(town: Town, builds: list[str]) -> None:
    first = town_scene(town)
    assert town_scene(town) is first
    town_scene.cache_clear()
    again = town_scene(town)
    assert builds == ["brookside"]
    tables = ((first.mesh, again.mesh), (first.cells, again.cells), (first.ground.arrays, again.ground.arrays))
    for one, other in (
        *tables,
        (first.signals, again.signals),
        (first.lenses, again.lenses),
        (first.lamps, again.lamps),
    ):
        for column, expected in zip(map(np.asarray, other), map(np.asarray, one), strict=True):
            np.testing.assert_array_equal(column, expected)
            assert column.dtype == expected.dtype
    assert again.lots == first.lots and again.programmes == first.programmes
    places = [site.position for site in town.sites]
    np.testing.assert_array_equal(again.ground.height_at(places), first.ground.height_at(places))


@pytest.mark.long
def test_an_altered_town_has_a_scene_of_its_own(town: Town, builds: list[str]) -> None:
    town_scene(town)
    lanes = [replace(lane, points=lane.points + (0.0, 0.0, 0.5)) for lane in town.lanes]
    parts = {name: getattr(town, name) for name in ("links", "junctions", "streets", "sites", "signals")}
    others = {name: getattr(town, name) for name in ("crosswalks", "sidewalks", "programmes")}
    town_scene(Town(name=town.name, lanes=lanes, **parts, **others))
    assert len(builds) == 2


@pytest.mark.long
def test_a_damaged_entry_is_built_again(town: Town, builds: list[str], tmp_path: Path) -> None:
    town_scene(town)
    (entry,) = (tmp_path / "cache" / "scenes").glob("*.npz")
    data = bytearray(entry.read_bytes())
    data[len(data) // 2] ^= 1
    entry.write_bytes(data)
    town_scene.cache_clear()
    town_scene(town)
    assert len(builds) == 2


@pytest.mark.long
def test_without_a_cache_folder_scenes_are_built(
    town: Town, builds: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", "")
    town_scene(town)
    town_scene.cache_clear()
    town_scene(town)
    assert len(builds) == 2
