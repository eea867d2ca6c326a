from __future__ import annotations

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.sim.infractions import WorldEventKind, WorldEventLog
from dorothie_gym.sim.network.network import TownNetwork
from tests.sim.crossings import lit_crossing, way_in
from tests.sim.driving import network


def way(first: float, last: float, count: int) -> Array:
    """Poses on the way north, the car's middle going evenly from one place to another."""
    poses = np.zeros((count, 6))
    poses[:, 0], poses[:, 1] = 2.0, np.linspace(first, last, count)
    poses[:, 2], poses[:, 3] = -np.pi / 2, 8.0
    return poses


def test_reports_come_in_the_order_of_their_frames_and_once() -> None:
    reports = WorldEventLog(TownNetwork(lit_crossing("ew")), 5.0)
    reports.add(WorldEventKind.HAZARD_STOP, 6, reason="Static")
    reports.add(WorldEventKind.HAZARD_END, 1, reason="Static")
    poses = way(16.0, 12.0, 9)
    events = reports.close(poses, 8)
    assert [event.kind for event in events] == [
        WorldEventKind.HAZARD_END, WorldEventKind.RED_LIGHT, WorldEventKind.HAZARD_STOP,
    ]  # fmt: skip
    assert events[1].frame == 4  # its front is at 11.5 m, the line at 12 m
    assert events[1].data["lane"] == way_in("s")
    assert reports.close(poses[[-1, -1]], 9) == []


def test_infractions_are_counted_and_name_their_counterpart() -> None:
    reports = WorldEventLog(network("brookside"), 5.0)
    for key in (3, 4):
        reports.infraction(
            WorldEventKind.COLLISION, 10, lane=1, station=2.0, x=3.0, y=4.0, key=key, other=ObjectClass.VEHICLES
        )
    assert reports.infractions[WorldEventKind.COLLISION] == 2
    assert reports.infractions[WorldEventKind.RED_LIGHT] == 0
