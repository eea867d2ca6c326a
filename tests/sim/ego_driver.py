"""Perfect instructions for the ego, from the map, the route and the true pose."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.maps import Site, Town
from dorothie_gym.maps.routing import LaneEntry, Leg, router
from dorothie_gym.ontology import ARRIVAL_DISTANCE, PhysicalAction
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.ego_controller import GoalAhead, LocalPlanner
from dorothie_gym.sim.ego.limits import LEAD, u_turn_braking
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.town_arrays import town_arrays
from tests.sim.driving import Trip, on_lane

Instruction = tuple[PhysicalAction, int]

FRAMES = 15

DECISION = FRAMES / FRAME_RATE
"""An instruction is given at most this often [s]."""

STRAIGHT = {LaneEntry.CHANGE_LEFT: 90, LaneEntry.CHANGE_RIGHT: -90}


def guided_trip(roads: TownNetwork, start: Site, goal: Site, *, most: float = 1200.0) -> Trip:
    """Drives from one site to another without others; the ego has arrived when it stands beside the goal.

    Args:
        roads: the town.
        start: departure of the ego.
        goal: destination.
        most: longest duration [s].
    """
    world = on_lane(roads, start.lane, start.station)
    car, ego, planner = world.car, world.ego, world.planner
    ego.cruise = 60.0
    ego.set_goals([GoalAhead(lane=goal.lane, station=goal.station)])
    worst = 0.0
    for _ in range(round(most / DECISION)):
        speed = float(car.speed)
        if planner.held and speed < 0.1:
            if math.dist(car.position, goal.waypoint) <= ARRIVAL_DISTANCE:
                return Trip(world, worst, True)
            planner.command(PhysicalAction.START, 0, speed)
        instruction = _next(roads, planner, goal, speed)
        if instruction is not None:
            planner.command(*instruction, speed)
        world.step(FRAMES)
        worst = max(worst, float(np.abs(world.offsets).max()))
    return Trip(world, worst, False)


def _next(roads: TownNetwork, planner: LocalPlanner, goal: Site, speed: float) -> Instruction | None:
    """Returns the next instruction, if there is one."""
    town, ways = roads.town, town_arrays(roads).ways
    if planner.held or town.lanes[planner.lane].in_junction:
        return None
    left = goal.station - planner.station
    turning_round = planner.in_manoeuvre and planner.manoeuvre[0] is PhysicalAction.U_TURN
    if planner.lane == goal.lane and not turning_round and -1.0 < left <= 0.56 * speed + speed**2 / 6.0 + 0.3:
        return PhysicalAction.STOP, 0
    route = router(town).route((planner.lane, planner.station), (goal.lane, goal.station))
    assert route is not None, (planner.lane, planner.station, goal)
    for before, leg in zip(route.legs, route.legs[1:], strict=False):
        if leg.entry is not LaneEntry.FOLLOW:
            return _aside(planner, before, leg, speed)
        if town.lanes[leg.lane].in_junction and ways[before.lane].offers:
            (angle,) = (way.angle for way in town.exits(before.lane) if way.connector == leg.lane)
            return None if planner.turn_ahead == angle else (PhysicalAction.J_TURN, angle)
    return None


def _aside(planner: LocalPlanner, before: Leg, leg: Leg, speed: float) -> Instruction | None:
    """A lane switch or U-turn, when the car is where it is to begin."""
    busy = planner.in_manoeuvre or planner.manoeuvre[0] not in (None, PhysicalAction.J_TURN)
    if busy or before.lane != planner.lane:
        return None
    left = before.end - planner.station
    if leg.entry is LaneEntry.U_TURN:
        braking = LEAD + u_turn_braking(speed)
        return (PhysicalAction.U_TURN, 0) if left <= max(3.0, braking + DECISION * speed) else None
    if left > max(3.0, 0.8 * speed):
        return None
    return PhysicalAction.LANE_SWITCH, STRAIGHT[leg.entry]


def random_pair(town: Town, seed: int) -> tuple[Site, Site]:
    """Two different sites."""
    one, other = np.random.default_rng(seed).choice(len(town.sites), size=2, replace=False)
    return town.sites[int(one)], town.sites[int(other)]
