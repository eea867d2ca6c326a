import math
import textwrap
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.model import LinkType, SignalKind
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.yaml import read_yaml_town, schema
from dorothie_gym.support.portable_math import wrap_degrees

VILLAGE = """\
name: village
speed: 50
junctions:
  green: [0, 0]
  pond: [120, 0]
  barn: [0, 110]
streets:
  High Street: {through: [green, pond], speed: 30}
  Mill Lane: [green, barn]
  Ring: {through: [pond, [120, 110], barn, [-90, 110], [-90, 0], green, [0, -90], [120, -90], pond], radius: 25}
lights: [green]
crosswalks:
  - [green, High Street]
  - [barn, Ring]
"""


def compiled(tmp_path: Path, text: str) -> Town:
    path = tmp_path / "village.yaml"
    path.write_text(text, encoding="utf-8")
    return read_yaml_town(path)


@pytest.fixture(scope="module")
def village(tmp_path_factory: pytest.TempPathFactory) -> Town:
    return compiled(tmp_path_factory.mktemp("village"), VILLAGE)


@pytest.fixture(scope="module")
def brookside() -> Town:
    import dorothie_gym.maps as package

    return read_yaml_town(Path(str(package.__file__)).parent / "data" / "brookside.yaml")


@pytest.fixture(params=["village", "brookside"])
def town(request: pytest.FixtureRequest) -> Town:
    return request.getfixturevalue(request.param)


def smallest_radius(points: np.ndarray) -> float:
    """Radius of the tightest circle through three successive points (n, 3)."""
    a, b, c = points[:-2, :2], points[1:-1, :2], points[2:, :2]
    u, v, w = b - a, c - b, c - a
    cross = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    sides = np.hypot(*u.T) * np.hypot(*v.T) * np.hypot(*w.T)
    return float(np.min(sides / np.maximum(2.0 * cross, 1e-9)))


def test_village_has_two_lanes_a_segment_and_a_connector_for_every_pair_of_arms(village: Town) -> None:
    inside = [lane for lane in village.lanes if lane.in_junction]
    assert len(village.lanes) - len(inside) == 2 * 5
    assert len(inside) == 4 * 3 + 3 * 2 + 3 * 2
    assert len(village.links) == 2 * len(inside)
    assert [len(junction.connectors) for junction in village.junctions] == [12, 6, 6]
    assert [lane.id for lane in village.lanes] == list(range(len(village.lanes)))


def test_the_two_lanes_of_a_segment_share_a_road_and_keep_right(village: Town) -> None:
    along, against = village.lanes[0], village.lanes[1]
    assert (along.road_id, along.lane_id, against.road_id, against.lane_id) == (0, -1, 0, 1)
    assert along.points[0, 0] < along.points[-1, 0] and against.points[0, 0] > against.points[-1, 0]
    assert np.allclose(along.points[:, 1], 1.75) and np.allclose(against.points[:, 1], -1.75)  # y points south


def test_roads_are_numbered_apart(town: Town) -> None:
    uses = Counter(lane.road_id for lane in town.lanes)
    assert all(uses[lane.road_id] == (1 if lane.in_junction else 2) for lane in town.lanes)


def test_linked_lanes_meet_without_gap_or_kink(town: Town) -> None:
    for link in town.links:
        source, target = town.lanes[link.source], town.lanes[link.target]
        assert np.array_equal(source.points[-1], target.points[0])
        kink = wrap_degrees(math.degrees(source.headings[-1] - target.headings[0]))
        assert abs(kink) < 2.0, (link, kink)


def test_turns_are_typed_on_entry_by_their_change_of_heading(town: Town) -> None:
    for link in town.links:
        if town.lanes[link.source].in_junction:
            assert link.type is LinkType.STRAIGHT
            continue
        connector = town.lanes[link.target]
        turn = wrap_degrees(math.degrees(connector.headings[-1] - connector.headings[0]))
        expected = LinkType.STRAIGHT if abs(turn) < 35 else LinkType.RIGHT if turn > 0 else LinkType.LEFT
        assert link.type is expected


def test_a_crossroads_offers_right_straight_and_left(village: Town) -> None:
    into_green = village.lanes[1]  # High Street, westwards
    assert [(way.type, way.angle) for way in village.exits(into_green.id)] == [
        (LinkType.RIGHT, -90),
        (LinkType.STRAIGHT, 0),
        (LinkType.LEFT, 90),
    ]


def test_lanes_can_be_driven_by_a_car(town: Town) -> None:
    assert min(smallest_radius(lane.points) for lane in town.lanes) > 5.5


def test_curves_are_sampled_to_a_centimetre(town: Town) -> None:
    for lane in town.lanes:
        step = np.diff(lane.stations)
        bend = np.abs(np.diff(lane.headings))
        assert np.all(step <= 20.0 + 1e-9)
        assert np.all(step[bend > 0.01] <= 2.0 + 1e-9)
        # A chord of length c that turns by t is at most c * t / 8 from its arc.
        assert np.all(step[step < 2.0] * bend[step < 2.0] / 8.0 <= 0.0105)


def test_exact_offset_of_a_bend(village: Town) -> None:
    ring_outside = next(lane for lane in village.lanes if lane.street == 2 and lane.lane_id == 1)
    assert smallest_radius(ring_outside.points) == pytest.approx(25.0 + 1.75, abs=0.05)


def test_every_lane_reaches_every_other(town: Town) -> None:
    def reached(step) -> set[int]:
        seen, todo = {0}, [0]
        while todo:
            todo.extend(fresh := [k for k in step(todo.pop()) if k not in seen])
            seen.update(fresh)
        return seen

    assert len(reached(lambda k: [link.target for link in town.successors(k)])) == len(town.lanes)
    assert len(reached(town.predecessors)) == len(town.lanes)


def test_streets_hold_their_lanes_and_the_ways_straight_through(village: Town) -> None:
    assert [street.name for street in village.streets] == ["High Street", "Mill Lane", "Ring"]
    assert village.streets[0].lanes == (0, 1)
    ring = [village.lanes[k] for k in village.streets[2].lanes]
    assert sum(not lane.in_junction for lane in ring) == 2 * 3
    assert all(lane.street == 2 for lane in ring)
    for lane in village.lanes:
        if lane.in_junction:
            before = village.lanes[village.predecessors(lane.id)[0]].street
            after = village.lanes[village.successors(lane.id)[0].target].street
            assert lane.street == (before if before == after else -1)


def test_speed_limits_are_those_of_the_street(village: Town) -> None:
    assert village.lanes[0].speed_limit == pytest.approx(30 / 3.6)
    assert village.lanes[2].speed_limit == pytest.approx(50 / 3.6)
    connector = village.lanes[village.successors(1)[0].target]
    assert connector.speed_limit == pytest.approx(30 / 3.6)


def test_each_approach_of_a_lit_junction_has_a_light_that_faces_it(village: Town) -> None:
    assert [signal.kind for signal in village.signals] == [SignalKind.TRAFFIC_LIGHT] * 4
    assert len({signal.lanes for signal in village.signals}) == 4
    for signal in village.signals:
        (lane,) = (village.lanes[k] for k in signal.lanes)
        assert {village.lanes[way.target].junction_id for way in village.successors(lane.id)} == {0}
        assert lane.project(np.array(signal.position[:2]))[1] == pytest.approx(lane.widths[-1] / 2 + 1.0)
        assert math.cos(signal.heading - lane.headings[-1]) == pytest.approx(-1.0)


def test_crosswalks_lie_across_every_arm_of_the_street(village: Town) -> None:
    assert len(village.crosswalks) == 1 + 2
    outline = village.crosswalks[0].outline
    assert outline.shape == (4, 2)
    assert outline[:, 1].min() < -3.5 and outline[:, 1].max() > 3.5
    assert 0.0 < outline[:, 0].min() < outline[:, 0].max() < village.lanes[0].points[0, 0]


def test_brookside_has_its_documented_figures(brookside: Town) -> None:
    assert brookside.name == "brookside"
    assert 60 <= len(brookside.lanes) <= 100
    assert 2.5 <= brookside.kilometres <= 3.5
    assert 8 <= len(brookside.junctions) <= 9
    assert 8 <= len(brookside.streets) <= 10
    assert {len(junction.connectors) for junction in brookside.junctions} == {6, 12}  # T and crossroads
    assert brookside.signals and brookside.crosswalks
    assert min(lane.length for lane in brookside.lanes if not lane.in_junction) >= 40.0


def test_a_file_without_a_name_is_called_after_itself(tmp_path: Path) -> None:
    assert compiled(tmp_path, VILLAGE.replace("name: village\n", "")).name == "village"


def test_names_are_texts_even_where_yaml_sees_something_else(tmp_path: Path) -> None:
    text = VILLAGE.replace("Mill Lane", "12").replace("green", "no")
    assert compiled(tmp_path, text).streets[1].name == "12"


def test_compiling_is_deterministic(tmp_path: Path, village: Town) -> None:
    again = compiled(tmp_path, VILLAGE)
    assert all(np.array_equal(a.points, b.points) for a, b in zip(village.lanes, again.lanes, strict=True))
    assert again.links == village.links


def test_the_example_in_the_documentation_compiles(tmp_path: Path) -> None:
    example = textwrap.dedent(str(schema.__doc__).split("A village::\n")[1])
    assert [street.name for street in compiled(tmp_path, example).streets] == ["High Street", "Mill Lane", "Back Lane"]
