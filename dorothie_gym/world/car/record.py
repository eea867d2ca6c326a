"""What drives the session's car, `kernel.records.CAR`, as Python reads and writes it: some fields at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.world.kernel.records import fields

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.world_arrays import WorldArrays


class CarRecord:
    """Groups of fields: ``.item()`` of one is a tuple of numbers, and ``[()] = numbers`` writes one (`fields`).

    Attributes:
        orders: action, action_end, cruise, held and manual: what the car is to do.
        pedals: throttle, steer and brake, where it is driven by hand.
        place: s, offset and roadblock: where it is on its path, and how far ahead a roadblock is.
        hazard: hazard and hazard_gap: what it stops for.
        outcome: events and collisions: how many.
        air: friction, wind, wind_heading and wind_phase: what the weather does to it.
    """

    def __init__(self, arrays: WorldArrays) -> None:
        """Shows the record in the arrays of a world."""
        self.orders = fields(arrays.car, "action", "action_end", "cruise", "held", "manual")
        self.pedals = fields(arrays.car, "throttle", "steer", "brake")
        self.place = fields(arrays.car, "s", "offset", "roadblock")
        self.hazard = fields(arrays.car, "hazard", "hazard_gap")
        self.outcome = fields(arrays.car, "events", "collisions")
        self.air = fields(arrays.car, "friction", "wind", "wind_heading", "wind_phase")
