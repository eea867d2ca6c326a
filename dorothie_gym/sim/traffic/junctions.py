"""Admission to junctions: lights, signs, right of way, order of arrival, room beyond the junction.

Lights and signs come first, then priority, then the order of arrival. Vehicles with crossing paths are never admitted
together: one that is crossing clears the junction first.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.traffic_light_programs import YELLOW_BRAKING
from dorothie_gym.sim.state.codes import NOBODY, Colour, Kind, Relation, TrafficControl, Wait
from dorothie_gym.sim.traffic.parameters import (
    AFTER_END,
    AT_LINE,
    CLOSED,
    COMFORT,
    CRITICAL_GAP,
    CYCLIST_ACCELERATION,
    GIVING_WAY_PATIENCE,
    HARDEST_BRAKING,
    LAPSE,
    OVER_LINE,
    ROOM_BEHIND,
    ROOM_EACH,
    ROOM_SIGHT,
    SLOW,
    SNEAKING,
    START,
    TRAFFIC_STANDING,
    UNUSED,
)
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays


EARLY = 1e-6
"""Time before the end of a phase at which it is looked up again, so that rounding does not matter [s]."""


@compiled
def phase_at(town: TownArrays, number: int, time: float) -> tuple[int, float]:
    """Returns the phase of a programme at a time [s], and its remaining duration [s]."""
    programme = town.programmes[number]
    now = (time - programme.offset) % programme.cycle
    for k in range(programme.phases):
        end = town.phase_ends[programme.phase + k]
        if now < end:
            return k, end - now
    return 0, 0.0


@compiled
def colour_at(town: TownArrays, number: int, time: float) -> int:
    """Returns the `Colour` of the light at the end of a lane at any time [s]; -1 if there is none."""
    lane = town.lanes[number]
    if lane.programme < 0:
        return -1
    programme = town.programmes[lane.programme]
    phase, _ = phase_at(town, lane.programme, time)
    return int(town.colours[programme.colour + phase * programme.slots + lane.slot])


@compiled
def light(town: TownArrays, world: WorldArrays, number: int, time: float) -> int:
    """Returns the `Colour` of the light at the end of a lane, now or at a later time; green if there is no light."""
    lane = town.lanes[number]
    if lane.programme < 0:
        return 0  # Colour.GREEN
    lamp = world.lamps[lane.programme]
    now = world.clock[0].time
    if now >= lamp.until:
        lamp.phase, left = phase_at(town, lane.programme, now)
        lamp.until = now + left - EARLY
    phase = lamp.phase
    if time != now:
        phase, _ = phase_at(town, lane.programme, time)
    programme = town.programmes[lane.programme]
    return int(town.colours[programme.colour + phase * programme.slots + lane.slot])


# --- Admission --------------------------------------------------------------------------------------------------------

CLEAR = 0.5
"""Distance of a vehicle's rear beyond a junction at which the vehicle has left it [m]."""


@inlined
def announce(vehicle: VehicleRecord, lane: int, connector: int, distance: float, now: float) -> None:
    """Announces a vehicle on a lane to a connector, its front `distance` [m] before it."""
    if vehicle.approach != connector or vehicle.approach_lane != lane:
        if vehicle.approach < 0 or vehicle.approach_lane != lane:
            vehicle.stood = False
            vehicle.since, vehicle.asked = math.inf, -math.inf
        vehicle.approach, vehicle.approach_lane, vehicle.wait = connector, lane, Wait.NOT
    vehicle.distance, vehicle.seen = distance, now
    if vehicle.speed < TRAFFIC_STANDING and distance < AT_LINE:
        vehicle.stood = True


@inlined
def forget(vehicle: VehicleRecord) -> None:
    """Withdraws the announcement of a vehicle."""
    vehicle.approach, vehicle.approach_lane, vehicle.stood, vehicle.wait = NOBODY, NOBODY, False, Wait.NOT


@compiled
def request(town: TownArrays, world: WorldArrays, i: int, k: int) -> int:
    """Requests the connector that was announced, the `k`-th lane of the plan; repeated until it is entered.

    Returns:
        The reason to wait, or `Wait.NOT`. Then no vehicle with a crossing path is admitted until this one has crossed,
        loses its green light, or does not use the permission.
    """
    vehicle = world.vehicles[i]
    now = world.clock[0].time
    if vehicle.inside == vehicle.approach:
        return Wait.NOT
    if now - vehicle.asked > LAPSE:
        vehicle.since = math.inf
    if vehicle.claim >= 0:
        if vehicle.claim != vehicle.approach or _light_stops(town, world, vehicle, now, True):
            vehicle.claim = NOBODY
        else:
            vehicle.claim_asked = vehicle.asked = now
            vehicle.wait = Wait.NOT
            return Wait.NOT
    wait = _reason_to_wait(town, world, i, k, now)
    vehicle.wait, vehicle.asked = wait, now
    if wait == Wait.NOT:
        vehicle.claim, vehicle.claim_since, vehicle.claim_asked = vehicle.approach, now, now
    return wait


@inlined
def note(town: TownArrays, vehicle: VehicleRecord, now: float) -> None:
    """Updates the connector of a vehicle: entered, left, or granted and not used."""
    followed = vehicle.plan[0]
    if vehicle.claim >= 0:
        if followed == vehicle.claim:
            vehicle.inside, vehicle.claim = followed, NOBODY
            forget(vehicle)
        else:
            if vehicle.speed > TRAFFIC_STANDING:
                vehicle.claim_since = now
            if now - vehicle.claim_since > UNUSED or now - vehicle.claim_asked > LAPSE:
                vehicle.claim = NOBODY
    if vehicle.inside >= 0 and town.lanes[followed].junction != town.lanes[vehicle.inside].junction:
        if vehicle.station > 0.5 * vehicle.length + CLEAR:
            vehicle.inside = NOBODY


@compiled
def _reason_to_wait(town: TownArrays, world: WorldArrays, i: int, k: int, now: float) -> int:
    own = world.vehicles[i]
    if _light_stops(town, world, own, now, False):
        if own.since < math.inf:
            own.since += max(now - own.asked, 0.0)
        return Wait.LIGHT
    if _has_to_stop(town, own):
        return Wait.STOP_SIGN
    own.since = min(own.since, now)
    if not has_room(town, world, i, k):
        return Wait.NO_ROOM
    if _is_closed(town, world, i, now):
        return Wait.CLOSED
    return _others(town, world, i, now)


@inlined
def _is_closed(town: TownArrays, world: WorldArrays, i: int, now: float) -> bool:
    """Returns whether the ego turns round in the junction that a vehicle other than the ego approaches."""
    if world.vehicles[i].kind == Kind.DRIVEN:
        return False
    car, junction = world.car[0], town.lanes[world.vehicles[i].approach].junction
    for c in range(CLOSED):
        if car.closed[c] == junction and now - car.closed_at[c] < LAPSE:
            return True
    return False


@compiled
def close(town: TownArrays, world: WorldArrays, junction: int) -> bool:
    """Requests a whole junction for a U-turn of the ego in its mouth; repeated as long as it is needed.

    Returns:
        Whether it is empty; then no other vehicle is admitted while this is repeated.
    """
    car, slot = world.car[0], 0
    for c in range(CLOSED):
        if car.closed[c] == junction:
            slot = c
            break
        if car.closed_at[c] < car.closed_at[slot]:
            slot = c
    car.closed[slot], car.closed_at[slot] = junction, world.clock[0].time
    for i in range(1, len(world.vehicles)):
        other = world.vehicles[i]
        if other.kind == Kind.EMPTY:
            continue
        if other.claim >= 0 and town.lanes[other.claim].junction == junction:
            return False
        if other.inside >= 0 and town.lanes[other.inside].junction == junction:
            return False
    return True


@compiled
def _others(town: TownArrays, world: WorldArrays, i: int, now: float) -> int:
    """Returns the reason to wait for other vehicles: on a crossing path, waiting for longer, or with priority."""
    own = world.vehicles[i]
    connector = town.lanes[own.approach]
    patient = now - own.since > GIVING_WAY_PATIENCE
    turn, giving = False, False
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j == i or other.kind == Kind.EMPTY:
            continue
        if relation(town, connector, other.claim) > 0 or relation(town, connector, other.inside) > 0:
            return Wait.OCCUPIED
        meeting = relation(town, connector, other.approach)
        if meeting == Relation.APART or now - other.seen >= LAPSE:
            continue
        if not turn and _comes_first(town, other, own, meeting, now):
            turn = True
        if meeting == Relation.WAITS and not patient and not giving and _is_coming(town, world, j, now):
            giving = True
    if turn:
        return Wait.TURN
    return Wait.GIVING_WAY if giving else Wait.NOT


@inlined
def relation(town: TownArrays, connector: LaneRecord, other: int) -> int:
    """Returns the `Relation` of a connector to another lane, or -1 if there is none."""
    if other < 0 or town.lanes[other].junction != connector.junction:
        return 0  # Relation.APART
    return int(town.relations[connector.relation + town.lanes[other].place])


@compiled
def _light_stops(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord, now: float, let_in: bool) -> bool:
    """Returns whether a vehicle has to stop for its light, and can; `let_in` if it was about to enter."""
    if town.lanes[vehicle.approach_lane].programme < 0 or vehicle.distance < -OVER_LINE:
        return False
    colour = light(town, world, vehicle.approach_lane, now)
    if colour == Colour.GREEN:
        return False
    braking = vehicle.speed * vehicle.speed / (2.0 * max(vehicle.distance, 0.1))
    if colour == Colour.RED or vehicle.wait == Wait.LIGHT:
        return bool(braking <= HARDEST_BRAKING)
    return bool(braking <= YELLOW_BRAKING) and not _may_sneak(town, world, vehicle, now, let_in)


@compiled
def _may_sneak(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord, now: float, let_in: bool) -> bool:
    """Returns whether a vehicle that yielded during green may use the yellow phase, if enough of it is left."""
    if now - vehicle.since <= SNEAKING or vehicle.distance >= AT_LINE:
        return False
    if let_in:
        return True
    pull = CYCLIST_ACCELERATION if vehicle.kind == Kind.CYCLIST else COMFORT
    over = now + START + math.sqrt(2.0 * max(vehicle.distance, 0.0) / pull)
    return bool(light(town, world, vehicle.approach_lane, over) == Colour.YELLOW)


@compiled
def _has_to_stop(town: TownArrays, vehicle: VehicleRecord) -> bool:
    return bool(not vehicle.stood and town.lanes[vehicle.approach_lane].control == TrafficControl.STOP)


@compiled
def _comes_first(town: TownArrays, other: VehicleRecord, own: VehicleRecord, meeting: int, now: float) -> bool:
    """Returns whether a waiting vehicle goes before another one by waiting time, regardless of priority."""
    if other.since >= own.since or now - other.asked >= LAPSE:
        return False
    if other.wait == Wait.LIGHT or other.wait == Wait.STOP_SIGN:
        return False
    if other.wait == Wait.NO_ROOM:  # delays only those that would take the room it waits for
        return _have_one_exit(town, other, own)
    if now - other.since > GIVING_WAY_PATIENCE:
        return True
    if other.wait == Wait.GIVING_WAY or meeting == Relation.WAITS:
        return False
    return bool(relation(town, town.lanes[other.approach], own.approach) != Relation.WAITS)


@inlined
def _have_one_exit(town: TownArrays, one: VehicleRecord, other: VehicleRecord) -> bool:
    """Returns whether two announced vehicles leave the junction on the same lane."""
    exit = town.lanes[one.approach].exit
    return bool(exit >= 0 and exit == town.lanes[other.approach].exit)


@compiled
def _is_coming(town: TownArrays, world: WorldArrays, j: int, now: float) -> bool:
    """Returns whether a vehicle with priority would be in the junction within the critical gap."""
    other = world.vehicles[j]
    if _light_stops(town, world, other, now, False) or _has_to_stop(town, other):
        return False
    if other.wait == Wait.GIVING_WAY or other.wait == Wait.TURN:
        return False  # it waits for others itself
    if other.wait == Wait.CLOSED or other.wait == Wait.NO_ROOM:
        return False
    if other.speed < TRAFFIC_STANDING:  # about to start, unless its path is occupied
        return bool(other.distance < AT_LINE) and not _is_occupied(town, world, j)
    return bool(other.distance < CRITICAL_GAP * other.speed)


@compiled
def _is_occupied(town: TownArrays, world: WorldArrays, i: int) -> bool:
    connector = town.lanes[world.vehicles[i].approach]
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j != i and other.kind != Kind.EMPTY:
            if relation(town, connector, other.claim) > 0 or relation(town, connector, other.inside) > 0:
                return True
    return False


@compiled
def has_room(town: TownArrays, world: WorldArrays, i: int, k: int) -> bool:
    """Returns whether there is room beyond a junction for a vehicle and all others that are heading there.

    They must fit behind the first slow vehicle, and before the next junction.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        i: the vehicle.
        k: index of the connector in its plan.
    """
    own = world.vehicles[i]
    while k < own.planned and town.lanes[own.plan[k]].junction >= 0:
        k += 1
    if k == own.planned:
        return True
    before = _heading_to(town, world, i, own.plan[k])
    start, slow, closed = 0.0, math.inf, False
    while k < own.planned and start < ROOM_SIGHT and slow == math.inf:
        lane = town.lanes[own.plan[k]]
        if lane.junction >= 0:
            closed = True
            break
        n = world.heads[own.plan[k]]
        while n >= 0:
            node = world.nodes[n]
            if node.body != i and node.station > -AFTER_END:
                if node.speed <= SLOW:
                    slow = start + node.station - node.half_length
                    break
                before += 1
            n = node.next
        start += lane.length
        k += 1
    if slow < ROOM_BEHIND + ROOM_EACH * before:
        return False
    return before == 0 or not closed or start > ROOM_EACH * (before + 0.5)


@inlined
def _is_listed(world: WorldArrays, j: int, lane: int) -> bool:
    """Returns whether `has_room` finds a vehicle in the list of a lane, which was made before this substep."""
    one, other = world.nodes[2 * j], world.nodes[2 * j + 1]
    if one.lane == lane and one.station > -AFTER_END:
        return True
    return bool(other.lane == lane and other.station > -AFTER_END)


@compiled
def _heading_to(town: TownArrays, world: WorldArrays, i: int, exit: int) -> int:
    """Returns the number of other vehicles that were admitted to the junction and leave it on a lane."""
    count = 0
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j == i or other.kind == Kind.EMPTY:
            continue
        if other.claim >= 0 and town.lanes[other.claim].exit == exit:
            count += 1
        if other.inside >= 0 and town.lanes[other.inside].exit == exit and not _is_listed(world, j, exit):
            count += 1
    return count
