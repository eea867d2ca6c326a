"""What is kept of a session before it begins."""

from __future__ import annotations

from dataclasses import asdict

from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.envs.scenario import Scenario
from dorothie_gym.sessions import SessionHeader


def header_of(scenario: Scenario, town: str, config: EnvConfig) -> SessionHeader:
    """The header of a session.

    Args:
        scenario: what the session begins with.
        town: name of the town.
        config: settings of the environment.
    """
    storyboard = scenario.storyboard
    return SessionHeader(
        town=town,
        storyboard=storyboard.name,
        seed=scenario.seed,
        decision_frequency=config.decision_frequency,
        street_names=[name.label for name in scenario.street_names],
        landmarks=[
            {
                "name": landmark.name.label,
                "lane": landmark.lane,
                "station": landmark.station,
                "x": landmark.position[0],
                "y": landmark.position[1],
                "street": landmark.street,
                "hidden": landmark.hidden,
            }
            for landmark in storyboard.landmarks
        ],
        subgoals=[
            {
                "description": subgoal.description,
                "landmark": subgoal.landmark,
                "after": subgoal.after,
                "trigger": subgoal.trigger,
                "delete": subgoal.delete,
                "change": subgoal.change,
            }
            for subgoal in storyboard.subgoals
        ],
        story=storyboard.story,
        departure=scenario.departure,
        config=asdict(config),
    )
