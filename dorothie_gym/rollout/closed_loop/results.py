"""The outcome of a rollout: a row a session, the table over them, and its file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from dorothie_gym.errors import RolloutError
from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind
from dorothie_gym.rollout.closed_loop.intervals import RESAMPLES, SEED, Interval, figures_of
from dorothie_gym.rollout.closed_loop.metrics import METRICS, Metric, RecoverySeconds
from dorothie_gym.rollout.closed_loop.session_record import SessionRecord

RESULT_FILE: Final = "rollout.json"
"""Within the folder of a rollout: its rows and its table."""

RESULT_VERSION: Final = "1.0"

NO_EXCEPTION: Final = "none"
"""Name of the row of sessions in which nothing unexpected happened."""


@dataclass(frozen=True, kw_only=True)
class RolloutRow:
    """One session of a rollout.

    Attributes:
        number: in the rollout.
        town: where it was played.
        seed: what it was played from.
        record: its measures; None where it ended in an error.
        error: that error.
    """

    number: int
    town: str
    seed: int
    record: SessionRecord | None = None
    error: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Returns number, town, seed, error, and the measures or null."""
        record = None if self.record is None else self.record.to_json()
        return {"number": self.number, "town": self.town, "seed": self.seed, "error": self.error, "record": record}


@dataclass(frozen=True, kw_only=True)
class RolloutResult:
    """What came of a rollout.

    Attributes:
        settings: what it was made from (`RolloutSettings.to_json`).
        rows: of the sessions that were played, by number.
    """

    settings: Mapping[str, Any]
    rows: tuple[RolloutRow, ...]

    @property
    def complete(self) -> bool:
        """Whether all sessions that were planned have been played."""
        return len(self.rows) == int(self.settings["sessions_planned"])

    @property
    def errored(self) -> int:
        """How many sessions ended in an error."""
        return sum(row.record is None for row in self.rows)

    def figures(self) -> dict[str, Interval]:
        """Returns every metric over all sessions, by key."""
        return _figures(self.rows)

    def to_json(self) -> dict[str, Any]:
        """Returns the table and the rows in JSON types; the same whoever computes it, and with however many workers."""
        return {
            "version": RESULT_VERSION,
            "settings": dict(self.settings),
            "complete": self.complete,
            **self.table(),
            "per_town": self._parts(dict.fromkeys(row.town for row in self.rows), lambda row, town: row.town == town),
            "per_exception": self.per_exception(),
            "seeds": [row.seed for row in self.rows],
            "interval": {"share": 0.95, "resamples": RESAMPLES, "seed": SEED},
            "rows": [row.to_json() for row in self.rows],
        }

    def table(self) -> dict[str, Any]:
        """Returns `sessions`, `errored`, `decisions`, and each metric as mean, low and high."""
        return _table(self.rows)

    def per_exception(self) -> dict[str, Any]:
        """Returns the table of the sessions in which each kind of exception happened, and of those without any.

        What is met and recovered from counts for the exceptions of that kind only.
        """
        found: dict[str, Any] = {}
        for kind in ExceptionKind:
            rows = [_only(row, kind) for row in self.rows if kind in _kinds(row)]
            if rows:
                found[kind.name.lower()] = _table(rows)
        free = [row for row in self.rows if row.record is not None and not row.record.exceptions]
        return {**found, NO_EXCEPTION: _table(free)} if free else found

    def _parts(self, names: Iterable[str], belongs: Callable[[RolloutRow, str], bool]) -> dict[str, Any]:
        return {name: _table([row for row in self.rows if belongs(row, name)]) for name in names}


def result_from_json(page: Any, where: str) -> RolloutResult:
    """Reads what `RolloutResult.to_json` returned; raises `RolloutError`, naming `where`, if it is something else."""
    try:
        if str(page["version"]).split(".")[0] != RESULT_VERSION.split(".")[0]:
            raise RolloutError(f"{where}: is of version {page['version']}; this package reads {RESULT_VERSION}")
        settings = dict(page["settings"])
        int(settings["sessions_planned"])
        rows = [
            RolloutRow(
                number=int(row["number"]),
                town=str(row["town"]),
                seed=int(row["seed"]),
                record=None if row["record"] is None else SessionRecord.from_json(row["record"]),
                error=row["error"],
            )
            for row in page["rows"]
        ]
    except (KeyError, TypeError, AttributeError) as error:
        raise RolloutError(
            f"{where}: is no result of a rollout ({type(error).__name__}: {error}); "
            f"give a {RESULT_FILE} that `dorothie-gym rollout --out` wrote"
        ) from None
    return RolloutResult(settings=settings, rows=tuple(rows))


def read_result(path: Path | str) -> RolloutResult:
    """Reads the result of a rollout.

    Args:
        path: of its folder, or of the file (also of what `rollout --json` wrote).

    Raises:
        RolloutError: there is none, or it is damaged.
    """
    file = Path(path) / RESULT_FILE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise RolloutError(f"{file}: does not exist; write it with `dorothie-gym rollout --out`")
    try:
        page = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise RolloutError(f"{file}: is no JSON ({error}); write it anew with `dorothie-gym rollout`") from None
    return result_from_json(page, str(file))


def _table(rows: Iterable[RolloutRow]) -> dict[str, Any]:
    rows = list(rows)
    records = [row.record for row in rows if row.record is not None]
    return {
        "sessions": len(rows),
        "errored": len(rows) - len(records),
        "decisions": sum(record.decisions for record in records),
        **{key: figure.to_json() for key, figure in _figures(rows).items()},
    }


def _figures(rows: Iterable[RolloutRow]) -> dict[str, Interval]:
    rows = list(rows)
    records = [row.record for row in rows if row.record is not None]
    return figures_of(records, len(rows) - len(records))


def _kinds(row: RolloutRow) -> frozenset[ExceptionKind]:
    return frozenset() if row.record is None else frozenset(each.kind for each in row.record.exceptions)


def _only(row: RolloutRow, kind: ExceptionKind) -> RolloutRow:
    """The same session with the exceptions of one kind."""
    assert row.record is not None
    kept = tuple(each for each in row.record.exceptions if each.kind is kind)
    return replace(row, record=replace(row.record, exceptions=kept))


# --- The result of a rollout on a terminal ---------------------------------------------------------------------------

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
