"""The result of a rollout on a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from dorothie_gym.evaluation.closed_loop.metrics import METRICS, Metric, RecoverySeconds
from dorothie_gym.evaluation.closed_loop.results import RolloutResult
from dorothie_gym.ontology import AGENT_ROLES

ALL_METRICS: Final[tuple[Metric | RecoverySeconds, ...]] = (*METRICS, RecoverySeconds())

MAIN: Final = (
    "success",
    "goal_condition_success",
    "spl",
    "route_completion",
    "infractions",
    "driving_score",
    "seconds",
)
"""Metrics of the table of towns."""

HANDLING: Final = ("success", "driving_score", "exceptions_met", "exceptions_recovered", "recovery_seconds")
"""Metrics of the table of exceptions."""

SEEDS: Final = 20
"""So many seeds are printed; all are in the file and in --json."""


def print_result(result: RolloutResult, console: Console) -> None:
    """Prints the tables of a rollout, its seeds, and what went wrong."""
    page = result.to_json()
    settings = page["settings"]
    cast = ", ".join(f"{role} {settings[str(role)]}" for role in AGENT_ROLES)
    errors = f", {page['errored']} of them ended in an error" if page["errored"] else ""
    console.print(f"{page['sessions']} sessions{errors}: {cast}", markup=False, soft_wrap=True)
    console.print(_overall(page))
    console.print(_parts("town", page["per_town"], MAIN))
    console.print(_parts("exception", page["per_exception"], HANDLING))
    seeds = [str(row.seed) for row in result.rows]
    more = "" if len(seeds) <= SEEDS else f", ... ({len(seeds)} in all, see --json)"
    console.print(f"Seeds (of --seed {settings['seed']}): {', '.join(seeds[:SEEDS])}{more}", soft_wrap=True)
    for row in result.rows:
        if row.error is not None:
            console.print(f"Session {row.number} ({row.town}, seed {row.seed}): {row.error}", markup=False)


def figure_text(metric: Metric | RecoverySeconds, figure: Mapping[str, float | None]) -> str:
    """Returns a figure with its interval: "95.0 [92.1, 97.4] %" for a share, "-" where it is not defined."""
    mean, low, high = figure["mean"], figure["low"], figure["high"]
    if mean is None:
        return "-"
    scale, digits = (100.0, 1) if metric.is_share else (1.0, 2)
    text = f"{mean * scale:.{digits}f}"
    if low is not None and high is not None:
        text += f" [{low * scale:.{digits}f}, {high * scale:.{digits}f}]"
    return text + (" %" if metric.is_share else "")


def _overall(page: Mapping[str, Any]) -> Table:
    table = Table("metric", "mean [95 % interval]", title="Closed loop")
    for metric in ALL_METRICS:
        table.add_row(metric.title, figure_text(metric, page[metric.key]))
    return table


def _parts(name: str, parts: Mapping[str, Mapping[str, Any]], keys: tuple[str, ...]) -> Table:
    chosen = [metric for metric in ALL_METRICS if metric.key in keys]
    table = Table(name, "sessions", "errored", *(metric.title for metric in chosen), title=f"By {name}")
    for part, figures in parts.items():
        cells = (figure_text(metric, figures[metric.key]).replace(" [", "\n[") for metric in chosen)
        table.add_row(part.replace("_", " "), str(figures["sessions"]), str(figures["errored"]), *cells)
    return table
