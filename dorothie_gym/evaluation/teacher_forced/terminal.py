"""The table and its supplements, for a terminal (rich)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.evaluation.teacher_forced.labels import ALL
from dorothie_gym.evaluation.teacher_forced.metrics import (
    COLUMNS,
    PAPER_SUFFIX,
    SHOWN,
    TASK_NAMES,
    has_paper_figure,
    metric_title,
    metrics_of,
    shown_title,
    task_of,
    title_of,
)
from dorothie_gym.evaluation.teacher_forced.paper_comparison import (
    ModelFinding,
    ModelVerdict,
    PaperFigure,
    paper_figure,
)
from dorothie_gym.evaluation.teacher_forced.report import (
    NONE,
    claim_line,
    legend,
    notes,
    paper_row,
    part_title,
    percent,
    points_rows,
    row_title,
)
from dorothie_gym.evaluation.teacher_forced.scoring import class_labels

if TYPE_CHECKING:
    from dorothie_gym.evaluation.analysis.intervals import Estimate
    from dorothie_gym.evaluation.teacher_forced.table import ResultsTable

WIDE: Final = 110
"""Minimum terminal width for showing the tasks side by side [characters]."""

NOTES: Final = 8
"""Number of notes shown; the JSON has all."""

_VERDICTS: Final = {
    ModelVerdict.HOLDS: "green",
    ModelVerdict.FAILS: "red",
    ModelVerdict.UNDECIDED: "yellow",
    ModelVerdict.UNTESTED: "dim",
}


def print_table(table: ResultsTable, console: Console) -> None:
    """Prints all models: figures by part of the corpus, ours above the paper's, the findings, and the counts."""
    for part in table.parts:
        console.print(part_title(part), style="bold", markup=False)
        for tasks in _side_by_side(table, console):
            console.print(_figures(table, part, tasks))
            console.print()
    console.print(legend(table).replace(" / the paper's", ", below them in grey the paper's"), style="dim")
    console.print()
    for finding in table.findings():
        if any(claim.difference.seeds for claim in finding.claims):
            _print_finding(finding, console)
    print_counts(table, console)


def print_details(table: ResultsTable, model: str, console: Console) -> None:
    """Prints one model: every metric by part, by handled exception, and the accuracy of each class."""
    console.print(model, style="bold", markup=False)
    for make in (_metrics, _by_handling):
        for tasks in _side_by_side(table, console):
            console.print(make(table, model, tasks))
            console.print()
    for shown in _classes(table, model):
        console.print(shown)
        console.print()


def print_counts(table: ResultsTable, console: Console) -> None:
    """Prints the points of each fold, and the events that were not scored, with reasons."""
    heads, rows = points_rows(table)
    shown = _grid(*heads)
    for row in rows:
        shown.add_row(*row)
    console.print(shown)
    console.print()
    lines = list(notes(table))
    for note in lines[: NOTES + 1]:
        console.print(note, style="dim", markup=False, soft_wrap=True)
    if len(lines) > NOTES + 1:
        console.print(f"... and {len(lines) - NOTES - 1} more; --json has all", style="dim")


def _side_by_side(table: ResultsTable, console: Console) -> Sequence[Sequence[Task]]:
    """Returns the groups of tasks that share a table: all tasks on a wide terminal, else one per group."""
    return [table.tasks] if console.width >= WIDE else [(task,) for task in table.tasks]


def _figures(table: ResultsTable, part: str, tasks: Sequence[Task]) -> Table:
    names = {TASK_NAMES[task] for task in tasks}
    keys = [key for key in SHOWN if task_of(key) in names]
    shown = Table(box=None, pad_edge=False)
    shown.add_column("model", vertical="top")
    for key in keys:
        shown.add_column(f"{task_of(key)}\n{shown_title(key)}", justify="right")
    for model in table.models:
        shown.add_row(_title(table, model), *(_cell(table, model, part, key) for key in keys))
    return shown


def _title(table: ResultsTable, model: str) -> Text:
    """Returns the name of a model, and below it that of the paper's row if that is another."""
    title, row = Text(row_title(table, model)), paper_row(table, model)
    return title if row in ("", model) else Text.assemble(title, (f"\npaper: {row}", "dim"))


def _cell(table: ResultsTable, model: str, part: str, key: str) -> Text:
    text = Text(_percent(table.estimate(model, part, key)), style="bold" if model in table.best(part, key) else "")
    paper = paper_figure(model, part, key) if has_paper_figure(key) else None
    return text if paper is None else Text.assemble(text, ("\n" + _percent(paper), "dim"))


def _percent(figure: Estimate | PaperFigure) -> str:
    return percent(figure).replace(" ± ", " ±")


def _print_finding(finding: ModelFinding, console: Console) -> None:
    colour = _VERDICTS[finding.verdict]
    console.print(Text.assemble((finding.statement, "bold"), f" ({finding.part}): ", (str(finding.verdict), colour)))
    for claim in finding.claims:
        console.print(f"  {claim_line(claim)}", style="dim", markup=False, soft_wrap=True)
    if finding.note:
        console.print(f"  {finding.note}", style="dim italic", markup=False)
    console.print()


def _metrics(table: ResultsTable, model: str, tasks: Sequence[Task]) -> Table:
    columns = [(task, part) for task in tasks for part in table.parts]
    shown = _grid("", *(_heading(task, part) for task, part in columns))
    points = [str(table.points(model, part, task)) for task, part in columns]
    shown.add_row("points scored", *points, style="dim")
    names = dict.fromkeys(name for task in tasks for name in metrics_of(task) if _is_own(name))
    for name in names:
        cells = [
            _percent(table.estimate(model, part, f"{task}_{name}")) if name in metrics_of(task) else ""
            for task, part in columns
        ]
        shown.add_row(metric_title(name), *cells)
    return shown


def _is_own(name: str) -> bool:
    """Returns whether a metric needs a row of its own: for moves and actions, the paper's protocol equals ours."""
    return name.removesuffix(PAPER_SUFFIX) not in ("move_accuracy", "action_accuracy") or PAPER_SUFFIX not in name


def _heading(task: Task, part: str) -> str:
    return TASK_NAMES[task] if part == ALL else f"{TASK_NAMES[task]}\n{part}"


def _by_handling(table: ResultsTable, model: str, tasks: Sequence[Task]) -> Table:
    keys = [key for key in COLUMNS if task_of(key) in {TASK_NAMES[task] for task in tasks}]
    shown = _grid(
        "exchanges that handle", *(title_of(key).replace(" accuracy", "").replace(" ", "\n", 1) for key in keys)
    )
    for part in table.parts:
        for kind in Handled:
            cells = []
            for key in keys:
                count = table.points(model, part, Task(key.partition("_")[0]), kind)
                figure = _percent(table.estimate(model, part, key, kind))
                cells.append(_counted(figure, count) if count else Text(NONE))
            what = "nothing" if kind is Handled.NONE else f"{kind} exceptions"
            shown.add_row(what if part == ALL else f"{what}, {part}", *cells)
    return shown


def _classes(table: ResultsTable, model: str) -> Iterator[Table]:
    for task in table.tasks:
        estimates = {part: table.per_class(model, part, task) for part in table.parts}
        counts = {part: table.confusion(model, part, task) for part in table.parts}
        shown = _grid(f"{TASK_NAMES[task]}, right of", *(("labels" if p == ALL else p) for p in table.parts))
        names = dict.fromkeys(name for part in table.parts for name in estimates[part])
        order = list(class_labels(task))
        for name in sorted(names, key=order.index):
            cells = []
            for part in table.parts:
                matrix = counts[part]
                estimate = estimates[part].get(name)
                seeds = max(len(table.runs_of(model)), 1)
                count = 0 if matrix is None else int(matrix[order.index(name)].sum()) // seeds
                cells.append(Text(NONE) if estimate is None else _counted(_percent(estimate), count))
            shown.add_row(name, *cells)
        yield shown


def _counted(figure: str, count: int) -> Text:
    return Text.assemble(f"{figure} ", (f"({count})", "dim"))


def _grid(*heads: str) -> Table:
    shown = Table(box=None, pad_edge=False)
    for k, head in enumerate(heads):
        shown.add_column(head, justify="right" if k else "left", no_wrap=not k)
    return shown
