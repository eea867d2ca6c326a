import pytest

from dorothie_gym.sim.network.ahead import HORIZON, LaneChains
from dorothie_gym.sim.network.network import TownNetwork

from .towns import EAST_OUT, EVERY_TOWN, SOUTH_OUT, WEST_EAST, WEST_IN, WEST_SOUTH, find_town, t_junction_town


@pytest.mark.parametrize("name", EVERY_TOWN)
def test_chain_begins_with_the_lane_and_joins_end_to_start(name):
    network = TownNetwork(find_town(name))
    chains, lanes = LaneChains(network), network.lanes_list()
    for index, lane in list(network.lanes_dict().items())[::7]:
        chain = chains.around(index, None)
        assert (chain.rows[0], chain.offsets[0]) == (lane.row, 0.0)
        for part in (chain.offsets >= 0, chain.offsets <= 0):
            assert len(set(chain.rows[part].tolist())) == part.sum()  # each lane once ahead, and once behind
        ends = {0.0, *(o + lanes[r].length for r, o in zip(chain.rows, chain.offsets, strict=True))}
        for row, offset in zip(chain.rows[1:], chain.offsets[1:], strict=True):
            if offset > 0:
                assert min(abs(offset - end) for end in ends) < 1e-9
                assert offset <= lane.length + HORIZON
            else:
                assert offset + lanes[row].length >= -HORIZON - 1e-9


def test_chain_follows_all_links_or_the_route():
    network = TownNetwork(t_junction_town())
    chains, start = LaneChains(network), network.index_of(WEST_IN)

    def lanes(route):
        return {network.lanes_list()[row].town_lane.id for row in chains.around(start, route).rows}

    assert lanes(None) == {WEST_IN, WEST_EAST, EAST_OUT, WEST_SOUTH, SOUTH_OUT}
    assert lanes([network.index_of(WEST_SOUTH)]) == {WEST_IN, WEST_SOUTH, SOUTH_OUT}
    assert lanes([start, network.index_of(WEST_EAST)]) == {WEST_IN, WEST_EAST, EAST_OUT}
    assert lanes([network.index_of(EAST_OUT)]) == lanes(None)  # not reached from here by a link
