from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, NoteKind, Town, load_town, town_names
from dorothie_gym.maps.lane_neighbours import innermost, outermost
from dorothie_gym.maps.opendrive import import_opendrive, read_opendrive

from .opendrive_text import lane, linked, opendrive, road, section, shared_map

LEFT, RIGHT = LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT


def _read(tmp_path: Path, *parts: str, rule: str = "") -> Town:
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(road(sections="".join(parts), rule=rule)))
    return read_opendrive(path)


def check_neighbours(town: Town) -> None:
    """Left and right are inverse, and no lane is reached again by changes to one side."""
    sides = {(link.source, link.target): link.type for link in town.links if link.type.is_lane_change}
    for (source, target), side in sides.items():
        back = sides.get((target, source))
        assert back is None or {side, back} == {LEFT, RIGHT}
    for lane_ in town.lanes:
        for side in (LEFT, RIGHT):
            seen, here = {lane_.id}, town.neighbour(lane_.id, side)
            while here is not None:
                assert here not in seen
                seen.add(here)
                here = town.neighbour(here, side)


def _turn_lane_at_the_centre(end: str) -> list[str]:
    """A through lane that is number 1 along the road, and 2 where a turn lane opens between it and the centre."""
    if end == "start":
        return [
            section(0.0, lane(2, more=linked(after=1)), lane(1)),
            section(60.0, lane(1, more=linked(before=2))),
        ]
    return [
        section(0.0, lane(-1, more=linked(after=-2))),
        section(60.0, lane(-2, more=linked(before=-1)), lane(-1)),
    ]


@pytest.mark.parametrize("end", ["start", "end"])
@pytest.mark.parametrize("rule", ["", 'rule="LHT"'])
def test_a_lane_that_changes_its_number_is_on_the_side_where_it_lies(tmp_path: Path, end: str, rule: str) -> None:
    town = _read(tmp_path, *_turn_lane_at_the_centre(end), rule=rule)
    through = max(town.lanes, key=lambda lane_: lane_.length).id
    (turn,) = (lane_.id for lane_ in town.lanes if lane_.id != through)
    toward_kerb, toward_centre = (RIGHT, LEFT) if not rule else (LEFT, RIGHT)
    assert town.neighbour(turn, toward_kerb) == through
    assert town.neighbour(through, toward_centre) == turn
    assert town.neighbour(turn, toward_centre) is None
    check_neighbours(town)
    assert outermost(town, turn) == outermost(town, through) != innermost(town, turn) == innermost(town, through)
    beside = town.lanes[turn]
    middle = beside.position(0.5 * beside.length)
    assert (town.lanes[through].project(middle)[1] > 0.0) == (town.neighbour(through, RIGHT) == turn)


def test_lanes_that_change_places_have_no_changes_to_each_other(tmp_path: Path) -> None:
    crossing = [
        section(0.0, lane(-1, more=linked(after=-2)), lane(-2, more=linked(after=-1))),
        section(50.0, lane(-1, more=linked(before=-2)), lane(-2, more=linked(before=-1))),
    ]
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(road(8, sections="".join(crossing))))
    town, notes = import_opendrive(path)
    assert not any(link.type.is_lane_change for link in town.links)
    check_neighbours(town)
    (note,) = (note for note in notes.sorted() if note.kind is NoteKind.LANE_CHANGE)
    assert note.element.startswith("road 8 / lane")


def test_a_round_of_three_lanes_is_no_neighbourhood(tmp_path: Path) -> None:
    """Three lanes, each beside the next in a section of its own, so that the third is beside the first again."""
    first = section(0.0, lane(-1, more=linked(after=-3)), lane(-2, more=linked(after=-1)))
    second = section(
        30.0,
        lane(-1, more=linked(before=-2)),
        lane(-2, more=linked(after=-1)),
        lane(-3, more=linked(before=-1, after=-2)),
    )
    third = section(60.0, lane(-1, more=linked(before=-2)), lane(-2, more=linked(before=-3)))
    town = _read(tmp_path, first, second, third)
    assert len(town.lanes) == 3
    check_neighbours(town)


@pytest.mark.parametrize("name", town_names())
def test_neighbours_in_shipped_towns_are_inverse(name: str) -> None:
    check_neighbours(load_town(name))


@pytest.mark.parametrize("name", ["Town01", "Town02", "Town05"])
def test_neighbours_in_real_maps_are_inverse(name: str) -> None:
    check_neighbours(load_town(shared_map(name)))


@pytest.mark.parametrize("seed", range(20))
def test_random_links_of_lanes_give_no_rounds(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    parts = []
    for k in range(5):
        count = int(random.integers(2, 5))
        rows = [lane(-n, more=linked(after=-int(random.integers(1, 5)))) for n in range(1, count + 1)]
        parts.append(section(20.0 * k, *rows))
    check_neighbours(_read(tmp_path, *parts))
