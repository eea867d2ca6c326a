import numpy as np
import pytest

from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import Relation, TrafficControl
from dorothie_gym.sim.state.town_arrays import town_arrays
from tests.sim.network.towns import WEST_EAST, WEST_IN, WEST_SOUTH, find_town, t_junction_town

CONTROLS = {
    SignalKind.TRAFFIC_LIGHT: TrafficControl.LIGHT,
    SignalKind.STOP: TrafficControl.STOP,
    SignalKind.YIELD: TrafficControl.YIELD,
    None: TrafficControl.NONE,
}


@pytest.mark.parametrize("name", ["brookside", "millbrook", "Town05.xodr"])
def test_links_and_right_of_way_are_the_towns(name):
    town = find_town(name)
    arrays, rules = town_arrays(TownNetwork(town)), right_of_way(town)
    for lane in town.lanes:
        record = arrays.lanes[lane.id]
        after = arrays.neighbours[record.successor : record.successor + record.successors]
        before = arrays.neighbours[record.predecessor : record.predecessor + record.predecessors]
        assert after.tolist() == [link.target for link in town.successors(lane.id)]
        assert tuple(before) == town.predecessors(lane.id)
        assert record.control == CONTROLS[rules.control(lane.id)]
        assert record.length == pytest.approx(lane.length) and record.limit == lane.speed_limit
        if not lane.in_junction:
            assert record.junction == -1
            continue
        others = [k for k, other in enumerate(arrays.lanes) if other.junction == record.junction]
        row = arrays.relations[record.relation : record.relation + len(others)]
        assert {other for other, what in zip(others, row, strict=True) if what} == set(rules.foes(lane.id))
        waits = {other for other, what in zip(others, row, strict=True) if what == Relation.WAITS}
        assert waits == set(rules.waits_for(lane.id))


def test_lanes_that_begin_together_know_where_they_part():
    arrays = town_arrays(TownNetwork(t_junction_town()))
    lane = arrays.lanes[WEST_EAST]
    (sibling,) = arrays.siblings[lane.sibling : lane.sibling + lane.siblings]
    assert sibling.lane == WEST_SOUTH and 5.0 < sibling.until < 12.0
    assert arrays.lanes[WEST_IN].siblings == 0


@pytest.mark.parametrize("name", ["brookside", "millbrook"])
def test_crosswalks_join_pavements_and_are_passed_by_the_lanes_across(name):
    town = find_town(name)
    arrays = town_arrays(TownNetwork(town))
    assert len(arrays.crossings) == len(town.crosswalks)
    for number, crossing in enumerate(arrays.crossings):
        assert 6.0 < crossing.length < 20.0
        passing = [
            (lane, passage)
            for lane in arrays.lanes
            for passage in arrays.passages[lane.passage : lane.passage + lane.passages]
            if passage.crossing == number
        ]
        assert passing
        for lane, passage in passing:
            assert 0.0 <= passage.start <= passage.stop <= lane.length
            assert 0.0 < passage.across < crossing.length
        for end in (0, 1):
            walk = arrays.walks[crossing.walk[end]]
            mouths = arrays.mouths[walk.mouth : walk.mouth + walk.mouths]
            assert any(m.crossing == number and m.end == end for m in mouths)
            assert (np.diff(mouths.station) >= 0.0).all()
