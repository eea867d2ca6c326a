from __future__ import annotations

import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.policies.navigation.junction_exits import JunctionExits, nearest_sector
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.support.portable_math import wrap_degrees

TOWNS = ("brookside", "millbrook", "midtown", "northgate")


@pytest.mark.parametrize("town", TOWNS)
def test_every_exit_has_a_sector_of_its_road_only(town: str) -> None:
    model = load_town(town)
    ways = JunctionExits(model)
    for lane in model.lanes:
        if lane.in_junction:
            continue
        roads: dict[int, int] = {}
        for way in model.exits(lane.id):
            if way.junction_id < 0:
                continue
            sector = ways.sector_of(lane.id, way.connector)
            assert sector is not None
            road = model.lanes[way.lane].road_id
            assert roads.setdefault(sector, road) == road
            assert abs(wrap_degrees(SECTORS[sector] - way.angle)) <= 90.0


@pytest.mark.parametrize("town", TOWNS)
def test_parallel_lanes_share_sectors(town: str) -> None:
    model = load_town(town)
    ways = JunctionExits(model)
    for link in model.links:
        if link.type.is_lane_change and not model.lanes[link.source].in_junction:
            mine, theirs = (ways.by_sector(lane) for lane in (link.source, link.target))
            assert [way is None for way in mine] == [way is None for way in theirs]


def test_sectors_are_eighths_of_a_circle() -> None:
    assert [nearest_sector(angle) for angle in SECTORS] == list(range(8))
    assert SECTORS[nearest_sector(100.0)] == 90 and SECTORS[nearest_sector(-20.0)] == 0
    assert SECTORS[nearest_sector(175.0)] == -180
