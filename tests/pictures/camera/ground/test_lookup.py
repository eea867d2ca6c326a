"""Materials of the ground: against point-in-polygon of shapely, and against the map itself in whole towns."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.maps.model import Array
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.camera.ground.arrays import ground_arrays
from dorothie_gym.pictures.camera.ground.cells import Painted
from dorothie_gym.pictures.camera.ground.colours import colour_at
from dorothie_gym.pictures.camera.ground.lookup import GroundArrays, material_at, materials_around, materials_at
from dorothie_gym.pictures.camera.ground.materials import LOOKS, MATERIALS, SYMBOLS, Material, Relief
from dorothie_gym.pictures.camera.ground.sheets import MAP_SCALE, Sheet, town_sheets
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.support.compilation import compiled
from tests.maps.opendrive_text import shared_map

KINDS = [Material.ROAD, Material.PAVEMENT, Material.WHITE_PAINT, Material.PARK]


def sheet_of(polygons: list[Painted], low: float = -1.0, high: float = 9.0) -> Sheet:
    return Sheet(tuple(polygons), Material.COUNTRY, np.full(2, low), np.full(2, high), 0, ())


def found(ground: GroundArrays, points: Array, sheet: int = 0) -> NDArray[np.uint8]:
    out = np.empty(len(points), dtype=np.uint8)
    materials_at(ground, sheet, np.ascontiguousarray(points), out)
    return out


def top_most(polygons: list[Painted], points: Array, outside: Material = Material.COUNTRY) -> NDArray[np.uint8]:
    """Brute force: the even-odd rule, polygon by polygon."""
    out = np.full(len(points), outside, dtype=np.uint8)
    for polygon in polygons:
        low, high = polygon.points.min(axis=0), polygon.points.max(axis=0)
        near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
        if not len(near):
            continue
        a, b = polygon.points, np.roll(polygon.points, -1, axis=0)
        x, y = points[near, 0][:, None], points[near, 1][:, None]
        crosses = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
        inside = (crosses & (a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0]) < x)).sum(axis=1) % 2 == 1
        out[near[inside]] = polygon.material
    return out


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**9), count=st.integers(1, 12), whole=st.booleans())
def test_random_polygons_are_found_as_by_the_even_odd_rule(seed: int, count: int, whole: bool) -> None:
    rng = np.random.default_rng(seed)
    polygons = []
    for _ in range(count):
        corners = rng.uniform(-2.0, 10.0, (rng.integers(3, 12), 2))  # may cross themselves and leave the grid
        polygons.append(Painted(np.round(corners) if whole else corners, KINDS[rng.integers(len(KINDS))]))
    points = rng.uniform(-3.0, 11.0, (400, 2))
    ground = ground_arrays([sheet_of(polygons)])
    inside = ((points >= -1.0) & (points < 9.0)).all(axis=1)
    assert (found(ground, points[inside]) == top_most(polygons, points[inside])).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**9), size=st.sampled_from([0.3, 3.0, 30.0]))
def test_simple_polygons_are_found_as_by_shapely(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
    corners = 4.0 + size * rng.uniform(0.4, 1.0, (9, 1)) * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    points = rng.uniform(-1.0, 9.0, (300, 2))
    ground = ground_arrays([sheet_of([Painted(corners, Material.ROAD)])])
    inside = shapely.contains_xy(shapely.Polygon(corners), points[:, 0], points[:, 1])
    assert ((found(ground, points) == Material.ROAD) == inside).all()


@compiled
def corners_at(ground: GroundArrays, points: Array, step: float, out: NDArray[np.uint8]) -> None:
    for k in range(len(points)):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = materials_around(ground, 0, points[k, 0], points[k, 1], step)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**9), count=st.integers(1, 12), step=st.sampled_from([0.0, 0.01, 0.1, 0.7]))
def test_materials_around_a_point_are_those_of_the_corners(seed: int, count: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    polygons = [Painted(rng.uniform(-2.0, 10.0, (7, 2)), KINDS[rng.integers(len(KINDS))]) for _ in range(count)]
    ground, points = ground_arrays([sheet_of(polygons)]), rng.uniform(-3.0, 11.0, (400, 2))
    out = np.empty((len(points), 4), dtype=np.uint8)
    corners_at(ground, points, step, out)
    shifts = [(-step, -step), (step, -step), (-step, step), (step, step)]
    expected = np.stack([found(ground, points + shift) for shift in shifts], axis=1)
    np.testing.assert_array_equal(out[:, [0, 3]], expected[:, [0, 3]])
    differ = expected[:, 0] != expected[:, 3]
    np.testing.assert_array_equal(out[differ], expected[differ])


@pytest.mark.long
@pytest.mark.parametrize("name", ["brookside", "midtown", "Town01", pytest.param("Town05", marks=pytest.mark.slow)])
def test_ground_of_a_town_is_what_its_map_shows(name: str) -> None:
    town = load_town(name if name in town_names() else str(shared_map(name)))
    sheets = town_sheets(MapLayers(town))
    ground = ground_arrays(sheets)
    layers = MapLayers(town, scale=MAP_SCALE)
    shapes = [shape for shape in layers.shapes if shape.colour not in SYMBOLS]
    rng = np.random.default_rng(5)
    lanes = [town.lanes[k] for k in rng.integers(0, len(town.lanes), 400)]
    places = np.array([lane.points[rng.integers(len(lane.points)), :2] for lane in lanes])
    points = places + rng.uniform(-9.0, 9.0, places.shape)
    shown = top_most([Painted(shape.points, MATERIALS[shape.colour]) for shape in shapes], points)
    on_ground = found(ground, points)
    if not layers.bridge_levels:
        assert (on_ground == shown).all()
        return
    # from the top: bridges cover the ground; a bridge's shadow is no part of it
    seen = on_ground
    for sheet in range(1, len(sheets)):
        if sheets[sheet].level > 0:
            above = found(ground, points, sheet)
            seen = np.where(above != Material.NOTHING, above, seen)
    assert (seen == shown).mean() > 0.999
    assert (on_ground != shown).any()  # under a bridge lies something else


def test_colours_of_the_map_are_materials_or_symbols() -> None:
    assert not MATERIALS.keys() & SYMBOLS
    assert LOOKS[MATERIALS[palette.ROAD]].relief is Relief.FLAT
    assert LOOKS[MATERIALS[palette.SIDEWALK]].relief is Relief.RAISED
    assert LOOKS.keys() == set(Material)


# --- Colours ----------------------------------------------------------------------------------------------------------


@compiled
def colours_at(ground: GroundArrays, points: Array, footprint: float, out: Array) -> None:
    for k in range(len(points)):
        out[k, 0], out[k, 1], out[k, 2] = colour_at(ground, 0, points[k, 0], points[k, 1], footprint)


def seen_colours(ground: GroundArrays, points: Array, footprint: float) -> Array:
    out = np.zeros((len(points), 3))
    colours_at(ground, np.ascontiguousarray(points), footprint, out)
    return out


def striped() -> GroundArrays:
    """Stripes of paint on asphalt, 0.2 m wide, every metre."""
    road = Painted(np.array([[-5.0, -5.0], [45.0, -5.0], [45.0, 45.0], [-5.0, 45.0]]), Material.ROAD)
    stripes = [
        Painted(np.array([[x, -4.0], [x + 0.2, -4.0], [x + 0.2, 44.0], [x, 44.0]]), Material.WHITE_PAINT)
        for x in np.arange(0.0, 40.0)
    ]
    return ground_arrays([sheet_of([road, *stripes], -5.0, 45.0)])


@pytest.mark.parametrize("footprint", [0.01, 0.1, 0.25, 0.4, 0.7, 1.5, 4.0, 11.0])
def test_mean_colour_does_not_depend_on_the_footprint(footprint: float) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(10.0, 30.0, (20000, 2))
    road, paint = (np.array(LOOKS[kind].colour, dtype=float) for kind in (Material.ROAD, Material.WHITE_PAINT))
    mean = seen_colours(striped(), points, footprint).mean(axis=0)
    assert mean == pytest.approx(0.8 * road + 0.2 * paint, rel=0.05)


def test_edge_of_paint_is_blended_over_the_footprint_of_a_pixel() -> None:
    ground = striped()
    across = np.column_stack((np.linspace(19.5, 20.5, 401), np.full(401, 20.0)))
    sharp, smooth = (seen_colours(ground, across, footprint)[:, 0] for footprint in (0.01, 0.1))
    assert np.abs(np.diff(sharp)).max() > 100.0
    assert np.abs(np.diff(smooth)).max() < 90.0
    assert np.ptp(seen_colours(ground, across, 8.0)[:, 0]) < 12.0  # stripes are not visible from far away


def test_beyond_the_map_lies_country_to_the_horizon() -> None:
    ground = ground_arrays(town_sheets(MapLayers(load_town("brookside"))))
    far = np.array([[5000.0, 5000.0], [-3000.0, 100.0]])
    assert (found(ground, far) == Material.COUNTRY).all()
    assert material_at(ground, 0, 1e7, -1e7) == Material.COUNTRY
    colour = seen_colours(ground, far, 30.0)
    assert np.allclose(colour, LOOKS[Material.COUNTRY].colour)


def test_arrays_are_the_same_when_built_again() -> None:
    first, second = (ground_arrays(town_sheets(MapLayers(load_town("brookside")))) for _ in range(2))
    for name in GroundArrays._fields:
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes(), name
    assert first.nbytes < 8e6
