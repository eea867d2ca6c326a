"""Settings of the world."""

from __future__ import annotations

import enum
from dataclasses import asdict, dataclass

from dorothie_gym.support.copying import shared

FRAME_RATE = 30
"""Physics substeps, and frames of a recording, a second (paper, appendix B.2)."""

FAULT_SECONDS = 30.0
"""Duration of a sensor fault [s] (design)."""

FRAME_COLUMNS = ("frame", "x", "y", "heading", "speed", "throttle", "steer", "brake", "lane")
"""Columns of the ego's trajectory: metres, radians, m/s, normalised controls; `lane` is the lane's id."""


class AutomaticBraking(enum.StrEnum):
    """Extent of the car's automatic braking."""

    COMPLETE = "complete"
    """For all bodies in sight, for red lights and stop signs; the car slows down in poor sight."""
    PERCEIVED = "perceived"
    """For bodies that its sensors have had in view for `WorldConfig.braking_delay`. Bodies behind vehicles are hidden
    from the sensors. The car keeps its speed in poor sight, and the action Start close to a red light or a stop sign
    passes it."""


@shared
@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """Settings of the world.

    Attributes:
        vehicles: background vehicles, about one in eight a cyclist, as many as fit.
        pedestrians: pedestrians, as many as fit.
        density: upper bound of vehicles, and of pedestrians, per km of lanes outside junctions; None for no bound. It
            keeps the same numbers from blocking small towns.
        cruise_speed: cruise speed of the ego at the start [km/h], a multiple of 5 in 5..90. In a town without a cruise
            speed of its own (`Town.cruise`), the ego follows the speed limits instead of the default until another
            speed is set.
        collisions_stop: duration of the ego's standstill after a collision [s].
        braking: extent of the car's automatic braking; also as text.
        braking_delay: time for which a body must be in view before `AutomaticBraking.PERCEIVED` acts on it [s].
    """

    vehicles: int = 10
    pedestrians: int = 4
    density: float | None = None
    cruise_speed: float = 40.0
    collisions_stop: float = 3.0
    braking: AutomaticBraking = AutomaticBraking.COMPLETE
    braking_delay: float = 1.0

    def __post_init__(self) -> None:
        if not 0 <= self.vehicles <= 200:
            raise ValueError(f"WorldConfig.vehicles is {self.vehicles}; it must be in 0..200")
        if not 0 <= self.pedestrians <= 200:
            raise ValueError(f"WorldConfig.pedestrians is {self.pedestrians}; it must be in 0..200")
        if self.density is not None and not 0.0 < self.density <= 200.0:
            raise ValueError(
                f"WorldConfig.density is {self.density}; it must be above 0 and at most 200 per km, or None"
            )
        if not 5.0 <= self.cruise_speed <= 90.0 or self.cruise_speed % 5:
            raise ValueError(
                f"WorldConfig.cruise_speed is {self.cruise_speed}; it must be a multiple of 5 in 5..90 km/h"
            )
        if not 0.0 <= self.collisions_stop <= 60.0:
            raise ValueError(f"WorldConfig.collisions_stop is {self.collisions_stop}; it must be in 0..60 s")
        if self.braking not in (kinds := list(map(str, AutomaticBraking))):
            raise ValueError(f"WorldConfig.braking is {self.braking!r}; it must be {' or '.join(kinds)}")
        object.__setattr__(self, "braking", AutomaticBraking(self.braking))
        if not 0.0 <= self.braking_delay <= 5.0:
            raise ValueError(f"WorldConfig.braking_delay is {self.braking_delay}; it must be in 0..5 s")

    def crowd(self, km: float) -> tuple[int, int]:
        """Returns the numbers of vehicles and of pedestrians in a town with a length of lanes [km]."""
        most = 200 if self.density is None else round(self.density * km)
        return min(self.vehicles, most), min(self.pedestrians, most)

    def record(self) -> dict[str, object]:
        """Returns the settings in JSON types, for records; without the usual density and braking."""
        settings = asdict(self)
        if self.density is None:
            del settings["density"]
        braking = settings.pop("braking")
        if braking is AutomaticBraking.COMPLETE:
            del settings["braking_delay"]
            return settings
        return {**settings, "braking": str(braking)}
