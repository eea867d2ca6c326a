"""Settings of the world."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.support.copying import shared

FRAME_RATE = 30
"""Physics substeps, and frames of a recording, a second (paper, appendix B.2)."""

FRAME_COLUMNS = ("frame", "x", "y", "heading", "speed", "throttle", "steer", "brake", "lane")
"""Columns of the ego's trajectory: metres, radians, m/s, normalised controls; `lane` is the lane's id."""


@shared
@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """Settings of the world.

    Attributes:
        vehicles: background vehicles, about one in eight a cyclist, as many as fit.
        pedestrians: pedestrians, as many as fit.
        cruise_speed: cruise speed of the ego at the start [km/h], a multiple of 5 in 5..90. In a town without a cruise
            speed of its own (`Town.cruise`), the ego follows the speed limits instead of the default until another
            speed is set.
        collisions_stop: duration of the ego's standstill after a collision [s].
    """

    vehicles: int = 10
    pedestrians: int = 4
    cruise_speed: float = 40.0
    collisions_stop: float = 3.0

    def __post_init__(self) -> None:
        if not 0 <= self.vehicles <= 200:
            raise ValueError(f"WorldConfig.vehicles is {self.vehicles}; it must be in 0..200")
        if not 0 <= self.pedestrians <= 200:
            raise ValueError(f"WorldConfig.pedestrians is {self.pedestrians}; it must be in 0..200")
        if not 5.0 <= self.cruise_speed <= 90.0 or self.cruise_speed % 5:
            raise ValueError(
                f"WorldConfig.cruise_speed is {self.cruise_speed}; it must be a multiple of 5 in 5..90 km/h"
            )
        if not 0.0 <= self.collisions_stop <= 60.0:
            raise ValueError(f"WorldConfig.collisions_stop is {self.collisions_stop}; it must be in 0..60 s")
