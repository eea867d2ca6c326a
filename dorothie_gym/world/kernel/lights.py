"""What the traffic lights show: `Town.light`, whose phases are looked up again only when they have ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

EARLY = 1e-6
"""A phase is looked up anew this long before it ends, lest rounding matters [s]."""


@compiled
def phase_at(town: TownArrays, number: int, time: float) -> tuple[int, float]:
    """Phase of a programme at a time [s], and how long it still lasts [s]."""
    programme = town.programmes[number]
    now = (time - programme.offset) % programme.cycle
    for k in range(programme.phases):
        end = town.phase_ends[programme.phase + k]
        if now < end:
            return k, end - now
    return 0, 0.0


@compiled
def light(town: TownArrays, world: WorldArrays, number: int, time: float) -> int:
    """`Colour` of the light at the end of a lane at the present time or later; green where there is none."""
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
