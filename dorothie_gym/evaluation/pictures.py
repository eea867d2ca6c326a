"""The table and the confusion matrices as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.catalogue import COLUMNS, PAPER_SUFFIX, SHOWN, shown_title, task_of
from dorothie_gym.evaluation.intervals import Estimate
from dorothie_gym.evaluation.labels import ALL, UNSEEN
from dorothie_gym.evaluation.paper import PaperFigure, paper_figure
from dorothie_gym.evaluation.report import part_title, row_title
from dorothie_gym.evaluation.scoring import class_labels
from dorothie_gym.evaluation.table import ResultsTable
from dorothie_gym.sessions import Task
from dorothie_gym.world.graphics.charts import INK, SHEET, SOFT, dress_percent_axes, empty_figure

PANELS: Final = tuple(key + PAPER_SUFFIX if key + PAPER_SUFFIX in SHOWN else key for key in COLUMNS)
"""What is drawn: the paper's six columns, by the paper's protocol, so that its figures can stand beside ours."""

_ROW, _TOP, _BOTTOM = 0.46, 1.75, 0.75
_OURS: Final = {"seen": "#2f62c4", "unseen": "#cf7f1d", ALL: "#2f62c4"}
_PAPER = "#9a9ea6"


def draw_table(table: ResultsTable, path: Path | str) -> Path:
    """Draws a panel for each column of the paper's table: a row for each model, a dot for each part, with intervals.

    Args:
        table: the table.
        path: PNG file to write.

    Raises:
        OSError: the file cannot be written.
    """
    height = _TOP + _BOTTOM + _ROW * max(len(table.models), 1)
    with empty_figure(15.0, height) as figure:
        axes = figure.subplots(1, len(PANELS), sharey=True, squeeze=False)[0]
        figure.subplots_adjust(left=0.185, right=0.985, top=1 - _TOP / height, bottom=_BOTTOM / height, wspace=0.09)
        for key, panel in zip(PANELS, axes, strict=True):
            _panel(panel, table, key)
        names = [row_title(table, model).replace(" (not run: ", "\n(not run: ") for model in table.models]
        axes[0].set_yticks(range(len(names)), names, fontsize=8.5, color=INK)
        axes[0].set_ylim(len(names) - 0.5, -0.5)
        title = "Models on the three tasks" + (", ours beside the paper's" if _has_paper(table) else "")
        figure.text(0.012, 1 - 0.42 / height, title, fontsize=14, weight="bold")
        figure.text(0.012, 1 - 0.68 / height, _subtitle(table), fontsize=9.5, color=SOFT)
        _legend(figure, table, height)
        figure.savefig(path, format="png")
    return Path(path)


def draw_confusions(table: ResultsTable, model: str, path: Path | str) -> Path:
    """Draws the confusion matrices of a model: a column for each task, a row for each part of the corpus.

    Args:
        table: the table.
        model: name of a model that was run.
        path: PNG file to write.

    Raises:
        OSError: the file cannot be written.
    """
    tasks, parts = table.tasks, table.parts
    widths = [1.0 if task is Task.NFD else 1.45 for task in tasks]
    with empty_figure(5.2 * sum(widths) + 0.8, 7.6 * len(parts) + 1.0) as figure:
        height = 7.6 * len(parts) + 1.0
        grid = figure.add_gridspec(
            len(parts), len(tasks), left=0.085, right=0.985, top=1 - 1.25 / height, bottom=1.0 / height,
            wspace=0.26, hspace=0.32, width_ratios=widths,
        )  # fmt: skip
        seeds = len(table.runs_of(model))
        over = f", mean over {seeds} seeds" if seeds > 1 else ""
        figure.text(0.012, 1 - 0.45 / height, model, fontsize=15, weight="bold")
        figure.text(
            0.012, 1 - 0.75 / height, f"Per cent of the points of each label (their number){over}", fontsize=10,
            color=SOFT,
        )  # fmt: skip
        for row, part in enumerate(parts):
            for column, task in enumerate(tasks):
                matrix = table.confusion(model, part, task)
                if matrix is not None:
                    _matrix(figure.add_subplot(grid[row, column], anchor="N"), matrix, task, part, seeds)
        figure.savefig(path, format="png")
    return Path(path)


def _panel(axes: Any, table: ResultsTable, key: str) -> None:
    parts = table.parts
    for row, model in enumerate(table.models):
        for k, part in enumerate(parts):
            offset = (k - (len(parts) - 1) / 2) * 0.42
            paper = paper_figure(model, part, key)
            if paper is not None:
                _dot(axes, paper, row + offset + 0.09, _PAPER, filled=part != UNSEEN, square=True)
            _dot(axes, table.estimate(model, part, key), row + offset - 0.07, _OURS[part], filled=part != UNSEEN)
    dress_percent_axes(axes, f"{task_of(key)}\n{shown_title(key)}", len(table.models), margin=2)


def _dot(
    axes: Any, figure: Estimate | PaperFigure, at: float, colour: str, *, filled: bool, square: bool = False
) -> None:
    if figure.mean is None:
        return
    mean, half = 100 * figure.mean, 100 * (figure.half_width or 0.0)
    axes.plot([mean - half, mean + half], [at, at], color=colour, linewidth=1.3, zorder=2)
    axes.plot(
        [mean], [at], "s" if square else "o", markersize=3.6 if square else 5.2, color=colour,
        markerfacecolor=colour if filled else SHEET, markeredgewidth=1.2, zorder=3,
    )  # fmt: skip


def _legend(figure: Any, table: ResultsTable, height: float) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for part in table.parts:
        for colour, marker, whose in ((_OURS[part], "o", "ours"), (_PAPER, "s", "paper")):
            if whose == "paper" and not _has_paper(table):
                continue
            face = SHEET if part == UNSEEN else colour
            label = f"{whose}, {part_title(part).lower()}"
            handles.append(Line2D([], [], color=colour, marker=marker, markerfacecolor=face, label=label))
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.006, 1 - 0.75 / height), ncols=4, frameon=False, fontsize=9
    )


def _has_paper(table: ResultsTable) -> bool:
    return any(paper_figure(m, part, key) for m in table.models for part in table.parts for key in PANELS)


def _subtitle(table: ResultsTable) -> str:
    labels = table.labels
    ours = f"{labels.root.resolve().name}, split {labels.split}, {len(labels.part_of)} sessions"
    paper = "; the paper's figures are of SDN" if _has_paper(table) else ""
    return f"{ours}{paper}. Mean and 95 % interval over seeds. (paper): computed as the paper's code does."


def _matrix(axes: Any, counts: NDArray[np.int64], task: Task, part: str, seeds: int) -> None:
    names = class_labels(task)
    used = np.flatnonzero(counts.sum(axis=1) + counts.sum(axis=0))
    shown = counts[np.ix_(used, used)]
    totals = shown.sum(axis=1, keepdims=True)
    shares = np.divide(shown, totals, out=np.zeros(shown.shape), where=totals > 0)
    axes.imshow(shares, cmap=_shades(), vmin=0.0, vmax=1.0, aspect="equal")
    for row, column in zip(*np.nonzero(shown), strict=True):
        share = shares[row, column]
        axes.text(
            column, row, f"{100 * share:.0f}", ha="center", va="center", fontsize=7.5,
            color="white" if share > 0.55 else INK,
        )  # fmt: skip
    labels = [f"{names[k]} ({round(total / seeds)})" for k, total in zip(used, totals[:, 0], strict=True)]
    _dress_matrix(axes, labels, [names[k] for k in used])
    right = float(np.trace(shown)) / max(int(shown.sum()), 1)
    title = f"{task_of(task.value + '_')}" + ("" if part == ALL else f", {part_title(part).lower()}")
    axes.set_title(f"{title}: {100 * right:.1f} % right", fontsize=11, loc="left", pad=8)


def _dress_matrix(axes: Any, rows: Sequence[str], columns: Sequence[str]) -> None:
    axes.set_xticks(range(len(columns)), columns, fontsize=8.5, color=INK)
    axes.set_yticks(range(len(rows)), rows, fontsize=8.5, color=INK)
    for label in axes.get_xticklabels():
        label.set(rotation=45, ha="right", rotation_mode="anchor")
    axes.set_xlabel("predicted", fontsize=9)
    axes.set_ylabel("label", fontsize=9)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=SHEET, linewidth=1.5)
    axes.tick_params(axis="both", which="both", length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _shades() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("shades", ["#f2ede1", "#a9c4f2", _OURS[ALL], "#173a80"])
