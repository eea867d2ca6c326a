"""The map one would hang up: names along their streets, a sheet as large as the town needs, a legend that fits it."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.world.graphics import MapPainter, palette, town_picture
from dorothie_gym.world.graphics.ground import town_bounds
from dorothie_gym.world.graphics.icons import pin_icon
from dorothie_gym.world.graphics.legend import Legend
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.sheet import sheet_size
from dorothie_gym.world.town import Lane, Street, Town, load_town

MAPS = Path(__file__).parents[2] / "../shared/maps"
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


def test_names_can_be_read_without_turning_the_head_over(sheet: MapPainter) -> None:
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


def test_a_name_without_any_room_is_reported() -> None:
    lanes = [straight(0, 200.0), straight(1, 6.0, y=60.0, street=1)]
    streets = [Street(id=0, name="Elm Street", lanes=(0,)), Street(id=1, name="Very Narrow Passage", lanes=(1,))]
    painter = MapPainter(Town(name="two", lanes=lanes, links=[], junctions=[], streets=streets), size=(900, 400))
    assert painter.missing == ("Very Narrow Passage",)
    assert [label.text for label in painter.labels] == ["Elm Street"]


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
    assert [text for text, _ in Legend(town, Plan(town), 20.0).entries] == ["one-way street", "lanes of one direction"]
    brookside = load_town("brookside")
    words = [text for text, _ in Legend(brookside, Plan(brookside), 20.0).entries]
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
