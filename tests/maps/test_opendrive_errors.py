from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import ImportNote, NoteAction, NoteKind
from dorothie_gym.maps.opendrive import import_opendrive, read_opendrive

from .opendrive_text import geometry, lane, linked, opendrive, road, section, shared_map


def _error(tmp_path: Path, text: str) -> TownError:
    path = tmp_path / "bad.xodr"
    path.write_text(text)
    with pytest.raises(TownError) as caught:
        read_opendrive(path)
    assert caught.value.source == str(path)
    assert str(path) in str(caught.value)
    return caught.value


def _note(tmp_path: Path, text: str, lanes: int) -> ImportNote:
    """The only thing that was dropped from a map, of which that many lanes are left."""
    path = tmp_path / "map.xodr"
    path.write_text(text)
    town, notes = import_opendrive(path)
    assert len(town.lanes) == lanes
    (note,) = (note for note in notes.sorted() if note.action is NoteAction.DROPPED)
    return note


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(TownError, match=r"nowhere\.xodr: file: cannot be opened"):
        read_opendrive(tmp_path / "nowhere.xodr")


def test_a_folder_is_no_map(tmp_path: Path) -> None:
    with pytest.raises(TownError, match="cannot be opened"):
        read_opendrive(tmp_path)


def test_a_path_that_no_file_can_have_is_one_error() -> None:
    with pytest.raises(TownError, match="cannot be opened"):
        read_opendrive("a\0b.xodr")


@pytest.mark.parametrize("text", ["", "lanes: [1, 2]", "<OpenDRIVE><road></OpenDRIVE>"])
def test_invalid_xml_is_reported_with_its_line(tmp_path: Path, text: str) -> None:
    assert "XML" in _error(tmp_path, text).reason


def test_a_truncated_map_is_reported_with_its_line(tmp_path: Path) -> None:
    text = opendrive(road(1), "\n", road(2))
    error = _error(tmp_path, text[: len(text) * 2 // 3])
    assert error.element == "line 2"
    assert "not complete" in error.reason


def test_a_truncated_real_map_is_one_error(tmp_path: Path) -> None:
    text = shared_map("Town02").read_text()
    for share in (0.1, 0.5, 0.99):
        assert "not complete" in _error(tmp_path, text[: int(share * len(text))]).reason


def test_another_kind_of_xml_is_refused(tmp_path: Path) -> None:
    assert "OpenDRIVE" in _error(tmp_path, "<osm><way/></osm>").reason


def test_a_map_without_roads_is_refused(tmp_path: Path) -> None:
    assert "no roads" in _error(tmp_path, opendrive()).reason


def test_a_map_without_driving_lanes_is_refused(tmp_path: Path) -> None:
    pavement = road(1, sections=section(0.0, lane(-1, kind="sidewalk")))
    assert "no driving lanes" in _error(tmp_path, opendrive(pavement)).reason


def test_a_road_of_an_unknown_geometry_is_dropped_and_named(tmp_path: Path) -> None:
    note = _note(tmp_path, opendrive(road(1), road(12, plan=geometry("<bezier/>", 100.0))), lanes=1)
    assert note.kind is NoteKind.ROAD
    assert note.element.startswith("road 12 / geometry / bezier")
    assert "unknown geometry bezier" in note.message


def test_a_map_of_which_no_lane_is_left_is_refused_with_the_first_loss(tmp_path: Path) -> None:
    error = _error(tmp_path, opendrive(*(road(k, plan=geometry("<bezier/>", 100.0)) for k in (12, 13))))
    assert error.element.startswith("road 12 / geometry / bezier")
    assert "unknown geometry bezier" in error.reason and "no driving lane is left" in error.reason


@pytest.mark.parametrize(
    ("old", "new", "element", "attribute"),
    [
        ('hdg="0.0"', 'hdg="north"', "road 12 / geometry", "hdg"),
        ('length="100.0" id="12"', 'length="nan" id="12"', "road 12", "length"),
        ('a="4"', 'a="wide"', "road 12 / laneSection / lane -1 / width", "a"),
        (' x="0.0"', "", "road 12 / geometry", "x is missing"),
    ],
)
def test_a_broken_attribute_is_named_with_its_element(
    tmp_path: Path, old: str, new: str, element: str, attribute: str
) -> None:
    text = opendrive(road(12))
    assert old in text
    error = _error(tmp_path, text.replace(old, new))
    assert error.element.startswith(element)
    assert f"attribute {attribute}" in error.reason


@pytest.mark.parametrize("side", ["predecessor", "successor"])
@pytest.mark.parametrize(
    ("link", "missing"),
    [
        ('elementType="road" elementId="99" contactPoint="start"', "road 99"),
        ('elementType="junction" elementId="7"', "junction 7"),
        ('elementType="road" elementId="broken" contactPoint="start"', "road broken"),
        ("", "elementId is missing"),
    ],
)
def test_a_link_of_a_road_to_nothing_is_dropped(tmp_path: Path, side: str, link: str, missing: str) -> None:
    broken = road(2, length=-1.0, plan=geometry("<line/>", 100.0)).replace('id="2"', 'id="broken"')
    parts = [road(12, link=f"<{side} {link}/>"), *([broken] if "broken" in link else [])]
    path = tmp_path / "map.xodr"
    path.write_text(opendrive(*parts))
    town, notes = import_opendrive(path)
    assert len(town.lanes) == 1
    (note,) = (note for note in notes.sorted() if note.kind is NoteKind.ROAD_LINK)
    assert note.action is NoteAction.DROPPED
    assert note.element.startswith(f"road 12 / link / {side}")
    assert missing in note.message


@pytest.mark.parametrize("contact", ['contactPoint="start"', ""])
def test_a_connection_to_no_road_is_dropped(tmp_path: Path, contact: str) -> None:
    junction = f'<junction id="5"><connection id="0" incomingRoad="12" connectingRoad="44" {contact}/></junction>'
    note = _note(tmp_path, opendrive(road(12), junction), lanes=1)
    assert note.kind is NoteKind.CONNECTION
    assert note.element.startswith("junction 5 / connection 0")
    assert "road 44" in note.message


def test_of_two_roads_of_one_id_the_first_is_read(tmp_path: Path) -> None:
    second = road(3, sections=section(0.0, lane(-1), lane(-2)))
    note = _note(tmp_path, opendrive(road(3), second), lanes=1)
    assert note.kind is NoteKind.ROAD and "same id" in note.message


def test_a_road_without_geometry_is_named(tmp_path: Path) -> None:
    assert "no geometry" in _error(tmp_path, opendrive(road(3, plan=" "))).reason


def test_a_driving_lane_without_width_is_named(tmp_path: Path) -> None:
    bare = '<lane id="-1" type="driving" level="false"></lane>'
    error = _error(tmp_path, opendrive(road(3, sections=section(0.0, bare))))
    assert error.element.startswith("road 3 / laneSection / lane -1")


def test_a_lane_that_shrinks_to_a_point_is_named(tmp_path: Path) -> None:
    plan = geometry('<arc curvature="-0.5"/>', 3.0)
    error = _error(tmp_path, opendrive(road(3, length=3.0, plan=plan)))
    assert error.element == "road 3 / laneSection 0 / lane -1"


def test_a_lane_that_jumps_is_named(tmp_path: Path) -> None:
    plan = geometry("<line/>", 50.0) + geometry("<line/>", 50.0, s=50.0, x=1e9)
    error = _error(tmp_path, opendrive(road(3, plan=plan)))
    assert error.element == "road 3 / laneSection 0 / lane -1"
    assert "jumps" in error.reason


@pytest.mark.parametrize("length", [-1.0, 1e9])
def test_an_impossible_length_is_refused_before_it_is_sampled(tmp_path: Path, length: float) -> None:
    assert "length" in _error(tmp_path, opendrive(road(3, length=length, plan=geometry("<line/>", 100.0)))).reason


def test_a_lane_section_behind_the_end_of_its_road_is_dropped(tmp_path: Path) -> None:
    sections = section(0.0, lane(-1)) + section(1e9, lane(-1))
    assert "lane sections" in _note(tmp_path, opendrive(road(3, sections=sections)), lanes=1).message


def test_lane_sections_are_put_into_the_order_of_s(tmp_path: Path) -> None:
    path = tmp_path / "map.xodr"
    ahead, behind = section(40.0, lane(-1, more=linked(before=-1))), section(0.0, lane(-1, more=linked(after=-1)))
    path.write_text(opendrive(road(3, sections=ahead + behind)))
    town, notes = import_opendrive(path)
    assert [lane.length for lane in town.lanes] == pytest.approx([100.0])
    assert [note.action for note in notes.sorted()] == [NoteAction.REPAIRED]


def test_an_unknown_unit_of_speed_is_named_and_the_limit_dropped(tmp_path: Path) -> None:
    kind = '<type s="0" type="town"><speed max="30" unit="knots"/></type>'
    note = _note(tmp_path, opendrive(road(3, more=kind)), lanes=1)
    assert note.kind is NoteKind.SPEED and "knots" in note.message


@pytest.mark.parametrize("value", ['x="west"', 'x="1e300"', 'hdg="inf"'])
def test_one_broken_road_does_not_take_the_others_with_it(tmp_path: Path, value: str) -> None:
    name = value.split("=")[0]
    broken = road(2).replace(f' {name}="0.0"', f" {value}")
    assert broken != road(2)
    note = _note(tmp_path, opendrive(road(1), broken, road(3)), lanes=2)
    assert note.element.startswith("road 2") and f"attribute {name}" in note.message


def test_what_was_dropped_is_logged_with_a_few_of_each_kind(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    link = '<successor elementType="road" elementId="99" contactPoint="start"/>'
    path = tmp_path / "map.xodr"
    path.write_text(opendrive(*(road(k, link=link) for k in range(9))))
    assert len(read_opendrive(path).lanes) == 9
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == 4
    assert "road 0 / link / successor" in lines[0] and "6 more" in lines[-1]


def test_a_map_cannot_draw_in_other_files(tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("hidden words")
    text = f'<!DOCTYPE OpenDRIVE [<!ENTITY x SYSTEM "{secret.as_uri()}">]><OpenDRIVE>&x;</OpenDRIVE>'
    assert "hidden words" not in str(_error(tmp_path, text))


def _small(text: str, tmp_path: Path, encoding: str = "utf-8") -> int:
    path = tmp_path / "small.xodr"
    path.write_bytes(text.encode(encoding))
    return len(read_opendrive(path).lanes)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_a_map_may_declare_any_encoding(tmp_path: Path, encoding: str) -> None:
    declared = encoding.removesuffix("-sig")
    text = opendrive(road(1)).replace('version="1.0"', f'version="1.0" encoding="{declared}"')
    assert _small(text.replace('name=""', 'name="Königsstraße"'), tmp_path, encoding) == 1


def test_a_map_may_have_a_namespace_and_unknown_elements(tmp_path: Path) -> None:
    header = '<header revMajor="1" revMinor="6"><geoReference><![CDATA[+proj=tmerc <&>]]></geoReference></header>'
    extras = '<userData code="x"><vectorScene program="RoadRunner"/></userData><!-- note --><?tool of another?>'
    text = opendrive(header, extras, road(1, more=extras, plan=geometry(extras + "<line/>", 100.0)), extras)
    named = text.replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://code.asam.net/simulation/standard/opendrive_schema">')
    assert _small(text, tmp_path) == _small(named, tmp_path) == 1


def test_a_namespace_does_not_change_the_message_of_a_fault(tmp_path: Path) -> None:
    text = opendrive(road(3, plan=" ")).replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://example.org/o">')
    assert _error(tmp_path, text).element.startswith("road 3")


def test_the_junction_attribute_of_a_road_is_optional(tmp_path: Path) -> None:
    assert _small(opendrive(road(1)), tmp_path) == 1
    assert _small(opendrive(road(1).replace('junction="-1"', "")), tmp_path) == 1
    assert _small(opendrive(road(1).replace('junction="-1"', 'junction=""')), tmp_path) == 1
