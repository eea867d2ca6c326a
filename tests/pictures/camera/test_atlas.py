"""Textures: powers of two with mip levels in a row, words that are read from left to right, equal in every process."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np
import pytest

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.pictures.camera.atlas import (
    BRAND_SIGNS,
    STREET_GROUND,
    STREET_NAMES,
    AtlasArrays,
    Texture,
    TextureAtlas,
    town_atlas,
    with_street_names,
)
from dorothie_gym.pictures.camera.lettering import Picture, lettered


def level(atlas: AtlasArrays, texture: int, number: int = 0) -> Picture:
    first, width, height, levels = atlas.table[texture].tolist()
    assert number < levels
    for _ in range(number):
        first, width, height = first + width * height, width // 2, height // 2
    return atlas.texels[first : first + width * height].reshape(height, width, 4).astype(np.float32)


def test_textures_lie_in_a_row_with_all_their_levels() -> None:
    atlas = town_atlas()
    assert len(atlas.table) == STREET_NAMES
    end = 0
    for first, width, height, levels in atlas.table.tolist():
        assert first == end
        assert width & (width - 1) == 0
        assert height & (height - 1) == 0
        assert min(width, height) >> (levels - 1) == 1
        end += sum((width >> k) * (height >> k) for k in range(levels))
    assert end == len(atlas.texels)
    assert level(atlas, Texture.PLAIN).tolist() == [[[255.0, 255.0, 255.0, 0.0]]]


@pytest.mark.parametrize("texture", Texture)
def test_each_level_has_the_mean_colour_of_the_texture(texture: Texture) -> None:
    atlas = town_atlas()
    whole = level(atlas, texture).mean(axis=(0, 1))
    for number in range(atlas.table[texture, 3]):
        np.testing.assert_allclose(level(atlas, texture, number).mean(axis=(0, 1)), whole, atol=1.0)


def test_a_texture_needs_powers_of_two() -> None:
    with pytest.raises(ValueError, match="48 x 32 texels"):
        TextureAtlas().add(np.zeros((32, 48, 4), dtype=np.float32))


def test_words_are_neither_mirrored_nor_upside_down() -> None:
    picture = lettered("L", (64, 64), ink=(255, 255, 255), ground=(0, 0, 0))[..., 0]
    stem, foot = picture[:, :32].sum(), picture[:32].sum()
    assert stem > 1.3 * picture[:, 32:].sum()  # the stem of an L is on its left
    assert foot > 1.3 * picture[32:].sum()  # its foot is below: row 0 is at the bottom


def test_words_fill_their_panel_without_leaving_it() -> None:
    for words in ("Ann", "Martin Luther King Boulevard"):
        picture = lettered(words, (256, 64), ink=(255, 255, 255), ground=(0, 0, 0))[..., 0]
        assert (picture > 128).any()
        assert not picture[[0, -1]].any()
        assert not picture[:, [0, -1]].any()
        rows, columns = np.nonzero(picture > 128)
        assert np.ptp(columns) > 200 or np.ptp(rows) > 40


def test_blades_show_the_names_of_the_session() -> None:
    base = town_atlas()
    first = with_street_names(base, ["Baits", "Bishop"])
    second = with_street_names(base, ["Bishop", "Baits"])
    assert len(first.table) == STREET_NAMES + 2
    for texture in Texture:
        np.testing.assert_array_equal(level(first, texture), level(base, texture))
    np.testing.assert_array_equal(level(first, STREET_NAMES), level(second, STREET_NAMES + 1))
    np.testing.assert_array_equal(level(first, STREET_NAMES + 1, 3), level(second, STREET_NAMES, 3))
    assert (level(first, STREET_NAMES) != level(first, STREET_NAMES + 1)).any()
    ground = (level(first, STREET_NAMES)[..., :3] == STREET_GROUND).all(axis=-1)
    assert ground.mean() > 0.3


def test_each_brand_has_a_sign_of_its_own_colours() -> None:
    plain = {LandmarkName.UNKNOWN, LandmarkName.QUERIED, LandmarkName.HOUSE, LandmarkName.PERSON}
    assert set(BRAND_SIGNS) == set(LandmarkName) - plain
    grounds = np.array([ground for _, _, _, ground in BRAND_SIGNS.values()], dtype=float)
    apart = np.abs(grounds[:, None] - grounds[None]).sum(axis=-1) + 1000.0 * np.eye(len(grounds))
    assert apart.min() > 75.0


def test_textures_are_equal_in_another_process() -> None:
    program = (
        "import hashlib; from dorothie_gym.pictures.camera.atlas import town_atlas, with_street_names;"
        "print(hashlib.sha256(with_street_names(town_atlas(), ['Hill']).texels.tobytes()).hexdigest())"
    )
    other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.strip()
    assert other == hashlib.sha256(with_street_names(town_atlas(), ["Hill"]).texels.tobytes()).hexdigest()
