"""Map sheets: names along their streets, size of the sheet, and legend."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

from dorothie_gym.maps import Lane, Street, Town, load_town, town_names
from dorothie_gym.pictures import MapPainter, palette, town_picture
from dorothie_gym.pictures.maps.ground import town_bounds
from dorothie_gym.pictures.maps.icons import pin_icon
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.map_sheet import Legend, sheet_painter, sheet_size
from dorothie_gym.pictures.maps.street_axes import roadways
from tests.maps.opendrive_text import geometry, lane, opendrive, road, section

MAPS = Path(__file__).parents[3] / "../shared/maps"
TOWNS = ["brookside", "Town01", "Town05"]


def town_named(name: str) -> Town:
    if not name.startswith("Town"):
        return load_town(name)
    file = MAPS / f"{name}.xodr"
    if not file.exists():
        pytest.skip("../shared/maps is not there")
    return load_town(str(file))


@pytest.fixture(scope="module", params=TOWNS)
def sheet(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> MapPainter:
    town = town_named(request.param)
    return town_picture(town, tmp_path_factory.mktemp("sheet") / "town.png", (2000, 1800))


def straight(index: int, length: float, y: float = 0.0, street: int = 0) -> Lane:
    points = np.array([[0.0, y, 0.0], [length, y, 0.0]])
    return Lane(
        id=index, road_id=index, lane_id=-1, points=points, widths=np.full(2, 3.5), speed_limit=10.0, street=street
    )


@pytest.mark.long
def test_every_street_is_named(sheet: MapPainter) -> None:
    assert {label.street for label in sheet.labels} == {street.id for street in sheet.town.streets}
    assert sheet.missing == ()


def test_names_lie_along_their_streets(sheet: MapPainter) -> None:
    for label in sheet.labels:
        lanes = [lane for lane in sheet.town.lanes if lane.street == label.street and not lane.in_junction]
        headings = np.arctan2(*np.diff(label.path, axis=0).T[::-1])
        middles = (label.path[1:] + label.path[:-1]) / 2.0 / sheet.scale + sheet.origin
        for point, heading in list(zip(middles, headings, strict=True))[::6]:
            away, turn = min(_beside(lane, point, heading) for lane in lanes)
            assert away < 7.5, f"{label.text} is off its street"
            assert turn < np.radians(6.0), f"{label.text} lies across its street"


def _beside(lane: Lane, point: np.ndarray, heading: float) -> tuple[float, float]:
    """Distance of a point from a lane [m], and angle between a direction and the lane's, whichever way it runs."""
    s, aside = lane.project(point)
    turn = abs((heading - lane.heading_at(s) + np.pi / 2.0) % np.pi - np.pi / 2.0)
    return abs(aside), float(turn)


def test_names_are_never_upside_down(sheet: MapPainter) -> None:
    for label in sheet.labels:
        across = label.path[-1] - label.path[0]
        assert across[0] > -0.03 * abs(across[1]), f"{label.text} is upside down"


def test_names_touch_neither_each_other_nor_pins_nor_signs(sheet: MapPainter) -> None:
    fixed = [sheet.to_pixel(site.position) for site in sheet.town.sites]
    fixed += [sheet.to_pixel(post.at) for post in sheet.plan.posts]
    for label in sheet.labels:
        gap = np.hypot(*(label.path[:, None] - np.array(fixed)).transpose(2, 0, 1)).min()
        assert gap > 0.6 * label.size, f"{label.text} touches a pin or sign"
    for a, b in itertools.combinations(sheet.labels, 2):
        gap = np.hypot(*(a.path[:, None] - b.path).transpose(2, 0, 1)).min()
        assert gap > 0.5 * (a.size + b.size), f"{a.text} touches {b.text}"


@pytest.mark.parametrize("name", TOWNS)
def test_the_sheet_is_large_enough_to_be_read_and_not_larger(name: str) -> None:
    town = town_named(name)
    width, height = sheet_size(town)
    x0, y0, x1, y1 = town_bounds(town)
    assert 2500 <= max(width, height) <= 4000
    assert 3.5 * min(width / (x1 - x0), height / (y1 - y0)) >= 20.0, "a lane is broad enough for its arrows"


def test_long_streets_are_named_again() -> None:
    town = Town(
        name="long",
        lanes=[straight(0, 900.0)],
        links=[],
        junctions=[],
        streets=[Street(id=0, name="Long Mile", lanes=(0,))],
    )
    painter = MapPainter(town, size=(3000, 300), label_spacing=600.0)
    places = sorted(float(label.path[:, 0].mean()) for label in painter.labels)
    assert len(places) > 2
    assert min(b - a for a, b in itertools.pairwise(places)) >= 600.0


@pytest.mark.parametrize("name", [*town_names(), "Town01", "Town02", "Town05"])
def test_every_street_of_every_town_carries_its_name(name: str) -> None:
    painter = sheet_painter(town_named(name))
    assert painter.missing == ()
    assert {label.text for label in painter.labels} == {street.name for street in painter.town.streets}


@pytest.mark.parametrize("name", ["midtown", "northgate"])
def test_names_of_broad_roads_are_not_the_smallest(name: str) -> None:
    painter = sheet_painter(town_named(name))
    smallest = min(label.size for label in painter.labels)
    broad = {way.street for way in roadways(painter.plan.borders) if np.median(way.width) > 16.0}
    assert broad
    for street in broad:
        assert max(label.size for label in painter.labels if label.street == street) > smallest


def painter_of(lanes: list[Lane], names: list[str], **options: Any) -> MapPainter:
    streets = [
        Street(id=k, name=name, lanes=tuple(lane.id for lane in lanes if lane.street == k))
        for k, name in enumerate(names)
    ]
    return MapPainter(Town(name="test", lanes=lanes, links=[], junctions=[], streets=streets), **options)


def test_a_name_longer_than_its_street_stands_beside_it() -> None:
    lanes = [straight(0, 200.0), straight(1, 6.0, y=60.0, street=1)]
    painter = painter_of(lanes, ["Elm Street", "Very Narrow Passage"], size=(900, 400))
    assert painter.missing == ()
    assert {label.text: label.beside for label in painter.labels} == {"Elm Street": False, "Very Narrow Passage": True}
    (beside,) = (label for label in painter.labels if label.beside)
    away = np.abs(beside.path[:, 1] - painter.to_pixel((3.0, 60.0))[1])
    assert (away > 1.75 * painter.scale + 0.5 * beside.size).all(), "no letter is on the road"
    (x0, y), (x1, _) = np.round(beside.path[[0, -1]]).astype(int)
    letters = pygame.surfarray.array3d(painter.surface())[x0:x1, y - 9 : y + 9].astype(int)
    assert (np.abs(letters - palette.INK).max(axis=-1) < 40).any(), "dark type on the ground"


def test_an_invisible_street_is_reported() -> None:
    """The whole street lies inside a junction."""
    inner = Lane(
        id=1,
        road_id=1,
        lane_id=-1,
        junction_id=3,
        points=np.array([[60.0, 40.0, 0.0], [80.0, 40.0, 0.0]]),
        widths=np.full(2, 3.5),
        speed_limit=10.0,
        street=1,
    )
    painter = painter_of([straight(0, 200.0), inner], ["Elm Street", "Nowhere"], size=(900, 400))
    assert painter.missing == ("Nowhere",)


def test_a_name_too_long_for_a_broad_block_is_broken_into_two_rows() -> None:
    lanes = [straight(k, 60.0, y=3.5 * k) for k in range(5)]
    painter = painter_of(lanes, ["Parliament Avenue"], size=(760, 320), type_sizes=(60, 50))
    (label,) = painter.labels
    assert label.rows == ("Parliament", "Avenue") and not label.beside
    first, second = (row.mean(axis=0) for row in label.row_paths())
    assert first[1] < second[1], "the first row is above the second"
    middle = painter.to_pixel((30.0, 7.0))
    assert np.allclose((first + second) / 2.0, middle, atol=30.0)
    edges = painter.to_pixel([(0.0, -1.75), (0.0, 15.75)])[:, 1]
    assert edges[0] < first[1] - label.size / 2.0 and second[1] + label.size / 2.0 < edges[1]


def test_a_name_with_too_short_blocks_goes_on_across_the_junction() -> None:
    lanes = [straight(0, 30.0)]
    beyond = np.array([[44.0, 0.0, 0.0], [74.0, 0.0, 0.0]])
    lanes.append(Lane(id=1, road_id=1, lane_id=-1, points=beyond, widths=np.full(2, 3.5), speed_limit=9.0, street=0))
    painter = painter_of(lanes, ["Long Street"], size=(500, 200), type_sizes=(40, 40))
    (label,) = painter.labels
    x = label.path[:, 0] / painter.scale + painter.origin[0]
    assert x.min() < 30.0 and x.max() > 44.0 and not label.beside


def test_the_middle_of_a_road_is_where_its_edges_are_equally_far() -> None:
    """Two lanes one way, one the other: the line between the directions is not in the middle."""
    lanes = [
        straight(0, 120.0, y=1.75),
        straight(1, 120.0, y=5.25),
        Lane(
            id=2,
            road_id=2,
            lane_id=1,
            points=np.array([[120.0, -1.75, 0.0], [0.0, -1.75, 0.0]]),
            widths=np.full(2, 3.5),
            speed_limit=9.0,
            street=0,
        ),
    ]
    town = Town(
        name="uneven", lanes=lanes, links=[], junctions=[], streets=[Street(id=0, name="Elm Street", lanes=(0, 1, 2))]
    )
    (way,) = roadways(MapLayers(town).borders)
    assert np.allclose(way.width, 10.5, atol=0.2) and np.allclose(way.line[:, 1], 1.75, atol=0.2)


def test_names_are_known_before_anything_is_painted() -> None:
    painter = sheet_painter(load_town("brookside"))
    assert painter.labels and "_surface" not in vars(painter)
    painter.surface()
    assert "_surface" in vars(painter)


def test_sheets_are_the_same_byte_for_byte(tmp_path: Path) -> None:
    town = load_town("brookside")
    for name in ("a.png", "b.png"):
        town_picture(town, tmp_path / name, (1000, 800), time=12.0, fold="unseen")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_fold_stands_in_the_title(tmp_path: Path) -> None:
    town = load_town("brookside")
    for fold in (None, "unseen"):
        town_picture(town, tmp_path / f"{fold}.png", (1000, 800), fold=fold)
    assert (tmp_path / "None.png").read_bytes() != (tmp_path / "unseen.png").read_bytes()


def test_the_legend_explains_what_is_there_and_nothing_else() -> None:
    town = Town(name="plain", lanes=[straight(0, 100.0), straight(1, 100.0, y=3.5)], links=[], junctions=[])
    assert [text for text, _ in Legend(town, MapLayers(town), 20.0).entries] == [
        "one-way street",
        "lanes of one direction",
    ]
    brookside = load_town("brookside")
    words = [text for text, _ in Legend(brookside, MapLayers(brookside), 20.0).entries]
    assert {"landmark site", "traffic light", "crosswalk", "ways on from a lane"} <= set(words)
    assert "tunnel" not in words and "bridge" not in words


def test_a_picture_too_small_for_a_title_and_a_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="too small"):
        town_picture(load_town("brookside"), tmp_path / "a.png", (1200, 200))


def test_a_pin_points_at_its_bearing_and_keeps_its_number_upright() -> None:
    right, left = pin_icon("7", 20, 0), pin_icon("7", 20, 180)
    middle = right.get_height() // 2
    reach = [[x for x in range(icon.get_width()) if icon.get_at((x, middle)).a > 128] for icon in (right, left)]
    assert max(reach[0]) - right.get_width() / 2 > 30 and right.get_width() / 2 - min(reach[0]) < 25
    assert left.get_width() / 2 - min(reach[1]) > 30 and max(reach[1]) - left.get_width() / 2 < 25
    assert tuple(right.get_at((right.get_width() // 2 - 12, middle)))[:3] == palette.PIN


def test_a_narrow_town_gets_a_sheet_wide_enough_for_its_title() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 900.0, 0.0]])
    lane = Lane(id=0, road_id=0, lane_id=-1, points=points, widths=np.full(2, 3.5), speed_limit=10.0)
    width, height = sheet_size(Town(name="narrow", lanes=[lane], links=[], junctions=[]))
    assert height <= 4000 and width > 0.5 * height


@pytest.mark.parametrize("heading", [0.0, 1.5707963])
@pytest.mark.parametrize("length", [400.0, 900.0])
def test_a_straight_road_gets_a_sheet_in_either_direction(tmp_path: Path, heading: float, length: float) -> None:
    path = tmp_path / "straight.xodr"
    plan = geometry("<line/>", length, hdg=heading)
    path.write_text(opendrive(road(1, length=length, plan=plan, sections=section(0.0, lane(1), lane(-1)))))
    painter = town_picture(load_town(path), tmp_path / "map.png")
    width, height = pygame.image.load(str(tmp_path / "map.png")).get_size()
    assert (width, height) == painter.size
    assert max(width, height) <= 4000
