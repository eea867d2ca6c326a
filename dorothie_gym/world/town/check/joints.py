"""Whether lanes that are linked meet: in the plane, in height and in direction."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dorothie_gym.world.town.check.fault import Fault, FaultKind
from dorothie_gym.world.town.model import Town

MAX_GAP = 0.05
"""Largest distance in the plane between the ends of linked lanes [m]; demanded of the towns."""

MAX_STEP = 0.05
"""Largest step in the road [m]: more is felt as a lowered kerb is, which is built 2 to 5 cm high."""

MAX_KINK = math.radians(5.0)
"""Largest sudden change of direction [rad]; demanded of the towns."""

_SLACK = 1e-9
"""Rounding that is no fault [m or rad]."""


def joint_faults(town: Town) -> Iterator[Fault]:
    """Gaps, steps and kinks between lanes that are linked, lane changes left out."""
    for link in town.links:
        if link.type.is_lane_change:
            continue
        source, target = town.lanes[link.source], town.lanes[link.target]
        (x, y, z), (u, v, w) = source.points[-1], target.points[0]
        lanes, position = (source.id, target.id), (float(x), float(y))
        pair = f"lane {target.id} begins"
        gap = math.hypot(u - x, v - y)
        if gap > MAX_GAP + _SLACK:
            message = f"{pair} {gap:.2f} m from the end of lane {source.id}"
            yield Fault(kind=FaultKind.GAP, lanes=lanes, position=position, message=message)
        if abs(w - z) > MAX_STEP + _SLACK:
            message = f"{pair} {abs(w - z):.2f} m {'above' if w > z else 'below'} the end of lane {source.id}"
            yield Fault(kind=FaultKind.HEIGHT_STEP, lanes=lanes, position=position, message=message)
        turn = math.remainder(float(target.headings[0] - source.headings[-1]), math.tau)
        if abs(turn) > MAX_KINK + _SLACK:
            side = "right" if turn > 0 else "left"
            message = f"{pair} {math.degrees(abs(turn)):.1f} degrees to the {side} of the end of lane {source.id}"
            yield Fault(kind=FaultKind.KINK, lanes=lanes, position=position, message=message)
