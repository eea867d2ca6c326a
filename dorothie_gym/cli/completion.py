"""Completion of names on the command line: towns, storyboards, policies, models, algorithms and environments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Final, TypeAlias

from dorothie_gym import maps as town_maps
from dorothie_gym import policies as players
from dorothie_gym import tasks
from dorothie_gym._registration import environment_ids
from dorothie_gym.maps.folds import TownFold
from dorothie_gym.maps.generated.specification import PREFIX as GENERATED_TOWNS
from dorothie_gym.ontology.roles import Role

ROLE_MODELS: Final = ("co-wizard", "participant")
"""Models of `train` that play a role."""

VISION_MODELS: Final = ("segformer", "detr")
"""Models of `train` that read pictures."""

Completion: TypeAlias = Callable[[str], list[str]]
"""Function that returns the completions of the beginning of a word."""


def complete_town(incomplete: str) -> list[str]:
    """Returns the shipped towns, the start of generated ones, and the map files that begin with a text."""
    return _names(incomplete, (*town_maps.town_names(), GENERATED_TOWNS)) + list(
        _paths(incomplete, (".yaml", ".yml", ".xodr"))
    )


def complete_towns(incomplete: str) -> list[str]:
    """Returns the completions of the last name in a list of towns, with the names before it."""
    before, comma, last = incomplete.rpartition(",")
    return [
        before + comma + name for name in _names(last, (*TownFold, "all", *town_maps.town_names(), GENERATED_TOWNS))
    ]


def complete_storyboard(incomplete: str) -> list[str]:
    """Returns the shipped storyboards and the JSON files that begin with a text."""
    return _names(incomplete, tasks.template_names()) + list(_paths(incomplete, (".json",)))


def complete_policy(role: str) -> Completion:
    """Returns the completion of the policies of a role, by name or file."""

    def complete(incomplete: str) -> list[str]:
        return _names(incomplete, players.policy_names(Role(role))) + list(_paths(incomplete))

    return complete


def complete_model(incomplete: str) -> list[str]:
    """Returns the models of `train` that begin with a text; none where torch is not installed."""
    try:
        from dorothie_gym.baselines.model_entries import CAMERA_ROWS, ROWS
    except ImportError:
        return []
    return _names(incomplete, (*(row.command for row in (*ROWS, *CAMERA_ROWS)), *VISION_MODELS, *ROLE_MODELS))


def complete_algorithm(incomplete: str) -> list[str]:
    """Returns the algorithms of `train-rl` that begin with a text; none where torch is not installed."""
    try:
        from dorothie_gym.baselines.rl.settings import ALGORITHMS
    except ImportError:
        return []
    return _names(incomplete, ALGORITHMS)


def complete_env(incomplete: str) -> list[str]:
    """Returns the ids of the registered environments that begin with a text."""
    return _names(incomplete, environment_ids())


def _names(incomplete: str, known: Iterable[str]) -> list[str]:
    return [name for name in known if name.startswith(incomplete)]


def _paths(incomplete: str, suffixes: tuple[str, ...] = ()) -> Iterator[str]:
    """Yields the files with one of the suffixes (any without), and the folders, that begin with a text."""
    given = Path(incomplete)
    folder = given if incomplete.endswith("/") else given.parent
    if not incomplete or not folder.is_dir():
        return
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or not str(path).startswith(str(given)):
            continue
        if path.is_dir():
            yield f"{path}/"
        elif not suffixes or path.suffix.lower() in suffixes:
            yield str(path)
