from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps.opendrive import read_opendrive

from .opendrive_text import geometry, lane, opendrive, road, section, shared_map


def _error(tmp_path: Path, text: str) -> TownError:
    path = tmp_path / "bad.xodr"
    path.write_text(text)
    with pytest.raises(TownError) as caught:
        read_opendrive(path)
    assert caught.value.source == str(path)
    assert str(path) in str(caught.value)
    return caught.value


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


def test_an_unknown_geometry_is_named(tmp_path: Path) -> None:
    error = _error(tmp_path, opendrive(road(1), road(12, plan=geometry("<bezier/>", 100.0))))
    assert error.element.startswith("road 12 / geometry / bezier")
    assert "unknown geometry bezier" in error.reason


@pytest.mark.parametrize(
    ("old", "new", "element", "attribute"),
    [
        ('hdg="0.0"', 'hdg="north"', "road 12 / geometry", "hdg"),
        ('length="100.0" id="12"', 'length="nan" id="12"', "road 12", "length"),
        ('a="4"', 'a="wide"', "road 12 / laneSection / lane -1 / width", "a"),
        ('junction="-1"', 'junction="none"', "road 12", "junction"),
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


def test_a_road_that_leads_to_no_road_is_named(tmp_path: Path) -> None:
    link = '<successor elementType="road" elementId="99" contactPoint="start"/>'
    error = _error(tmp_path, opendrive(road(12, link=link)))
    assert error.element.startswith("road 12 / link / successor")
    assert "road 99" in error.reason


def test_a_road_that_leads_to_no_junction_is_named(tmp_path: Path) -> None:
    error = _error(tmp_path, opendrive(road(12, link='<successor elementType="junction" elementId="7"/>')))
    assert "junction 7" in error.reason


def test_a_junction_that_refers_to_no_road_is_named(tmp_path: Path) -> None:
    junction = (
        '<junction id="5"><connection id="0" incomingRoad="12" connectingRoad="44" contactPoint="start"/></junction>'
    )
    error = _error(tmp_path, opendrive(road(12), junction))
    assert error.element.startswith("junction 5 / connection 0")
    assert "road 44" in error.reason


def test_two_roads_of_one_id_are_refused(tmp_path: Path) -> None:
    assert "same id" in _error(tmp_path, opendrive(road(3), road(3))).reason


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


def test_a_lane_section_behind_the_end_of_its_road_is_refused(tmp_path: Path) -> None:
    sections = section(0.0, lane(-1)) + section(1e9, lane(-1))
    assert "lane sections" in _error(tmp_path, opendrive(road(3, sections=sections))).reason


def test_an_unknown_unit_of_speed_is_named(tmp_path: Path) -> None:
    kind = '<type s="0" type="town"><speed max="30" unit="knots"/></type>'
    assert "knots" in _error(tmp_path, opendrive(road(3, more=kind))).reason


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
