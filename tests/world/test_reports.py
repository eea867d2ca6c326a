from __future__ import annotations

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.reports import Pose, Reports, WorldEventKind
from tests.world.crossings import lit_crossing, way_in
from tests.world.driving import network


def pose(y: float) -> Pose:
    return Pose(2.0, y, -1.5707963267948966, 8.0, 0.0, False)


def test_reports_come_in_the_order_of_their_frames_and_once() -> None:
    reports = Reports(TownNetwork(lit_crossing("ew")), pose(16.0), 5.0)
    reports.add(WorldEventKind.HAZARD_STOP, 6, reason="Static")
    reports.add(WorldEventKind.HAZARD_END, 1, reason="Static")
    way = [pose(16.0 - 0.5 * (k + 1)) for k in range(8)]
    events = reports.close(way, 8)
    assert [event.kind for event in events] == [
        WorldEventKind.HAZARD_END, WorldEventKind.RED_LIGHT, WorldEventKind.HAZARD_STOP,
    ]  # fmt: skip
    assert events[1].frame == 4  # its front is at 11.5 m, the line at 12 m
    assert events[1].data["lane"] == way_in("s")
    assert reports.close([way[-1]], 9) == []


def test_infractions_are_counted_and_name_their_counterpart() -> None:
    reports = Reports(network("brookside"), pose(0.0), 5.0)
    for key in (3, 4):
        reports.infraction(
            WorldEventKind.COLLISION, 10, lane=1, station=2.0, x=3.0, y=4.0, key=key, other=ObjectClass.VEHICLES
        )
    assert reports.infractions[WorldEventKind.COLLISION] == 2
    assert reports.infractions[WorldEventKind.RED_LIGHT] == 0
