"""What a session begins with, drawn from its seed: storyboard, street names, departure."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.maps import Town
from dorothie_gym.ontology import StreetName
from dorothie_gym.recording import SessionHeader
from dorothie_gym.tasks import Storyboard, StoryboardTemplate, bind, load_template, template_names

NAMES = tuple(name for name in StreetName if name not in (StreetName.UNKNOWN, StreetName.QUERIED, StreetName.HIGHWAY))
"""The fourteen names that are given to streets."""


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Everything a session begins with.

    Attributes:
        seed: what it was drawn from.
        storyboard: the task, bound to places of the town.
        street_names: name of each street of the town.
        departure: lane and distance along it [m] where the car stands.
    """

    seed: int
    storyboard: Storyboard
    street_names: tuple[StreetName, ...]
    departure: tuple[int, float]


def draw_scenario(town: Town, template: StoryboardTemplate | None, seed: int) -> Scenario:
    """Draws a scenario; the same for the same town, template and seed.

    Args:
        town: the map; it needs at least as many sites as the storyboard has landmarks, and one to depart from.
        template: the storyboard's template; None draws one of those that are shipped.
        seed: any whole number >= 0.

    Raises:
        StoryboardError: the template does not fit the town.
    """
    task, streets, departure = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    if template is None:
        names = template_names()
        template = load_template(names[int(task.integers(len(names)))])
    storyboard = bind(template, town.sites, task)
    taken = {landmark.site for landmark in storyboard.landmarks}
    free = [site for site in town.sites if site.id not in taken] or list(town.sites)
    start = free[int(departure.integers(len(free)))]
    return Scenario(
        seed=seed,
        storyboard=storyboard,
        street_names=_name_streets(town, streets),
        departure=(start.lane, start.station),
    )


def _name_streets(town: Town, rng: np.random.Generator) -> tuple[StreetName, ...]:
    """Names shuffled over the streets; a ring road called Highway keeps its name, streets beyond the 14 have none."""
    shuffled = [NAMES[int(i)] for i in rng.permutation(len(NAMES))]
    names: list[StreetName] = []
    for street in town.streets:
        if street.name == StreetName.HIGHWAY.label:
            names.append(StreetName.HIGHWAY)
        else:
            names.append(shuffled.pop() if shuffled else StreetName.UNKNOWN)
    return tuple(names)


# --- What is kept of a session before it begins ----------------------------------------------------------------------


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
