"""Result of a rollout: one row per session, the table over all sessions, and its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NotRequired, TypedDict

from msgspec import Meta
from rich.console import Console
from rich.table import Table

from dorothie_gym.errors import InputFileError, RolloutError
from dorothie_gym.evaluation.analysis.intervals import CONFIDENCE, RESAMPLES
from dorothie_gym.evaluation.closed_loop.beacon import BeaconPage
from dorothie_gym.evaluation.closed_loop.metrics import (
    BOOTSTRAP_SEED,
    METRICS,
    AllTrials,
    FigurePage,
    MetricInterval,
    RecoverySeconds,
    ShownMetric,
    figures_of,
)
from dorothie_gym.evaluation.closed_loop.seal import SealPage
from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord, SessionRecordPage
from dorothie_gym.evaluation.closed_loop.usage import (
    SessionUsage,
    total_usage,
    usage_from_json,
    usage_table,
    usage_to_json,
)
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.policies.language_model.usage import UsagePage
from dorothie_gym.support.input_files import MAX_RESULT_JSON, checked, raising, read_json

if TYPE_CHECKING:
    from dorothie_gym.support.files import JsonValue

RESULT_FILE: Final = "rollout.json"
"""File of rows and table in the folder of a rollout."""

RESULT_VERSION: Final = "1.0"

NO_EXCEPTION: Final = "none"
"""Name of the group of sessions without exceptions."""


@dataclass(frozen=True, kw_only=True)
class RolloutRow:
    """Result of one session of a rollout.

    Attributes:
        number: number of the session in the rollout.
        town: name or file of the town.
        seed: seed of the session.
        record: measures of the session; None if it ended in an error.
        error: the error, if any.
        usage: usage of language models, by role; empty if there is none.
        trial: number of the trial, of several of one scenario.
        participant: name of the participant's player, if several take turns.
    """

    number: int
    town: str
    seed: int
    record: SessionRecord | None = None
    error: str | None = None
    usage: SessionUsage = field(default_factory=dict)
    trial: int = 0
    participant: str | None = None

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types; `usage`, `trial` and `participant` are left out if there are none."""
        record = None if self.record is None else self.record.to_json()
        return {
            "number": self.number,
            "town": self.town,
            "seed": self.seed,
            "error": self.error,
            "record": record,
            **({"usage": usage_to_json(self.usage)} if self.usage else {}),
            **({"trial": self.trial} if self.trial else {}),
            **({"participant": self.participant} if self.participant is not None else {}),
        }


@dataclass(frozen=True, kw_only=True)
class RolloutTable:
    """Metrics over sessions of a rollout.

    Attributes:
        sessions: number of sessions.
        errored: number of sessions that ended in an error.
        decisions: number of decisions of the agents.
        figures: each metric by key.
    """

    sessions: int
    errored: int
    decisions: int
    figures: Mapping[str, FigurePage]

    @classmethod
    def of(cls, rows: Sequence[RolloutRow]) -> RolloutTable:
        """Returns the table of the given rows."""
        records = [row.record for row in rows if row.record is not None]
        return cls(
            sessions=len(rows),
            errored=len(rows) - len(records),
            decisions=sum(record.decisions for record in records),
            figures={key: figure.to_json() for key, figure in _figures(rows).items()},
        )

    def to_json(self) -> dict[str, object]:
        """Returns `sessions`, `errored`, `decisions`, and each metric, in JSON types."""
        return {"sessions": self.sessions, "errored": self.errored, "decisions": self.decisions, **self.figures}


@dataclass(frozen=True, kw_only=True)
class RolloutResult:
    """Result of a rollout.

    Attributes:
        settings: settings of the rollout (`RolloutSettings.to_json`).
        rows: rows of the finished sessions, by number.
    """

    settings: Mapping[str, Any]
    rows: tuple[RolloutRow, ...]

    @property
    def complete(self) -> bool:
        """Whether all planned sessions are finished."""
        return len(self.rows) == int(self.settings["sessions_planned"])

    @property
    def errored(self) -> int:
        """Number of sessions that ended in an error."""
        return sum(row.record is None for row in self.rows)

    def figures(self) -> dict[str, MetricInterval]:
        """Returns every metric over all sessions, by key."""
        return _figures(self.rows)

    def to_json(self) -> dict[str, object]:
        """Returns the table and the rows in JSON types; they do not depend on the number of workers."""
        usage, partners = self.usage(), self.per_partner()
        return {
            "version": RESULT_VERSION,
            "settings": dict(self.settings),
            "complete": self.complete,
            **self.table().to_json(),
            "per_town": {town: table.to_json() for town, table in self.per_town().items()},
            "per_exception": {kind: table.to_json() for kind, table in self.per_exception().items()},
            **({"per_partner": {name: table.to_json() for name, table in partners.items()}} if partners else {}),
            **({"usage": usage_to_json(usage)} if usage else {}),
            "seeds": [row.seed for row in self.rows],
            "interval": {"share": CONFIDENCE, "resamples": RESAMPLES, "seed": BOOTSTRAP_SEED},
            "rows": [row.to_json() for row in self.rows],
        }

    def table(self) -> RolloutTable:
        """Returns the table of all sessions."""
        return RolloutTable.of(self.rows)

    def usage(self) -> SessionUsage:
        """Returns the usage of language models in all sessions, by role; empty if there is none."""
        return total_usage([row.usage for row in self.rows])

    def per_town(self) -> dict[str, RolloutTable]:
        """Returns the table of each town, in the order of their first sessions."""
        towns = dict.fromkeys(row.town for row in self.rows)
        return {town: RolloutTable.of([row for row in self.rows if row.town == town]) for town in towns}

    def per_partner(self) -> dict[str, RolloutTable]:
        """Returns the table of each participant, in the order of their first sessions; empty if there is only one."""
        names = dict.fromkeys(row.participant for row in self.rows if row.participant is not None)
        return {name: RolloutTable.of([row for row in self.rows if row.participant == name]) for name in names}

    def per_exception(self) -> dict[str, RolloutTable]:
        """Returns a table for the sessions with each kind of exception, and one for sessions without exceptions.

        Exceptions met and recovered from are those of that kind only.
        """
        found: dict[str, RolloutTable] = {}
        for kind in ExceptionKind:
            rows = [
                replace(row, record=record)
                for row in self.rows
                if row.record is not None and (record := _only(row.record, kind)).exceptions
            ]
            if rows:
                found[kind.name.lower()] = RolloutTable.of(rows)
        free = [row for row in self.rows if row.record is not None and not row.record.exceptions]
        return {**found, NO_EXCEPTION: RolloutTable.of(free)} if free else found


class _RowPage(TypedDict):
    """Row in JSON types; fields as in `RolloutRow`."""

    number: Annotated[int, Meta(ge=0)]
    town: str
    seed: Annotated[int, Meta(ge=0)]
    error: str | None
    record: SessionRecordPage | None
    usage: NotRequired[dict[str, UsagePage]]
    trial: NotRequired[Annotated[int, Meta(ge=0, lt=1000)]]
    participant: NotRequired[str]


class _ConfigPage(TypedDict):
    """Settings of the engine that tables and commands show."""

    max_seconds: float
    word_error_rate: float


class _TrainingPage(TypedDict, total=False):
    """Cost of the training of a learned player."""

    steps: Annotated[float, Meta(ge=0)]
    seconds: Annotated[float, Meta(ge=0)]


class _SettingsPage(TypedDict):
    """Fields of the output of `RolloutSettings.to_json` that are read."""

    participant: str
    co_wizard: str
    ad_wizard: str
    towns: list[str]
    sessions_planned: Annotated[int, Meta(ge=1, lt=2**31)]
    seed: Annotated[int, Meta(ge=0)]
    config: _ConfigPage
    training: NotRequired[dict[str, _TrainingPage]]
    tier: NotRequired[str]
    oracle: NotRequired[bool]
    beacon: NotRequired[BeaconPage]
    seal: NotRequired[SealPage]
    trials: NotRequired[Annotated[int, Meta(ge=1, lt=2**31)]]


class _ResultPage(TypedDict):
    """Fields of the output of `RolloutResult.to_json` that are read; the tables follow from the rows."""

    version: str
    settings: _SettingsPage
    rows: list[_RowPage]


def result_from_json(page: JsonValue, where: str) -> RolloutResult:
    """Parses the output of `RolloutResult.to_json`; raises `RolloutError`, naming `where`, if it is malformed."""
    with raising(RolloutError):
        version = page.get("version") if isinstance(page, Mapping) else None
        if isinstance(version, str) and version.split(".")[0] != RESULT_VERSION.split(".")[0]:
            raise RolloutError(f"{where}: is of version {version[:40]}; this package reads {RESULT_VERSION}")
        try:
            found = checked(page, _ResultPage, where)
        except InputFileError as error:
            raise RolloutError(f"{error}; give a {RESULT_FILE} from `dorothie-gym rollout --out`") from None
        rows = [
            RolloutRow(
                number=row["number"],
                town=row["town"],
                seed=row["seed"],
                record=None if row["record"] is None else SessionRecord.from_json(row["record"]),
                error=row["error"],
                usage=usage_from_json(row.get("usage", {})),
                trial=row.get("trial", 0),
                participant=row.get("participant"),
            )
            for row in found["rows"]
        ]
    # With the settings that are not read here, such as the other ones of the engine.
    settings = checked(page, dict[str, Any], where)["settings"]
    return RolloutResult(settings=settings, rows=tuple(rows))


def read_result(path: Path | str) -> RolloutResult:
    """Reads the result of a rollout.

    Args:
        path: folder of the rollout, or its file (also the output of `rollout --json`).

    Raises:
        RolloutError: the file is missing or damaged.
    """
    file = Path(path) / RESULT_FILE if Path(path).is_dir() else Path(path)
    with raising(RolloutError):
        try:
            page = read_json(file, MAX_RESULT_JSON)
        except FileNotFoundError:
            raise RolloutError(f"{file}: does not exist; write it with `dorothie-gym rollout --out`") from None
    return result_from_json(page, str(file))


def _figures(rows: Sequence[RolloutRow]) -> dict[str, MetricInterval]:
    records = [row.record for row in rows if row.record is not None]
    found = figures_of(records, len(rows) - len(records))
    found[AllTrials.key] = AllTrials().interval(_trials(rows))
    return found


def _trials(rows: Sequence[RolloutRow]) -> list[list[bool]]:
    """Returns whether each trial of each scenario is passed; an error counts as a failure."""
    found: dict[tuple[str, int], list[bool]] = {}
    for row in rows:
        found.setdefault((row.town, row.seed), []).append(row.record is not None and row.record.passed)
    return list(found.values())


def _only(record: SessionRecord, kind: ExceptionKind) -> SessionRecord:
    """Returns the record with the exceptions of one kind only."""
    return replace(record, exceptions=tuple(each for each in record.exceptions if each.kind is kind))


# --- terminal ---------------------------------------------------------------------------------------------------------

ALL_METRICS: Final[tuple[ShownMetric, ...]] = (*METRICS, RecoverySeconds(), AllTrials())

TOWN_METRICS: Final = (
    "talk_success",
    "unnecessary_questions",
    "timely_completion",
    "success",
    "goal_condition_success",
    "spl",
    "route_completion",
    "infractions",
    "driving_score",
    "seconds",
)
"""Metrics of the table of towns."""

PARTNER_METRICS: Final = (
    "talk_success",
    "timely_completion",
    "success",
    "goal_condition_success",
    "driving_score",
    "all_trials",
)
"""Metrics of the table of partners."""

EXCEPTION_METRICS: Final = ("success", "driving_score", "exceptions_met", "exceptions_recovered", "recovery_seconds")
"""Metrics of the table of exceptions."""

MAX_PRINTED_SEEDS: Final = 20
"""Number of seeds that are printed; the file and --json have all."""

MAX_PRINTED_TOWNS: Final = 20
"""Number of towns up to which there is a table of towns; the file and --json have all."""


def print_result(result: RolloutResult, console: Console) -> None:
    """Prints the tables of a rollout, its seeds, and its errors."""
    table, settings = result.table(), result.settings
    cast = ", ".join(f"{role} {settings[str(role)]}" for role in AGENT_ROLES)
    errors = f", {table.errored} of them ended in an error" if table.errored else ""
    console.print(f"{table.sessions} sessions{errors}: {cast}", markup=False, soft_wrap=True)
    console.print(_overall(table))
    towns = result.per_town()
    if len(towns) > MAX_PRINTED_TOWNS:
        console.print(f"{len(towns)} towns; --json and the file have the figures of each")
    else:
        for part in _parts("town", towns, TOWN_METRICS, console.width):
            console.print(part)
    for part in _parts("exception", result.per_exception(), EXCEPTION_METRICS, console.width):
        console.print(part)
    partners = result.per_partner()
    for part in _parts("partner", partners, PARTNER_METRICS, console.width) if partners else ():
        console.print(part)
    if worst := worst_partner(partners):
        console.print(f"Worst partner: {worst}", markup=False)
    if usage := result.usage():
        console.print(usage_table(usage, table.sessions))
    seeds = [str(row.seed) for row in result.rows]
    more = "" if len(seeds) <= MAX_PRINTED_SEEDS else f", ... ({len(seeds)} in all, see --json)"
    source = "the beacon" if settings.get("beacon") else f"--seed {settings['seed']}"
    console.print(f"Seeds (of {source}): {', '.join(seeds[:MAX_PRINTED_SEEDS])}{more}", soft_wrap=True)
    for row in result.rows:
        if row.error is not None:
            console.print(f"Session {row.number} ({row.town}, seed {row.seed}): {row.error}", markup=False)


def worst_partner(partners: Mapping[str, RolloutTable]) -> str | None:
    """Returns the partner with the lowest timely completion, or success where that is undefined; None without any."""
    ranks = {name: table.figures["timely_completion"]["mean"] for name, table in partners.items()}
    if any(rank is None for rank in ranks.values()):
        ranks = {name: table.figures["success"]["mean"] for name, table in partners.items()}
    known = {name: rank for name, rank in ranks.items() if rank is not None}
    return min(known, key=lambda name: (known[name], name)) if known else None


def figure_text(metric: ShownMetric, figure: FigurePage) -> str:
    """Returns a figure with its interval: "95.0 [92.1, 97.4] %" for a share, "-" if it is undefined."""
    mean, low, high = figure["mean"], figure["low"], figure["high"]
    if mean is None:
        return "-"
    scale, digits = (100.0, 1) if metric.is_share else (1.0, 2)
    text = f"{mean * scale:.{digits}f}"
    if low is not None and high is not None:
        text += f" [{low * scale:.{digits}f}, {high * scale:.{digits}f}]"
    return text + (" %" if metric.is_share else "")


def _overall(page: RolloutTable) -> Table:
    table = Table("metric", "mean [95 % interval]", title="Closed loop")
    for metric in ALL_METRICS:
        if metric.optional and page.figures[metric.key]["mean"] is None:
            continue
        table.add_row(metric.title, figure_text(metric, page.figures[metric.key]))
    return table


_BORDER: Final = 3
"""Width of a table's border and padding per column; one more at its end [columns]."""


def _parts(name: str, parts: Mapping[str, RolloutTable], keys: tuple[str, ...], width: int) -> Iterator[Table]:
    """Yields tables of the metrics of each part, each with as many metrics as a width [columns] has room for."""
    first: dict[str, list[str]] = {
        name: [part.replace("_", " ") for part in parts],
        "sessions": [str(page.sessions) for page in parts.values()],
        "errored": [str(page.errored) for page in parts.values()],
    }
    figures = {
        metric.title: [figure_text(metric, page.figures[metric.key]).replace(" [", "\n[") for page in parts.values()]
        for metric in ALL_METRICS
        if metric.key in keys and not (metric.optional and is_undefined(metric, parts))
    }
    taken, chosen = _width(first) + 1, dict[str, list[str]]()
    for title, cells in figures.items():
        if chosen and taken + _width({**chosen, title: cells}) > width:
            yield _table(name, {**first, **chosen}, width)
            chosen = {}
        chosen[title] = cells
    yield _table(name, {**first, **chosen}, width)


def is_undefined(metric: ShownMetric, parts: Mapping[str, RolloutTable]) -> bool:
    """Returns whether no table has a value of a metric."""
    return all(page.figures[metric.key]["mean"] is None for page in parts.values())


def _narrowest(title: str, cells: Sequence[str]) -> int:
    """Returns the width of a column that breaks no word of its title and no line of its cells."""
    return max(len(part) for part in (*title.split(), *(line for cell in cells for line in cell.split("\n"))))


def _width(columns: Mapping[str, Sequence[str]]) -> int:
    return sum(_narrowest(title, cells) + _BORDER for title, cells in columns.items())


def _table(name: str, columns: Mapping[str, Sequence[str]], width: int) -> Table:
    """Returns a table; its titles are wrapped if it would otherwise be wider than a width [columns]."""
    whole = sum(max(len(title), _narrowest(title, cells)) + _BORDER for title, cells in columns.items()) + 1
    table = Table(title=f"By {name}")
    for title, cells in columns.items():
        table.add_column(title, width=_narrowest(title, cells) if whole > width else None)
    for row in zip(*columns.values(), strict=True):
        table.add_row(*row)
    return table
