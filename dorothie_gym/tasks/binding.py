"""Binds a template to the places of a town."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks.casting import cast
from dorothie_gym.tasks.catalogue import catalogue
from dorothie_gym.tasks.errors import StoryboardError
from dorothie_gym.tasks.sites import spread_places
from dorothie_gym.tasks.storyboard import Landmark, Place, Storyboard, Subgoal
from dorothie_gym.tasks.templates import StoryboardTemplate, SubgoalTemplate, fill


def bind(
    template: StoryboardTemplate, places: Sequence[Place], rng: np.random.Generator, *, name: str | None = None
) -> Storyboard:
    """Draws landmarks, values and places for a template.

    All ten kinds of landmark are placed, whether the story needs them or not, and as many more houses and people as
    it needs; those of the story get the best spread places.

    Args:
        template: the template.
        places: the town's places, in an order that does not depend on chance.
        rng: the only source of chance.
        name: name of the storyboard; by default that of the template.

    Raises:
        StoryboardError: the town has fewer places than there are landmarks.
    """
    parts = cast(template, rng)
    values = _draw_values(template, parts, rng)
    names, indices = _line_up(parts)
    if len(names) > len(places):
        reason = f"{len(names)} landmarks need as many places, but the town has {len(places)}; use a larger town"
        raise StoryboardError(template.name, "variables", reason)
    hidden = {indices[f"${variable}"] for variable in template.hidden}
    return Storyboard(
        name=template.name if name is None else name,
        story=fill(template.story, values),
        subgoals=tuple(_bind_subgoal(subgoal, values, indices) for subgoal in template.subgoals),
        landmarks=_place(names, tuple(indices.values()), hidden, places, rng),
    )


def _draw_values(
    template: StoryboardTemplate, parts: Mapping[str, LandmarkName], rng: np.random.Generator
) -> dict[str, str]:
    """What each name of the template stands for in texts; dependents of one attribute draw without replacement."""
    values = {row.name: catalogue()[parts[f"${row.name}"]].noun for row in template.variables}
    left: dict[tuple[str, str], list[str]] = {}
    for row in template.dependents:
        attribute = catalogue()[parts[f"${row.variable}"]].attributes[row.attribute]
        pool = left.setdefault((row.variable, row.attribute), list(attribute))
        values[row.name] = pool.pop(int(rng.integers(len(pool))))
    return values


def _line_up(parts: Mapping[str, LandmarkName]) -> tuple[list[LandmarkName], dict[str, int]]:
    """Names of all landmarks (each kind once, then the repeated ones), and the index that each part gets."""
    names = list(catalogue())
    indices: dict[str, int] = {}
    seen: set[LandmarkName] = set()
    for part, name in parts.items():
        if name in seen:
            indices[part] = len(names)
            names.append(name)
        else:
            indices[part] = names.index(name)
            seen.add(name)
    return names, indices


def _place(
    names: Sequence[LandmarkName],
    first: Sequence[int],
    hidden: set[int],
    places: Sequence[Place],
    rng: np.random.Generator,
) -> tuple[Landmark, ...]:
    """Puts landmarks at places, those whose indices are in `first` before the others."""
    order = [*first, *(index for index in range(len(names)) if index not in first)]
    sites = dict(zip(order, spread_places(places, len(names), rng), strict=True))
    numbers: Counter[LandmarkName] = Counter()
    landmarks = []
    for index, name in enumerate(names):
        kind, site = catalogue()[name], sites[index]
        numbers[name] += 1
        landmarks.append(
            Landmark(
                index=index,
                name=name,
                label=kind.label if names.count(name) == 1 else f"{kind.label} {numbers[name]}",
                category=kind.category,
                site=site.id,
                lane=site.lane,
                station=site.station,
                position=site.position,
                waypoint=site.waypoint,
                street=site.street,
                hidden=index in hidden,
            )
        )
    return tuple(landmarks)


def _bind_subgoal(subgoal: SubgoalTemplate, values: Mapping[str, str], indices: Mapping[str, int]) -> Subgoal:
    moved = subgoal.change_destination
    return Subgoal(
        landmark=indices[subgoal.destination],
        description=fill(subgoal.description, values),
        after=subgoal.after,
        trigger=subgoal.trigger,
        delete=subgoal.delete,
        change=None if subgoal.change is None else fill(subgoal.change, values),
        change_landmark=None if moved is None else indices[moved],
        delete_after_subgoal=subgoal.delete_after_subgoal,
        leaves=subgoal.leaves,
    )
