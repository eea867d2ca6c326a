"""One-way roads that leave the map are not imported; what leads on stays."""

from pathlib import Path

from dorothie_gym.maps import load_town
from dorothie_gym.maps.import_notes import NoteAction, NoteKind
from dorothie_gym.maps.opendrive.compile import import_opendrive
from tests.maps.ending_lanes import dead_end, ring, stub
from tests.maps.mirrored_opendrive import mirror
from tests.maps.opendrive_text import geometry, lane, opendrive, road, section


def test_one_way_road_that_leads_off_the_map_is_dropped_with_a_note(tmp_path: Path) -> None:
    town, notes = import_opendrive(stub(tmp_path / "stub.xodr"))
    assert {each.road_id for each in town.lanes} == {1, 2}
    (note,) = (note for note in notes.sorted() if note.kind is NoteKind.LANE)
    assert note.action is NoteAction.DROPPED and "road 7 / lane -1" in note.element


def test_lanes_and_links_of_the_rest_stay_as_they_are(tmp_path: Path) -> None:
    whole, rest = load_town(ring(tmp_path / "ring.xodr")), load_town(stub(tmp_path / "stub.xodr"))
    assert rest.links == whole.links
    ids = [[(each.road_id, each.lane_id) for each in town.lanes] for town in (rest, whole)]
    assert ids[0] == ids[1]


def test_dead_ends_at_which_a_car_can_turn_round_stay(tmp_path: Path) -> None:
    assert len(load_town(dead_end(tmp_path / "map.xodr")).lanes) == 4


def test_map_of_a_single_one_way_road_stays(tmp_path: Path) -> None:
    path = tmp_path / "one_way.xodr"
    path.write_text(opendrive(road(1, length=200.0, sections=section(0.0, lane(-1), lane(-2)))))
    assert len(load_town(path).lanes) == 2


def test_merge_leads_to_the_lane_that_goes_on(tmp_path: Path) -> None:
    town = load_town(ring(tmp_path / "ring.xodr"))
    for number in range(len(town.lanes)):
        side = town.merge(number)
        assert (side is None) is bool(town.successors(number))
        if side is not None:
            beside = town.neighbour(number, side)
            assert beside is not None and town.successors(beside)


def test_no_site_lies_where_a_lane_tapers_away(tmp_path: Path) -> None:
    town = load_town(ring(tmp_path / "ring.xodr"))
    assert town.sites
    for site in town.sites:
        beside = town.lanes[site.lane]
        assert beside.width_at(site.station) > 3.0
        if town.merge(beside.id) is not None:
            assert site.station < beside.wide_until - 50.0


def test_two_way_road_with_dead_ends_stays_beside_others_on_both_sides(tmp_path: Path) -> None:
    plan = geometry("<line/>", 150.0, x=400.0, y=400.0)
    apart = road(7, length=150.0, plan=plan, sections=section(0.0, lane(1), lane(-1)))
    mirror(ring(tmp_path / "map.xodr", apart), tmp_path / "image.xodr")
    for name in ("map.xodr", "image.xodr"):
        assert sum(each.road_id == 7 for each in load_town(tmp_path / name).lanes) == 2
