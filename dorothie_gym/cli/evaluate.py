"""`dorothie-gym evaluate`: scores of predictions, or of trivial baselines, on the three tasks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym import archive
from dorothie_gym.cli.options import Maps
from dorothie_gym.cli.output import Facts, check_file, fail, print_json, reporting_errors, stderr, wide_stdout
from dorothie_gym.errors import CacheError, PredictionError, SessionError
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.evaluation import teacher_forced

DETAILED = 2
"""Largest number of models that are shown in detail."""


def evaluate(
    predictions: Annotated[
        list[Path] | None, typer.Argument(metavar="PREDICTIONS...", help="Files of predictions, of one or more seeds.")
    ] = None,
    corpus: Annotated[
        Path | None,
        typer.Option(
            "--corpus", "--sessions", help="Corpus or folder of sessions; default: a small corpus, generated once."
        ),
    ] = None,
    split: Annotated[str, typer.Option(help="train, val, test or all.")] = "test",
    tasks: Annotated[str, typer.Option(help="all, or a list of ufn,rfn,nfd.")] = "all",
    model: Annotated[
        str | None, typer.Option(help="Trivial baseline: majority or random; default majority, without predictions.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the trivial baseline.")] = 0,
    seeds: Annotated[int, typer.Option(min=1, help="Number of seeds of the trivial baseline, from --seed on.")] = 1,
    save: Annotated[
        Path | None,
        typer.Option(metavar="FILE.parquet", help="File for the predictions of the trivial baseline."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write the table (md, tex, json) and its pictures into a folder.")
    ] = None,
    maps: Maps = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Score predictions on the three tasks: understanding (ufn), response (rfn) and navigation (nfd)."""
    files = predictions or []
    floor = model if model is not None or files else "majority"
    if save is not None:
        if floor is None:
            fail("--save writes the predictions of a trivial baseline; add --model majority or --model random")
        check_file(save)
    with reporting_errors():
        chosen, part = _tasks(tasks), _split(split)
        if floor is not None:
            _check_floor(floor)
        try:
            read = _read(files, chosen)
            where = archive.Corpus.load(_default_sessions() if corpus is None else corpus, maps=maps)
            labels = teacher_forced.labels_of(where, part)
            if floor is not None:
                read += _floor(floor, where, labels, range(seed, seed + seeds), chosen, save)
            about = {str(path): page for path in files if (page := teacher_forced.read_about(path))}
            table = teacher_forced.evaluate_predictions(read, labels, about=about)
            if out is not None:
                teacher_forced.write_report(table, out)
        except PredictionError as error:
            fail(str(error))
    if as_json:
        print_json({"tasks": [task.value for task in chosen], **_flat(table), **table.to_json()})
    else:
        _show(table, out)


def _read(files: Sequence[Path], tasks: Sequence[archive.Task]) -> list[teacher_forced.TaskPredictions]:
    read = [given for given in teacher_forced.read_predictions(*files) if given.task in tasks]
    if files and not read:
        names = ", ".join(task.value for task in tasks)
        fail(f"{', '.join(map(str, files))}: no row has the task {names} in its column 'task'")
    return read


def _floor(
    name: str,
    corpus: archive.Corpus,
    labels: teacher_forced.CorpusLabels,
    seeds: range,
    tasks: Sequence[archive.Task],
    save: Path | None,
) -> list[teacher_forced.TaskPredictions]:
    try:
        train = teacher_forced.labels_of(corpus, "train")
    except SessionError as error:
        if labels.split != teacher_forced.ALL:
            fail(f"the trivial baseline {name} is fitted on the split train: {error}; or give a file of predictions")
        note = f"There is no split train: the trivial baseline {name} is fitted on the sessions that it is scored on."
        stderr().print(note, soft_wrap=True, markup=False)
        train = labels
    drawn = [given for seed in seeds for given in teacher_forced.predict_floor(name, train, labels, seed)]
    wanted = [given for given in drawn if given.task in tasks]
    if save is not None:
        teacher_forced.write_predictions(
            save, wanted, about={"model": name, "corpus": str(corpus.root), "split": labels.split}
        )
    return wanted


def _tasks(text: str) -> tuple[archive.Task, ...]:
    names = [name.strip().lower() for name in text.split(",")]
    if names == ["all"]:
        return tuple(archive.Task)
    for name in names:
        if name not in {task.value for task in archive.Task}:
            fail(f"task {name!r} is unknown; choose from {', '.join(task.value for task in archive.Task)}, or all")
    return tuple(task for task in archive.Task if task.value in names)


def _split(text: str) -> teacher_forced.Split:
    for split in teacher_forced.SPLITS:
        if split == text:
            return split
    fail(f"split {text!r} is unknown; choose from {', '.join(teacher_forced.SPLITS)}")


def _check_floor(name: str) -> None:
    try:
        teacher_forced.make_floor(name)
    except ValueError as error:
        fail(str(error))


def _default_sessions() -> Path:
    try:
        return rollouts.default_corpus()
    except CacheError as error:
        fail(str(error))


def _flat(table: teacher_forced.ResultsTable) -> Facts:
    """Returns the scores of a single run over all parts; skipped points are unscored or scored in part."""
    if len(table.runs) != 1:
        return {}
    run = table.runs[0]
    scores = run.parts[teacher_forced.ALL]
    skipped = [row.task for row in (*run.left_out, *table.labels.skipped)]
    return {
        "model": run.model,
        "seed": run.seed,
        **{f"{task.value}_points": count for task, count in scores.points.items()},
        **{f"{task.value}_skipped": skipped.count(task) for task in scores.points},
        **{key: None if math.isnan(value) else value for key, value in scores.metrics.items()},
    }


def _show(table: teacher_forced.ResultsTable, out: Path | None) -> None:
    console = wide_stdout()
    if len(table.models) > DETAILED:
        teacher_forced.print_table(table, console)
    else:
        for name in table.models:
            teacher_forced.print_details(table, name, console)
        teacher_forced.print_counts(table, console)
    if out is not None:
        console.print(f"Written: {out}", style="dim", markup=False, soft_wrap=True)
