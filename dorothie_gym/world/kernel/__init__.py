"""The traffic of a town, stepped by compiled loops over arrays.

`town_arrays` reads a town once; a `WorldArrays` is the state of one world in it, filled by `populate` or the `add_...`
functions; `step` lets it go on. Compiled and in plain Python (``NUMBA_DISABLE_JIT=1``) the result is the same, byte by
byte, and it is a function of the state alone: of seed and actions, not of the process or the order of worlds.
"""

from dorothie_gym.world.kernel.editing import (
    add_pedestrian,
    add_prop,
    add_street_walker,
    add_vehicle,
    move_prop,
    remove_pedestrian,
    remove_prop,
    remove_vehicle,
)
from dorothie_gym.world.kernel.populating import populate
from dorothie_gym.world.kernel.records import Footway, Kind, Wait, Walk
from dorothie_gym.world.kernel.stepping import step
from dorothie_gym.world.kernel.town_arrays import TownArrays, town_arrays
from dorothie_gym.world.kernel.world_arrays import WorldArrays, empty_world, grown

__all__ = [
    "Footway", "Kind", "TownArrays", "Wait", "Walk", "WorldArrays", "add_pedestrian", "add_prop", "add_street_walker",
    "add_vehicle", "empty_world", "grown", "move_prop", "populate", "remove_pedestrian", "remove_prop",
    "remove_vehicle", "step", "town_arrays",
]  # fmt: skip
