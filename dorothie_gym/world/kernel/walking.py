"""People on foot: they walk along footways, round corners, and now and then over a road.

They walk towards a place a little ahead on their way, past one another, and keep their distance from everything.
Everybody decides anew every `PACE` substeps, in turns, and walks straight on in between.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.crossing import comes_to_crosswalk, cross, wait
from dorothie_gym.world.kernel.footways import enter_next, find_segment, locate, place_beside, side_kept
from dorothie_gym.world.kernel.pacing import AHEAD, note_progress, walk_towards
from dorothie_gym.world.kernel.records import NOBODY, Footway, Records, Walk
from dorothie_gym.world.kernel.straying import steps_out, stray

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

PACE = 5
"""Substeps between two decisions of a pedestrian."""

BLOCKED = 3.0
"""Who has been kept from walking on for this long turns round [s]."""

CORNER = 0.5
"""One turns the corner this far before the end of a footway [m]."""


@inlined
def walk(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Moves all pedestrians on by `dt` [s], and counts who is on which crosswalk, and who strays."""
    clock, busy = world.clock[0], world.busy
    clock.straying = 0
    for c in range(len(busy)):
        busy[c] = 0
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state == Walk.EMPTY:
            continue
        if not walker.crashed:
            if (clock.frame + p) % PACE == 0:
                _decide(town, world, p, PACE * dt)
            if walker.speed > 0.0:
                step = walker.speed * dt
                walker.x += walker.cos * step
                walker.y += walker.sin * step
                walker.odometer += step
        if walker.state == Walk.CROSSING:
            busy[walker.crossing] += 1
        elif walker.state == Walk.STRAYING:
            clock.straying += 1


@compiled
def _decide(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """What a pedestrian does for some time [s]."""
    walker = world.pedestrians[p]
    note_progress(walker, time)
    if walker.state == Walk.WALKING:
        _stroll(town, world, p, time)
    elif walker.state == Walk.WAITING:
        wait(town, world, p, time)
    elif walker.state == Walk.CROSSING:
        cross(town, world, p, time)
    else:
        stray(town, world, p, time)


@inlined
def _stroll(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks along a footway, and onto the next one or back at its end."""
    walker = world.pedestrians[p]
    lateral = locate(town, walker)
    way = town.walks[walker.walk]
    if walker.station > way.length - CORNER if walker.direction > 0.0 else walker.station < CORNER:
        enter_next(town, walker)
        lateral = locate(town, walker)
        way = town.walks[walker.walk]
    if way.kind == Footway.STREET:
        if steps_out(town, world, walker, time):
            return
    elif walker.waited >= 0.0 and comes_to_crosswalk(town, walker, way, time):
        return
    x, y, cos, sin = place_beside(town, walker, walker.station + walker.direction * AHEAD, side_kept(way))
    if walk_towards(world, p, x, y, cos, sin, walker.direction * lateral, way.half_width, time):
        walker.waited = min(walker.waited + time, 0.0)
        return
    walker.waited += time
    if walker.waited > BLOCKED:
        walker.direction, walker.waited = -walker.direction, 0.0


@compiled
def place_walker(town: TownArrays, walker: Records) -> None:
    """Puts a pedestrian where its footway and station say, with nothing of its past but its random numbers."""
    walker.state, walker.crossing, walker.crashed, walker.mouth = Walk.WALKING, NOBODY, False, 0
    walker.waited, walker.staying, walker.crash_age, walker.far = 0.0, 0.0, 0.0, 0.0
    way = town.walks[walker.walk]
    find_segment(town, walker)
    walker.x, walker.y, walker.cos, walker.sin = place_beside(town, walker, walker.station, side_kept(way))
    locate(town, walker)
    walker.heading = math.atan2(walker.sin, walker.cos)
    walker.left_x, walker.left_y = walker.x, walker.y
    walker.speed = 0.0
