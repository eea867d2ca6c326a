"""Cross-play: each of several Co-Wizards with each of several participants, over the same sessions.

Self-play measures a pair that may have developed its own conventions; cross-play shows how a policy cooperates with
others (Carroll et al., NeurIPS 2019; Strouse et al., NeurIPS 2021).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from rich.table import Table

from dorothie_gym.evaluation.closed_loop.leaderboard import model_name
from dorothie_gym.evaluation.closed_loop.many_rollouts import folder_name, roll_out_all
from dorothie_gym.evaluation.closed_loop.results import ALL_METRICS, RolloutResult, figure_text
from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, command_of, towns_text
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import SCRIPTED, AnyPlayer, Player, player_of
from dorothie_gym.session.config import EnvConfig

RESULT_NAME: Final = "cross_play.json"
"""File of the result in the folder of a cross-play."""

PAGE_METRICS: Final = ("success", "goal_condition_success", "driving_score", "exchanges_per_subgoal")
"""Keys of the metrics with a matrix on the page."""

PRINTED_METRICS: Final = ("success", "goal_condition_success")
"""Keys of the metrics that are printed."""


@dataclass(frozen=True, kw_only=True)
class CrossPlaySettings:
    """Settings of a cross-play, which determine its result.

    Policies are given in any form that `player_of` takes, such as a class, and kept as players.

    Attributes:
        co_wizards: players of the Co-Wizard, at least one; the rows of the matrix.
        participants: players of the participant, at least one; the columns.
        ad_wizard: player of the Ad-Wizard in all sessions.
        towns: names or files of towns, which take turns.
        sessions: number of sessions of each pair.
        seed: seed; the sessions are the same for all pairs.
        config: settings of the engine.
    """

    co_wizards: Sequence[AnyPlayer]
    participants: Sequence[AnyPlayer]
    ad_wizard: AnyPlayer = SCRIPTED
    towns: tuple[str, ...]
    sessions: int = 20
    seed: int = 0
    config: EnvConfig = field(default_factory=EnvConfig)

    def __post_init__(self) -> None:
        """Checks the fields."""
        for name, players in (("co_wizards", self.rows), ("participants", self.columns)):
            given = [player.name for player in players]
            if not given:
                raise ValueError(f"{name} is empty; give at least one")
            if len(set(given)) < len(given):
                raise ValueError(f"{name} has {', '.join(given)}; give each once")

    @property
    def rows(self) -> tuple[Player, ...]:
        """Players of the Co-Wizard."""
        return tuple(player_of(given, Role.CO_WIZARD) for given in self.co_wizards)

    @property
    def columns(self) -> tuple[Player, ...]:
        """Players of the participant."""
        return tuple(player_of(given, Role.PARTICIPANT) for given in self.participants)

    def plans(self) -> dict[str, RolloutSettings]:
        """Returns the rollout of each pair by the name of its folder, row by row."""
        found: dict[str, RolloutSettings] = {}
        for driver in self.rows:
            for guide in self.columns:
                name = f"{folder_name(driver, Role.CO_WIZARD)}--{folder_name(guide, Role.PARTICIPANT)}"
                cast = {Role.CO_WIZARD: driver, Role.PARTICIPANT: guide, Role.AD_WIZARD: self.ad_wizard}
                found[name] = RolloutSettings(
                    cast=cast, towns=self.towns, sessions=self.sessions, seed=self.seed, config=self.config
                )
        return found


@dataclass(frozen=True, kw_only=True)
class CrossPlayResult:
    """Result of a cross-play.

    Attributes:
        co_wizards: names of the rows.
        participants: names of the columns.
        cells: result of each pair (Co-Wizard, participant).
    """

    co_wizards: tuple[str, ...]
    participants: tuple[str, ...]
    cells: Mapping[tuple[str, str], RolloutResult]

    def to_json(self) -> dict[str, object]:
        """Returns names, and the table of each pair with intervals, in JSON types."""
        cells = [
            {
                "co_wizard": driver,
                "participant": guide,
                "complete": result.complete,
                **result.table().to_json(),
                "usage": {role: usage.to_json() for role, usage in result.usage().items()},
            }
            for (driver, guide), result in self.cells.items()
        ]
        settings = dict(next(iter(self.cells.values())).settings)
        shared = {name: settings[name] for name in ("ad_wizard", "towns", "sessions_planned", "seed", "config")}
        return {"co_wizards": list(self.co_wizards), "participants": list(self.participants), **shared, "cells": cells}

    def matrix(self, key: str) -> list[list[str]]:
        """Returns the figures of a metric as text, with intervals; a row for each Co-Wizard."""
        metric = next(one for one in ALL_METRICS if one.key == key)
        return [
            [figure_text(metric, self.cells[driver, guide].table().figures[key]) for guide in self.participants]
            for driver in self.co_wizards
        ]

    def tables(self) -> list[Table]:
        """Returns the matrices for the terminal."""
        found = []
        for key in PRINTED_METRICS:
            table = Table("Co-Wizard \\ participant", title=_title(key))
            for guide in _short(self.participants):
                table.add_column(guide)
            for driver, cells in zip(_short(self.co_wizards), self.matrix(key), strict=True):
                table.add_row(driver, *cells)
            found.append(table)
        return found

    def page(self) -> str:
        """Returns the matrices as Markdown, with the commands of the pairs."""
        settings = next(iter(self.cells.values())).settings
        lines = [
            "# Cross-play",
            "",
            "This page is generated by `dorothie-gym cross-play`. Rows are Co-Wizards, columns participants; each pair",
            f"played the same {settings['sessions_planned']} sessions, in {towns_text(settings['towns'], ', ')}."
            " Values are"
            " means with 95 % intervals, as in",
            "closed-loop evaluation.",
        ]
        for key in PAGE_METRICS:
            head = "| Co-Wizard | " + " | ".join(_short(self.participants)) + " |"
            lines += ["", f"## {_title(key).capitalize()}", "", head, "|" + "---|" * (len(self.participants) + 1)]
            rows = zip(_short(self.co_wizards), self.matrix(key), strict=True)
            lines += [f"| {driver} | {' | '.join(cells)} |" for driver, cells in rows]
        commands = [command_of(result.settings) for result in self.cells.values()]
        return "\n".join([*lines, "", "## Commands", "", "```bash", *commands, "```", ""])


def _short(names: Sequence[str]) -> list[str]:
    """Returns the names of players, of models instead of the paths of their folders where that is clear."""
    short = [model_name(name) for name in names]
    return [label if short.count(label) == 1 else name for name, label in zip(names, short, strict=True)]


def _title(key: str) -> str:
    return next(metric.title for metric in ALL_METRICS if metric.key == key)


def cross_play(
    settings: CrossPlaySettings,
    folder: Path | str,
    *,
    workers: int = 1,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> CrossPlayResult:
    """Plays all pairs; an interrupted cross-play is resumed. See `roll_out_all`.

    Args:
        settings: settings.
        folder: folder with a rollout for each pair, created if missing.
        workers: number of processes.
        ray: address of a Ray cluster that replaces the workers.
        on_session: called with the numbers of finished and of planned sessions.

    Raises:
        RolloutError: a result is damaged.
        SessionError: a folder contains other files, or a rollout of other settings.
        ProcessError: a process died, or there is no such cluster.
        OSError: a folder cannot be written.
    """
    plans = settings.plans()
    results = roll_out_all(plans, folder, workers=workers, ray=ray, on_session=on_session)
    cells = {
        (plan.players[Role.CO_WIZARD].name, plan.players[Role.PARTICIPANT].name): results[name]
        for name, plan in plans.items()
    }
    return CrossPlayResult(
        co_wizards=tuple(player.name for player in settings.rows),
        participants=tuple(player.name for player in settings.columns),
        cells=cells,
    )
