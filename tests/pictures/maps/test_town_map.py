from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import Junction, Lane, LaneLink, LinkType, Signal, SignalKind, Street, Town, load_town
from dorothie_gym.pictures import MapPainter, palette, town_picture
from dorothie_gym.pictures.maps.borders import BorderKind
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.text import font, font_path, shorten, wrap
from dorothie_gym.pictures.views.aerial import darkness, weather_summary

MAPS = Path(__file__).parents[3] / "../shared/maps"


def straight(index: int, start: tuple[float, float], end: tuple[float, float], z: float = 0.0, street: int = 0) -> Lane:
    points = np.array([[*start, z], [*end, z]])
    return Lane(
        id=index, road_id=index, lane_id=-1, points=points, widths=np.full(2, 3.5), speed_limit=10.0, street=street
    )


def two_way_street() -> Town:
    """200 m of street, eastwards on y=1.75 and westwards on y=-1.75."""
    lanes = [straight(0, (0.0, 1.75), (200.0, 1.75)), straight(1, (200.0, -1.75), (0.0, -1.75))]
    streets = [Street(id=0, name="Elm Street", lanes=(0, 1))]
    return Town(name="one street", lanes=lanes, links=[], junctions=[], streets=streets)


def overpass(upper_first: bool) -> Town:
    """Two lanes that cross at the origin, 6 m apart in height; lane 0 is the upper one if it comes first."""
    high, low = (6.0, 0.0) if upper_first else (0.0, 6.0)
    lanes = [straight(0, (-60.0, 0.0), (60.0, 0.0), high), straight(1, (0.0, -60.0), (0.0, 60.0), low)]
    return Town(name="overpass", lanes=lanes, links=[], junctions=[])


def pixels(painter: MapPainter) -> np.ndarray:
    import pygame

    return pygame.surfarray.array3d(painter.surface())


def colour_at(painter: MapPainter, xy: tuple[float, float]) -> tuple[int, ...]:
    x, y = np.round(painter.to_pixel(xy)).astype(int)
    return tuple(painter.surface().get_at((int(x), int(y))))[:3]


def test_road_is_painted_where_the_lanes_are_and_country_elsewhere() -> None:
    painter = MapPainter(two_way_street(), size=(800, 300))
    assert colour_at(painter, (20.0, 1.75)) == palette.ROAD
    assert colour_at(painter, (20.0, -1.75)) == palette.ROAD
    assert colour_at(painter, (20.0, 12.5)) in (palette.COUNTRY, palette.COUNTRY_TREE)


def test_a_line_parts_the_two_directions() -> None:
    kinds = [border.kind for border in MapLayers(two_way_street()).borders.lines]
    assert sorted(kinds) == [BorderKind.CENTRE, BorderKind.EDGE, BorderKind.EDGE]


def test_dashes_part_lanes_of_the_same_direction() -> None:
    lanes = [straight(0, (0.0, 0.0), (100.0, 0.0)), straight(1, (0.0, 3.5), (100.0, 3.5))]
    plan = MapLayers(Town(name="wide", lanes=lanes, links=[], junctions=[]))
    inner = [border for border in plan.borders.lines if border.kind is BorderKind.LANE]
    assert [(border.lanes, border.sign) for border in inner] == [((1,), -1)]
    assert plan.borders.outer_neighbour == {0: 1}


@pytest.mark.parametrize("upper_first", [True, False])
def test_the_higher_road_is_painted_over_the_lower(upper_first: bool) -> None:
    plan = MapLayers(overpass(upper_first))
    assert [(part.level, part.lane) for part in plan.stretches] == [(1, 0 if upper_first else 1)]
    painter = MapPainter(overpass(upper_first), size=(600, 600))
    along = (0.0, 3.2) if upper_first else (3.2, 0.0)  # just beside the upper road, on the lower one
    assert colour_at(painter, along) == palette.BRIDGE_SHADOW
    across = along[::-1]  # on the upper road, where the kerb of the lower one would be
    assert colour_at(painter, across) == palette.ROAD


def test_asphalt_between_connectors_is_filled() -> None:
    corners = [(-6.0, -6.0), (6.0, -6.0), (6.0, 6.0), (-6.0, 6.0)]
    lanes = []
    for k in range(4):
        points = np.array([[*corners[k], 0.0], [*corners[(k + 1) % 4], 0.0]])
        lanes.append(
            Lane(id=k, road_id=k, lane_id=-1, junction_id=7, points=points, widths=np.full(2, 3.0), speed_limit=10.0)
        )
    junction = Junction(id=7, position=(0.0, 0.0), connectors=(0, 1, 2, 3))
    painter = MapPainter(Town(name="square", lanes=lanes, links=[], junctions=[junction]), size=(400, 400))
    assert colour_at(painter, (0.0, 0.0)) == palette.ROAD


def test_every_street_of_the_default_town_is_named_and_names_keep_apart() -> None:
    town = load_town("brookside")
    painter = MapPainter(town, size=(1600, 1200))
    assert {label.text for label in painter.labels} == {street.name for street in town.streets}
    for k, label in enumerate(painter.labels):
        assert label.path[-1][0] >= label.path[0][0] - 1.0, f"{label.text} is upside down"
        for other in painter.labels[k + 1 :]:
            gap = np.hypot(*(label.path[:, None] - other.path).transpose(2, 0, 1)).min()
            assert gap >= label.size, f"{label.text} touches {other.text}"


def test_names_keep_off_junctions_where_there_is_room() -> None:
    town = load_town("brookside")
    painter = MapPainter(town, size=(1600, 1200))
    centres = painter.to_pixel([junction.position for junction in town.junctions])
    for label in painter.labels:
        assert np.hypot(*(label.path[:, None] - centres).transpose(2, 0, 1)).min() > 3.0 * painter.scale


def test_given_names_replace_those_of_the_map() -> None:
    painter = MapPainter(two_way_street(), size=(800, 300), street_names=["Beal"])
    assert [label.text for label in painter.labels] == ["Beal"]


def test_too_few_names_and_too_small_a_picture_are_refused() -> None:
    with pytest.raises(ValueError, match="street_names: 0 names for 1 streets"):
        MapPainter(two_way_street(), size=(800, 300), street_names=[])
    with pytest.raises(ValueError, match="size"):
        MapPainter(two_way_street(), size=(40, 40))


def test_a_stop_line_and_an_arrow_stand_before_a_choice() -> None:
    main, ahead = straight(0, (0.0, 0.0), (60.0, 0.0)), straight(1, (60.0, 0.0), (80.0, 0.0))
    points = np.array([[60.0, 0.0, 0.0], [68.0, -3.0, 0.0], [70.0, -12.0, 0.0]])
    lanes = [main]
    for k, line in ((1, ahead.points), (2, points)):
        widths = np.full(len(line), 3.5)
        lanes.append(Lane(id=k, road_id=k, lane_id=-1, junction_id=3, points=line, widths=widths, speed_limit=10.0))
    links = [LaneLink(0, 1, LinkType.STRAIGHT), LaneLink(0, 2, LinkType.LEFT)]
    junction = Junction(id=3, position=(66.0, 0.0), connectors=(1, 2))
    stop = Signal(id=0, kind=SignalKind.STOP, position=(59.0, 3.0, 2.0), heading=0.0, lanes=(0,))
    town = Town(name="fork", lanes=lanes, links=links, junctions=[junction], signals=[stop])
    plan = MapLayers(town)
    bars = [shape for shape in plan.shapes if shape.colour == palette.STOP_LINE]
    assert len(bars) == 1 and bars[0].bounds[2] <= 60.0 and bars[0].bounds[0] > 58.0
    assert [(arrow.shows, arrow.turns) for arrow in plan.arrows] == [(0, (LinkType.STRAIGHT, LinkType.LEFT))]
    assert {palette.ARROW} <= {shape.colour for shape in plan.shapes}


def test_a_surface_is_a_copy() -> None:
    painter = MapPainter(two_way_street(), size=(400, 200))
    painter.surface().fill((0, 0, 0))
    assert pixels(painter).max() == 255


def test_a_window_shows_the_same_map_in_metres() -> None:
    painter = MapPainter.at_scale(two_way_street(), 4.0)
    assert painter.scale == pytest.approx(4.0, rel=0.01)
    view = painter.window((20.0, 1.75), (100, 60))
    assert view.get_size() == (100, 60)
    assert tuple(view.get_at((50, 30)))[:3] == palette.ROAD


def test_picture_is_written_and_is_the_same_each_time(tmp_path: Path) -> None:
    town = load_town("brookside")
    for name in ("a.png", "b.png"):
        town_picture(town, tmp_path / name, (800, 600))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


def test_missing_folder_of_a_picture_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist; make it first"):
        town_picture(two_way_street(), tmp_path / "missing" / "a.png")


def test_pictures_need_neither_display_nor_its_modules(tmp_path: Path) -> None:
    code = (
        "import sys; from dorothie_gym.maps import load_town\n"
        "from dorothie_gym.pictures import town_picture\n"
        "assert 'pygame' not in sys.modules and 'matplotlib' not in sys.modules\n"
        "town_picture(load_town('brookside'), sys.argv[1], (640, 480))\n"
        "import pygame; assert not pygame.display.get_init(); assert 'matplotlib' not in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a.png")], capture_output=True, text=True, env={"PATH": ""}
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""


@pytest.mark.long
def test_imported_town_with_an_overpass_is_painted(tmp_path: Path) -> None:
    file = MAPS / "Town05.xodr"
    if not file.exists():
        pytest.skip("../shared/maps is not there")
    painter = town_picture(load_town(str(file)), tmp_path / "town05.png", (1000, 800))
    assert {label.street for label in painter.labels} == set(range(len(painter.town.streets)))
    assert any(part.level > 0 for part in painter.plan.stretches)
    assert painter.missing == ()


def test_typeface_survives_pygame_being_quit() -> None:
    import pygame

    assert font_path() is not None and Path(str(font_path())).name == "DejaVuSans.ttf"
    before = font(14).size("Broadway")
    pygame.font.quit()
    assert font(14).size("Broadway") == before


def test_text_is_wrapped_and_shortened_to_a_width() -> None:
    lines = wrap("turn left at the second junction, thenverylongwordwithoutaspaceinitanywhere", 14, 120)
    assert all(font(14).size(line)[0] <= 120 for line in lines)
    assert "".join(lines).replace(" ", "") == "turnleftatthesecondjunction,thenverylongwordwithoutaspaceinitanywhere"
    assert shorten("short", 14, 120) == "short"
    assert shorten("much too long for so little room", 14, 120).endswith("…")


def test_weather_summary_in_words() -> None:
    assert weather_summary({}) == "day, clear"
    assert weather_summary({"sun_altitude_angle": -30.0, "precipitation": 80.0}) == "night, heavy rain"
    assert weather_summary({"fog_density": 80.0}) == "day, dense fog"
    assert weather_summary({"cloudiness": 80.0, "wetness": 50.0}) == "day, overcast, wet road"
    assert darkness({"sun_altitude_angle": 45.0}) == 0.0
