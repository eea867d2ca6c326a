"""Binding of a storyboard template to a town: landmark kinds, sites, and values for all names of the template."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.errors import StoryboardError
from dorothie_gym.support import portable_math as pm
from dorothie_gym.tasks.catalogue import LandmarkKind, catalogue, categories, find_kind, kinds_in, map_labels
from dorothie_gym.tasks.storyboard import (
    Dependent,
    Landmark,
    LandmarkSite,
    Storyboard,
    StoryboardTemplate,
    Subgoal,
    SubgoalTemplate,
    Variable,
    fill,
    variable_of,
)

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import LandmarkName


def cast(template: StoryboardTemplate, rng: np.random.Generator | None = None) -> dict[str, LandmarkName]:
    """Assigns a landmark kind to each name of a template.

    Kinds that a town contains once are assigned once. House and Person may be assigned repeatedly; for a wide category
    ("places") they are repeated only if all other matching kinds are in use.

    Args:
        template: the template; all references of its destinations must be defined.
        rng: source of randomness; without it, the first matching kinds are used (feasibility check).

    Returns:
        A kind for each landmark named directly (key: its label) and each variable (key: "$NAME").

    Raises:
        StoryboardError: if no landmark has a category or attribute, or if there are more names than landmarks.
    """
    fixed = {
        ref: kind.name
        for ref in template.destinations()
        if variable_of(ref) is None and (kind := find_kind(ref)) is not None
    }
    chosen = _assign(_roles(template.variables, template.dependents, template.name), tuple(fixed.values()), rng)
    if chosen is None:
        raise StoryboardError(template.name, "variables", _shortage(template, fixed))
    names = (f"${variable.name}" for variable in template.variables)
    return fixed | dict(zip(names, chosen, strict=True))


@lru_cache(maxsize=64)
def _roles(
    variables: tuple[Variable, ...], dependents: tuple[Dependent, ...], story: str
) -> tuple[tuple[LandmarkKind, ...], ...]:
    """Returns the kinds that each variable of a storyboard with a name may stand for.

    Raises:
        StoryboardError: the ontology has none for one of them.
    """
    lacking = [variable for variable in variables if not kinds_in(variable.category)]
    if lacking:
        kinds = ", ".join(f"{variable.category!r} ({variable.name})" for variable in lacking)
        known = ", ".join(("places", *categories()))
        reason = f"no landmark is of category {kinds}; use one of {known}"
        raise StoryboardError(story, f"variables.{lacking[0].name}", reason)
    return tuple(
        _candidates(variable, [row for row in dependents if row.variable == variable.name], story)
        for variable in variables
    )


def _candidates(variable: Variable, dependents: Sequence[Dependent], story: str) -> tuple[LandmarkKind, ...]:
    """Returns the kinds that a variable may stand for, by its own dependents."""
    kinds = kinds_in(variable.category)
    for attribute, number in Counter(row.attribute for row in dependents).items():
        field = f"dependents.{next(row.name for row in dependents if row.attribute == attribute)}"
        having = tuple(kind for kind in kinds if attribute in kind.attributes)
        if not having:
            known = ", ".join(sorted({name for kind in kinds for name in kind.attributes})) or "none"
            reason = f"no landmark of {variable.category!r} has the attribute {attribute!r}; it has: {known}"
            raise StoryboardError(story, field, reason)
        kinds = tuple(kind for kind in having if len(kind.attributes[attribute]) >= number)
        if not kinds:
            most = max(len(kind.attributes[attribute]) for kind in having)
            reason = (
                f"{number} different {variable.name}.{attribute} are requested, but only {most} exist; request fewer"
            )
            raise StoryboardError(story, field, reason)
    return kinds


def _assign(
    candidates: Sequence[Sequence[LandmarkKind]],
    taken: tuple[LandmarkName, ...],
    rng: np.random.Generator | None,
) -> tuple[LandmarkName, ...] | None:
    """Returns one kind per row of candidates by depth-first search; None if no assignment exists."""
    if not candidates:
        return ()
    row = candidates[0]
    order = [row[k] for k in (rng.permutation(len(row)) if rng is not None else range(len(row)))]
    unused = [kind for kind in order if kind.name not in taken]
    repeated = [kind for kind in order if kind.name in taken and kind.repeatable]
    for kind in unused + repeated:
        rest = _assign(candidates[1:], (*taken, kind.name), rng)
        if rest is not None:
            return (kind.name, *rest)
    return None


def _shortage(template: StoryboardTemplate, fixed: Mapping[str, LandmarkName]) -> str:
    wanted = ", ".join(f"{variable.name} ({variable.category})" for variable in template.variables)
    named = f" besides {', '.join(fixed)}" if fixed else ""
    return f"there are not enough different landmarks for {wanted}{named}; request fewer or use wider categories"


# A stop counts within 2 m of a waypoint (paper, appendix "Interface Components"); the spacing also allows queues.
SITE_SPACING = 15.0
"""Preferred minimum distance between two landmarks [m]."""


def spread_places(places: Sequence[LandmarkSite], count: int, rng: np.random.Generator) -> list[LandmarkSite]:
    """Samples sites: first on unused lanes at a distance of `SITE_SPACING`, then on any lane, then the farthest ones.

    Args:
        places: candidate sites; at least `count`.
        count: number of sites.
        rng: source of randomness for the order of the candidates.

    Returns:
        Distinct sites, in descending order of spread.
    """
    shuffled = [places[k] for k in rng.permutation(len(places)).tolist()]
    chosen: list[LandmarkSite] = []
    for fresh_lane in (True, False):
        lanes = {place.lane for place in chosen}
        left = []
        for place in shuffled:
            if len(chosen) == count or (fresh_lane and place.lane in lanes) or _gap(place, chosen) < SITE_SPACING:
                left.append(place)
            else:
                chosen.append(place)
                lanes.add(place.lane)
        shuffled = left
    while len(chosen) < count:
        farthest = max(range(len(shuffled)), key=lambda k: _gap(shuffled[k], chosen))
        chosen.append(shuffled.pop(farthest))
    return chosen


def _gap(place: LandmarkSite, others: Sequence[LandmarkSite]) -> float:
    """Returns the smallest distance to other sites, between landmarks or between waypoints [m]."""
    gap, position, waypoint = math.inf, place.position, place.waypoint
    for other in others:
        gap = min(gap, pm.dist(position, other.position), pm.dist(waypoint, other.waypoint))
    return gap


def bind(
    template: StoryboardTemplate, places: Sequence[LandmarkSite], rng: np.random.Generator, *, name: str | None = None
) -> Storyboard:
    """Samples landmarks, values and sites for a template.

    All ten landmark kinds are placed, together with the additional houses and people that the story needs; landmarks of
    the story are assigned the sites with the widest spread. A small town has only as many kinds besides those of the
    story as leave a place for the departure.

    Args:
        template: the template.
        places: candidate sites of the town, in a deterministic order.
        rng: source of randomness.
        name: name of the storyboard; the name of the template by default.

    Raises:
        StoryboardError: if the town has fewer sites than there are landmarks in the story.
    """
    parts = cast(template, rng)
    values = _draw_values(template, parts, rng)
    if len(parts) > len(places):
        reason = f"{len(parts)} landmarks need as many places, but the town has {len(places)}; use a larger town"
        raise StoryboardError(template.name, "variables", reason)
    names, indices = _line_up(parts, len(places))
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
    """Returns the text for each name of the template; dependents of one attribute draw without replacement."""
    values = {row.name: catalogue()[parts[f"${row.name}"]].noun for row in template.variables}
    left: dict[tuple[str, str], list[str]] = {}
    for row in template.dependents:
        attribute = catalogue()[parts[f"${row.variable}"]].attributes[row.attribute]
        pool = left.setdefault((row.variable, row.attribute), list(attribute))
        values[row.name] = pool.pop(int(rng.integers(len(pool))))
    return values


def longest_values(template: StoryboardTemplate) -> dict[str, str]:
    """Returns the longest text that each name of a template may stand for.

    Args:
        template: the template; `cast` accepts it.
    """
    roles = _roles(template.variables, template.dependents, template.name)
    kinds = {variable.name: candidates for variable, candidates in zip(template.variables, roles, strict=True)}
    values = {name: max((kind.noun for kind in candidates), key=len) for name, candidates in kinds.items()}
    for row in template.dependents:
        values[row.name] = max((v for kind in kinds[row.variable] for v in kind.attributes[row.attribute]), key=len)
    return values


def needed_places(template: StoryboardTemplate) -> int:
    """Returns the number of places that a storyboard needs at least: one for each of its landmarks."""
    return len(cast(template))


def _line_up(parts: Mapping[str, LandmarkName], places: int) -> tuple[list[LandmarkName], dict[str, int]]:
    """Returns the names of all landmarks (each kind once, then repeated ones) and the index of each part.

    If there are too few places, kinds that the story does not mention are left out, and one place remains free.

    Args:
        parts: kinds of the landmarks in the story.
        places: number of places; at least that of the parts.
    """
    names = list(catalogue())
    spare = [name for name in names if name not in parts.values()]
    if len(parts) + len(spare) > places:
        left_out = spare[max(places - 1 - len(parts), 0) :]
        names = [name for name in names if name not in left_out]
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
    places: Sequence[LandmarkSite],
    rng: np.random.Generator,
) -> tuple[Landmark, ...]:
    """Assigns landmarks to sites, those with an index in `first` first."""
    order = [*first, *(index for index in range(len(names)) if index not in first)]
    sites = dict(zip(order, spread_places(places, len(names), rng), strict=True))
    landmarks = []
    for index, (name, label) in enumerate(zip(names, map_labels(names), strict=True)):
        kind, site = catalogue()[name], sites[index]
        landmarks.append(
            Landmark(
                index=index,
                name=name,
                label=label,
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
        reason=None if subgoal.reason is None else fill(subgoal.reason, values),
        messages=subgoal.messages.filled(values),
    )
