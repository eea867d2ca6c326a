"""The side of the road and names in Latin letters, read from OpenStreetMap files."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from dorothie_gym.maps.street_map_facts import read_facts, rename_roads
from tests.maps.osm_text import TWO_WAY, Drawing

RING = ("east", "north", "west", "south")


def roundabout(nodes: tuple[str, ...], **tags: str) -> Drawing:
    """Returns a district with a ring through some nodes, and a street with a name in Japanese."""
    drawing = Drawing()
    for name, (x, y) in zip(RING, ((20.0, 0.0), (0.0, 20.0), (-20.0, 0.0), (0.0, -20.0)), strict=True):
        drawing.node(name, x, y)
    drawing.node("far", 200.0, 0.0)
    drawing.way("", [*nodes, nodes[0]], {"highway": "residential", "junction": "roundabout", **tags})
    drawing.way("札幌通", ["east", "far"], {**TWO_WAY, "name:en": "Sapporo Street", "name:ja": "札幌通"})
    drawing.way("Улица Ленина", ["north", "far"], {**TWO_WAY, "name:en": "Lenin Street"})
    drawing.way("河", ["north", "far"], {"waterway": "river", "name:en": "River"})
    return drawing


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(
    ("nodes", "tags", "left"),
    [
        (RING, {}, False),
        (RING[::-1], {}, True),
        (RING, {"oneway": "-1"}, True),
        (RING[::-1], {"driving_side": "right", "maxspeed": "20"}, False),
        (RING[:2], {}, False),
    ],
)
def test_roundabouts_show_the_side_of_the_road(
    tmp_path: Path, nodes: tuple[str, ...], tags: dict[str, str], left: bool, compressed: bool
) -> None:
    content = roundabout(nodes, **tags).text().encode()
    path = tmp_path / "district.osm"
    path.write_bytes(gzip.compress(content) if compressed else content)
    facts = read_facts(path)
    assert facts.left_hand is left
    assert facts.latin_names == {"札幌通": "Sapporo Street"}


@pytest.mark.parametrize("content", [b"", b"<osm", b"\x1f\x8bxx", b"no map", b"<osm><way><nd/></way></osm>"])
def test_broken_files_have_no_facts(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.osm"
    path.write_bytes(content)
    facts = read_facts(path)
    assert not facts.left_hand and facts.latin_names == {}


def test_roads_are_renamed() -> None:
    text = '<OpenDRIVE><road name="札幌通" id="1"/><road name="a &amp; b" id="2"/></OpenDRIVE>'.encode()
    renamed = rename_roads(text, {"札幌通": "Sapporo Street"}).decode()
    assert 'name="Sapporo Street"' in renamed and 'name="a &amp; b"' in renamed
    assert rename_roads(text, {}) == text
