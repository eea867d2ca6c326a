"""Rewards and the end of an episode, as the records of a world and a task have them."""

from __future__ import annotations

import math
from typing import Any

import pytest

from dorothie_gym.envs.navigation.config import NavigationConfig
from dorothie_gym.envs.navigation.episode import LEFT_ROAD_DISTANCE, Ending, EpisodeArrays, episode_arrays, judge
from dorothie_gym.session.rewards import NAVIGATION_TERMS, NavigationWeights
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.state.codes import Breach
from dorothie_gym.sim.state.town_arrays import empty_town
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.support.compilation.records import plain

WEIGHTS = NavigationWeights(
    progress=1.0, subgoal=10.0, success=100.0, collision=-3.0, infraction=-5.0, gave_up=-7.0, time=-2.0, action=-0.5,
    refusal=-0.25,
)  # fmt: skip


class Episode:
    """An episode whose decisions the test makes up."""

    def __init__(self, **settings: Any) -> None:
        self.world: WorldArrays = empty_world(empty_town(), vehicles=1, pedestrians=0, driven=True)
        self.arrays: EpisodeArrays = episode_arrays(NavigationConfig(weights=WEIGHTS, **settings))
        self.state = plain(self.arrays.state)[0]

    def play(self, seconds: float, **values: object) -> Ending:
        """Judges a decision at a time; `values` are fields of the episode."""
        self.world.clock["frame"] = round(seconds * FRAME_RATE)
        for name, value in values.items():
            self.state[name] = value
        judge(self.world, self.arrays)
        return Ending(int(self.state["ending"]))

    @property
    def terms(self) -> dict[str, float]:
        return dict(zip(NAVIGATION_TERMS, self.state["terms"].tolist(), strict=True))


def test_events_are_rewarded_once() -> None:
    episode = Episode()
    episode.play(0.5, left=50.0, progress=4.0, reached=1, acted=True)
    assert episode.terms == {
        "progress": 4.0, "subgoal": 10.0, "success": 0.0, "collision": 0.0, "infraction": 0.0, "gave_up": 0.0,
        "time": -1.0, "action": -0.5, "refusal": 0.0,
    }  # fmt: skip
    assert episode.state["reward"] == pytest.approx(12.5)
    episode.world.car["collisions"] = 1
    episode.world.watch["counts"][0, [Breach.COLLISION, Breach.RED_LIGHT, Breach.OFF_ROAD]] = 3, 1, 1
    episode.play(1.0, progress=0.0, refusals=2)
    assert episode.terms["collision"] == -3.0
    assert episode.terms["infraction"] == -10.0  # collisions apart
    assert (episode.terms["subgoal"], episode.terms["action"], episode.terms["refusal"]) == (0.0, 0.0, -0.5)
    episode.play(1.5, refusals=0, acted=False)
    assert episode.state["reward"] == -1.0


@pytest.mark.parametrize(("collisions", "reward"), [(0, 100.0), (1, 0.0)])
def test_success_needs_a_drive_without_collisions(collisions: int, reward: float) -> None:
    episode = Episode()
    episode.world.car["collisions"] = collisions
    assert episode.play(20.0, done=True, succeeded=True) is Ending.ARRIVED
    assert episode.terms["success"] == reward
    assert episode.terms["gave_up"] == 0.0


def test_patience_ends_where_the_goal_comes_no_nearer() -> None:
    episode = Episode(patience=30.0)
    assert episode.play(0.0, left=100.0) is Ending.NONE
    assert episode.play(20.0, left=98.5) is Ending.NONE  # nearer
    assert episode.play(49.5, left=98.0) is Ending.NONE
    assert episode.play(49.5, left=300.0, renewed=True) is Ending.NONE  # another goal
    assert episode.play(79.0, left=299.5) is Ending.NONE
    assert episode.play(79.5, left=299.5) is Ending.GAVE_UP
    assert episode.terms["gave_up"] == -7.0


def test_unreachable_goals_wear_out_patience() -> None:
    episode = Episode(patience=10.0)
    assert episode.play(9.5, left=math.inf) is Ending.NONE
    assert episode.play(10.0, left=math.inf) is Ending.GAVE_UP


def test_time_limit_comes_last() -> None:
    episode = Episode(max_seconds=60.0, patience=60.0)
    episode.play(59.5, left=10.0)
    assert episode.play(60.0, left=9.8) is Ending.OUT_OF_TIME
    assert episode.terms["gave_up"] == 0.0
    episode.world.car["offset"] = -LEFT_ROAD_DISTANCE - 0.1
    assert episode.play(60.0) is Ending.LEFT_ROAD
    assert episode.play(60.0, done=True) is Ending.ARRIVED
