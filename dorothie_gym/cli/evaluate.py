"""`dorothie-gym evaluate`: scores of predictions, or of trivial baselines, on the three tasks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import Maps
from dorothie_gym.cli.output import Facts, check_file, fail, print_json, reporting_errors, stderr, wide_stdout

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import Corpus
    from dorothie_gym.archive.visibility import Task
    from dorothie_gym.evaluation.teacher_forced.labels import CorpusLabels, Split
    from dorothie_gym.evaluation.teacher_forced.predictions import TaskPredictions
    from dorothie_gym.evaluation.teacher_forced.table import ResultsTable

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
        from dorothie_gym.archive.corpus import Corpus
        from dorothie_gym.errors import PredictionError
        from dorothie_gym.evaluation.teacher_forced.labels import labels_of
        from dorothie_gym.evaluation.teacher_forced.prediction_reader import read_about
        from dorothie_gym.evaluation.teacher_forced.table import evaluate_predictions

        chosen, part = _tasks(tasks), _split(split)
        if floor is not None:
            _check_floor(floor)
        try:
            read = _read(files, chosen)
            where = Corpus.load(_default_sessions() if corpus is None else corpus, maps=maps)
            labels = labels_of(where, part)
            if floor is not None:
                read += _floor(floor, where, labels, range(seed, seed + seeds), chosen, save)
            about = {str(path): page for path in files if (page := read_about(path))}
            table = evaluate_predictions(read, labels, about=about)
            if out is not None:
                from dorothie_gym.evaluation.teacher_forced.report import write_report

                write_report(table, out)
        except PredictionError as error:
            fail(str(error))
    if as_json:
        print_json({"tasks": [task.value for task in chosen], **_flat(table), **table.to_json()})
    else:
        _show(table, out)


def _read(files: Sequence[Path], tasks: Sequence[Task]) -> list[TaskPredictions]:
    from dorothie_gym.evaluation.teacher_forced.prediction_reader import read_predictions

    read = [given for given in read_predictions(*files) if given.task in tasks]
    if files and not read:
        names = ", ".join(task.value for task in tasks)
        fail(f"{', '.join(map(str, files))}: no row has the task {names} in its column 'task'")
    return read


def _floor(
    name: str, corpus: Corpus, labels: CorpusLabels, seeds: range, tasks: Sequence[Task], save: Path | None
) -> list[TaskPredictions]:
    from dorothie_gym.errors import SessionError
    from dorothie_gym.evaluation.teacher_forced.labels import ALL, labels_of
    from dorothie_gym.evaluation.teacher_forced.predictions import write_predictions
    from dorothie_gym.evaluation.teacher_forced.trivial_baselines import predict_floor

    try:
        train = labels_of(corpus, "train")
    except SessionError as error:
        if labels.split != ALL:
            fail(f"the trivial baseline {name} is fitted on the split train: {error}; or give a file of predictions")
        note = f"There is no split train: the trivial baseline {name} is fitted on the sessions that it is scored on."
        stderr().print(note, soft_wrap=True, markup=False)
        train = labels
    drawn = [given for seed in seeds for given in predict_floor(name, train, labels, seed)]
    wanted = [given for given in drawn if given.task in tasks]
    if save is not None:
        write_predictions(save, wanted, about={"model": name, "corpus": str(corpus.root), "split": labels.split})
    return wanted


def _tasks(text: str) -> tuple[Task, ...]:
    from dorothie_gym.archive.visibility import Task

    names = [name.strip().lower() for name in text.split(",")]
    if names == ["all"]:
        return tuple(Task)
    for name in names:
        if name not in {task.value for task in Task}:
            fail(f"task {name!r} is unknown; choose from {', '.join(task.value for task in Task)}, or all")
    return tuple(task for task in Task if task.value in names)


def _split(text: str) -> Split:
    from dorothie_gym.evaluation.teacher_forced.labels import SPLITS

    for split in SPLITS:
        if split == text:
            return split
    fail(f"split {text!r} is unknown; choose from {', '.join(SPLITS)}")


def _check_floor(name: str) -> None:
    from dorothie_gym.evaluation.teacher_forced.trivial_baselines import make_floor

    try:
        make_floor(name)
    except ValueError as error:
        fail(str(error))


def _default_sessions() -> Path:
    from dorothie_gym.errors import CacheError
    from dorothie_gym.evaluation.rollout.corpus_cache import default_corpus

    try:
        return default_corpus()
    except CacheError as error:
        fail(str(error))


def _flat(table: ResultsTable) -> Facts:
    """Returns the scores of a single run over all parts; skipped points are unscored or scored in part."""
    if len(table.runs) != 1:
        return {}
    from dorothie_gym.evaluation.teacher_forced.labels import ALL

    run = table.runs[0]
    scores = run.parts[ALL]
    skipped = [row.task for row in (*run.left_out, *table.labels.skipped)]
    return {
        "model": run.model,
        "seed": run.seed,
        **{f"{task.value}_points": count for task, count in scores.points.items()},
        **{f"{task.value}_skipped": skipped.count(task) for task in scores.points},
        **{key: None if math.isnan(value) else value for key, value in scores.metrics.items()},
    }


def _show(table: ResultsTable, out: Path | None) -> None:
    from dorothie_gym.evaluation.teacher_forced.terminal import print_counts, print_details, print_table

    console = wide_stdout()
    if len(table.models) > DETAILED:
        print_table(table, console)
    else:
        for name in table.models:
            print_details(table, name, console)
        print_counts(table, console)
    if out is not None:
        console.print(f"Written: {out}", style="dim", markup=False, soft_wrap=True)
