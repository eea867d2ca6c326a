"""Towns with traffic on the left, by mirror images of towns with traffic on the right."""

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import (
    DrivingSide,
    ImportNote,
    Lane,
    LinkType,
    NoteKind,
    Town,
    check_town,
    load_town,
    mirrored,
    town_names,
)
from dorothie_gym.maps.cache import pack, unpack
from dorothie_gym.maps.driving_side import OPPOSITES
from dorothie_gym.maps.lane_neighbours import innermost, oncoming_lanes, outermost
from dorothie_gym.maps.opendrive import import_opendrive
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.routing import router
from dorothie_gym.maps.site_inference import lay_sites
from dorothie_gym.maps.traffic_light_programs import derive_programmes
from dorothie_gym.maps.yaml import read_yaml_town

from .ending_lanes import ring
from .mirrored_opendrive import mirror
from .opendrive_text import geometry, lane, opendrive, road, section, shared_map
from .yaml_text import MIDTOWN, written

LEFT, RIGHT = DrivingSide.LEFT, DrivingSide.RIGHT


@pytest.fixture(params=town_names())
def pair(request: pytest.FixtureRequest) -> tuple[Town, Town]:
    """A shipped town and its mirror image."""
    town = load_town(request.param)
    return town, mirrored(town)


def test_a_town_mirrored_twice_is_the_same_town(pair: tuple[Town, Town]) -> None:
    town, image = pair
    assert (town.traffic, image.traffic) == (RIGHT, LEFT)
    assert mirrored(image).identity == town.identity != image.identity


def test_an_archive_keeps_the_side(pair: tuple[Town, Town]) -> None:
    _, image = pair
    assert unpack(pack(image, "key"), "key").identity == image.identity


def test_a_mirror_image_has_no_faults(pair: tuple[Town, Town]) -> None:
    assert not check_town(pair[1])


def test_the_rules_of_a_mirror_image_are_mirrored(pair: tuple[Town, Town]) -> None:
    town, image = pair
    rules, mirrored_rules = right_of_way(town), right_of_way(image)
    for row in town.lanes:
        assert rules.foes(row.id) == mirrored_rules.foes(row.id)
        assert rules.waits_for(row.id) == mirrored_rules.waits_for(row.id)
        assert (innermost(town, row.id), outermost(town, row.id)) == (
            innermost(image, row.id),
            outermost(image, row.id),
        )
        exits = {way.connector: -way.angle % 360 for way in town.exits(row.id)}
        assert exits == {way.connector: way.angle % 360 for way in image.exits(row.id)}
        angles = [way.angle for way in image.exits(row.id)]
        assert angles == sorted(angles) or -180 in angles
    arguments = town.lanes, town.links, town.junctions, town.signals
    assert derive_programmes(*arguments) == derive_programmes(
        image.lanes, image.links, image.junctions, image.signals, LEFT
    )


def test_oncoming_lanes_of_a_mirror_image_are_the_same(pair: tuple[Town, Town]) -> None:
    town, image = pair
    for row in town.lanes:
        for station in np.linspace(0.0, row.length, 5).tolist():
            one, other = oncoming_lanes(town).at(row.id, station), oncoming_lanes(image).at(row.id, station)
            assert (one is None) == (other is None)
            if one is not None and other is not None:
                assert one.lane == other.lane and one.station == pytest.approx(other.station, abs=1e-6)


def test_sites_of_a_mirror_image_are_at_the_kerb_on_the_left(pair: tuple[Town, Town]) -> None:
    town, image = pair
    one, other = lay_sites(town.lanes, town.links), lay_sites(image.lanes, image.links, traffic=LEFT)
    assert [(a.lane, pytest.approx(a.station)) for a in one] == [(b.lane, b.station) for b in other]
    assert all(image.lanes[site.lane].project(np.array(site.position))[1] < 0.0 for site in other)


def test_routes_through_a_mirror_image_cost_the_same() -> None:
    town = load_town("midtown")
    image = mirrored(town)
    places = [(site.lane, site.station) for site in town.sites]
    for start in places[::5]:
        for goal in places[1::6]:
            one, other = router(town).route(start, goal), router(image).route(start, goal)
            assert one is not None and other is not None
            assert one.cost == pytest.approx(other.cost) and [leg.lane for leg in one.legs] == [
                leg.lane for leg in other.legs
            ]


# --- YAML ------------------------------------------------------------------------------------------------------------

LEFT_HAND = (
    MIDTOWN.replace("speed: 50\n", "speed: 50\ntraffic: left\n")
    .replace("gate: [0, 200]", "gate: [0, -200]")
    .replace("corner: [200, 200]", "corner: [200, -200]")
    .replace("hill: [200, -150]", "hill: [200, 150]")
    .replace("[420, 200]", "[420, -200]")
    .replace("[420, -150]", "[420, 150]")
    .replace("[0, -150]", "[0, 150]")
    .replace("{left: [Grand Avenue]", "{right: [Grand Avenue]")
    .replace("[100, 14]", "[100, -14]")
    .replace("[100, 188]", "[100, -188]")
)
"""The mirror image of `MIDTOWN`."""


def test_a_left_hand_file_is_the_mirror_image_of_a_right_hand_one(tmp_path: Path) -> None:
    (tmp_path / "left").mkdir()
    town, image = read_yaml_town(written(tmp_path, MIDTOWN)), read_yaml_town(written(tmp_path / "left", LEFT_HAND))
    assert image.traffic is LEFT
    assert mirrored(image).links == town.links and image.programmes == town.programmes
    for one, other in zip(town.lanes, mirrored(image).lanes, strict=True):
        np.testing.assert_array_equal(one.points, other.points)
    assert [site.position for site in mirrored(image).sites] == [site.position for site in town.sites]
    assert check_town(image) == ()


def test_a_left_hand_ring_is_driven_clockwise(tmp_path: Path) -> None:
    for text, sense in ((MIDTOWN, -1.0), (LEFT_HAND, 1.0)):
        town = read_yaml_town(written(tmp_path, text))
        (ring,) = (street for street in town.streets if street.name == "circus")
        turned = [town.lanes[k].headings[-1] - town.lanes[k].headings[0] for k in ring.lanes]
        assert sense * sum(turned) > 3.0  # headings grow clockwise


SQUARE = (
    "traffic: left\njunctions: {a: [0, -50], b: [200, -50], c: [0, -250], d: [200, -250]}\n"
    "streets: {One: [a, b], Two: [c, d], Three: [a, c], Four: [b, d]}\n"
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LEFT_HAND.replace("{right: [Grand", "{left: [Grand"), "unknown key 'left'"),
        (MIDTOWN.replace("{left: [Grand", "{right: [Grand"), "unknown key 'right'"),
        (MIDTOWN.replace("speed: 50\n", "speed: 50\ntraffic: british\n"), "unknown side 'british'"),
        (LEFT_HAND.replace("turn_lanes: [market]", "turn_lanes: [circus]"), "roundabout, which has no right turns"),
        (
            SQUARE.replace("Four: [b, d]", "Four: {through: [b, [200, -100], [190, -100], d], radius: 40}"),
            r"the bend at \[200\.0, -100\.0\]",
        ),
        (SQUARE.replace("Four: [b, d]", "Four: [b, d], Five: [a, d], Six: [b, c]"), r"near \[9\d, -1\d\d\]"),
    ],
)
def test_messages_are_about_the_file_and_not_its_mirror_image(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(TownError, match=message):
        read_yaml_town(written(tmp_path, text))


# --- OpenDRIVE -------------------------------------------------------------------------------------------------------

BOTH_WAYS = section(0.0, lane(1), lane(-1))


def _read(tmp_path: Path, *roads: str) -> tuple[Town, tuple[ImportNote, ...]]:
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*roads))
    town, notes = import_opendrive(path)
    return town, tuple(note for note in notes.sorted() if note.kind is NoteKind.TRAFFIC)


def _one_way(number: int, offset: float, hdg: float) -> str:
    """A road of 200 m along x with two lanes on the right of its line, which lies at `offset` across it [m]."""
    x = 0.0 if hdg == 0.0 else 200.0
    sections = section(0.0, lane(-1), lane(-2))
    return road(number, length=200.0, plan=geometry("<line/>", 200.0, x=x, y=offset, hdg=hdg), sections=sections)


def test_sites_of_a_left_hand_map_lie_on_the_left(tmp_path: Path) -> None:
    town, notes = _read(tmp_path, road(length=200.0, sections=BOTH_WAYS, rule='rule="LHT"'))
    assert town.traffic is LEFT and not notes
    assert len(town.sites) > 4 and {site.lane for site in town.sites} == {0, 1}
    assert all(town.lanes[site.lane].project(np.array(site.position))[1] < 0.0 for site in town.sites)


def test_a_map_without_a_rule_follows_its_oncoming_lanes(tmp_path: Path) -> None:
    # the lines of both roads lie at the kerb, as in SUMO's left-hand maps
    town, (note,) = _read(tmp_path, _one_way(1, 8.0, 0.0), _one_way(2, -8.0, 3.141592653589793))
    assert town.traffic is LEFT
    assert note.message == "oncoming traffic is on the right of most lanes: left-hand traffic"
    kerbs = {row.id for row in town.lanes if town.neighbour(row.id, LEFT.to_kerb) is None}
    assert {site.lane for site in town.sites} == kerbs
    assert all(abs(town.lanes[k].lane_id) == 2 for k in kerbs)
    assert all(town.lanes[site.lane].project(np.array(site.position))[1] < 0.0 for site in town.sites)


def test_the_same_roads_side_by_side_the_other_way_are_right_hand(tmp_path: Path) -> None:
    town, notes = _read(tmp_path, _one_way(1, 0.0, 0.0), _one_way(2, 0.0, 3.141592653589793))
    assert town.traffic is RIGHT and not notes
    assert all(town.lanes[site.lane].project(np.array(site.position))[1] > 0.0 for site in town.sites)


def test_a_road_without_a_rule_follows_the_others(tmp_path: Path) -> None:
    beside = road(2, plan=geometry("<line/>", 100.0, y=500.0), sections=BOTH_WAYS)
    town, (note,) = _read(tmp_path, road(sections=BOTH_WAYS, rule='rule="LHT"'), beside)
    assert town.traffic is LEFT
    assert note.element.startswith("road 2") and "LHT" in note.message


def test_a_map_with_both_rules_is_refused_in_one_sentence(tmp_path: Path) -> None:
    other = road(2, plan=geometry("<line/>", 100.0, y=500.0), sections=BOTH_WAYS, rule='rule="RHT"')
    with pytest.raises(TownError, match=r"to the right on 1 roads .*road 2.* to the left on 1 .*road 1.*same 'rule'"):
        _read(tmp_path, road(sections=BOTH_WAYS, rule='rule="LHT"'), other)


def test_turns_across_oncoming_traffic_wait_in_left_hand_traffic() -> None:
    assert LEFT.crosses_oncoming(LinkType.RIGHT) and not LEFT.crosses_oncoming(LinkType.LEFT)
    assert RIGHT.crosses_oncoming(LinkType.LEFT) and not RIGHT.crosses_oncoming(LinkType.RIGHT)
    assert all(side.crosses_oncoming(LinkType.U_TURN) for side in DrivingSide)
    assert LEFT.as_right_hand(LinkType.LANE_CHANGE_LEFT) is LinkType.LANE_CHANGE_RIGHT


def test_the_mirror_image_of_a_file_is_the_mirror_image_of_its_town(tmp_path: Path) -> None:
    source = shared_map("Town02")
    mirror(source, tmp_path / "Town02.xodr")
    (town, _), (left, _) = import_opendrive(source), import_opendrive(tmp_path / "Town02.xodr")
    assert left.traffic is LEFT
    image = mirrored(left)

    def ends(lane: Lane) -> tuple[int, ...]:
        return lane.road_id, *np.round(lane.points[[0, -1]].ravel(), 2).tolist()

    ids = {ends(row): row.id for row in town.lanes}
    same = {row.id: ids[ends(row)] for row in image.lanes}  # lanes may be in another order
    assert sorted(same.values()) == list(range(len(town.lanes)))
    links = {(same[link.source], same[link.target], link.type) for link in image.links}
    assert links == {(link.source, link.target, link.type) for link in town.links}
    assert {(same[site.lane], round(site.station, 1)) for site in image.sites} == {
        (site.lane, round(site.station, 1)) for site in town.sites
    }
    ruled = {(signal.kind, frozenset(same[lane] for lane in signal.lanes)) for signal in image.signals}
    assert ruled == {(signal.kind, frozenset(signal.lanes)) for signal in town.signals}


def test_a_mirror_image_keeps_the_cruise_speed(tmp_path: Path) -> None:
    path = tmp_path / "fast.yaml"
    path.write_text(LEFT_HAND)
    assert load_town(path).cruise is None
    path.write_text(f"cruise: 25\n{LEFT_HAND}")
    town = load_town(path)
    assert town.cruise == mirrored(town).cruise == 25.0


def test_ending_lanes_are_left_to_the_other_side_in_a_mirror_image(tmp_path: Path) -> None:
    town = load_town(ring(tmp_path / "ring.xodr"))
    image = mirrored(town)
    sides = [town.merge(lane.id) for lane in town.lanes]
    assert any(sides) and [image.merge(lane.id) for lane in town.lanes] == [side and OPPOSITES[side] for side in sides]
