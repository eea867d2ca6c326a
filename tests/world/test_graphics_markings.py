"""What is painted on roads and stands beside them: lines, medians, arrows, lights, signs, bridges and tunnels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
import pygame
import pytest

from dorothie_gym.world.graphics import MapPainter, palette
from dorothie_gym.world.graphics.arrows import ARROW_LENGTH, TURNS, one_way_places
from dorothie_gym.world.graphics.borders import Border, BorderKind
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.shapes import Shape
from dorothie_gym.world.town import (
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

MAPS = Path(__file__).parents[2] / "../shared/maps"


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
    return [border for border in Plan(town).borders.lines if border.kind is kind]


def painted(town: Town, colour: palette.Colour) -> list[Shape]:
    return [shape for shape in Plan(town).shapes if shape.colour == colour]


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
    arrows = Plan(town).arrows
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


def test_no_line_where_nobody_has_to_stop() -> None:
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
    posts = Plan(town_of(*lanes, links=links, junctions=junctions, signals=signals)).posts
    assert {post.lanes: post.at[1] for post in posts} == pytest.approx({(0,): -3.25, (1,): 6.75})


def test_one_way_arrows_stand_on_one_way_streets_alone() -> None:
    lanes = (
        road(0, [(0.0, 1.75), (100.0, 1.75)]),
        road(1, [(100.0, -1.75), (0.0, -1.75)], number=1),
        road(2, [(0.0, 60.0), (100.0, 60.0)]),
    )
    town = town_of(*lanes)
    assert {lane for lane, _ in one_way_places(town, Plan(town).borders)} == {2}


def test_a_road_deep_under_a_street_is_a_tunnel() -> None:
    town = town_of(road(0, [(0.0, 0.0), (120.0, 0.0)]), road(1, [(60.0, -60.0), (60.0, 60.0)], z=-6.0))
    plan = Plan(town)
    assert [(part.level, part.lane) for part in plan.stretches] == [(-1, 1)]
    painter = MapPainter(town, size=(900, 900))
    assert colour_at(painter, (60.0, 7.0)) == palette.TUNNEL
    assert colour_at(painter, (60.0, 1.0)) == palette.ROAD, "the street goes on above it"
    assert colour_at(painter, (60.0, -5.0)) == palette.TUNNEL


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
