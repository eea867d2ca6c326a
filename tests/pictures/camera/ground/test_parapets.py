"""Parapets meet at corners without gaps."""

from __future__ import annotations

import numpy as np

from dorothie_gym.pictures.camera.ground.bridges_and_tunnels import _add_parapets
from dorothie_gym.pictures.camera.mesh import MeshBuilder


def test_walls_around_a_square_are_closed() -> None:
    corners = np.array([[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [10.0, 10.0, 1.0], [0.0, 10.0, 1.0]])
    lines = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    builder = MeshBuilder()
    _add_parapets(builder, lines)
    mesh = builder.build()
    edges: dict[tuple[tuple[float, ...], ...], int] = {}
    for triangle in np.round(mesh.corners.astype(float), 3).tolist():
        for k in range(3):
            ends = tuple(sorted((tuple(triangle[k]), tuple(triangle[(k + 1) % 3]))))
            edges[ends] = edges.get(ends, 0) + 1
    open_edges = [ends for ends, count in edges.items() if count != 2]
    # only the feet, which stand on the deck, belong to one face
    assert all(end[2] == 1.0 for ends in open_edges for end in ends)
    inner = mesh.corners[..., :2].reshape(-1, 2)
    assert np.hypot(*(inner - (0.3, 0.3)).T).min() < 1e-3  # the corner on the bisector


def test_a_single_wall_has_ends() -> None:
    builder = MeshBuilder()
    _add_parapets(builder, np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]]))
    assert len(builder) == 10
