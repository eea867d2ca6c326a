"""The leaderboard: a row a policy, from the results of rollouts, as a page and a picture."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from dorothie_gym.ontology import Role
from dorothie_gym.rendering.charts import INK, dress_percent_axes, empty_figure
from dorothie_gym.rollout.closed_loop.metrics import Metric, RecoverySeconds
from dorothie_gym.rollout.closed_loop.results import (
    ALL_METRICS,
    RESULT_FILE,
    RolloutError,
    RolloutResult,
    figure_text,
    read_result,
)
from dorothie_gym.rollout.closed_loop.running import COST_FILE, command_of, fold_of_towns

OTHER: Final = "other"
"""Part of the rollouts in towns of both folds, or of none."""

PARTS: Final[Mapping[str, str]] = {"seen": "Seen towns", "unseen": "Unseen towns", OTHER: "Other towns"}
"""Parts of the page, and their titles."""

COLUMNS: Final = (
    "success", "goal_condition_success", "spl", "route_completion", "infraction_score", "driving_score", "seconds",
    "exchanges_per_subgoal", "clarification_rate", "exceptions_recovered", "recovery_seconds",
)  # fmt: skip
"""Metrics of the page, by key."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A rollout on the leaderboard.

    Attributes:
        folder: where its result lies.
        result: the result.
        page: its table (`RolloutResult.table`).
        cost: what it took where it was played: `wall_seconds`, `cpu_seconds`, `workers`; empty where not known.
    """

    folder: Path
    result: RolloutResult
    page: Mapping[str, Any]
    cost: Mapping[str, float]

    @property
    def policy(self) -> str:
        """How its row is called: the Co-Wizard, and who else is not scripted, and how badly they hear."""
        settings = self.result.settings
        name = str(settings[str(Role.CO_WIZARD)])
        others = [
            f"{role.value.replace('_', '-')} {settings[str(role)]}"
            for role in (Role.PARTICIPANT, Role.AD_WIZARD)
            if settings[str(role)] != "scripted"
        ]
        if rate := settings["config"]["word_error_rate"]:
            others.append(f"word errors {100 * rate:g} %")
        return f"{name} ({', '.join(others)})" if others else name

    @property
    def part(self) -> str:
        """Part of the page: a key of `PARTS`."""
        return fold_of_towns(self.result.settings["towns"]) or OTHER

    @property
    def rank(self) -> tuple[float, float, str]:
        """What rows are sorted by: success, then driving score, best first; then the name."""
        success, score = (self.page[key]["mean"] for key in ("success", "driving_score"))
        return -(success or 0.0), -(score or 0.0), self.policy


def read_entries(folders: Sequence[Path | str]) -> tuple[Entry, ...]:
    """Reads the results of rollouts, in order of parts and ranks.

    Args:
        folders: of rollouts, or of folders with rollouts in them.

    Raises:
        RolloutError: there is none, one is damaged, or two are of the same policy in the same part.
    """
    entries: dict[tuple[str, str], Entry] = {}
    for folder in _with_results(folders):
        entry = _read(folder)
        other = entries.setdefault((entry.part, entry.policy), entry)
        if other is not entry:
            raise RolloutError(
                f"{folder}: {entry.policy} in {PARTS[entry.part].lower()} is in {other.folder}, too; give one of them"
            )
    order = list(PARTS)
    return tuple(sorted(entries.values(), key=lambda entry: (order.index(entry.part), entry.rank)))


def leaderboard_page(entries: Sequence[Entry], picture: str | None = None) -> str:
    """Returns the leaderboard as Markdown.

    Args:
        entries: the rollouts, in order.
        picture: name of the picture beside the page, or None.
    """
    lines = [
        "# Leaderboard",
        "",
        "Written by `dorothie-gym leaderboard` from the results of `dorothie-gym rollout`; not to be edited. Means",
        "over sessions with 95 % bootstrap intervals; sessions that ended in an error count as failures. What the",
        "columns mean is told in [Closed loop](closed-loop.md).",
    ]
    if picture is not None:
        lines += ["", f"![Success and driving score of each policy, with intervals]({picture})"]
    for part, title in PARTS.items():
        chosen = [entry for entry in entries if entry.part == part]
        if chosen:
            lines += ["", f"## {title}", "", *_figures(chosen)]
    lines += ["", "## Cost", "", *_costs(entries), "", "## Commands", "", "The tables come out of these again:", ""]
    lines += ["```bash", *(command_of(entry.result.settings) for entry in entries), "```", ""]
    return "\n".join(lines)


def _figures(entries: Sequence[Entry]) -> list[str]:
    columns: list[Metric | RecoverySeconds] = [
        next(metric for metric in ALL_METRICS if metric.key == key) for key in COLUMNS
    ]
    rows = [["Co-Wizard", "sessions", "errored", *(metric.title for metric in columns)]]
    for entry in entries:
        cells = [figure_text(metric, entry.page[metric.key]) for metric in columns]
        part = "" if entry.result.complete else f" of {entry.result.settings['sessions_planned']}"
        rows.append([entry.policy, f"{entry.page['sessions']}{part}", str(entry.page["errored"]), *cells])
    return _table(rows)


def _costs(entries: Sequence[Entry]) -> list[str]:
    rows = [["Co-Wizard", "towns", "steps of training", "training", "decisions played", "played in", "processor time"]]
    for entry in entries:
        training = entry.result.settings.get("training", {}).get(str(Role.CO_WIZARD), {})
        workers = entry.cost.get("workers")
        rows.append(
            [
                entry.policy,
                entry.part,
                f"{training['steps']:,.0f}" if "steps" in training else "-",
                _time(training.get("seconds")),
                f"{entry.page['decisions']:,}",
                _time(entry.cost.get("wall_seconds")) + (f" by {workers:g}" if workers else ""),
                _time(entry.cost.get("cpu_seconds")),
            ]
        )
    return _table(rows)


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return [lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]


def _time(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{seconds:.0f} s" if seconds < 600 else f"{seconds / 60:.0f} min"


def _with_results(folders: Sequence[Path | str]) -> list[Path]:
    found: list[Path] = []
    for given in map(Path, folders):
        here = [given] if (given / RESULT_FILE).is_file() else sorted(p.parent for p in given.glob(f"*/{RESULT_FILE}"))
        if not here:
            raise RolloutError(f"{given}: holds no {RESULT_FILE}; write one with `dorothie-gym rollout --out {given}`")
        found += [folder for folder in here if folder not in found]
    return found


def _read(folder: Path) -> Entry:
    result = read_result(folder)
    file = folder / COST_FILE
    try:
        cost = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    except ValueError as error:
        raise RolloutError(f"{file}: is no JSON ({error}); remove it, and play the rollout again") from None
    return Entry(folder=folder, result=result, page=result.table(), cost=cost)


# --- The leaderboard as a picture: a row a policy, a dot a part, with intervals --------------------------------------

PANELS: Final = ("success", "goal_condition_success", "driving_score", "spl")
"""Metrics that are drawn: shares, each with a panel of its own."""

_ROW, _TOP, _BOTTOM = 0.5, 1.2, 0.6
_COLOURS: Final = {"seen": "#2f62c4", "unseen": "#cf7f1d", OTHER: "#5f8a3a"}


def draw_leaderboard(entries: Sequence[Entry], path: Path | str) -> Path:
    """Draws the leaderboard.

    Args:
        entries: the rollouts, in order.
        path: PNG file to write.

    Returns:
        The path.

    Raises:
        OSError: the file cannot be written.
    """
    names = list(dict.fromkeys(entry.policy for entry in sorted(entries, key=lambda entry: entry.rank)))
    height = _TOP + _BOTTOM + _ROW * max(len(names), 1)
    with empty_figure(12.0, height) as figure:
        axes = figure.subplots(1, len(PANELS), sharey=True, squeeze=False)[0]
        figure.subplots_adjust(left=0.2, right=0.98, top=1 - _TOP / height, bottom=_BOTTOM / height, wspace=0.09)
        for key, panel in zip(PANELS, axes, strict=True):
            _panel(panel, entries, names, key)
        axes[0].set_yticks(range(len(names)), names, fontsize=9, color=INK)
        axes[0].set_ylim(len(names) - 0.5, -0.5)
        figure.text(0.012, 1 - 0.38 / height, "Co-Wizards in the loop", fontsize=14, weight="bold")
        _legend(figure, entries, height)
        figure.savefig(path, format="png")
    return Path(path)


def _panel(axes: Any, entries: Sequence[Entry], names: Sequence[str], key: str) -> None:
    parts = [part for part in PARTS if any(entry.part == part for entry in entries)]
    for entry in entries:
        figure = entry.page[key]
        if figure["mean"] is None:
            continue
        at = names.index(entry.policy) + (parts.index(entry.part) - (len(parts) - 1) / 2) * 0.3
        colour = _COLOURS[entry.part]
        if figure["low"] is not None:
            axes.plot([100 * figure["low"], 100 * figure["high"]], [at, at], color=colour, linewidth=1.4, zorder=2)
        axes.plot([100 * figure["mean"]], [at], "o", markersize=5.5, color=colour, zorder=3)
    title = next(metric.title for metric in ALL_METRICS if metric.key == key)
    dress_percent_axes(axes, title, len(names), margin=3)


def _legend(figure: Any, entries: Sequence[Entry], height: float) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=_COLOURS[part], marker="o", label=title.lower())
        for part, title in PARTS.items()
        if any(entry.part == part for entry in entries)
    ]
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.006, 1 - 0.5 / height), ncols=3, frameon=False, fontsize=9
    )
