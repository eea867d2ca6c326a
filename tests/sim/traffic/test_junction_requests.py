"""Admission to a crossing, request by request: lights, priority, patience, room, order of arrival, permissions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.maps import Town
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.town import LightPhase
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import Kind, Wait
from dorothie_gym.sim.traffic.junctions import announce, close, note, request
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import GIVING_WAY_PATIENCE, LAPSE
from tests.sim.crossings import ARMS, across, crossing, lit_crossing, way_in, way_out
from tests.sim.state.states import Pose, kernel_world

DT = 0.1


class Askers:
    """Vehicles far away from a crossing, which announce themselves and ask when and where a test says so."""

    def __init__(self, town: Town, *ways: str) -> None:
        """Ways are two letters each: the arm from which a vehicle comes, and the one to which it goes."""
        self.ways = ways
        poses = [Pose(way_in(start), 10.0 + 12.0 * k) for k, (start, _) in enumerate(ways)]
        self.town, self.world = kernel_world(TownNetwork(town), poses)
        for vehicle, (start, end) in zip(self.world.vehicles, ways, strict=True):
            vehicle.plan[:3], vehicle.planned = (way_in(start), across(start, end), way_out(end)), 3

    def come(self, i: int, now: float, distance: float = 1.0, speed: float = 0.0) -> None:
        """A vehicle is on its way to the line, its front so far before it [m]."""
        vehicle, (start, end) = self.world.vehicles[i], self.ways[i]
        vehicle.speed, self.world.clock.time = speed, now
        announce(vehicle, way_in(start), across(start, end), distance, now)

    def ask(self, i: int, now: float, distance: float = 1.0, speed: float = 0.0) -> Wait:
        self.come(i, now, distance, speed)
        return Wait(request(self.town, self.world, i, 1))

    def be_on(self, i: int, lane: int, station: float, now: float) -> None:
        """A vehicle follows a lane now."""
        vehicle = self.world.vehicles[i]
        vehicle.plan[0], vehicle.station = lane, station
        note(self.town, vehicle, now)

    def block(self, i: int, arm: str) -> None:
        """A vehicle stands where others leave the crossing by an arm."""
        vehicle = self.world.vehicles[i]
        vehicle.lane = vehicle.plan[0] = way_out(arm)
        vehicle.own_station = vehicle.station = 6.0
        vehicle.planned, vehicle.speed = 1, 0.0
        rebuild(self.town, self.world)

    def unblock(self, i: int) -> None:
        self.world.vehicles[i].kind = Kind.EMPTY
        rebuild(self.town, self.world)


# --- lights -------------------------------------------------------------------------------------------------------


def test_vehicle_in_the_junction_at_red_clears_it_first() -> None:
    askers = Askers(lit_crossing("ns", green=5.0), "sn", "ew")
    assert askers.ask(0, 4.0, distance=5.0, speed=8.0) is Wait.NOT
    for now in np.arange(4.5, 12.0, 0.5):  # 5 s green, 3 s yellow, 1 s red for all, then green for the others
        askers.be_on(0, across("s", "n"), 0.5, now)
        assert askers.ask(1, now) is (Wait.LIGHT if now < 9.0 else Wait.OCCUPIED)
    askers.be_on(0, way_out("n"), 8.0, 12.0)
    assert askers.ask(1, 12.0) is Wait.NOT


def test_permission_is_withdrawn_if_the_vehicle_can_still_stop_for_the_light() -> None:
    askers = Askers(lit_crossing("ns", green=5.0), "sn", "sn")
    assert askers.ask(0, 4.0, distance=20.0, speed=8.0) is Wait.NOT
    assert askers.ask(1, 4.0, distance=6.0, speed=8.0) is Wait.NOT
    assert askers.ask(0, 5.5, distance=15.0, speed=8.0) is Wait.LIGHT
    assert askers.world.vehicles[0].claim < 0
    assert askers.ask(1, 5.5, distance=3.0, speed=8.0) is Wait.NOT


# --- priority -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("oncoming", ["far", "red", "blocked"])
def test_left_turn_does_not_wait_for_far_standing_or_stopped_vehicles(oncoming: str) -> None:
    phases = [LightPhase(duration=60.0, green=(2,) if oncoming == "red" else (0, 2))]
    askers = Askers(crossing(dict.fromkeys(ARMS, SignalKind.TRAFFIC_LIGHT), phases), "ns", "sw", "en")
    if oncoming == "blocked":
        askers.block(2, "s")
        assert askers.ask(0, 1.0) is Wait.NO_ROOM
    else:
        askers.come(0, 1.0, distance=60.0 if oncoming == "far" else 30.0, speed=8.0)
    assert askers.ask(1, 1.0, distance=2.0, speed=2.0) is Wait.NOT


def test_left_turn_waits_for_a_close_vehicle_with_green() -> None:
    askers = Askers(lit_crossing("ns", green=60.0), "ns", "sw")
    askers.come(0, 1.0, distance=30.0, speed=8.0)
    assert askers.ask(1, 1.0, distance=2.0, speed=2.0) is Wait.GIVING_WAY


def test_left_turn_yields_to_a_vehicle_that_starts_at_the_same_light() -> None:
    askers = Askers(lit_crossing("ew", green=5.0), "sw", "ns")
    for now in (8.5, 8.9, 9.1):  # all stand; green from 9 s on; the left turn happens to ask first
        for i in (0, 1):
            askers.come(i, now)
        answers = [askers.ask(i, now) for i in (0, 1)]
    assert answers == [Wait.GIVING_WAY, Wait.NOT]


def stream(askers: Askers, now: float) -> None:
    """Keeps a vehicle with priority at most two seconds away from the line: vehicles 1 and 2 in turns."""
    askers.come(1 + int(now / 2.0) % 2, now, distance=8.0 * (2.0 - now % 2.0), speed=8.0)


def test_left_turn_may_use_the_yellow_without_oncoming_vehicles() -> None:
    askers = Askers(lit_crossing("ns", green=15.0), "sw", "ns", "ns", "ns")
    entered = math.inf
    for now in np.arange(0.0, 19.0, DT):
        if now < 14.0:
            stream(askers, now)
        else:
            askers.come(3, now, distance=20.0, speed=8.0)  # it can stop for the yellow
        if askers.ask(0, now) is Wait.NOT:
            entered = min(entered, now)
    assert 15.0 <= entered < 18.0


@pytest.mark.parametrize("sign", [None, SignalKind.YIELD])
def test_vehicle_that_yields_to_an_endless_stream_is_admitted_after_a_while(sign: SignalKind | None) -> None:
    askers = Askers(crossing({"s": sign} if sign else {}), "sw", "ns", "ns")
    entered = math.inf
    for now in np.arange(0.0, 60.0, DT):
        stream(askers, now)
        if askers.ask(0, now) is Wait.NOT:
            entered = min(entered, now)
    assert GIVING_WAY_PATIENCE - 5.0 < entered < GIVING_WAY_PATIENCE + 5.0


# --- room and turns -----------------------------------------------------------------------------------------------


def test_vehicle_without_room_does_not_block_later_ones() -> None:
    askers = Askers(crossing(), "sn", "ew", "we")
    askers.block(2, "n")
    assert askers.ask(0, 0.0) is Wait.NO_ROOM
    assert askers.ask(1, 0.1) is Wait.NOT
    askers.unblock(2)
    assert askers.ask(0, 0.2) is Wait.OCCUPIED
    askers.be_on(1, across("e", "w"), 1.0, 0.3)
    askers.be_on(1, way_out("w"), 8.0, 0.3)
    assert askers.ask(0, 0.4) is Wait.NOT


def test_vehicle_that_waits_for_room_keeps_its_turn() -> None:
    askers = Askers(crossing({"s": SignalKind.YIELD}), "sn", "ew", "ew", "we")
    askers.block(3, "n")
    for now in np.arange(0.0, GIVING_WAY_PATIENCE + 1.0, 0.5):
        stream(askers, now)
        assert askers.ask(0, now) is Wait.NO_ROOM
    askers.unblock(3)
    stream(askers, now)
    assert askers.ask(0, now + DT) is Wait.NOT  # as if it had given way to them all the time


def test_room_goes_to_the_vehicle_that_waited_first() -> None:
    askers = Askers(crossing(), "wn", "sn", "ns")
    askers.block(2, "n")
    for now in (0.0, 0.1, 0.2):
        if now > 0.05:
            assert askers.ask(0, now) is Wait.NO_ROOM  # it came later and happens to ask first
        assert askers.ask(1, now) is Wait.NO_ROOM
    askers.unblock(2)
    assert askers.ask(0, 0.3) is Wait.TURN
    assert askers.ask(1, 0.3) is Wait.NOT


def test_vehicle_that_reroutes_for_lack_of_room_keeps_its_turn() -> None:
    askers = Askers(crossing({"s": SignalKind.YIELD}), "sn", "ew", "ew", "we")
    askers.block(3, "n")
    for now in np.arange(0.0, GIVING_WAY_PATIENCE + 1.0, 0.5):
        stream(askers, now)
        assert askers.ask(0, now) is Wait.NO_ROOM
    askers.ways = ("sw", *askers.ways[1:])
    askers.world.vehicles[0].plan[1:3] = across("s", "w"), way_out("w")
    assert askers.ask(0, now + DT) is Wait.NOT


@pytest.mark.parametrize("on_its_way", [0.3, 2.6, 4.0])
def test_vehicle_on_its_way_to_a_lane_takes_up_room_there(on_its_way: float) -> None:
    """Also in the moment in which it begins to follow the lane, but is not in the lane's list yet."""
    askers = Askers(crossing(), "sn", "wn", "ns")
    askers.block(2, "n")
    blocker, first = askers.world.vehicles[2], askers.world.vehicles[0]
    blocker.own_station = blocker.station = 20.0
    rebuild(askers.town, askers.world)
    assert askers.ask(0, 0.0) is Wait.NOT
    askers.be_on(0, across("s", "n"), 1.0, 0.1)
    connector = across("s", "n")
    first.lane, first.own_station = connector, float(askers.town.lanes[connector].length) - on_its_way
    first.station = first.own_station
    rebuild(askers.town, askers.world)
    if on_its_way < 3.0:
        first.plan[0], first.station = way_out("n"), -on_its_way
    assert askers.ask(1, 0.2) is Wait.NO_ROOM


def test_first_come_is_first_served() -> None:
    askers = Askers(crossing(), "sw", "ew", "ns")
    assert askers.ask(0, 0.0) is Wait.NOT
    askers.be_on(0, across("s", "w"), 5.0, 0.05)
    assert askers.ask(2, 0.1) is Wait.OCCUPIED
    assert askers.ask(1, 0.2) is Wait.OCCUPIED
    assert askers.ask(2, 0.2) is Wait.OCCUPIED
    askers.be_on(0, way_out("w"), 5.0, 0.3)
    assert askers.ask(1, 0.3) is Wait.TURN  # it asks first but came later
    assert askers.ask(2, 0.3) is Wait.NOT


def test_unused_permission_lapses() -> None:
    askers = Askers(crossing(), "sn", "ew")
    assert askers.ask(0, 0.0) is Wait.NOT
    for now in np.arange(0.1, 3.0, 0.1):
        assert askers.ask(1, now) is (Wait.OCCUPIED if now < LAPSE + 0.15 else Wait.NOT)
        askers.be_on(0, way_in("s"), 100.0, now)  # it stands and asks no more
    assert askers.world.vehicles[0].claim < 0


# --- U-turns ------------------------------------------------------------------------------------------------------


def test_closed_junction_admits_only_the_ego() -> None:
    askers = Askers(crossing(), "ns", "sn", "sn")
    askers.world.vehicles[0].kind = Kind.DRIVEN
    junction = int(askers.town.lanes[across("s", "n")].junction)
    assert close(askers.town, askers.world, junction)
    assert askers.ask(1, 0.5) is Wait.CLOSED
    assert askers.ask(0, 0.5, distance=20.0, speed=5.0) is Wait.NOT
    askers.world.vehicles[0].claim = -1
    assert askers.ask(1, 0.5 + LAPSE + 0.1) is Wait.NOT
    assert not close(askers.town, askers.world, junction)  # not empty any more
    assert askers.ask(2, 0.6 + LAPSE) is Wait.CLOSED
