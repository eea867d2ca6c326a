"""Crosswalks: their places, the pavements that they join, and the lanes that cross them."""

import numpy as np
import pytest

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.pedestrians.walkways import KERB_REACH
from dorothie_gym.sim.state.codes import Footway
from dorothie_gym.sim.state.town_arrays import town_arrays
from tests.sim.network.towns import find_town

TOWNS = ["brookside", "millbrook", "midtown", "northgate"]


@pytest.mark.parametrize("name", TOWNS)
def test_every_crosswalk_joins_two_pavements_where_they_have_a_mouth(name):
    town = find_town(name)
    arrays = town_arrays(TownNetwork(town))
    assert len(arrays.crossings) == len(town.crosswalks) > 0
    for number, crossing in enumerate(arrays.crossings):
        ends = np.column_stack((crossing.x, crossing.y))
        assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(crossing.length)
        for end in (0, 1):
            walk = arrays.walks[crossing.walk[end]]
            assert walk.kind == Footway.PAVEMENT
            mouths = arrays.mouths[walk.mouth : walk.mouth + walk.mouths]
            (mouth,) = [m for m in mouths if m.crossing == number and m.end == end]
            assert mouth.station == crossing.station[end]
            points = arrays.walk_points[walk.first : walk.last + 1]
            x = np.interp(mouth.station, points[:, 2], points[:, 0])
            y = np.interp(mouth.station, points[:, 2], points[:, 1])
            dx, dy = x - ends[end, 0], y - ends[end, 1]
            assert abs(dx * crossing.cos + dy * crossing.sin) < 0.1  # beside the mouth, the crosswalk leads past it
            assert np.hypot(dx, dy) < KERB_REACH


@pytest.mark.parametrize("name", TOWNS)
def test_pedestrians_cross_in_the_middle_of_the_crosswalk(name):
    town = find_town(name)
    crossings = town_arrays(TownNetwork(town)).crossings
    for crosswalk, crossing in zip(town.crosswalks, crossings, strict=True):
        dx, dy = (crosswalk.outline[:, axis] - (crossing.x[0], crossing.y[0])[axis] for axis in (0, 1))
        along, aside = dx * crossing.cos + dy * crossing.sin, dy * crossing.cos - dx * crossing.sin
        assert -2.0 < along.min() < along.max() < crossing.length + 2.0  # from one pavement to the other
        assert aside.max() + aside.min() == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize("name", TOWNS)
def test_lanes_cross_every_crosswalk_on_the_line_of_the_pedestrians(name):
    town = find_town(name)
    arrays = town_arrays(TownNetwork(town))
    assert set(arrays.passages.crossing.tolist()) == set(range(len(town.crosswalks)))
    for lane, record in zip(town.lanes, arrays.lanes, strict=True):
        for passage in arrays.passages[record.passage : record.passage + record.passages]:
            x, y = lane.position(float(passage.start + passage.stop) / 2)
            assert 0.0 <= passage.start <= passage.stop < passage.start + 25.0
            crossing = arrays.crossings[passage.crossing]
            across = (x - crossing.x[0]) * crossing.cos + (y - crossing.y[0]) * crossing.sin
            assert passage.across == pytest.approx(across, abs=1.0)
            assert abs((y - crossing.y[0]) * crossing.cos - (x - crossing.x[0]) * crossing.sin) < 1.5  # half its depth


@pytest.mark.parametrize("name", TOWNS)
def test_pavements_do_not_overlap_lanes(name):
    network = TownNetwork(find_town(name))
    arrays = town_arrays(network)
    for walk in arrays.walks[arrays.walks.kind == Footway.PAVEMENT]:
        points = arrays.walk_points[walk.first : walk.last + 1]
        for station in np.linspace(0.0, walk.length, 9):
            x, y, z = (float(np.interp(station, points[:, 2], points[:, k])) for k in (0, 1, 4))
            lane = network.get_lane(network.get_closest_lane_index(np.array([x, y]), height=z))
            at, lateral = lane.local_coordinates(np.array([x, y]))
            assert abs(lateral) > lane.width_at(at) / 2 or not 0.0 < at < lane.length
