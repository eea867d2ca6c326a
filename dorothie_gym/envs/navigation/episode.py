"""End and rewards of an episode of the navigation environments (compiled)."""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.session.rewards import NAVIGATION_TERMS, write_navigation_terms
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.state.codes import COLLISION
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64, RecordArray, by_reference, empty_records

if TYPE_CHECKING:
    from dorothie_gym.envs.navigation.config import NavigationConfig
    from dorothie_gym.sim.state.world_arrays import WorldArrays

NEARER = 1.0
"""Decrease of the cost to go that counts as progress for `patience` [m]."""

LEFT_ROAD_DISTANCE = 15.0
"""Distance from the path beyond which the ego counts as having left the road [m]."""

EARLY = 1e-9
"""Tolerance for rounding in time limits [s]."""


class Ending(enum.IntEnum):
    """Reason for the end of an episode."""

    NONE = 0
    ARRIVED = 1
    LEFT_ROAD = 2
    GAVE_UP = 3
    OUT_OF_TIME = 4

    @property
    def label(self) -> str:
        """Reason as `info["reason"]` has it; "" for none."""
        return _LABELS[self]


_LABELS = {
    Ending.NONE: "",
    Ending.ARRIVED: "arrived",
    Ending.LEFT_ROAD: "left the road",
    Ending.GAVE_UP: "gave up",
    Ending.OUT_OF_TIME: "out of time",
}
_NONE, _ARRIVED, _LEFT_ROAD, _GAVE_UP, _OUT_OF_TIME = (int(ending) for ending in Ending)


class EpisodeRecord:
    """State of an episode; the first fields are written before a decision is judged."""

    left: Float  # cost to go from the ego's true place [m at 40 km/h]
    progress: Float  # decrease of the cost to go since the last decision [m]
    reached: Int32  # number of live subgoals reached
    refusals: Int32  # actions that were refused at this decision
    acted: Flag  # whether a physical action was chosen
    renewed: Flag  # whether the goal or the roadblocks on the route have changed
    done: Flag  # whether the destination was reached, and whether all live subgoals were
    succeeded: Flag
    nearest: Float  # minimum cost to go so far, and the time at which it was reached [s]
    nearest_at: Float
    counted: Int32  # subgoals, collisions of the ego's own fault, and infractions that were rewarded so far
    collisions: Int64
    broken: Int64
    terms: Annotated[NDArray[np.float64], "f8", (len(NAVIGATION_TERMS),)]  # of the last decision
    reward: Float
    ending: Int32  # `Ending`


class EpisodeSettings:
    """Settings of an episode, see `NavigationConfig`."""

    weights: Annotated[NDArray[np.float64], "f8", (len(NAVIGATION_TERMS),)]
    frequency: Float  # of decisions [Hz]
    patience: Float  # [s]
    max_seconds: Float


@by_reference
class EpisodeArrays(NamedTuple):
    """An episode in arrays of one record each, or one row each in a batch."""

    state: RecordArray[EpisodeRecord]
    settings: RecordArray[EpisodeSettings]


def episode_arrays(config: NavigationConfig) -> EpisodeArrays:
    """Returns the arrays of an episode that begins."""
    arrays = EpisodeArrays(empty_records(EpisodeRecord, 1), empty_records(EpisodeSettings, 1))
    arrays.state["nearest"] = math.inf
    settings = arrays.settings[0]
    settings.weights[:] = list(vars(config.weights).values())
    settings.frequency, settings.patience = config.decision_frequency, config.patience
    settings.max_seconds = config.max_seconds
    return arrays


_write_terms = compiled(write_navigation_terms)


@compiled
def judge(world: WorldArrays, episode: EpisodeArrays) -> None:
    """Ends an episode if its conditions are met, and writes the reward of the last decision and its terms.

    Args:
        world: arrays of the world after the decision.
        episode: arrays of the episode.
    """
    state, settings = episode.state[0], episode.settings[0]
    now = world.clock[0].frame / FRAME_RATE
    if state.renewed or state.left < state.nearest - NEARER:
        state.nearest, state.nearest_at, state.renewed = state.left, now, False
    if state.done:
        state.ending = _ARRIVED
    elif abs(world.car[0].offset) > LEFT_ROAD_DISTANCE:
        state.ending = _LEFT_ROAD
    elif now - state.nearest_at >= settings.patience - EARLY:
        state.ending = _GAVE_UP
    elif now >= settings.max_seconds - EARLY:
        state.ending = _OUT_OF_TIME
    collisions, broken = world.car[0].collisions, 0
    for kind in range(len(world.watch[0].counts)):
        broken += world.watch[0].counts[kind] if kind != COLLISION else 0
    failed = state.ending == _LEFT_ROAD or state.ending == _GAVE_UP
    state.reward = _write_terms(
        state.terms,
        settings.weights,
        state.progress,
        state.reached - state.counted,
        collisions == 0 and bool(state.done) and bool(state.succeeded),
        collisions - state.collisions,
        broken - state.broken,
        failed,
        settings.frequency,
        bool(state.acted) and state.refusals == 0,
        state.refusals,
    )
    state.counted, state.collisions, state.broken = state.reached, collisions, broken
