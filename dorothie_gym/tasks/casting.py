"""Which landmark plays which part: every destination of a template gets a kind of landmark of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks.catalogue import LandmarkKind, categories, find_kind, kinds_in
from dorothie_gym.tasks.errors import StoryboardError
from dorothie_gym.tasks.templates import StoryboardTemplate, Variable, variable_of


def cast(template: StoryboardTemplate, rng: np.random.Generator | None = None) -> dict[str, LandmarkName]:
    """Chooses a kind of landmark for each name of a template.

    Kinds that a town has once are given to one name only. House and Person may be given to several, but for a
    wide category ("places") they are repeated only when every other kind that fits is taken.

    Args:
        template: the template; its destinations must refer to something.
        rng: draws among the kinds that fit; without it, the first ones are taken (to see whether there are any).

    Returns:
        A kind for each landmark named outright (key: its label) and each variable (key: "$NAME").

    Raises:
        StoryboardError: a category or attribute that no landmark has, or more names than landmarks.
    """
    fixed = {
        ref: kind.name
        for ref in template.destinations()
        if variable_of(ref) is None and (kind := find_kind(ref)) is not None
    }
    candidates = [_candidates(template, variable) for variable in template.variables]
    chosen = _assign(candidates, tuple(fixed.values()), rng)
    if chosen is None:
        raise StoryboardError(template.name, "variables", _shortage(template, fixed))
    names = (f"${variable.name}" for variable in template.variables)
    return fixed | dict(zip(names, chosen, strict=True))


def _candidates(template: StoryboardTemplate, variable: Variable) -> tuple[LandmarkKind, ...]:
    kinds = kinds_in(variable.category)
    if not kinds:
        known = ", ".join(("places", *categories()))
        reason = f"no landmark is of category {variable.category!r}; use one of {known}"
        raise StoryboardError(template.name, f"variables.{variable.name}", reason)
    dependents = [row for row in template.dependents if row.variable == variable.name]
    for attribute, number in Counter(row.attribute for row in dependents).items():
        field = f"dependents.{next(row.name for row in dependents if row.attribute == attribute)}"
        having = tuple(kind for kind in kinds if attribute in kind.attributes)
        if not having:
            known = ", ".join(sorted({name for kind in kinds for name in kind.attributes})) or "none"
            reason = f"no landmark of {variable.category!r} has the attribute {attribute!r}; it has: {known}"
            raise StoryboardError(template.name, field, reason)
        kinds = tuple(kind for kind in having if len(kind.attributes[attribute]) >= number)
        if not kinds:
            most = max(len(kind.attributes[attribute]) for kind in having)
            reason = (
                f"{number} different {variable.name}.{attribute} are asked for, but there are {most}; ask for fewer"
            )
            raise StoryboardError(template.name, field, reason)
    return kinds


def _assign(
    candidates: Sequence[Sequence[LandmarkKind]],
    taken: tuple[LandmarkName, ...],
    rng: np.random.Generator | None,
) -> tuple[LandmarkName, ...] | None:
    """One kind for each row of candidates, by depth-first search; None if there is no way."""
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
    return f"there are not enough different landmarks for {wanted}{named}; ask for fewer or for wider categories"
