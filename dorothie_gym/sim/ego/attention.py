"""Attention of the car's automatic braking with `AutomaticBraking.PERCEIVED`: what its sensors have in view, and when.

The sensors are as low as the bumper: a vehicle hides what is behind it, also people whom the passengers see over it.
The brakes act on a body that has been in view for a while: automatic emergency brakes confirm an object in several
frames, and a driver takes 0.7 to 1.5 s to brake after a signal (Green, Transportation Human Factors 2, 2000).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.state.codes import VEHICLES, Group, Wait
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import SeenRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays

VIEW_PAUSE = 6
"""Interruption of the view of a body after which it must be noticed again [frames]."""


class ViewedBody(Protocol):
    """Record of a body with the frames in which it was in view."""

    view_since: int
    view_last: int


@compiled
def keep_noticed(world: WorldArrays, seen: int) -> int:
    """Removes the bodies that the automatic braking has not noticed from the list of perceived bodies.

    Args:
        world: arrays of the world; the list `seen` and the frames of view of the bodies are written.
        seen: number of perceived bodies.

    Returns:
        Number of bodies left, in the same order.
    """
    frame = int(world.clock[0].frame)
    for n in range(seen):
        world.seen[n].hidden = _is_hidden(world, n)
    kept = 0
    for n in range(seen):
        body = world.seen[n]
        if not body.hidden and _note_view(world, body, frame):
            if kept < n:
                _copy(world.seen[kept], body)
            kept += 1
    return kept


@inlined
def _note_view(world: WorldArrays, body: SeenRecord, frame: int) -> bool:
    """Notes that a body is in view; returns whether it has been so for long enough."""
    if body.group == Group.VEHICLES:
        vehicle = world.vehicles[body.body]
        if frame - vehicle.view_last > VIEW_PAUSE:
            vehicle.view_since = frame
        vehicle.view_last = frame
        since = vehicle.view_since
    elif body.group == Group.PEDESTRIANS:
        walker = world.pedestrians[body.body]
        if frame - walker.view_last > VIEW_PAUSE:
            walker.view_since = frame
        walker.view_last = frame
        since = walker.view_since
    else:
        prop = world.props[body.body]
        if frame - prop.view_last > VIEW_PAUSE:
            prop.view_since = frame
        prop.view_last = frame
        since = prop.view_since
    return bool(frame - since >= world.car[0].attention)


@inlined
def is_noticed(world: WorldArrays, body: ViewedBody) -> bool:
    """Returns whether the braking acts on a body: always, or with `AutomaticBraking.PERCEIVED` after it was noticed."""
    car, frame = world.car[0], world.clock[0].frame
    in_view = frame - body.view_last <= VIEW_PAUSE and frame - body.view_since >= car.attention
    return bool(not car.attentive or in_view)


@inlined
def passes_line(world: WorldArrays, wait: int) -> bool:
    """Passes a line at which the ego should wait for a light or a stop sign, because it has been started before it.

    The others take it for one that has been let in.

    Args:
        world: arrays of the world.
        wait: reason to wait, a `Wait`.

    Returns:
        Whether the ego passes.
    """
    if wait != Wait.LIGHT and wait != Wait.STOP_SIGN:
        return False
    vehicle, now = world.vehicles[0], world.clock[0].time
    vehicle.claim, vehicle.claim_since, vehicle.claim_asked = vehicle.approach, now, now
    return True


@inlined
def _is_hidden(world: WorldArrays, n: int) -> bool:
    """Returns whether a nearer vehicle covers the centre of the n-th perceived body."""
    ego, body = world.vehicles[0], world.seen[n]
    x, y = ego.x + 0.5 * ego.length * ego.cos, ego.y + 0.5 * ego.length * ego.sin
    for m in range(n):
        other = world.seen[m]
        if other.kind == VEHICLES and abs(other.height - body.height) <= LEVEL_HEIGHT:
            if _crosses(other, x, y, body.x, body.y):
                return True
    return False


@compiled
def _crosses(box: SeenRecord, x: float, y: float, to_x: float, to_y: float) -> bool:
    """Returns whether a line crosses the outline of a body: the slab method (Kay and Kajiya 1986), in the plane."""
    dx, dy = x - box.x, y - box.y
    along, across = dx * box.cos + dy * box.sin, dy * box.cos - dx * box.sin
    dx, dy = to_x - x, to_y - y
    way, side = dx * box.cos + dy * box.sin, dy * box.cos - dx * box.sin
    first, last = 0.0, 1.0
    for axis in range(2):
        begin, step = (along, way) if axis == 0 else (across, side)
        half = 0.5 * (box.length if axis == 0 else box.width)
        if abs(step) < 1e-9:
            if abs(begin) > half:
                return False
            continue
        one, two = (-half - begin) / step, (half - begin) / step
        first, last = max(first, min(one, two)), min(last, max(one, two))
        if first > last:
            return False
    return True


@inlined
def _copy(here: SeenRecord, other: SeenRecord) -> None:
    here.distance2, here.x, here.y, here.heading = other.distance2, other.x, other.y, other.heading
    here.cos, here.sin, here.speed, here.length = other.cos, other.sin, other.speed, other.length
    here.width, here.height, here.kind, here.key = other.width, other.height, other.kind, other.key
    here.body, here.group = other.body, other.group
