"""The table as Markdown, LaTeX, JSON and pictures."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.teacher_forced.labels import ALL, UNSEEN
from dorothie_gym.evaluation.teacher_forced.metrics import (
    COLUMNS,
    PAPER_SUFFIX,
    SHOWN,
    TASK_NAMES,
    has_paper_figure,
    shown_title,
    task_of,
    title_of,
)
from dorothie_gym.evaluation.teacher_forced.paper_comparison import (
    SMALLEST_DIFFERENCE,
    ModelClaim,
    ModelFinding,
    PaperFigure,
    paper_figure,
    paper_name,
    paper_source,
)
from dorothie_gym.evaluation.teacher_forced.scoring import class_labels
from dorothie_gym.pictures.chart_style import INK, SHEET, SOFT, dress_percent_axes, empty_figure
from dorothie_gym.support.files import replacing, write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

    from dorothie_gym.evaluation.analysis.intervals import Estimate
    from dorothie_gym.evaluation.teacher_forced.table import ResultsTable

NONE: Final = "–"
"""Placeholder for a missing figure."""

_TEX: Final = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "–": "--",
    "±": r"$\pm$",
}


def write_report(table: ResultsTable, folder: Path | str, *, pictures: bool = True) -> tuple[Path, ...]:
    """Writes the table into a folder, which is created if necessary.

    Args:
        table: the table.
        folder: folder for `table.md`, `table.tex`, `table.json` and the pictures.
        pictures: also draw `table.png`, and `confusion-<model>.png` for each model.

    Returns:
        The files written.

    Raises:
        OSError: one cannot be written.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    texts = {
        "table.md": markdown(table),
        "table.tex": tex(table),
        "table.json": json.dumps(table.to_json(), indent=1, allow_nan=False) + "\n",
    }
    written = []
    for name, text in texts.items():
        write_atomically(place / name, text)
        written.append(place / name)
    if pictures:
        written.append(draw_table(table, place / "table.png"))
        for model in table.models:
            if table.runs_of(model):
                written.append(draw_confusions(table, model, place / f"confusion-{file_name(model)}.png"))
    return tuple(written)


def file_name(model: str) -> str:
    """Returns a model's name as a part of a file name: "toto-action-history" for "TOTO (- Action History)"."""
    signs = model.replace("(+", "with ").replace("(-", "without ")
    return re.sub(r"[^a-z0-9]+", "-", signs.casefold()).strip("-") or "model"


def percent(estimate: Estimate | PaperFigure) -> str:
    """Returns a figure in per cent with its half-width, if it has one: "40.9 ± 3.9"."""
    if estimate.mean is None:
        return NONE
    mean = f"{100 * estimate.mean:.1f}"
    return mean if estimate.half_width is None else f"{mean} ± {100 * estimate.half_width:.1f}"


def row_title(table: ResultsTable, model: str) -> str:
    """Returns the name of a model, and why it was not run if it was not: "HuBERT Only (not run: no audio)"."""
    return f"{model} (not run: {table.missing[model]})" if model in table.missing else model


def paper_row(table: ResultsTable, model: str) -> str:
    """Returns the paper's row with which a model of a table is compared; empty if no figures of the paper are shown."""
    shown = any(paper_figure(model, part, key) for part in table.parts for key in SHOWN)
    return paper_name(model) or "" if shown else ""


def part_title(part: str) -> str:
    """Returns the heading of a part of the corpus."""
    return "All sessions" if part == ALL else f"{part.capitalize()} towns"


def legend(table: ResultsTable) -> str:
    """Returns the content of the cells of the table."""
    seeds = sorted({len(table.runs_of(model)) for model in table.models if table.runs_of(model)})
    over = " to ".join(str(count) for count in dict.fromkeys((seeds[0], seeds[-1]))) if seeds else "no"
    some = f"mean and half-width of the 95 % interval over {over} seeds" if seeds and seeds[-1] > 1 else "one seed"
    paper = " / the paper's" if _has_paper(table) else ""
    protocol = (
        "Columns marked (paper) use the definitions of the paper's code: exact match of all slots, angles not wrapped"
    )
    others = any(paper_row(table, model) not in ("", model) for model in table.models)
    names = " Where the paper's row is called otherwise, it is another model." if others else ""
    values = f"Values in per cent: ours ({some}){paper}; {NONE}: no value."
    return f"{values}{names} {protocol}. The best of our values is bold."


# --- Markdown -------------------------------------------------------------------------------------------------------


def markdown(table: ResultsTable) -> str:
    """Returns the table as Markdown: figures by part, findings, points and omissions."""
    lines = ["# Results", "", legend(table), *([f"Paper: {paper_source()}."] if _has_paper(table) else [])]
    rowed = _has_paper(table)
    for part in table.parts:
        heads = ["model", *(["the paper's row"] if rowed else []), *(f"{task_of(k)} {shown_title(k)}" for k in SHOWN)]
        rows = [
            [
                row_title(table, model),
                *([paper_row(table, model) or NONE] if rowed else []),
                *_cells(table, model, part, _bold_markdown),
            ]
            for model in table.models
        ]
        lines += ["", f"## {part_title(part)}", "", *_markdown_table(heads, rows)]
    tested = [finding for finding in table.findings() if any(claim.difference.seeds for claim in finding.claims)]
    if tested:
        lines += [
            "",
            "## Findings",
            "",
            "The findings of the paper, and comparisons between models. Differences are paired over seeds, with 95 % "
            "intervals.",
        ]
        for finding in tested:
            lines += ["", *finding_lines(finding)]
    lines += ["", "## Points", "", *_markdown_table(*points_rows(table)), ""]
    lines += [f"- {line}" for line in notes(table)]
    return "\n".join(lines).rstrip() + "\n"


def _bold_markdown(text: str) -> str:
    return f"**{text}**"


def _markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head or ' ' for head in heads)} |"
    yield "|" + "---|" + "---:|" * (len(heads) - 1)
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in row)} |"


def _cells(table: ResultsTable, model: str, part: str, bold: Callable[[str], str]) -> Iterator[str]:
    for key in SHOWN:
        ours = percent(table.estimate(model, part, key))
        text = bold(ours) if model in table.best(part, key) else ours
        paper = paper_figure(model, part, key) if has_paper_figure(key) else None
        yield text if paper is None else f"{text} / {percent(paper)}"


def finding_lines(finding: ModelFinding) -> Iterator[str]:
    """Yields a finding and its claims, a line each."""
    yield f"**{finding.statement}** ({finding.part}): {finding.verdict}."
    yield from (f"- {claim_line(claim)}" for claim in finding.claims)
    if finding.note:
        yield f"- {finding.note}"


def claim_line(claim: ModelClaim) -> str:
    """Returns a claim in a line: figure, models, difference in points, verdict."""
    mean, half = claim.difference.mean, claim.difference.half_width
    amount = NONE if mean is None else f"{100 * mean:+.1f}" + ("" if half is None else f" ± {100 * half:.1f}")
    wanted = "above 0" if claim.expected == "positive" else f"below {100 * SMALLEST_DIFFERENCE:.0f}"
    return f"{title_of(claim.metric)}, {claim.higher} minus {claim.lower}: {amount}, expected {wanted}: {claim.verdict}"


def points_rows(table: ResultsTable) -> tuple[list[str], list[list[str]]]:
    """Returns headings and rows of the count of points: each fold of the corpus, and their sum."""
    heads = ["fold", "sessions", "flagged events", *TASK_NAMES.values(), "other flagged events"]
    rows = []
    for fold, count in sorted(table.labels.counts.items()):
        rows.append([fold or ALL, *(str(value) for value in count.to_json().values())])
    totals = [sum(int(row[k]) for row in rows) for k in range(1, len(heads))]
    return heads, [*rows, ["sum", *map(str, totals)]] if len(rows) > 1 else rows


def notes(table: ResultsTable) -> Iterator[str]:
    """Yields one sentence for each source of the figures, and for each event that was not scored."""
    labels = table.labels
    for corpus, encoder in sorted(_origins(table.about)):
        yield f"Trained on the corpus {corpus}; text encoder {encoder}."
    yield f"Scored: split {labels.split}, {len(labels.part_of)} sessions; divided: {labels.division}."
    for name, reason in labels.unreadable.items():
        yield f"Session {name} cannot be read: {reason}."
    for name in labels.incomplete:
        yield f"Session {name} was cut off; it counts as far as it goes."
    for skipped in labels.skipped:
        yield f"Session {skipped.session}, event {skipped.event}: {skipped.reason}."
    for run in table.runs:
        if run.ignored:
            yield f"{run.model}, seed {run.seed}: {run.ignored} predictions are of sessions outside the split."
        for skipped in run.left_out:
            task = TASK_NAMES[skipped.task] if skipped.task else ""
            yield (
                f"{run.model}, seed {run.seed}: {task} point at session {skipped.session}, event {skipped.event} was "
                f"left out: {skipped.reason}."
            )


def _origins(about: Mapping[str, object]) -> set[tuple[str, str]]:
    """Returns each pair of corpus hash and encoder name in the provenance of predictions."""
    corpus, encoder = about.get("corpus"), about.get("encoder")
    if isinstance(corpus, str) and isinstance(encoder, str):
        return {(corpus, encoder)}
    return {origin for value in about.values() if isinstance(value, Mapping) for origin in _origins(value)}


# --- LaTeX ----------------------------------------------------------------------------------------------------------


def tex(table: ResultsTable) -> str:
    """Returns the table as LaTeX (booktabs, graphicx, xcolor): below each model of the paper its figures, in grey."""
    lines = [
        r"% \usepackage{booktabs,graphicx,xcolor}",
        r"\begin{table*}",
        r"\centering\resizebox{\textwidth}{!}{%",
        rf"\begin{{tabular}}{{l{'c' * len(SHOWN)}}}",
        r"\toprule",
    ]
    for number, part in enumerate(table.parts):
        lines += [r"\midrule"] if number else []
        lines += _tex_heading(part)
        for model in table.models:
            cells = [_tex_cell(table, model, part, key) for key in SHOWN]
            lines.append(" & ".join([escape_tex(row_title(table, model)), *cells]) + r" \\")
            if row := paper_row(table, model):
                named = rf"\quad\textcolor{{gray}}{{paper{'' if row == model else f': {escape_tex(row)}'}}}"
                lines.append(" & ".join([named, *_tex_paper(model, part)]) + r" \\")
    caption = escape_tex(legend(table).replace("/ the", "and in grey the"))
    lines += [r"\bottomrule", r"\end{tabular}}", rf"\caption{{{caption}}}", r"\end{table*}"]
    return "\n".join(lines) + "\n"


def escape_tex(text: str) -> str:
    """Returns a text as LaTeX shows it."""
    signs = "".join(_TEX.get(letter, f"\\{letter}" if letter in "&%$#_{}" else letter) for letter in text)
    return signs.replace("(- ", "($-$ ").replace("(+ ", "($+$ ")


def _tex_heading(part: str) -> Iterator[str]:
    tasks = list(TASK_NAMES.values())
    width = len(SHOWN) // len(tasks)
    title = escape_tex(part_title(part))
    yield " & ".join(["", *(rf"\multicolumn{{{width}}}{{c}}{{{task} ({title.lower()})}}" for task in tasks)]) + r" \\"
    starts = [2 + width * k for k in range(len(tasks))]
    yield " ".join(rf"\cmidrule(lr){{{start}-{start + width - 1}}}" for start in starts)
    yield " & ".join(["Model", *(escape_tex(shown_title(key)) for key in SHOWN)]) + r" \\"
    yield r"\midrule"


def _tex_cell(table: ResultsTable, model: str, part: str, key: str) -> str:
    figure = _tex_figure(table.estimate(model, part, key))
    return rf"$\mathbf{{{figure}}}$" if model in table.best(part, key) else f"${figure}$" if figure else "--"


def _tex_paper(model: str, part: str) -> Iterator[str]:
    for key in SHOWN:
        figure = paper_figure(model, part, key) if has_paper_figure(key) else None
        yield "" if figure is None else rf"\textcolor{{gray}}{{${_tex_figure(figure)}$}}"


def _tex_figure(estimate: Estimate | PaperFigure) -> str:
    if estimate.mean is None:
        return ""
    mean = f"{100 * estimate.mean:.1f}"
    return mean if estimate.half_width is None else rf"{mean}_{{\pm {100 * estimate.half_width:.1f}}}"


def _has_paper(table: ResultsTable) -> bool:
    return any(paper_figure(model, part, key) for model in table.models for part in table.parts for key in SHOWN)


# --- The table and the confusion matrices as pictures ----------------------------------------------------------------

PANELS: Final = tuple(key + PAPER_SUFFIX if key + PAPER_SUFFIX in SHOWN else key for key in COLUMNS)
"""Columns of the picture: the paper's six, by the paper's protocol, so that its figures are comparable with ours."""

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
        figure.subplots_adjust(left=0.2, right=0.985, top=1 - _TOP / height, bottom=_BOTTOM / height, wspace=0.09)
        for key, panel in zip(PANELS, axes, strict=True):
            _panel(panel, table, key)
        names = [_picture_title(table, model) for model in table.models]
        axes[0].set_yticks(range(len(names)), names, fontsize=8.5, color=INK)
        axes[0].set_ylim(len(names) - 0.5, -0.5)
        title = "Models on the three tasks" + (", ours beside the paper's" if _has_paper_pictures(table) else "")
        figure.text(0.012, 1 - 0.42 / height, title, fontsize=14, weight="bold")
        figure.text(0.012, 1 - 0.68 / height, _subtitle(table), fontsize=9.5, color=SOFT)
        _legend(figure, table, height)
        with replacing(Path(path)) as new:
            figure.savefig(new, format="png")
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
            0.012,
            1 - 0.75 / height,
            f"Per cent of the points of each label (their number){over}",
            fontsize=10,
            color=SOFT,
        )
        for row, part in enumerate(parts):
            for column, task in enumerate(tasks):
                matrix = table.confusion(model, part, task)
                if matrix is not None:
                    _matrix(figure.add_subplot(grid[row, column], anchor="N"), matrix, task, part, seeds)
        with replacing(Path(path)) as new:
            figure.savefig(new, format="png")
    return Path(path)


def _picture_title(table: ResultsTable, model: str) -> str:
    """Returns the name of a row in two lines: the paper's name where that is another, or why it was not run."""
    title, row = row_title(table, model).replace(" (not run: ", "\n(not run: "), paper_row(table, model)
    return title if row in ("", model) or model in table.missing else f"{title}\n(paper: {row})"


def _panel(axes: Axes, table: ResultsTable, key: str) -> None:
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
    axes: Axes, figure: Estimate | PaperFigure, at: float, colour: str, *, filled: bool, square: bool = False
) -> None:
    if figure.mean is None:
        return
    mean, half = 100 * figure.mean, 100 * (figure.half_width or 0.0)
    axes.plot([mean - half, mean + half], [at, at], color=colour, linewidth=1.3, zorder=2)
    axes.plot(
        [mean],
        [at],
        "s" if square else "o",
        markersize=3.6 if square else 5.2,
        color=colour,
        markerfacecolor=colour if filled else SHEET,
        markeredgewidth=1.2,
        zorder=3,
    )


def _legend(figure: Figure, table: ResultsTable, height: float) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for part in table.parts:
        for colour, marker, whose in ((_OURS[part], "o", "ours"), (_PAPER, "s", "paper")):
            if whose == "paper" and not _has_paper_pictures(table):
                continue
            face = SHEET if part == UNSEEN else colour
            label = f"{whose}, {part_title(part).lower()}"
            handles.append(Line2D([], [], color=colour, marker=marker, markerfacecolor=face, label=label))
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.006, 1 - 0.75 / height), ncols=4, frameon=False, fontsize=9
    )


def _has_paper_pictures(table: ResultsTable) -> bool:
    return any(paper_figure(m, part, key) for m in table.models for part in table.parts for key in PANELS)


def _subtitle(table: ResultsTable) -> str:
    labels = table.labels
    ours = f"{labels.root.resolve().name}, split {labels.split}, {len(labels.part_of)} sessions"
    paper = "; the paper's figures are of SDN" if _has_paper_pictures(table) else ""
    return f"{ours}{paper}. Mean and 95 % interval over seeds. (paper): computed as the paper's code does."


def _matrix(axes: Axes, counts: NDArray[np.int64], task: Task, part: str, seeds: int) -> None:
    names = class_labels(task)
    used = np.flatnonzero(counts.sum(axis=1) + counts.sum(axis=0))
    shown = counts[np.ix_(used, used)]
    totals = shown.sum(axis=1, keepdims=True)
    shares = np.divide(shown, totals, out=np.zeros(shown.shape), where=totals > 0)
    axes.imshow(shares, cmap=_shades(), vmin=0.0, vmax=1.0, aspect="equal")
    for row, column in zip(*np.nonzero(shown), strict=True):
        share = shares[row, column]
        axes.text(
            column,
            row,
            f"{100 * share:.0f}",
            ha="center",
            va="center",
            fontsize=7.5,
            color="white" if share > 0.55 else INK,
        )
    labels = [f"{names[k]} ({round(total / seeds)})" for k, total in zip(used, totals[:, 0], strict=True)]
    _dress_matrix(axes, labels, [names[k] for k in used])
    right = float(np.trace(shown)) / max(int(shown.sum()), 1)
    title = f"{task_of(task.value + '_')}" + ("" if part == ALL else f", {part_title(part).lower()}")
    axes.set_title(f"{title}: {100 * right:.1f} % right", fontsize=11, loc="left", pad=8)


def _dress_matrix(axes: Axes, rows: Sequence[str], columns: Sequence[str]) -> None:
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


def _shades() -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("shades", ["#f2ede1", "#a9c4f2", _OURS[ALL], "#173a80"])
