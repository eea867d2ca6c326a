"""The leaderboard as a picture: a row a policy, a dot a part, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from dorothie_gym.evaluation.closed_loop.leaderboard import OTHER, PARTS, Entry
from dorothie_gym.evaluation.closed_loop.terminal import ALL_METRICS
from dorothie_gym.world.graphics.charts import INK, dress_percent_axes, empty_figure

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
