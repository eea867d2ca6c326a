"""Meshes: closed bodies face outwards, panels are read from the right side, textures lie where they are put."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures.camera.mesh import PLAIN, Mesh, MeshBuilder, Surface, joined

GREY = (128, 128, 128)


def volume(mesh: Mesh) -> float:
    """Returns the volume that outward faces enclose [m3], by the divergence theorem."""
    corners = mesh.corners.astype(float)
    return float((np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6.0)


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_a_closed_box_faces_outwards(heading: float) -> None:
    builder = MeshBuilder()
    builder.box((40.0, -7.0), heading, 4.0, 2.0, 1.0, 4.0, colour=GREY, kind=ObjectClass.BUILDING, closed=(True, True))
    mesh = builder.build()
    assert mesh.size == 12
    assert volume(mesh) == pytest.approx(4.0 * 2.0 * 3.0, rel=1e-4)
    centre = mesh.corners.reshape(-1, 3).mean(axis=0)
    assert (((mesh.corners.mean(axis=1) - centre) * mesh.normals).sum(axis=1) > 0).all()


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.0])
def test_a_panel_is_read_from_left_to_right_by_somebody_who_looks_along_its_heading(heading: float) -> None:
    builder = MeshBuilder()
    builder.panel((5.0, 6.0, 2.0), heading, 3.0, 1.0, colour=GREY, kind=ObjectClass.TRAFFIC_SIGN, texture=4)
    mesh = builder.build()
    looks = np.array([math.cos(heading), math.sin(heading), 0.0])
    right = np.array([-math.sin(heading), math.cos(heading), 0.0])  # y points south: right is clockwise on the map
    np.testing.assert_allclose(mesh.normals, np.broadcast_to(-looks, (2, 3)), atol=1e-6)
    np.testing.assert_allclose(mesh.u_axes[:, :3], np.broadcast_to(right / 3.0, (2, 3)), atol=1e-6)
    np.testing.assert_allclose(mesh.v_axes[:, :3], [[0.0, 0.0, 1.0]] * 2, atol=1e-6)
    assert set(mesh.textures.tolist()) == {4}


def test_the_back_of_a_two_sided_panel_is_readable_as_well() -> None:
    builder = MeshBuilder()
    builder.panel((0.0, 0.0, 0.0), 0.0, 2.0, 1.0, colour=GREY, kind=ObjectClass.TRAFFIC_SIGN, two_sided=True)
    mesh = builder.build()
    facing = mesh.normals[:, 0] < 0.0
    assert facing.sum() == 2
    np.testing.assert_allclose(mesh.u_axes[facing, 1], 0.5)
    np.testing.assert_allclose(mesh.u_axes[~facing, 1], -0.5)


def test_walls_carry_whole_repeats_of_their_texture() -> None:
    builder = MeshBuilder()
    builder.box((0.0, 0.0), 0.0, 10.0, 7.0, 0.0, 6.5, colour=GREY, kind=ObjectClass.BUILDING, repeat=(3.2, 3.2))
    mesh = builder.build()
    offsets = mesh.corners - mesh.corners[:, :1]
    u = np.einsum("nkj,nj->nk", offsets, mesh.u_axes[:, :3]) + mesh.u_axes[:, 3:]
    walls = np.abs(mesh.normals[:, 2]) < 0.5
    np.testing.assert_allclose(u[walls], np.round(u[walls]), atol=1e-5)
    assert sorted(set(np.round(u[walls].max(axis=1)).tolist())) == [2.0, 3.0]


def test_added_and_joined_meshes_keep_everything() -> None:
    first, second = MeshBuilder(), MeshBuilder()
    first.box((1.0, 2.0), 0.3, 4.0, 2.0, 0.0, 1.0, colour=(9, 8, 7), kind=ObjectClass.VEHICLES, texture=3, instance=17)
    second.panel((0.0, 0.0, 3.0), 1.0, 2.0, 1.0, colour=GREY, kind=ObjectClass.POLE, surface=Surface.EMISSIVE)
    whole = joined([first.build(), second.build()])
    again = MeshBuilder()
    again.add(whole)
    built = again.build()
    for name in Mesh._fields:
        np.testing.assert_allclose(getattr(built, name), getattr(whole, name), atol=1e-5)
    assert whole.instances.tolist() == [17] * 10 + [0] * 2
    assert whole.surfaces[-1] == Surface.EMISSIVE
    assert whole.classes[0] == ObjectClass.VEHICLES.value
    assert whole.textures[-1] == PLAIN


def test_triangles_without_extent_are_left_out() -> None:
    builder = MeshBuilder()
    builder.triangles([[[0, 0, 0], [1, 0, 0], [2, 0, 0]]], colour=GREY, kind=ObjectClass.OTHER)
    assert builder.build().size == 0
