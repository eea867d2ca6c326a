"""Answers about a town that are found once, when they are first asked for, and kept as long as the town is in use."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Concatenate, Final, ParamSpec, TypeVar, cast

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

P = ParamSpec("P")
Found = TypeVar("Found")

TOWNS: Final = 16
"""Number of towns, the last ones used, whose answers are kept."""


def kept_with_town(function: Callable[Concatenate[Town, P], Found]) -> Callable[Concatenate[Town, P], Found]:
    """Returns a function that keeps its results, for functions of a town and of few other arguments, such as a lane.

    Args:
        function: function without side effects, of hashable arguments given by position.
    """

    @functools.lru_cache(maxsize=TOWNS)
    def table(town: Town) -> dict[Any, Found]:
        return {}

    last: tuple[Town, dict[Any, Found]] | None = None  # most calls are about the town of the call before

    @functools.wraps(function)
    def found(town: Town, *arguments: P.args, **named: P.kwargs) -> Found:
        nonlocal last
        if named:
            return function(town, *arguments, **named)
        if last is None or last[0] is not town:
            last = town, table(town)
        known = last[1]
        if arguments not in known:
            known[arguments] = function(town, *arguments, **named)
        return known[arguments]

    return cast("Callable[Concatenate[Town, P], Found]", found)
