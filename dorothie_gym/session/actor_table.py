"""Table of the actors around the car of a world, as it is recorded (compiled)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.session.recording.surroundings import ACTOR_DTYPE, ActorKind
from dorothie_gym.sim.bodies import Pedestrian
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.support.compilation import compiled, fixed

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.world_arrays import WorldArrays
    from dorothie_gym.sim.world import World

_CAR, _CYCLIST, _NO_WALK = int(Kind.CAR), int(Kind.CYCLIST), int(Walk.EMPTY)
_VEHICLE, _RIDER, _WALKER, _PROP = (
    int(kind) for kind in (ActorKind.VEHICLE, ActorKind.CYCLIST, ActorKind.PEDESTRIAN, ActorKind.PROP)
)
_WALKER_LENGTH, _WALKER_WIDTH = float(Pedestrian.LENGTH), float(Pedestrian.WIDTH)

_COLUMNS: Final = len(ACTOR_DTYPE.names or ())
"""Number of columns of `ACTOR_DTYPE`, all of eight bytes: key and kind, then six numbers."""


@compiled
def write_actors(world: WorldArrays, whole: NDArray[np.int64], values: Array) -> int:
    """Writes vehicles, pedestrians and props without the ego; returns their number.

    Args:
        world: arrays of the world.
        whole: (n, 8) the table as whole numbers: its columns key and kind are written.
        values: (n, 8) the same table as floating-point numbers: its other columns are written.
    """
    count = 0
    for row in range(len(world.vehicles)):
        car = world.vehicles[row]
        if car.kind == _CAR or car.kind == _CYCLIST:
            whole[count, 0], whole[count, 1] = car.key, _VEHICLE if car.kind == _CAR else _RIDER
            values[count, 2], values[count, 3], values[count, 4] = car.x, car.y, car.heading
            values[count, 5], values[count, 6], values[count, 7] = car.speed, car.length, car.width
            count += 1
    for row in range(len(world.pedestrians)):
        walker = world.pedestrians[row]
        if walker.state != _NO_WALK:
            whole[count, 0], whole[count, 1] = walker.key, _WALKER
            values[count, 2], values[count, 3], values[count, 4] = walker.x, walker.y, walker.heading
            values[count, 5], values[count, 6], values[count, 7] = walker.speed, _WALKER_LENGTH, _WALKER_WIDTH
            count += 1
    for row in range(len(world.props)):
        prop = world.props[row]
        if prop.present:
            whole[count, 0], whole[count, 1] = prop.key, _PROP
            values[count, 2], values[count, 3], values[count, 4] = prop.x, prop.y, prop.heading
            values[count, 5], values[count, 6], values[count, 7] = 0.0, prop.length, prop.width
            count += 1
    return count


_write_actors = fixed(write_actors)


def actors_around(world: World) -> NDArray[np.void]:
    """Returns vehicles, pedestrians and props without the ego as rows of `ACTOR_DTYPE` (n,)."""
    arrays = world.actors.arrays
    whole = np.empty((len(arrays.vehicles) + len(arrays.pedestrians) + len(arrays.props), _COLUMNS), dtype=np.int64)
    count = _write_actors(arrays, whole, whole.view(np.float64))
    return whole[:count].view(ACTOR_DTYPE).reshape(-1)
