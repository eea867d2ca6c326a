"""Laps: stretches of road that the car drives again and again on the way to one place."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.analysis.truth_checks.talk_cases import Case
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

TIMES: Final = 3
"""Number of passes in one direction that make a stretch a lap."""

STRETCH: Final = 60.0
"""Length of road that is driven so often [m]."""

_STEP: Final = 5.0  # distance between compared points of the way [m]
_NEAR: Final = 6.0  # distance between points of two passes [m]
_SAME_WAY: Final = 30.0  # largest difference between their headings [degrees]
_BETWEEN: Final = 60.0  # shortest way between two passes [m]


def laps(session: Session) -> Iterator[Case]:
    """Yields the ways to the places of the errands; right are those without a stretch that is driven `TIMES` times."""
    rows = session.trajectory
    if not len(rows):
        return
    changes = {
        event.frame for event in session.of_type(EventType.SUBGOAL, EventType.EXCEPTION) if "subgoal" in event.data
    }
    bounds = [-1, *sorted(changes), int(rows["frame"][-1]) + 1]
    for begin, end in itertools.pairwise(bounds):
        part = rows[(rows["frame"] > begin) & (rows["frame"] <= end)]
        if len(part):
            long = _repeated_length(part) >= STRETCH
            yield Case(not long, float(part["frame"][0]) / FRAME_RATE, "laps" if long else "")


def _repeated_length(rows: NDArray[np.void]) -> float:
    """Returns the length of the road that is driven at least `TIMES` times in one direction [m]."""
    x, y = rows["x"].astype(float), rows["y"].astype(float)
    driven = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    kept = np.searchsorted(driven, np.arange(0.0, driven[-1], _STEP))
    x, y, driven, heading = x[kept], y[kept], driven[kept], np.degrees(rows["heading"].astype(float)[kept])
    length = 0.0
    for number in range(len(kept)):
        near = np.hypot(x[:number] - x[number], y[:number] - y[number]) <= _NEAR
        near &= np.abs(wrap_degrees(heading[:number] - heading[number])) <= _SAME_WAY
        passes = np.append(driven[:number][near], driven[number])
        length += _STEP * (1 + int((np.diff(passes) > _BETWEEN).sum()) >= TIMES)
    return length
