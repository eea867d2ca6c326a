"""Trigger of the scripted Ad-Wizard in a session in which an agent drives.

Compiled code checks at every decision whether a planned trick can be played, by the functions and random numbers of
the policy. Only then does the policy observe and act.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.ad_wizard import (
    KINDS,
    MOST_TRICKS,
    AdWizardConfig,
    ScriptedAdWizard,
    Trick,
    idle_until,
    suits_roadblock,
)
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.observation_parser import place_ahead
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.task_exceptions import plays_every_exception
from dorothie_gym.session.spaces.actions import ActionDecoder, RoleAction
from dorothie_gym.session.spaces.fields import STORY_LENGTH, SpaceLimits, plain_text
from dorothie_gym.session.view_steps import write_lanes
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.ego.path_builder import last_point_before
from dorothie_gym.sim.randomness import POOL, draw_share, seed_stream
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import Flag, Float, Int32, Int64, RecordArray, UInt64

if TYPE_CHECKING:
    from dorothie_gym.maps.routing_graph import RoutingLane
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.instructor_arrays import MarkRecord
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.observations import Observation
    from dorothie_gym.sim.state.world_arrays import WorldArrays
    from dorothie_gym.tasks.storyboard import TaskState

_CONFIG: Final = AdWizardConfig()
_SPACING, _EXPIRES, _MOST_ROADBLOCKS = _CONFIG.spacing, _CONFIG.expires_after, _CONFIG.most_roadblocks
_ROADBLOCK_SPEED, _CLEARANCE = _CONFIG.roadblock_speed, _CONFIG.roadblock_clearance
_ROADBLOCK_AHEAD, _CROWD_AHEAD, _MARGINS = _CONFIG.roadblock_ahead, _CONFIG.crowd_ahead, _CONFIG.roadblock_margins
_ROADBLOCK, _WEATHER, _TASK, _SENSOR, _CROWD = (
    KINDS.index(kind) for kind in (Trick.ROADBLOCK, Trick.WEATHER, Trick.TASK, Trick.SENSOR, Trick.CROWD)
)
_place_ahead, _suits_roadblock = compiled(place_ahead), compiled(suits_roadblock)


class PlansRecord:
    """Plans of the scripted Ad-Wizard in an environment."""

    times: Annotated[NDArray[np.float64], "f8", (MOST_TRICKS,)]  # of the tricks to come, infinite if there is none [s]
    due: Float  # earliest time of any action [s], infinite for never
    restores: Float  # earliest time at which a change is undone [s]
    last: Float  # time of the last trick [s]
    state_high: UInt64  # `RandomStream`
    state_low: UInt64
    step_high: UInt64
    step_low: UInt64
    seed: Int64
    count: Int64  # number of decisions, the next one included
    pool: Annotated[NDArray[np.int64], "i8", (POOL,)]  # scratch of seeds
    path: Annotated[NDArray[np.int64], "i8", (SpaceLimits.plan,)]  # scratch: 1 + number of the lanes ahead, 0 for none
    kinds: Annotated[NDArray[np.int32], "i4", (MOST_TRICKS,)]  # of these tricks, as in `KINDS`
    roadblocks: Int32  # number of those placed
    changes: Flag  # whether a change of the task is possible
    always: Flag  # whether the policy is called at every decision, as with a storyboard of a user's own
    acts: Flag  # whether it is called at the next decision


# --- Moments (compiled) -----------------------------------------------------------------------------------------------


@compiled
def look_for_moment(
    lanes: RecordArray[RoutingLane], marks: RecordArray[MarkRecord], world: WorldArrays, plans: PlansRecord
) -> None:
    """Records whether to query the Ad-Wizard at the next decision.

    Args:
        lanes: lanes of the town.
        marks: landmarks of the session.
        world: arrays of the world after the physics of a decision.
        plans: plans of the Ad-Wizard.
    """
    now = world.clock[0].frame / FRAME_RATE
    plans.count += 1
    plans.acts = now >= plans.due and (
        plans.always or now >= plans.restores or finds_moment(lanes, marks, world, plans, now)
    )


@compiled
def finds_moment(
    lanes: RecordArray[RoutingLane], marks: RecordArray[MarkRecord], world: WorldArrays, plans: PlansRecord, now: float
) -> bool:
    """Returns whether a planned trick can be played, with the random numbers that the policy will draw."""
    begun = False
    for k in range(MOST_TRICKS):
        begin, kind = max(plans.times[k], plans.last + _SPACING), plans.kinds[k]
        if not begin <= now < begin + _EXPIRES:
            continue
        if kind == _WEATHER or kind == _SENSOR or (kind == _TASK and plans.changes):
            return True
        blocks = kind == _ROADBLOCK
        if blocks and (plans.roadblocks >= _MOST_ROADBLOCKS or world.vehicles[0].speed < _ROADBLOCK_SPEED):
            continue
        if blocks or kind == _CROWD:
            if not begun:
                begun = True
                seed_stream(plans, plans.seed, plans.count, plans.pool)
                note_path(world, plans.path)
            low, high = _ROADBLOCK_AHEAD if blocks else _CROWD_AHEAD
            ahead = low + (high - low) * draw_share(plans)
            lane, station = _place_ahead(lanes, plans.path, world.plan[0].lane, world.plan[0].station + ahead)
            if lane >= 0 and (not blocks or is_open(lanes, marks, lane, station)):
                return True
    return False


@compiled
def note_path(world: WorldArrays, path: NDArray[np.int64]) -> None:
    """Writes the lanes ahead, as the Ad-Wizard observes them."""
    points = int(world.plan[0].points)
    write_lanes(world.course, points, last_point_before(world.course, points, world.car[0].s), path)


@compiled
def is_open(lanes: RecordArray[RoutingLane], marks: RecordArray[MarkRecord], lane: int, station: float) -> bool:
    """Returns whether a place is suitable for a roadblock."""
    length = lanes[lane].length
    return not lanes[lane].junction and _suits_roadblock(marks, lane, station, length, _MARGINS, _CLEARANCE)


# --- Policy -----------------------------------------------------------------------------------------------------------


class AdWizardTrigger:
    """Scripted Ad-Wizard of a session; it is called for an action only when it may act."""

    def __init__(self, town: Town, limits: SpaceLimits, scenario: Scenario, rate: float) -> None:
        """Draws its plans.

        Args:
            town: the map.
            limits: sizes of the spaces.
            scenario: scenario of the session.
            rate: average number of exceptions in a session.
        """
        self._policy, self._decoder = _wizard_of(limits, rate)
        self._plans = self._policy.initial_state(policy_seed(scenario.seed, Role.AD_WIZARD), town)
        self._story = plain_text(scenario.storyboard.story, STORY_LENGTH)

    def write(self, plans: np.void) -> None:
        """Writes its plans into a `PlansRecord`, but for the number of decisions."""
        state = self._plans
        plans["seed"], plans["last"], plans["roadblocks"] = state.seed, state.last_at, state.roadblocks
        plans["times"], plans["kinds"] = math.inf, -1
        for k, item in enumerate(state.planned):
            plans["times"][k], plans["kinds"][k] = item.at, KINDS.index(item.trick)
        plans["restores"] = min((item.at for item in state.restorations), default=math.inf)
        plans["due"] = idle_until(self._policy, state, self._story)
        plans["always"] = self._policy.plays_tasks and plays_every_exception(self._story)

    def act(self, seen: Mapping[str, Observation], count: int) -> RoleAction:
        """Returns its action at a decision.

        Args:
            seen: observations of the session.
            count: number of decisions so far, this one included.
        """
        action, self._plans = self._policy.step(seen[Role.AD_WIZARD], replace(self._plans, count=count - 1))
        return self._decoder(action)


@lru_cache(maxsize=16)
def _wizard_of(limits: SpaceLimits, rate: float) -> tuple[ScriptedAdWizard, ActionDecoder]:
    """Returns the policy, which has no state, and the decoder of its actions."""
    return ScriptedAdWizard(limits, rate=rate), ActionDecoder(Role.AD_WIZARD, limits)


def permits_changes(task: TaskState) -> bool:
    """Returns whether the Ad-Wizard may change the task now."""
    return bool(task.possible_triggers() or task.possible_deletions() or task.possible_changes())
