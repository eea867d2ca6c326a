"""Squares of mixed cells say the same as a look at all edges."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.lookup import SEVERAL, cell_at, material_at, material_in
from dorothie_gym.pictures.camera.ground.materials import Material
from dorothie_gym.pictures.camera.ground.sheets import Sheet


@pytest.mark.parametrize("seed", range(3))
def test_squares_have_the_material_of_all_their_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = [Material.ROAD, Material.PAVEMENT, Material.WHITE_PAINT, Material.PARK]
    polygons = []
    for k in range(24):
        around = np.sort(rng.uniform(0.0, 2.0 * np.pi, 5))
        corners = rng.uniform(0.0, 20.0, 2) + rng.uniform(0.1, 6.0) * np.column_stack((np.cos(around), np.sin(around)))
        polygons.append(Painted(corners, kinds[k % len(kinds)]))
    ground = ground_arrays([Sheet(tuple(polygons), Material.COUNTRY, np.zeros(2), np.full(2, 20.0), 0, ())])
    assert 0.2 < (ground.squares != SEVERAL).mean() < 1.0
    mixed = 0
    for x, y in rng.uniform(0.0, 100.0, (6000, 2)).tolist():
        cell = cell_at(ground, 0, x, y)
        if cell < 0:
            mixed += 1
            assert material_at(ground, 0, x, y) == material_in(ground, 0, -1 - cell, x, y)
    assert mixed > 50
