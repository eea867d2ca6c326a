"""What is around the car at a moment, as rows that a session keeps."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions import ACTOR_DTYPE, ActorKind
from dorothie_gym.world.bodies import Pedestrian
from dorothie_gym.world.kernel import Kind, Walk
from dorothie_gym.world.kernel.records import plain
from dorothie_gym.world.town import LightColour, LightProgramme, Town
from dorothie_gym.world.world import World

_ACTOR_KINDS = np.full(max(Kind) + 1, -1, dtype=np.int64)
_ACTOR_KINDS[Kind.CAR], _ACTOR_KINDS[Kind.CYCLIST] = ActorKind.VEHICLE, ActorKind.CYCLIST
"""By `Kind` of a vehicle; -1 for places that are empty and for the car itself."""

_PLACE = ("key", "x", "y", "heading")


def actors_around(world: World) -> NDArray[np.void]:
    """Returns everybody and everything on the road besides the car as rows of `ACTOR_DTYPE` (n,)."""
    state = world.actors.arrays
    vehicles, pedestrians, props = plain(state.vehicles), plain(state.pedestrians), plain(state.props)
    kinds = _ACTOR_KINDS[vehicles["kind"]]
    driving = np.flatnonzero(kinds >= 0)
    walking = np.flatnonzero(pedestrians["state"] != Walk.EMPTY)
    standing = np.flatnonzero(props["present"])
    first, second = len(driving), len(driving) + len(walking)
    rows = np.empty(second + len(standing), dtype=ACTOR_DTYPE)
    if first:
        part = rows[:first]
        part["kind"] = kinds[driving]
        for name in (*_PLACE, "speed", "length", "width"):
            part[name] = vehicles[name][driving]
    if second > first:
        part = rows[first:second]
        part["kind"], part["length"], part["width"] = ActorKind.PEDESTRIAN, Pedestrian.LENGTH, Pedestrian.WIDTH
        for name in (*_PLACE, "speed"):
            part[name] = pedestrians[name][walking]
    if len(standing):
        part = rows[second:]
        part["kind"], part["speed"] = ActorKind.PROP, 0.0
        for name in (*_PLACE, "length", "width"):
            part[name] = props[name][standing]
    return rows


_CLOSE = 1e-3
"""So shortly before a light changes it is looked at anew: sums of durations are not exact [s]."""


class LightStates:
    """What the traffic lights of a town show; put together anew only when one of them has changed.

    Args:
        town: the town.
    """

    def __init__(self, town: Town) -> None:
        self._programmes = town.programmes
        self._since, self._until = 0.0, -math.inf
        self._states: dict[int, LightColour] = {}

    def at(self, time: float) -> dict[int, LightColour]:
        """Returns the colours at a simulated time [s] by id of the signal; not to be modified."""
        if not self._since <= time < self._until:
            remaining = (_remaining(programme, time) for programme in self._programmes)
            self._since, self._until = time, time + min(remaining, default=math.inf) - _CLOSE
            phases = [(programme.phase_at(time), programme.signals) for programme in self._programmes]
            self._states = {signal: phase.colour(signal) for phase, signals in phases for signal in signals}
        return self._states


def _remaining(programme: LightProgramme, time: float) -> float:
    """How long the present phase still lasts [s]."""
    now = (time - programme.offset) % programme.cycle
    ends = itertools.accumulate(phase.duration for phase in programme.phases)
    return next((end - now for end in ends if now < end), 0.0)
