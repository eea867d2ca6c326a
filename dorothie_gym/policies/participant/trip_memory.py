"""Memory of the trip so far: where the car has driven, and where errands were done."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.policies.policy import replace
from dorothie_gym.support import portable_math as pm

PASSED_WITHIN: Final = 25.0
"""Distance within which a place at the road was passed [m]."""

UNDER_WAY: Final = 30.0
"""Time after naming a destination, or hearing how far it is, before which nobody asks for that [s]."""

_STEP: Final = 12.0  # between remembered positions [m]
_LEFT_BEHIND: Final = 80.0  # distance from which on a place has been passed, and not just reached [m]
_NEAR_STOP: Final = 130.0  # distance up to which a place is near an earlier stop [m]


@dataclass(frozen=True, kw_only=True)
class TripMemory:
    """Trip so far.

    Attributes:
        trail: positions of the car (x, y), some metres apart [m].
        stops: landmarks at which errands were done, in order.
        began_standing: time since which the car has been standing [s]; infinity while it moves.
        waited: duration of the last standstill that has ended [s], and its end.
    """

    trail: tuple[tuple[float, float], ...] = ()
    stops: tuple[SeenLandmark, ...] = ()
    began_standing: float = math.inf
    waited: tuple[float, float] = (0.0, -math.inf)

    def moved(self, position: tuple[float, float], now: float, *, standing: bool) -> TripMemory:
        """Records the position of the car [m] at a time [s]."""
        if standing:
            return replace(self, began_standing=now) if self.began_standing == math.inf else self
        changed = self
        if self.began_standing != math.inf:
            changed = replace(self, began_standing=math.inf, waited=(now - self.began_standing, now))
        last = changed.trail[-1] if changed.trail else None
        if last is None or pm.hypot(last[0] - position[0], last[1] - position[1]) >= _STEP:
            return replace(changed, trail=(*changed.trail, position))
        return changed

    def after_stop(self, mark: SeenLandmark) -> TripMemory:
        """Records an errand done at a landmark."""
        return replace(self, stops=(*self.stops, mark))

    def has_passed(self, mark: SeenLandmark) -> bool:
        """Returns whether the car has driven past a place on this trip without an errand, and is away from it."""
        if not self.trail or any(stop.row == mark.row for stop in self.stops):
            return False
        here = self.trail[-1]
        if pm.hypot(here[0] - mark.x, here[1] - mark.y) < _LEFT_BEHIND:
            return False
        return any(pm.hypot(x - mark.x, y - mark.y) < PASSED_WITHIN for x, y in self.trail)

    def stop_near(self, mark: SeenLandmark) -> SeenLandmark | None:
        """Returns the last stop if it is near a place."""
        last = self.stops[-1] if self.stops else None
        if last is None or last.row == mark.row or pm.hypot(last.x - mark.x, last.y - mark.y) > _NEAR_STOP:
            return None
        return last
