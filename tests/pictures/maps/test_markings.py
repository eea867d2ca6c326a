"""Road markings and structures: lines, medians, arrows, lights, signs, bridges and tunnels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
import pygame
import pytest

from dorothie_gym.maps import (
    Crosswalk,
    Junction,
    Lane,
    LaneLink,
    LightColour,
    LightPhase,
    LightProgramme,
    LinkType,
    Sidewalk,
    Signal,
    SignalKind,
    Site,
    Street,
    Town,
    load_town,
)
from dorothie_gym.pictures import MapPainter, palette
from dorothie_gym.pictures.maps.borders import Border, BorderKind
from dorothie_gym.pictures.maps.map_layers import MapLayers
from dorothie_gym.pictures.maps.markings import ARROW_LENGTH, TURNS, one_way_places
from dorothie_gym.pictures.maps.shapes import Shape

MAPS = Path(__file__).parents[3] / "../shared/maps"


def road(
    index: int,
    points: list[tuple[float, float]],
    *,
    z: float = 0.0,
    number: int = -1,
    junction: int = -1,
    widths: tuple[float, ...] | None = None,
) -> Lane:
    line = np.column_stack((np.array(points, dtype=float), np.full(len(points), z)))
    return Lane(
        id=index,
        road_id=index,
        lane_id=number,
        junction_id=junction,
        points=line,
        widths=np.full(len(points), 3.5) if widths is None else np.array(widths),
        speed_limit=10.0,
        street=0 if junction < 0 else -1,
    )


class Parts(TypedDict, total=False):
    links: Sequence[LaneLink]
    junctions: Sequence[Junction]
    signals: Sequence[Signal]
    sites: Sequence[Site]
    crosswalks: Sequence[Crosswalk]
    sidewalks: Sequence[Sidewalk]
    programmes: Sequence[LightProgramme]


def town_of(*lanes: Lane, **more: Unpack[Parts]) -> Town:
    streets = [Street(id=0, name="Elm Street", lanes=tuple(lane.id for lane in lanes))]
    return Town(name="test", lanes=lanes, streets=streets, **({"links": (), "junctions": ()} | more))


def approach(kind: SignalKind, crosswalks: Sequence[Crosswalk] = (), programmes: Sequence[LightProgramme] = ()) -> Town:
    """Lane 0 runs east for 60 m to a junction, which lane 1 crosses to lane 2; a light or sign rules lane 0."""
    lanes = (
        road(0, [(0.0, 0.0), (60.0, 0.0)]),
        road(1, [(60.0, 0.0), (75.0, 0.0)], junction=5),
        road(2, [(75.0, 0.0), (120.0, 0.0)]),
    )
    links = [LaneLink(0, 1, LinkType.STRAIGHT), LaneLink(1, 2, LinkType.STRAIGHT)]
    junctions = [Junction(id=5, position=(67.5, 0.0), connectors=(1,))]
    signals = [Signal(id=9, kind=kind, position=(90.0, 6.0, 3.0), heading=0.0, lanes=(0,))]
    return town_of(
        *lanes, links=links, junctions=junctions, signals=signals, crosswalks=crosswalks, programmes=programmes
    )


def lines_of(town: Town, kind: BorderKind) -> list[Border]:
    return [border for border in MapLayers(town).borders.lines if border.kind is kind]


def painted(town: Town, colour: palette.Colour) -> list[Shape]:
    return [shape for shape in MapLayers(town).shapes if shape.colour == colour]


def colour_at(painter: MapPainter, xy: tuple[float, float], time: float | None = None) -> tuple[int, ...]:
    x, y = np.round(painter.to_pixel(xy)).astype(int).tolist()
    return tuple(painter.surface(time).get_at((x, y)))[:3]


def test_a_lane_that_opens_has_its_dashes_where_it_is_wide_enough() -> None:
    """Beside a lane of no width the lines of both its sides would run together in a wedge."""
    wide = road(0, [(0.0, 0.0), (80.0, 0.0)])
    widths = tuple(3.5 * min(1.0, x / 40.0) for x in range(0, 81, 5))
    opening = road(1, [(float(x), 1.75 + w / 2.0) for x, w in zip(range(0, 81, 5), widths, strict=True)], widths=widths)
    dashes = [shape.points for shape in painted(town_of(wide, opening), palette.LANE_LINE)]
    assert dashes
    assert all(points[:, 0].min() > 15.0 for points in dashes)
    assert all(np.abs(points[:, 1] - 1.75).max() < 0.3 for points in dashes)


def test_lines_of_lanes_that_follow_each_other_are_one() -> None:
    parts = [road(k, [(50.0 * k, 0.0), (50.0 * (k + 1), 0.0)]) for k in range(3)]
    links = [LaneLink(k, k + 1, LinkType.STRAIGHT) for k in range(2)]
    edges = lines_of(town_of(*parts, links=links), BorderKind.EDGE)
    assert [border.lanes for border in edges] == [(0, 1, 2), (0, 1, 2)]
    assert all(np.isclose(np.hypot(*np.diff(border.points[:, :2], axis=0).T).sum(), 150.0) for border in edges)


def test_grass_grows_between_directions_that_lie_apart() -> None:
    town = town_of(road(0, [(0.0, 4.0), (100.0, 4.0)]), road(1, [(100.0, -4.0), (0.0, -4.0)], number=1))
    medians = lines_of(town, BorderKind.MEDIAN)
    assert {border.lanes for border in medians} == {(0,), (1,)}
    assert np.concatenate([border.gap for border in medians]) == pytest.approx(4.5)
    painter = MapPainter(town, size=(900, 200))
    assert colour_at(painter, (23.0, 0.0)) in (palette.MEDIAN, palette.MEDIAN_TREE)
    assert colour_at(painter, (23.0, 4.0)) == palette.ROAD


def test_arrows_show_every_way_on_and_no_other() -> None:
    town = load_town("brookside")
    arrows = MapLayers(town).arrows
    ends = {lane.id for lane in town.lanes if not lane.in_junction and len(town.exits(lane.id)) > 1}
    assert {arrow.shows for arrow in arrows} >= {k for k in ends if town.lanes[k].length > 20.0}
    for arrow in arrows:
        assert set(arrow.turns) == {way.type for way in town.exits(arrow.shows)} & set(TURNS)
        assert arrow.station + ARROW_LENGTH <= town.lanes[arrow.lane].length


def test_a_stop_line_lies_before_the_crosswalk_that_lies_before_the_junction() -> None:
    outline = np.array([[54.0, -3.0], [57.0, -3.0], [57.0, 3.0], [54.0, 3.0]])
    town = approach(SignalKind.STOP, crosswalks=[Crosswalk(id=0, outline=outline)])
    (bar,) = painted(town, palette.STOP_LINE)
    assert 52.0 < bar.bounds[0] < bar.bounds[2] < 54.0


def test_triangles_and_no_line_where_one_has_to_yield() -> None:
    triangles = painted(approach(SignalKind.YIELD), palette.STOP_LINE)
    assert len(triangles) > 2
    for triangle in triangles:
        tip = triangle.points[np.argmin(triangle.points[:, 0])]
        assert len(triangle.points) == 3 and triangle.points[:, 0].max() - tip[0] > 0.5, "points at who comes"


def test_no_line_where_no_stop_is_required() -> None:
    assert not painted(approach(SignalKind.SPEED), palette.STOP_LINE)


def test_lights_show_their_colour_at_the_stop_line_as_time_goes_by() -> None:
    phases = (
        LightPhase(duration=10.0, green=(9,)),
        LightPhase(duration=3.0, yellow=(9,)),
        LightPhase(duration=10.0),
    )
    programmes = [LightProgramme(junction_id=5, signals=(9,), phases=phases)]
    town = approach(SignalKind.TRAFFIC_LIGHT, programmes=programmes)
    painter = MapPainter(town, size=(1400, 600))
    middle = (town.lanes[0].length - 0.5, 0.0)
    assert colour_at(painter, middle) == palette.STOP_LINE
    shown = [colour_at(painter, middle, time) for time in (5.0, 11.0, 20.0, 25.0)]
    assert shown == [palette.LIGHT_GREEN, palette.LIGHT_AMBER, palette.LIGHT_RED, palette.LIGHT_GREEN]
    assert town.light(0, 11.0) is LightColour.YELLOW
    (post,) = painter.plan.posts
    assert 58.0 < post.at[0] < 60.0 and 2.0 < post.at[1] < 4.0, "on the right, beside the line, not across the junction"
    assert colour_at(painter, middle) == palette.STOP_LINE, "the base map keeps no colour"


def test_a_window_shows_the_lights_where_the_whole_map_does() -> None:
    programmes = [LightProgramme(junction_id=5, signals=(9,), phases=(LightPhase(duration=1.0),))]
    painter = MapPainter(approach(SignalKind.TRAFFIC_LIGHT, programmes=programmes), size=(1400, 600))
    view = painter.window((59.5, 0.0), (101, 101), time=0.0)
    assert tuple(view.get_at((50, 50)))[:3] == palette.LIGHT_RED


def test_a_light_of_the_left_lane_alone_stands_on_its_left() -> None:
    lanes = (
        road(0, [(0.0, 0.0), (60.0, 0.0)]),
        road(1, [(0.0, 3.5), (60.0, 3.5)], number=-2),
        road(2, [(60.0, 0.0), (80.0, 0.0)], junction=5),
        road(3, [(60.0, 3.5), (80.0, 3.5)], junction=5),
    )
    links = [LaneLink(0, 2, LinkType.STRAIGHT), LaneLink(1, 3, LinkType.STRAIGHT)]
    signals = [
        Signal(id=k, kind=SignalKind.TRAFFIC_LIGHT, position=(80.0, 9.0, 3.0), heading=0.0, lanes=(k,)) for k in (0, 1)
    ]
    junctions = [Junction(id=5, position=(70.0, 1.75), connectors=(2, 3))]
    posts = MapLayers(town_of(*lanes, links=links, junctions=junctions, signals=signals)).posts
    assert {post.lanes: post.at[1] for post in posts} == pytest.approx({(0,): -3.25, (1,): 6.75})


def test_one_way_arrows_stand_on_one_way_streets_alone() -> None:
    lanes = (
        road(0, [(0.0, 1.75), (100.0, 1.75)]),
        road(1, [(100.0, -1.75), (0.0, -1.75)], number=1),
        road(2, [(0.0, 60.0), (100.0, 60.0)]),
    )
    town = town_of(*lanes)
    assert {lane for lane, _ in one_way_places(town, MapLayers(town).borders)} == {2}


def test_a_road_deep_under_a_street_is_a_tunnel() -> None:
    town = town_of(road(0, [(0.0, 0.0), (120.0, 0.0)]), road(1, [(60.0, -60.0), (60.0, 60.0)], z=-6.0))
    plan = MapLayers(town)
    assert [(part.level, part.lane) for part in plan.stretches] == [(-1, 1)]
    painter = MapPainter(town, size=(900, 900))
    assert colour_at(painter, (60.0, 4.0)) == palette.TUNNEL
    assert colour_at(painter, (60.0, 1.0)) == palette.ROAD, "the street goes on above it"
    assert colour_at(painter, (60.0, -4.0)) == palette.TUNNEL
    assert colour_at(painter, (60.0, 20.0)) == palette.ROAD, "nothing covers the road there"


def dual_carriageway_under_a_street(angle: float = 0.0) -> Town:
    """A street along the x axis, turned by an angle [rad]; under it two lanes to the south and two to the north."""
    way = np.array([np.cos(angle), np.sin(angle)])
    lanes = [road(0, [tuple(-80.0 * way), tuple(80.0 * way)], number=-1)]
    for k, x in enumerate((-7.5, -4.0, 4.0, 7.5)):
        ends = [(x, 100.0), (x, -100.0)] if x > 0 else [(x, -100.0), (x, 100.0)]
        lanes.append(road(k + 1, ends, z=-6.0, number=1 if x < 0 else -1))
    return town_of(*lanes)


@pytest.mark.parametrize("angle", [0.0, 0.5, -0.8])
def test_a_tunnel_is_as_long_as_what_covers_it(angle: float) -> None:
    """The street is 3.5 m wide; its pavements add some metres, and crossing at an angle makes the way longer."""
    town = dual_carriageway_under_a_street(angle)
    parts = MapLayers(town).stretches
    assert {part.lane for part in parts} == {1, 2, 3, 4}
    for part in parts:
        lane = town.lanes[part.lane]
        a, b = lane.position(part.start), lane.position(part.end)
        assert abs(b[1] - a[1]) < 3.5 / np.cos(angle) + 10.0
        middle = (a + b) / 2.0
        assert middle[1] == pytest.approx(middle[0] * np.tan(angle), abs=0.3), "in the middle under the street"


def test_grass_in_a_cutting_ends_before_the_tunnel_and_never_lies_on_the_street_above() -> None:
    painter = MapPainter(dual_carriageway_under_a_street(), size=(900, 900))
    assert colour_at(painter, (0.0, 40.0)) in (palette.MEDIAN, palette.MEDIAN_TREE)
    assert colour_at(painter, (0.0, 0.0)) == palette.ROAD
    assert colour_at(painter, (0.0, 4.0)) == palette.TUNNEL


def test_slopes_lie_beside_an_open_cutting_and_nowhere_else() -> None:
    painter = MapPainter(dual_carriageway_under_a_street(), size=(900, 900))
    slope = {palette.CUTTING, palette.CUTTING_EDGE}
    assert colour_at(painter, (11.6, 30.0)) in slope and colour_at(painter, (-11.6, 30.0)) in slope
    level = town_of(road(0, [(0.0, 0.0), (120.0, 0.0)]), road(1, [(60.0, -60.0), (60.0, 60.0)], z=6.0))
    assert not slope & {shape.colour for shape in MapLayers(level).shapes}


def avenue_with_turn_lanes() -> Town:
    """Two turn lanes, back to back in the median of an avenue of 120 m with two lanes each way."""
    lanes = [
        road(0, [(0.0, 3.75), (62.0, 3.75)], number=-1),
        road(1, [(0.0, 7.25), (62.0, 7.25)], number=-2),
        road(2, [(62.0, 0.25), (120.0, 0.25)], number=-1),
        road(3, [(62.0, 3.75), (120.0, 3.75)], number=-2),
        road(4, [(62.0, 7.25), (120.0, 7.25)], number=-3),
        road(5, [(120.0, -3.75), (58.0, -3.75)], number=1),
        road(6, [(120.0, -7.25), (58.0, -7.25)], number=2),
        road(7, [(58.0, -0.25), (0.0, -0.25)], number=1),
        road(8, [(58.0, -3.75), (0.0, -3.75)], number=2),
        road(9, [(58.0, -7.25), (0.0, -7.25)], number=3),
    ]
    pairs = [(0, 3), (1, 4), (5, 8), (6, 9)]
    return town_of(*lanes, links=[LaneLink(a, b, LinkType.STRAIGHT) for a, b in pairs])


def test_turn_lanes_that_open_back_to_back_share_a_hatched_island() -> None:
    town = avenue_with_turn_lanes()
    assert [(pocket.lane, pocket.back) for pocket in MapLayers(town).pockets] == [(2, 2.0), (7, 2.0)]
    hatching = painted(town, palette.HATCHING)
    low = np.min([shape.points.min(axis=0) for shape in hatching], axis=0)
    high = np.max([shape.points.max(axis=0) for shape in hatching], axis=0)
    assert low[0] == pytest.approx(120.0 - high[0]) and 45.0 < low[0] < 57.0
    assert low[1] > -2.3 and high[1] < 2.3, "between the through lanes"


def test_no_kerb_is_seen_where_turn_lanes_open() -> None:
    painter = MapPainter(avenue_with_turn_lanes(), size=(1800, 500), street_names=[""])
    picture = pygame.surfarray.array3d(painter.surface())
    (x0, y0), (x1, y1) = np.round(painter.to_pixel([(20.0, -5.0), (100.0, 5.0)])).astype(int).tolist()
    seen = {tuple(colour) for colour in picture[x0:x1, y0:y1].reshape(-1, 3).tolist()}
    assert palette.ROAD in seen and not seen & {palette.KERB, palette.BLOCK, palette.PARK, palette.COUNTRY}


def test_a_lane_that_grows_from_nothing_has_no_island() -> None:
    town = avenue_with_turn_lanes()
    wide = [
        lane if lane.id != 2 else road(2, [(62.0, 2.0), (70.0, 0.25), (120.0, 0.25)], widths=(0.1, 3.5, 3.5))
        for lane in town.lanes
    ]
    assert 2 not in [pocket.lane for pocket in MapLayers(town_of(*wide, links=town.links)).pockets]


def test_the_pavement_continues_around_a_roundabout() -> None:
    """Only the arms have pavements in a map; ring and arms are of one paved square for those who walk."""
    angles = np.radians([[60.0, -60.0], [-120.0, -240.0]])
    arcs = [np.linspace(a, b, 40) for a, b in angles]
    rings = [road(k, [(30.0 * np.cos(t), 30.0 * np.sin(t)) for t in arc]) for k, arc in enumerate(arcs)]
    walks = [
        Sidewalk(id=k, points=np.array([[x, 33.0 * y, 0.0], [x, 60.0 * y, 0.0]]), width=2.0)
        for k, (x, y) in enumerate([(10.0, 1.0), (-10.0, 1.0), (10.0, -1.0), (-10.0, -1.0)])
    ]
    outside = (33.0, 0.0)
    for paved in (walks, walks[:1]):
        painter = MapPainter(town_of(*rings, sidewalks=paved), size=(700, 700))
        assert (colour_at(painter, outside) == palette.SIDEWALK) == (paved is walks)


def test_a_pavement_of_the_map_is_painted_up_to_the_kerb() -> None:
    walk = Sidewalk(id=0, points=np.array([[0.0, 6.0, 0.0], [100.0, 6.0, 0.0]]), width=2.0)
    painter = MapPainter(town_of(road(0, [(0.0, 0.0), (100.0, 0.0)]), sidewalks=[walk]), size=(900, 300))
    for y in (6.0, 4.0, 2.8):
        assert colour_at(painter, (30.0, y)) == palette.SIDEWALK
    assert colour_at(painter, (30.0, -4.0)) != palette.SIDEWALK


def test_a_lay_by_lies_beside_the_lane_at_a_site() -> None:
    site = Site(id=0, lane=0, station=50.0, position=(50.0, 7.75), waypoint=(50.0, 0.0), street=0)
    painter = MapPainter(town_of(road(0, [(0.0, 0.0), (100.0, 0.0)]), sites=[site]), size=(900, 300))
    assert colour_at(painter, (50.0, 3.0)) == palette.BAY
    assert colour_at(painter, (50.0, -3.0)) != palette.BAY


@pytest.mark.long
@pytest.mark.parametrize("name", ["Town02", "Town05"])
def test_no_ground_shows_through_the_junctions_of_imported_towns(name: str) -> None:
    file = MAPS / f"{name}.xodr"
    if not file.exists():
        pytest.skip("../shared/maps is not there")
    town = load_town(str(file))
    painter = MapPainter(town, size=(1700, 1500))
    pixels = pygame.surfarray.array3d(painter.surface())  # (width, height, 3)
    high = {part.lane for part in painter.plan.stretches}
    ground = (palette.COUNTRY, palette.BLOCK, palette.PARK, palette.KERB, palette.SIDEWALK)
    for k in (k for junction in town.junctions for k in junction.connectors if k not in high):
        lane = town.lanes[k]
        for aside in (-0.3, 0.0, 0.3):
            stations = np.arange(1.0, lane.length - 1.0, 2.0).tolist()
            places = [lane.position(s, aside * lane.width_at(s)) for s in stations]
            if places:
                x, y = np.round(painter.to_pixel(places)).astype(int).T
                seen = {tuple(row) for row in pixels[x, y].tolist()}
                assert not seen & set(ground), f"lane {k} of junction {lane.junction_id}"
