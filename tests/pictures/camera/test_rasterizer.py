"""Visibility buffer and labels: what they show is what rays hit, and closed surfaces have neither gaps nor overlaps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.pictures.camera.cells import TILE, draw_cells, new_order, sorted_by_cell
from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.materials import Material
from dorothie_gym.pictures.camera.ground.sheets import Sheet
from dorothie_gym.pictures.camera.labels import find_boxes, new_labels, write_labels
from dorothie_gym.pictures.camera.mesh import Mesh, MeshBuilder, empty_mesh
from dorothie_gym.pictures.camera.pose import CameraPose, View, view_from
from dorothie_gym.pictures.camera.rasterizer import (
    NEAR,
    SKY,
    VisibilityBuffer,
    clear,
    collect_triangles,
    draw_collected,
    draw_triangles,
    new_buffer,
)
from dorothie_gym.pictures.camera.samples import new_samples

GREY = (128, 128, 128)
CORNERS = np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]])
GROUND = ground_arrays([Sheet((Painted(CORNERS, Material.ROAD),), Material.ROAD, CORNERS[0], CORNERS[2], 0, ())])


def street(seed: int, count: int = 900) -> Mesh:
    """Returns boxes, slanted prisms and panels on a ground of few, large triangles."""
    rng, builder = np.random.default_rng(seed), MeshBuilder()
    corners = np.array([[-600, -600, 0], [600, -600, 0], [600, 600, 0], [-600, 600, 0]], dtype=float)
    builder.triangles(corners[[[0, 1, 2], [0, 2, 3]]], colour=GREY, kind=ObjectClass.ROAD)
    for k in range(count):
        centre, heading = rng.uniform(-200, 200, 2), rng.uniform(-4, 4)
        length, width, high = rng.uniform(0.3, 20), rng.uniform(0.3, 12), rng.uniform(0.2, 18)
        box = {"colour": GREY, "kind": ObjectClass.BUILDING, "instance": k + 1}
        if k % 3:
            builder.box(tuple(centre), heading, length, width, rng.uniform(0, 0.5), high, **box)  # type: ignore[arg-type]
        else:
            angles = np.linspace(0, 2 * np.pi, 8)[:-1]
            ring = np.column_stack((np.cos(angles), np.sin(angles)))
            builder.prism(centre + ring * width, 0.0, high, top=centre + ring * width * 0.4, **box)  # type: ignore[arg-type]
    return builder.build()


def seen(view: View, mesh: Mesh) -> VisibilityBuffer:
    """Draws a whole mesh."""
    buffer = new_buffer(view.width, view.height)
    clear(buffer)
    draw_triangles(view, buffer, mesh, 0, mesh.size, 0)
    assert (buffer.triangles[:, view.width :] == SKY).all()
    return buffer


def numbers_of(view: View, mesh: Mesh) -> NDArray[np.int32]:
    """Returns the numbers of the triangles in a picture of a whole mesh."""
    return seen(view, mesh).triangles[:, : view.width]


def rays_hit(view: View, mesh: Mesh) -> tuple[Array, NDArray[np.int64]]:
    """Returns depth and triangle of each pixel by ray casting; triangles seen from behind let rays through."""
    construction = pytest.importorskip("embreex.mesh_construction")
    scenes = pytest.importorskip("embreex.rtcore_scene")
    facing = np.flatnonzero(((view.origin - mesh.corners[:, 0]) * mesh.normals).sum(axis=1) > 0.0)
    scene = scenes.EmbreeScene(robust=True)
    # kept: the scene refers to it
    triangles = construction.TriangleMesh(scene, np.ascontiguousarray(mesh.corners[facing]))
    directions = view.rays().reshape(-1, 3)
    origins = view.origin + directions * NEAR
    answer = scene.run(origins.astype(np.float32), directions.astype(np.float32), output=True)
    del triangles
    hit = answer["primID"].astype(np.int64)
    depth = np.where(hit >= 0, answer["tfar"].astype(float) + NEAR, np.inf)
    shape = view.height, view.width
    return depth.reshape(shape), np.where(hit >= 0, facing[hit], SKY).reshape(shape)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_pixels_see_what_rays_hit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = street(seed)
    x, y, z, heading, pitch = rng.uniform((-100, -100, 0.3, -4, -0.3), (100, 100, 8, 4, 0.2)).tolist()
    pose = CameraPose(x, y, z, heading, pitch)
    view = view_from(pose, 240, 160, 90.0)
    labels, buffer = new_labels(240, 160), seen(view, mesh)
    write_labels(view, buffer, mesh, empty_mesh(), empty_mesh(), GROUND, new_samples(), labels)
    depth, hit = rays_hit(view, mesh)
    same = buffer.triangles == hit
    assert same.mean() >= 0.999
    with np.errstate(invalid="ignore"):
        error = np.where(np.isinf(depth) & np.isinf(labels.depth), 0.0, np.abs(labels.depth - depth))
    assert (error[depth < 200.0] <= 1e-3).mean() >= 0.999
    numbers = buffer.triangles[same & (hit >= 0)]
    assert (labels.semantic[same & (hit >= 0)] == mesh.classes[numbers]).all()
    assert (labels.instance[same & (hit >= 0)] == mesh.instances[numbers]).all()
    assert (labels.semantic[buffer.triangles == SKY] == ObjectClass.SKY.value).all()


@pytest.mark.parametrize("scale", [0.05, 0.3])
def test_what_the_near_plane_cuts_is_seen_as_rays_see_it(scale: float) -> None:
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1.0, 1.0, (400, 1, 3)) * [3.0, 3.0, 1.0] + rng.normal(0.0, scale * 10, (400, 3, 3))
    builder = MeshBuilder()
    builder.triangles(corners, colour=GREY, kind=ObjectClass.OTHER)
    mesh = builder.build()
    view = view_from(CameraPose(0.0, 0.0, 0.0, 0.4), 160, 120, 100.0)
    hit = rays_hit(view, mesh)[1]
    assert (hit >= 0).mean() > 0.5
    assert (numbers_of(view, mesh) == hit).mean() >= 0.998


@pytest.mark.parametrize("far", [0.0, 900.0, 4000.0])
def test_sifting_leaves_out_no_triangle_that_covers_a_sample(far: float) -> None:
    rng = np.random.default_rng(11)
    away = rng.uniform(0.2, 60.0, (20_000, 1, 1))
    sizes = away * rng.choice([0.001, 0.01, 0.03, 0.1], (20_000, 1, 1))
    corners = away * rng.normal(size=(20_000, 1, 3)) + sizes * rng.normal(size=(20_000, 3, 3)) + [far, -far, 0.0]
    builder = MeshBuilder()
    builder.triangles(corners, colour=GREY, kind=ObjectClass.OTHER)
    mesh = builder.build()
    view = view_from(CameraPose(far, -far, 0.0, 0.7), 84, 84, 90.0)
    whole = seen(view, mesh)
    buffer = new_buffer(84, 84)
    clear(buffer)
    step = buffer.kept.size // 2
    for first in range(0, mesh.size, step):  # all of them, none sifted
        count = min(step, mesh.size - first)
        buffer.kept[:count] = np.arange(first, first + count)
        draw_collected(view, buffer, mesh, count, 0)
    np.testing.assert_array_equal(buffer.triangles, whole.triangles)
    assert len(np.unique(whole.triangles)) > 100
    sifted = sum(
        collect_triangles(view, buffer, mesh, first, min(first + step, mesh.size), 0, 0)
        for first in range(0, mesh.size, step)
    )
    assert sifted < 0.25 * mesh.size


@pytest.mark.parametrize(("width", "height"), [(192, 128), (171, 101)])
def test_cells_show_the_same_as_the_whole_mesh(width: int, height: int) -> None:
    mesh, cells, order = sorted_by_cell(street(7, 1500))
    np.testing.assert_array_equal(mesh.corners, street(7, 1500).corners[order])
    scratch = new_order(cells, width, height)
    for heading in np.linspace(0, 6, 7):
        view = view_from(CameraPose(20.0, -5.0, 1.5, heading), width, height, 90.0)
        buffer = new_buffer(width, height)
        clear(buffer)
        drawn = draw_cells(view, buffer, mesh, cells, scratch, 0)
        whole = seen(view, mesh)
        np.testing.assert_array_equal(buffer.nearness, whole.nearness)
        assert (buffer.triangles == whole.triangles).mean() > 0.999  # others are equally near
        assert drawn < mesh.size
        for (row, column), least in np.ndenumerate(scratch.tiles):
            samples = buffer.nearness[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE]
            assert least == samples.min()


def convex_surface(rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    """Returns triangles (n, 3, 3) of a closed convex surface, seen from outside; neighbours share corners."""
    points = rng.normal(size=(count, 3))
    points = (points / np.linalg.norm(points, axis=1, keepdims=True) * (1.0, 0.8, 0.6)).astype(np.float32)
    triangles: NDArray[np.float32] = points[ConvexHull(points).simplices]
    inwards = np.linalg.det(triangles.astype(float)) < 0.0
    triangles[inwards] = triangles[inwards, ::-1]
    return triangles


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(20, 200), inside=st.booleans())
@settings(max_examples=25, deadline=None)
def test_closed_surfaces_have_no_gaps_and_draw_no_sample_twice(seed: int, count: int, inside: bool) -> None:
    rng = np.random.default_rng(seed)
    triangles = convex_surface(rng, count)
    builder = MeshBuilder()
    builder.triangles(triangles[:, ::-1] if inside else triangles, colour=GREY, kind=ObjectClass.OTHER)
    mesh = builder.build()
    away = rng.normal(size=3)
    away *= (0.0 if inside else 4.0) / np.linalg.norm(away)
    heading = math.atan2(-away[1], -away[0])
    pitch = math.atan2(-away[2], math.hypot(away[0], away[1]))
    view = view_from(CameraPose(float(away[0]), float(away[1]), float(away[2]), heading, pitch), 90, 70, 110.0)
    counts = np.zeros((70, 90), dtype=int)
    for k in range(mesh.size):
        buffer = new_buffer(90, 70)
        draw_triangles(view, buffer, mesh, k, k + 1, 0)
        counts += buffer.triangles[:, : view.width] >= 0
    if inside:  # the near plane does not reach the surface
        assert (counts == 1).all()
        return
    # convex from outside: once where it is seen, and no hole within a row
    assert counts.max() == 1
    for row in counts:
        hit = np.flatnonzero(row)
        assert len(hit) == 0 or len(hit) == hit[-1] - hit[0] + 1


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_the_near_plane_cuts_neighbours_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = np.array([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], dtype=float)
    middle = [*rng.uniform(-20, 20, 2), 0.0]
    fan = np.array([[corners[k], corners[(k + 1) % 4], middle] for k in range(4)])
    builder = MeshBuilder()
    builder.triangles(fan, colour=GREY, kind=ObjectClass.ROAD)
    view = view_from(CameraPose(rng.uniform(-1, 1), rng.uniform(-1, 1), 0.2, rng.uniform(-4, 4), -0.5), 80, 60, 90.0)
    counts = np.zeros((60, 80), dtype=int)
    for k in range(4):
        buffer = new_buffer(80, 60)
        draw_triangles(view, buffer, builder.build(), k, k + 1, 0)
        counts += buffer.triangles[:, : view.width] >= 0
    assert counts[30:].min() == counts.max() == 1  # below the horizon


def test_boxes_hold_the_pixels_of_their_instances() -> None:
    instance = np.random.default_rng(0).integers(0, 9, (40, 50)).astype(np.int32)
    instance[:, :5] = 0
    instance[10:12, 20:22] = 77
    keys = np.array([3, 5, 44, 77], np.int32)
    boxes = np.zeros((4, 5), np.int32)
    find_boxes(instance, keys, boxes)
    for key, (left, top, right, bottom, count) in zip(keys, boxes.tolist(), strict=True):
        rows, columns = np.nonzero(instance == key)
        if key == 44:
            assert (left, top, right, bottom, count) == (0, 0, 0, 0, 0)
        else:
            assert (left, top) == (columns.min(), rows.min())
            assert (right, bottom) == (columns.max() + 1, rows.max() + 1)
            assert count == len(rows)


def test_a_body_to_the_right_is_seen_on_the_right() -> None:
    builder = MeshBuilder()
    builder.box((10.0, 4.0), 0.0, 1.0, 1.0, 0.0, 1.0, colour=GREY, kind=ObjectClass.VEHICLES)  # south, looking east
    view = view_from(CameraPose(0.0, 0.0, 2.0, 0.0), 80, 60, 90.0)
    rows, columns = np.nonzero(numbers_of(view, builder.build()) >= 0)
    assert columns.min() > 40
    assert rows.min() > 30
