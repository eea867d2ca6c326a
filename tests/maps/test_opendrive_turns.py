from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.opendrive.topology import turn_type

from .opendrive_text import geometry, lane, linked, opendrive, road, section


@pytest.mark.parametrize(
    ("angle", "kind"),
    [
        (0.0, LinkType.STRAIGHT),
        (-34.0, LinkType.STRAIGHT),
        (90.0, LinkType.LEFT),
        (-90.0, LinkType.RIGHT),
        (149.0, LinkType.LEFT),
        (-151.0, LinkType.U_TURN),
        (180.0, LinkType.U_TURN),
    ],
)
def test_turns_are_typed_by_their_angle(angle: float, kind: LinkType) -> None:
    assert turn_type(angle) is kind


def _fork(tmp_path: Path, *shapes: str) -> list[LinkType]:
    """Types of the ways on from a road into connectors of these shapes (20 m each), which lead nowhere."""
    roads, rows = [], ""
    for k, shape in enumerate(shapes):
        link = '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
        sections = section(0.0, lane(-1, more=linked(before=-1)))
        plan = geometry(shape, 20.0, x=100.0)
        roads.append(road(10 + k, length=20.0, junction=9, plan=plan, link=link, sections=sections))
        rows += f'<connection id="{k}" incomingRoad="1" connectingRoad="{10 + k}" contactPoint="start">'
        rows += '<laneLink from="-1" to="-1"/></connection>'
    path = tmp_path / "fork.xodr"
    entry = road(1, link='<successor elementType="junction" elementId="9"/>')
    path.write_text(opendrive(entry, *roads, f'<junction id="9">{rows}</junction>'))
    return _types(path)


def _types(path: Path) -> list[LinkType]:
    town = read_opendrive(path)
    return [link.type for link in sorted(town.successors(0), key=lambda link: town.lanes[link.target].road_id)]


def _arc(degrees: float) -> str:
    return f'<arc curvature="{np.radians(degrees) / 20.0}"/>'


def _sideways(metres: float) -> str:
    """A way that leads into the lane beside: no change of heading from its start to its end."""
    b, c = 3 * metres, -2 * metres
    return f'<paramPoly3 aU="0" bU="20" cU="0" dU="0" aV="0" bV="0" cV="{b}" dV="{c}"/>'


@pytest.mark.parametrize(
    ("shapes", "types"),
    [
        ((_arc(10.0),), [LinkType.STRAIGHT]),
        ((_arc(30.0), _arc(-5.0)), [LinkType.LEFT, LinkType.STRAIGHT]),
        ((_arc(0.0), _arc(-20.0)), [LinkType.STRAIGHT, LinkType.RIGHT]),
        ((_arc(25.0), _arc(0.0), _arc(-25.0)), [LinkType.LEFT, LinkType.STRAIGHT, LinkType.RIGHT]),
        ((_arc(90.0), _arc(20.0), _arc(-90.0)), [LinkType.LEFT, LinkType.STRAIGHT, LinkType.RIGHT]),
        ((_sideways(3.5), _arc(0.0), _sideways(-3.5)), [LinkType.LEFT, LinkType.STRAIGHT, LinkType.RIGHT]),
    ],
)
def test_of_several_ways_straight_on_the_straightest_keeps_the_name(
    tmp_path: Path, shapes: tuple[str, ...], types: list[LinkType]
) -> None:
    assert _fork(tmp_path, *shapes) == types


def test_a_turn_in_two_parts_is_typed_as_a_whole(tmp_path: Path) -> None:
    def after(number: int) -> str:
        return f'<predecessor elementType="road" elementId="{number}" contactPoint="end"/>'

    both = section(0.0, lane(-1, more=linked(-1, -1)))
    onward = '<successor elementType="road" elementId="3" contactPoint="start"/>'
    half = np.radians(45.0)
    x, y = 20.0 / half * np.sin(half), 20.0 / half * (1.0 - np.cos(half))
    first = road(
        2, length=20.0, junction=9, plan=geometry(_arc(45.0), 20.0, x=100.0), link=after(1) + onward, sections=both
    )
    plan = geometry(_arc(45.0), 20.0, x=100.0 + x, y=y, hdg=half)
    second = road(3, length=20.0, junction=9, plan=plan, link=after(2), sections=both)
    rows = '<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/>'
    path = tmp_path / "parts.xodr"
    entry = road(1, link='<successor elementType="junction" elementId="9"/>')
    path.write_text(opendrive(entry, first, second, f'<junction id="9">{rows}</connection></junction>'))
    assert _types(path) == [LinkType.LEFT]
