from pathlib import Path

import pytest

from dorothie_gym.maps import Lane, Town
from dorothie_gym.maps.opendrive import read_opendrive
from dorothie_gym.maps.two_way_roads import RoadWay, two_way_roads

from .opendrive_text import geometry, lane, linked, opendrive, road, section


def _lanes(tmp_path: Path, *roads: str) -> tuple[Lane, ...]:
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*roads))
    return read_opendrive(path).lanes


def _one_way(number: int, x: float, y: float, heading: float, length: float = 100.0, lanes: int = 1) -> str:
    rows = section(0.0, *(lane(-k) for k in range(1, lanes + 1)))
    return road(number, length=length, plan=geometry("<line/>", length, x=x, y=y, hdg=heading), sections=rows)


@pytest.mark.parametrize("lanes", [1, 2, 3])
@pytest.mark.parametrize("gap", [0.0, 3.0])
def test_two_roads_side_by_side_in_opposite_directions_are_one(tmp_path: Path, lanes: int, gap: float) -> None:
    found = _lanes(tmp_path, _one_way(7, 0.0, 0.0, 0.0, lanes=lanes), _one_way(9, 100.0, gap, 3.14159265, lanes=lanes))
    assert two_way_roads(found) == {7: RoadWay(7, False), 9: RoadWay(7, True)}


@pytest.mark.parametrize(
    ("x", "y", "heading", "length"),
    [
        (0.0, 4.0, 0.0, 100.0),  # the same direction
        (100.0, 12.0, 3.14159265, 100.0),  # beyond a green
        (30.0, 0.0, 3.14159265, 30.0),  # beside a part of the other
        (200.0, 0.0, 3.14159265, 100.0),  # ahead of it
        (50.0, -50.0, 1.57079633, 100.0),  # across it
    ],
)
def test_other_roads_are_not(tmp_path: Path, x: float, y: float, heading: float, length: float) -> None:
    found = _lanes(tmp_path, _one_way(7, 0.0, 0.0, 0.0), _one_way(9, x, y, heading, length))
    assert two_way_roads(found) == {7: RoadWay(7, False), 9: RoadWay(9, False)}


def test_a_road_with_both_directions_is_its_own(tmp_path: Path) -> None:
    both = road(5, sections=section(0.0, lane(1), lane(-1)))
    assert two_way_roads(_lanes(tmp_path, both, _one_way(6, 100.0, 4.0, 3.14159265))) == {
        5: RoadWay(5, False),
        6: RoadWay(6, False),
    }


def _cross_town(tmp_path: Path) -> Town:
    """Two streets of two roads each that continue straight across a junction, as SUMO writes them, without turns."""
    parts, number = [], 1
    for heading, (c, s) in ((0.0, (1.0, 0.0)), (1.57079633, (0.0, 1.0))):
        for way in (1.0, -1.0):
            turn = heading if way > 0 else heading + 3.14159265
            ends = []
            for begin in (-110.0, 10.0):
                x, y = way * begin * c, way * begin * s
                ends.append((x, y))
            middle = geometry("<line/>", 20.0, x=-10.0 * way * c, y=-10.0 * way * s, hdg=turn)
            first, inner, second = number, number + 1, number + 2
            number += 3
            rows = section(0.0, lane(-1, more=linked(before=-1, after=-1)))
            parts += [
                road(
                    first,
                    plan=geometry("<line/>", 100.0, x=ends[0][0], y=ends[0][1], hdg=turn),
                    sections=rows,
                    link='<successor elementType="junction" elementId="1"/>',
                ),
                road(
                    inner,
                    length=20.0,
                    plan=middle,
                    sections=rows,
                    junction=1,
                    link=f'<predecessor elementType="road" elementId="{first}" contactPoint="end"/>'
                    f'<successor elementType="road" elementId="{second}" contactPoint="start"/>',
                ),
                road(
                    second,
                    plan=geometry("<line/>", 100.0, x=ends[1][0], y=ends[1][1], hdg=turn),
                    sections=rows,
                    link='<predecessor elementType="junction" elementId="1"/>',
                ),
            ]
    connections = "".join(
        f'<connection id="{k}" incomingRoad="{3 * k + 1}" connectingRoad="{3 * k + 2}" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        for k in range(4)
    )
    path = tmp_path / "cross.xodr"
    path.write_text(opendrive(*parts, f'<junction id="1">{connections}</junction>'))
    return read_opendrive(path)


def test_both_directions_of_a_street_have_one_name(tmp_path: Path) -> None:
    town = _cross_town(tmp_path)
    streets = [{town.lanes[k].road_id for k in street.lanes} for street in town.streets]
    assert sorted(map(sorted, streets)) == [[1, 6], [3, 4], [7, 12], [9, 10]]  # few streets are divided at the junction
