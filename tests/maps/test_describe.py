import json

import numpy as np
import pytest

from dorothie_gym.maps.catalogue import describe, load_town
from dorothie_gym.maps.model import Lane, LaneLink, LinkType, Signal, SignalKind, Street
from dorothie_gym.maps.town import Town


def lane(k: int, length: float) -> Lane:
    points = np.array([[0.0, 4.0 * k, 0.0], [length, 4.0 * k, 0.0]])
    return Lane(id=k, road_id=k, lane_id=-1, points=points, widths=np.full(2, 3.5), speed_limit=10.0)


def test_components_count_lane_changes_apart() -> None:
    change, back = LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT
    links = [
        (0, 1, LinkType.STRAIGHT),
        (1, 0, LinkType.STRAIGHT),
        (2, 2, LinkType.STRAIGHT),
        (1, 2, change),
        (2, 1, back),
    ]
    signals = [
        Signal(id=k, kind=kind, position=(0.0, 0.0, 0.0), heading=0.0)
        for k, kind in enumerate((SignalKind.TRAFFIC_LIGHT, SignalKind.STOP))
    ]
    town = Town(
        name="three",
        lanes=[lane(0, 100.0), lane(1, 200.0), lane(2, 33.333)],
        links=[LaneLink(*link) for link in links],
        junctions=[],
        streets=[Street(id=0, name="Long Lane", lanes=(0, 1))],
        signals=signals,
    )
    assert describe(town) == {
        "name": "three",
        "traffic": "right",
        "lanes": 3,
        "links": 3,
        "components": [2, 1],
        "components_with_lane_changes": [3],
        "kilometres": 0.33,
        "junctions": 0,
        "streets": ["Long Lane"],
        "signals": 1,
        "crosswalks": 0,
        "sites": 0,
    }


def test_a_town_without_lanes_has_no_components() -> None:
    assert describe(Town(name="void", lanes=[], links=[], junctions=[]))["components"] == []


def test_lanes_without_links_stand_alone() -> None:
    assert describe(Town(name="two", lanes=[lane(0, 10.0), lane(1, 10.0)], links=[], junctions=[]))["components"] == [
        1,
        1,
    ]


def test_brookside_is_one_component_and_goes_into_json() -> None:
    figures = describe(load_town("brookside"))
    assert json.loads(json.dumps(figures)) == figures
    assert figures["components"] == figures["components_with_lane_changes"] == [figures["lanes"]]
    assert figures["kilometres"] == pytest.approx(
        sum(lane.length for lane in load_town("brookside").lanes) / 1000, abs=0.005
    )
