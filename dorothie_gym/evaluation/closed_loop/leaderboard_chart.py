"""Picture of the leaderboard: intervals of the main metrics, policies from best to worst."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.evaluation.closed_loop.leaderboard import IMPORTED, OTHER, PART_TITLES, LeaderboardEntry, labels_of
from dorothie_gym.evaluation.closed_loop.protocol import sealed_part
from dorothie_gym.evaluation.closed_loop.results import ALL_METRICS
from dorothie_gym.evaluation.tiers import TIERS
from dorothie_gym.pictures.chart_style import INK, dress_percent_axes, empty_figure
from dorothie_gym.support.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CHART_METRICS: Final = ("success", "goal_condition_success", "driving_score", "spl")
"""Metrics of the panels of the picture."""

_ROW, _TOP, _BOTTOM = 0.5, 1.2, 0.6
_TIER_COLOURS: Final = ("#4d6f9f", "#b0793a", "#b03a3a", "#6a3ab0", "#2f8f5a", "#8f2f7a")
"""Colours of the tiers, in their order."""

_SEALED: Final = frozenset(sealed_part(name) for name in TIERS)

_COLOURS: Final = {
    "seen": "#2f62c4",
    "development": "#2f8f8a",
    "validation": "#9a7b1f",
    "unseen": "#cf7f1d",
    IMPORTED: "#8a4fb0",
    OTHER: "#5f8a3a",
    **dict(zip(TIERS, _TIER_COLOURS, strict=True)),
    **{sealed_part(name): colour for name, colour in zip(TIERS, _TIER_COLOURS, strict=True)},
}


@dataclass(frozen=True, kw_only=True)
class ChartRow:
    """Rollout in the picture.

    Attributes:
        label: name of the policy.
        part: key of `PART_TITLES`.
        figures: `mean`, `low` and `high` of each of `CHART_METRICS`.
    """

    label: str
    part: str
    figures: Mapping[str, Mapping[str, float | None]]


def draw_leaderboard(entries: Sequence[LeaderboardEntry], path: Path | str) -> Path:
    """Draws the leaderboard.

    Args:
        entries: the rollouts, in order.
        path: PNG file to write.

    Returns:
        The path.

    Raises:
        OSError: the file cannot be written.
    """
    labels = labels_of(entries)
    rows = [
        ChartRow(
            label=labels[entry.policy],
            part=entry.part,
            figures={key: entry.table.figures[key] for key in CHART_METRICS},
        )
        for entry in sorted(entries, key=lambda entry: entry.rank)
    ]
    return draw_rows(rows, path)


def draw_rows(rows: Sequence[ChartRow], path: Path | str) -> Path:
    """Draws the rows of a leaderboard, policies from best to worst; see `draw_leaderboard`."""
    names = list(dict.fromkeys(row.label for row in rows))
    height = _TOP + _BOTTOM + _ROW * max(len(names), 1)
    with empty_figure(12.0, height) as figure:
        axes = figure.subplots(1, len(CHART_METRICS), sharey=True, squeeze=False)[0]
        figure.subplots_adjust(left=0.2, right=0.98, top=1 - _TOP / height, bottom=_BOTTOM / height, wspace=0.09)
        for key, panel in zip(CHART_METRICS, axes, strict=True):
            _panel(panel, rows, names, key)
        axes[0].set_yticks(range(len(names)), [_folded(name) for name in names], fontsize=9, color=INK)
        axes[0].set_ylim(len(names) - 0.5, -0.5)
        figure.text(0.012, 1 - 0.38 / height, "Co-Wizards in the loop", fontsize=14, weight="bold")
        _legend(figure, {row.part for row in rows}, height)
        with replacing(Path(path)) as part:
            figure.savefig(part, format="png")
    return Path(path)


def _folded(label: str) -> str:
    """Returns a label with its remarks, which are in brackets, on a line of their own."""
    return label.replace(" (", "\n(", 1)


def _panel(axes: Axes, rows: Sequence[ChartRow], names: Sequence[str], key: str) -> None:
    parts = [part for part in PART_TITLES if any(row.part == part for row in rows)]
    for row in rows:
        figure = row.figures[key]
        mean, low, high = figure["mean"], figure["low"], figure["high"]
        if mean is None:
            continue
        at = names.index(row.label) + (parts.index(row.part) - (len(parts) - 1) / 2) * 0.3
        colour = _COLOURS[row.part]
        if low is not None and high is not None:
            axes.plot([100 * low, 100 * high], [at, at], color=colour, linewidth=1.4, zorder=2)
        axes.plot([100 * mean], [at], _marker(row.part), markersize=5.5, color=colour, zorder=3)
    title = next(metric.title for metric in ALL_METRICS if metric.key == key)
    dress_percent_axes(axes, title, len(names), margin=3)


def _marker(part: str) -> str:
    """Returns the marker of a part: a diamond for sealed tests, which have the colour of their tier."""
    return "D" if part in _SEALED else "o"


def _legend(figure: Figure, parts: AbstractSet[str], height: float) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=_COLOURS[part], marker=_marker(part), label=title.lower())
        for part, title in PART_TITLES.items()
        if part in parts
    ]
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.006, 1 - 0.5 / height), ncols=4, frameon=False, fontsize=9
    )
