"""`dorothie-gym evaluate`: the table of the three tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from dorothie_gym.cli.output import fail, print_json, stdout, told_plainly

_ROWS = (
    ("move accuracy", "move_accuracy"),
    ("slot F1 (micro)", "slot_f1"),
    ("slot F1 (macro)", "slot_f1_macro"),
    ("slot F1 (by slot type)", "slot_f1_type"),
    ("slot score (as the paper's code)", "slot_score_paper"),
    ("action accuracy", "action_accuracy"),
    ("argument accuracy", "argument_accuracy"),
    ("joint accuracy", "joint_accuracy"),
    ("argument accuracy (as the paper's code)", "argument_accuracy_paper"),
    ("joint accuracy (as the paper's code)", "joint_accuracy_paper"),
)


def evaluate(
    tasks: Annotated[str, typer.Option(help="all, or some of ufn,rfn,nfd.")] = "all",
    model: Annotated[str, typer.Option(help="majority or random.")] = "majority",
    sessions: Annotated[
        Path | None, typer.Option(help="Folder of sessions; without it, a few are played once and kept.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="What the model draws from.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON, and nothing else.")] = False,
) -> None:
    """Score a model on the three tasks: understanding (ufn), response (rfn) and navigation (nfd)."""
    with told_plainly():
        from dorothie_gym.evaluation import evaluate_folder, make_model, parse_tasks

        try:
            chosen = parse_tasks(tasks)
            make_model(model, seed)
        except ValueError as error:
            fail(str(error))
        folder = _default_sessions() if sessions is None else sessions
        table = evaluate_folder(folder, chosen, model, seed)
    if as_json:
        print_json({"tasks": [task.value for task in chosen], "sessions": str(folder), **table})
    else:
        _show(table, [task.value for task in chosen], folder)


def _default_sessions() -> Path:
    from dorothie_gym.rollout import CacheError, default_corpus

    try:
        return default_corpus()
    except CacheError as error:
        fail(str(error))


def _show(table: Mapping[str, Any], tasks: Sequence[str], folder: Path) -> None:
    shown = Table(box=None, pad_edge=False)
    shown.add_column(f"Model: {table['model']}", no_wrap=True)
    for task in tasks:
        shown.add_column(task[0].upper() + task[1] + task[2].upper(), justify="right")
    for title, key in (("points", "points"), ("points skipped", "skipped")):
        shown.add_row(title, *(str(table[f"{task}_{key}"]) for task in tasks), style="dim")
    for title, key in _ROWS:
        if any(f"{task}_{key}" in table for task in tasks):
            shown.add_row(title, *(_share(table, f"{task}_{key}") for task in tasks))
    console = stdout()
    console.print(shown)
    console.print()
    train, test = _split(table, folder)
    console.print(f"Sessions: {folder}", style="dim", markup=False, soft_wrap=True)
    console.print(f"Trained on {', '.join(train)}; tested on {', '.join(test)}.", style="dim", markup=False)
    if table["sessions_incomplete"]:
        console.print(f"Cut off, but used: {', '.join(table['sessions_incomplete'])}.", style="yellow", markup=False)
    for name, reason in table["sessions_unreadable"].items():
        console.print(f"Left out {name}: {reason}", style="yellow", markup=False)


def _share(table: Mapping[str, Any], key: str) -> str:
    if key not in table:
        return ""
    value = table[key]
    return "undefined" if value is None else f"{100 * value:.1f} %"


def _split(table: Mapping[str, Any], folder: Path) -> tuple[list[str], list[str]]:
    """Names of the sessions that trained and of those that tested."""
    from dorothie_gym.sessions import session_folders

    names = [path.name for path in session_folders(folder) if path.name not in table["sessions_unreadable"]]
    return names[: table["sessions_train"]], names[table["sessions_train"] :]
