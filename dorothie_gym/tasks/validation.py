"""Validation of storyboard templates across fields: references are defined, and the order of subgoals is feasible."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from dorothie_gym.errors import StoryboardError
from dorothie_gym.tasks.binding import cast
from dorothie_gym.tasks.templates import StoryboardTemplate, references, variable_of

MAX_LIVE_SUBGOALS = 6
"""Largest number of subgoals without a trigger: two to six landmarks to visit (paper, "Task Configuration")."""


def check(template: StoryboardTemplate) -> None:
    """Validates a template.

    Raises:
        StoryboardError: for the first invalid field, with the reason.
    """
    _check_names(template)
    _check_references(template)
    _check_number(template)
    _check_indices(template)
    _check_order(template)
    cast(template)


def _check_names(template: StoryboardTemplate) -> None:
    seen: set[str] = set()
    for field, name in _defined(template):
        if name in seen:
            raise StoryboardError(template.name, field, f"the name {name} is defined twice; rename one of them")
        seen.add(name)


def _defined(template: StoryboardTemplate) -> Iterator[tuple[str, str]]:
    yield from ((f"variables.{row.name}", row.name) for row in template.variables)
    yield from ((f"dependents.{row.name}", row.name) for row in template.dependents)


def _check_references(template: StoryboardTemplate) -> None:
    variables = tuple(row.name for row in template.variables)
    names = tuple(name for _, name in _defined(template))
    in_texts = [(field, name) for field, text in template.texts() for name in references(text)]
    to_landmarks = [(f"dependents.{row.name}", row.variable) for row in template.dependents]
    to_landmarks += [("hidden_from_wizard", name) for name in template.hidden]
    for index, subgoal in enumerate(template.subgoals):
        for field, ref in (("destination", subgoal.destination), ("change_destination", subgoal.change_destination)):
            name = variable_of(ref) if ref is not None else None
            if name is not None:
                to_landmarks.append((f"subgoals[{index}].{field}", name))
    _require(template, to_landmarks, variables, "variable")
    _require(template, in_texts, names, "variable or dependent")


def _require(
    template: StoryboardTemplate, wanted: Iterable[tuple[str, str]], known: Collection[str], what: str
) -> None:
    for field, name in wanted:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise StoryboardError(template.name, field, f"{name!r} is no {what}; define it, or use one of: {listed}")


def _check_number(template: StoryboardTemplate) -> None:
    live = sum(not subgoal.trigger for subgoal in template.subgoals)
    if len(template.subgoals) < 2:
        reason = f"a template has at least 2 subgoals, the last one being the destination, not {len(template.subgoals)}"
        raise StoryboardError(template.name, "subgoals", reason)
    if not 1 <= live <= MAX_LIVE_SUBGOALS:
        reason = f"1 to {MAX_LIVE_SUBGOALS} subgoals must be without `trigger`, not {live}"
        raise StoryboardError(template.name, "subgoals", reason)


def _check_indices(template: StoryboardTemplate) -> None:
    last = len(template.subgoals) - 1
    for index, subgoal in enumerate(template.subgoals):
        given = [("after", other) for other in subgoal.after]
        if subgoal.delete_after_subgoal is not None:
            given.append(("delete_after_subgoal", subgoal.delete_after_subgoal))
        for field, other in given:
            where = f"subgoals[{index}].{field}"
            if not 0 <= other <= last:
                raise StoryboardError(template.name, where, f"there is no subgoal {other}; use 0 to {last}")
            if other == index:
                raise StoryboardError(template.name, where, f"subgoal {index} refers to itself; remove it")


def _check_order(template: StoryboardTemplate) -> None:
    """Checks that no subgoal waits for itself or for the final destination, whichever subgoals are live."""
    number = len(template.subgoals)
    for index, subgoal in enumerate(template.subgoals):
        for other in subgoal.after:
            # `other` is the final destination as long as all later subgoals await their trigger.
            if other > index and all(template.subgoals[k].trigger for k in range(other + 1, number)):
                reason = f"subgoal {index} cannot come after subgoal {other}: that is the destination, which comes last"
                raise StoryboardError(template.name, f"subgoals[{index}].after", reason)
    waiting = set(range(number))
    while free := {k for k in waiting if not waiting.intersection(template.subgoals[k].after)}:
        waiting -= free
    if waiting:
        cycle = ", ".join(str(k) for k in sorted(waiting))
        reason = f"the subgoals {cycle} wait for one another in a cycle; remove one `after`"
        raise StoryboardError(template.name, f"subgoals[{min(waiting)}].after", reason)
