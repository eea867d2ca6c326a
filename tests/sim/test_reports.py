from __future__ import annotations

from dorothie_gym.ontology import ObjectClass, PropKind
from dorothie_gym.sim.traffic_rules import INFRACTION_KINDS, WorldEventKind
from tests.sim.crossings import lit_crossing, way_out
from tests.sim.driving import long_lane, network, run, world_at
from tests.sim.forcing import blind, park
from tests.sim.test_infractions import too_late_for_the_line


def test_reports_come_in_the_order_of_their_frames_and_once() -> None:
    world = too_late_for_the_line(lit_crossing("ew"))
    world.actors.add_prop(PropKind.STREET_BARRIER, way_out("n"), 6.0)
    blind(world)
    events = world.step(300)
    frames = [event.frame for event in events]
    assert {WorldEventKind.RED_LIGHT, WorldEventKind.COLLISION} <= {event.kind for event in events}
    assert frames == sorted(frames)
    assert not {event.kind for event in world.step(15)} & set(INFRACTION_KINDS)


def test_infractions_are_counted_and_name_their_counterpart() -> None:
    world = world_at("brookside", long_lane(network("brookside").town), 2.0)
    vehicle = park(world, 30.0)
    blind(world)
    (event,) = [event for event in run(world, 8.0) if event.kind in INFRACTION_KINDS]
    assert (event.data["key"], event.data["other"]) == (vehicle.key, ObjectClass.VEHICLES.label)
    assert world.reports.infractions == {kind: int(kind is WorldEventKind.COLLISION) for kind in INFRACTION_KINDS}


def test_a_batch_reads_the_same_counts() -> None:
    world = too_late_for_the_line(lit_crossing("ew"))
    run(world, 20.0)
    assert world.actors.arrays.watch["counts"].tolist() == [[0, 1, 0, 0, 0]]
