"""`dorothie-gym train` and `table`: training of models on a corpus, and the results table of all models."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.completion import VISION_MODELS, complete_model
from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import (
    FAILED,
    Facts,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    stderr,
    stdout,
    wide_stdout,
)
from dorothie_gym.cli.train_roles import ROLES, train_role
from dorothie_gym.cli.train_vision import train_vision
from dorothie_gym.errors import CacheError, CheckpointError, EncoderError, PredictionError, ProcessError
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.evaluation import teacher_forced
from dorothie_gym.support.installation import pip_install
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.baselines.experiment import Experiment
    from dorothie_gym.baselines.model_entries import ModelEntry
    from dorothie_gym.baselines.trainer import Epoch
    from dorothie_gym.evaluation.teacher_forced.table import ResultsTable

RUNS = Path("runs")
"""Default folder of trainings; it contains one folder per corpus."""

SMALL, AUTO = "small", "auto"
"""Default size and text encoder of models."""

_DETECTOR = Path("detr", "small", "seed-0")
_NOT_OF_DETECTIONS = "--detector is for models of detections and queries only, such as toto-detections"

CorpusOption = Annotated[
    Path | None,
    typer.Option("--corpus", metavar="DIR", help="Folder of the corpus; default: a small corpus, generated once."),
]
Size = Annotated[str, typer.Option("--config", "--size", help="small (two cores) or paper (the published sizes).")]
Seeds = Annotated[int, typer.Option(min=1, max=99, help="Number of seeds: 0, 1, ...")]
SomeSeeds = Annotated[
    int | None,
    typer.Option(min=1, max=99, help="Number of seeds: 0, 1, ...; default 5, of the vision models and the roles 1."),
]
Device = Annotated[
    str | None, typer.Option(help="segformer and detr: cpu, cuda, ...; default the GPU where there is one.")
]
PixelSource = Annotated[
    str | None,
    typer.Option("--inputs", help="detr: classes and depths that it reads, predicted (by the SegFormer) or true."),
]
Epochs = Annotated[
    int | None, typer.Option(min=1, max=10_000, help="segformer and detr: number of epochs; default that of the size.")
]
Detector = Annotated[
    Path | None,
    typer.Option(
        "--detector",
        metavar="DIR",
        help="Models of detections and queries: folder of the trained detector; default OUT/detr/small/seed-0.",
    ),
]
Hubert = Annotated[
    Path | None,
    typer.Option("--hubert", metavar="DIR", help="Models of HuBERT: folder of its weights (safetensors)."),
]
Encoder = Annotated[
    str, typer.Option(help="Text encoder: auto (minilm if installed, else hashing), hashing, minilm, bert.")
]
Out = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder of the trainings; a started training is resumed.")
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Hide the earlier acts of the Co-Wizard's own utterance at RfN points.")
]
Workers = Annotated[
    int | None, typer.Option(min=1, max=256, help="Number of worker processes; default one per processor.")
]


def train(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="toto, toto-belief, text, ... (see `table`); segformer, detr; co-wizard, participant.",
            autocompletion=complete_model,
        ),
    ],
    corpus: CorpusOption = None,
    size: Size = SMALL,
    seeds: SomeSeeds = None,
    encoder: Encoder = AUTO,
    out: Out = None,
    workers: Workers = None,
    strict: Strict = False,
    device: Device = None,
    inputs: PixelSource = None,
    epochs: Epochs = None,
    detector: Detector = None,
    hubert: Hubert = None,
    as_json: AsJson = False,
) -> None:
    """Train a model with several seeds, test it, and print its scores.

    An interrupted run is resumed by the same command. The vision models, segformer and detr, learn from pictures of the
    recorded sessions; co-wizard learns to talk and drive, and participant to guide, by imitation and practice.
    """
    if model in VISION_MODELS:
        if detector is not None:
            fail(_NOT_OF_DETECTIONS)
        if hubert is not None or strict or encoder != AUTO:
            fail(f"--hubert, --strict and --encoder are not for {model}")
        with _reporting_errors():
            folder, where = _places(corpus, out)
            train_vision(
                model, folder, where, size=size, seeds=seeds or 1, device=device, inputs=inputs, epochs=epochs,
                workers=workers, as_json=as_json,
            )  # fmt: skip
        return
    for option, given in (("--device", device), ("--inputs", inputs), ("--epochs", epochs)):
        if given is not None:
            fail(f"{option} is for {' and '.join(VISION_MODELS)} only")
    if model in ROLES:
        if detector is not None or hubert is not None or strict or size != SMALL or encoder != AUTO:
            fail(f"--detector, --hubert, --strict, --config and --encoder are not for {model}")
        with _reporting_errors():
            train_role(model, *_places(corpus, out), seeds=seeds or 1, workers=workers, as_json=as_json)
        return
    _train_benchmark_model(
        model, corpus, out, size=size, seeds=seeds or 5, encoder=encoder, workers=workers, strict=strict,
        detector=detector, hubert=hubert, as_json=as_json,
    )  # fmt: skip


def _train_benchmark_model(
    model: str,
    corpus: Path | None,
    out: Path | None,
    *,
    size: str,
    seeds: int,
    encoder: str,
    workers: int | None,
    strict: bool,
    detector: Path | None,
    hubert: Path | None,
    as_json: bool,
) -> None:
    """Trains a row of the results table with several seeds, and prints its scores."""
    with _reporting_errors():
        from dorothie_gym.baselines.experiment import gather_table, table_experiments
        from dorothie_gym.baselines.model_entries import find_row

        row = find_row(model)
        if row.missing:
            fail(f"{row.name} cannot be trained: {row.missing}")
        if detector is not None and row.objects != "detections":
            fail(_NOT_OF_DETECTIONS)
        if hubert is not None and row.sound != "hubert":
            fail("--hubert is for models of HuBERT only, such as toto-hubert")
        folder, where = _places(corpus, out)
        jobs = table_experiments(
            folder, where, encoder=encoder, size=size, seeds=seeds, rows=[row], strict=strict,
            detector=_checked_detector(detector or where / _DETECTOR, [row]), hubert=hubert,
        )  # fmt: skip
        results = _run(jobs, workers, quiet=as_json)
        table, _ = gather_table(jobs, floors=False)
    if as_json:
        print_json({"model": row.name, "corpus": str(folder), "runs": results, "table": table.to_json()})
        return
    _show(table)
    for result in results:
        if "epochs" not in result:
            continue
        stdout().print(
            f"Seed {result['seed']}: {result['epochs']} epochs, best {result['best_epoch']}, validation loss "
            f"{result['validation_loss']:.4f}, {result['seconds']:.0f} s; {result['folder']}",
            style="dim",
            markup=False,
            soft_wrap=True,
        )


def table(
    corpus: CorpusOption = None,
    size: Size = SMALL,
    seeds: Seeds = 5,
    models: Annotated[str, typer.Option(help="all, or a list of models: toto,text,...")] = "all",
    encoder: Encoder = AUTO,
    out: Out = None,
    workers: Workers = None,
    strict: Strict = False,
    detector: Detector = None,
    hubert: Hubert = None,
    as_json: AsJson = False,
) -> None:
    """Train all models that are not trained yet, and write the paper's results table with its figures beside ours.

    The output is Markdown, LaTeX, JSON, pictures, and the file of all predictions. An interrupted run is resumed by the
    same command.
    """
    begun = time.perf_counter()
    with _reporting_errors():
        from dorothie_gym.baselines.experiment import PREDICTIONS, gather_table, table_experiments
        from dorothie_gym.baselines.model_entries import ROWS, find_row

        rows = ROWS if models == "all" else [find_row(name.strip()) for name in models.split(",")]
        folder, where = _places(corpus, out)
        jobs = table_experiments(
            folder, where, encoder=encoder, size=size, seeds=seeds, rows=rows, strict=strict,
            detector=_checked_detector(detector or where / _DETECTOR, rows), hubert=hubert,
        )  # fmt: skip
        results = _run(jobs, workers, quiet=as_json)
        made, predictions = gather_table(jobs)
        teacher_forced.write_predictions(where / PREDICTIONS, predictions)
        teacher_forced.write_report(made, where)
    seconds = time.perf_counter() - begun
    if as_json:
        print_json({**made.to_json(), "out": str(where), "runs": results, "wall_seconds": round(seconds, 3)})
        return
    _show(made)
    stdout().print(
        f"{len(jobs)} trainings in {seconds:.0f} s. Written: {where}", style="dim", markup=False, soft_wrap=True
    )


def _run(jobs: Sequence[Experiment], workers: int | None, *, quiet: bool) -> list[Facts]:
    """Runs the trainings, and returns their results in the same order."""
    from dorothie_gym.baselines.experiment import run_experiments

    _name_former_trainings(jobs)
    found: dict[Path, Facts] = {}
    try:
        with _progress(len(jobs), quiet=quiet) as (on_epoch, on_job, on_session):
            for job, result in run_experiments(jobs, workers or available_processors(), on_epoch, on_session):
                found[job.folder] = result
                on_job(job)
    except KeyboardInterrupt:
        exit_interrupted(
            f"Interrupted with {len(found)} of {len(jobs)} trainings finished; resume with the same command."
        )
    return [found[job.folder] for job in jobs]


def _name_former_trainings(jobs: Sequence[Experiment]) -> None:
    """Names on standard error the trainings of former versions whose rows are called otherwise, and are not resumed."""
    from dorothie_gym.baselines.model_entries import FORMER_COMMANDS

    places = {job.model: job.out for job in jobs if not (job.out / job.model).exists()}
    for former, now in FORMER_COMMANDS.items():
        if now in places and (places[now] / former).is_dir():
            stderr().print(
                f"{places[now] / former}: has trainings of a former version, whose row is called {now} now; they are "
                "not resumed, but still play, and their predictions can be evaluated",
                style="dim",
                markup=False,
                soft_wrap=True,
            )


@contextmanager
def _progress(
    jobs: int, *, quiet: bool
) -> Iterator[tuple[Callable[[Experiment, Epoch], None], Callable[[Experiment], None], Callable[[], None]]]:
    """Shows a progress bar on a terminal."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress:
        bar, drawn = progress.add_task("Trainings", total=jobs), 0

        def on_epoch(job: Experiment, epoch: Epoch) -> None:
            loss = f"{epoch.training:.3f} / {epoch.validation:.3f}"
            progress.update(bar, description=f"{job.model}, seed {job.seed}, epoch {epoch.number}: loss {loss}")

        def on_job(job: Experiment) -> None:
            progress.update(bar, advance=1, description=f"{job.model}, seed {job.seed}: done")

        def on_session() -> None:
            nonlocal drawn
            drawn += 1
            progress.update(bar, description=f"Pictures of {drawn} session{'s'[: drawn > 1]} drawn")

        yield on_epoch, on_job, on_session


def _checked_detector(folder: Path, rows: Sequence[ModelEntry]) -> Path:
    """Returns the folder of a detector; raises `CheckpointError` if a row needs it and it cannot be used."""
    from dorothie_gym.baselines.dataset import sight_of

    for row in rows:
        sight_of(row.objects, folder)
    return folder


def _places(corpus: Path | None, out: Path | None) -> tuple[Path, Path]:
    """Returns the corpus, and the folder of its trainings, which is created."""
    folder = corpus
    if folder is None:
        try:
            folder = rollouts.default_corpus()
        except CacheError as error:
            fail(str(error))
    where = out or RUNS / folder.absolute().name
    where.mkdir(parents=True, exist_ok=True)
    return folder, where


def _show(table: ResultsTable) -> None:
    console = wide_stdout()
    teacher_forced.print_table(table, console)


@contextmanager
def _reporting_errors() -> Iterator[None]:
    """Turns errors of the input and of the training into one message."""
    try:
        import torch  # noqa: F401
    except ImportError:
        fail(f"training needs torch; run: {pip_install('baselines')}")
    with reporting_errors():
        try:
            yield
        except (EncoderError, CheckpointError, PredictionError, ValueError) as error:
            fail(str(error))
        except ProcessError as error:
            fail(str(error), FAILED)
