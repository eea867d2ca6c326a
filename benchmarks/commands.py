"""`python -m benchmarks`: measurements of speed and of understanding, each with its reference."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

import typer

from benchmarks.release.command import release
from dorothie_gym._startup import exit_on_signals
from dorothie_gym.cli.options import OWN_NAME, AsJson, CommandGroup, PictureCommand
from dorothie_gym.cli.output import check_picture, exit_interrupted, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.cli.warm_up import compile_first

if TYPE_CHECKING:
    from rich.table import Table

    from benchmarks.report import Report
    from benchmarks.timing import Figures, Progress
    from dorothie_gym.session.config import CameraOutput

Measure: TypeAlias = "Callable[[Progress], Figures]"
"""Measurement; takes a callback for its progress."""

SIMULATING: Final = ("world", "env", "vector", "camera", "lidar", "rl", "speech", "sessions")
"""Measurements of the simulation, which is compiled first."""

BATCHES: Final = ("vector", "rl")
"""Measurements of batches of `Navigation-v0`, which are compiled besides."""

app = typer.Typer(
    name="python -m benchmarks",
    cls=CommandGroup,
    help="Measure speeds, each with a reference in the same run: world, environment of three agents, "
    "batches of worlds, camera, lidar, speech, understanding, training, and import time.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_show_locals=False,
    add_completion=False,
)

Town = Annotated[str, typer.Option(metavar="NAME|FILE", help="A town's name, or a file (.xodr, .yaml).")]
Vehicles = Annotated[int, typer.Option(min=0, max=200, help="Number of vehicles, a tenth of them cyclists.")]
Pedestrians = Annotated[int, typer.Option(min=0, max=200, help="Number of pedestrians.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of positions and destinations.")]
Repeats = Annotated[int, typer.Option(min=1, max=99, help="Repeats per measurement; the median counts.")]
Picture = Annotated[
    Path | None, typer.Option(help="Draw a chart into this PNG file; default: named after the command.")
]


@app.command(cls=PictureCommand)
def world(
    town: Town = "northgate",
    vehicles: Vehicles = 30,
    pedestrians: Pedestrians = 20,
    props: Annotated[int, typer.Option(min=0, max=16, help="Props on lanes with a neighbouring lane.")] = 4,
    seed: Seed = 0,
    repeats: Repeats = 7,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Substeps per second of a full world, compared with the road of highway-env on the same map."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.world import measure

        return measure(
            town, vehicles=vehicles, pedestrians=pedestrians, props=props, seed=seed, repeats=repeats, progress=progress
        )

    _run("world", measured, picture, as_json)


@app.command(cls=PictureCommand)
def env(
    town: Town = "northgate",
    vehicles: Vehicles = 30,
    pedestrians: Pedestrians = 20,
    seed: Seed = 0,
    repeats: Repeats = 7,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Steps per second of the environment of three agents, compared with intersection-v0 of highway-env and SUMO."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.env import measure

        return measure(town, vehicles=vehicles, pedestrians=pedestrians, seed=seed, repeats=repeats, progress=progress)

    _run("env", measured, picture, as_json)


@app.command(cls=PictureCommand)
def vector(
    town: Town = "northgate",
    worlds: Annotated[int, typer.Option(min=1, max=4096, help="Number of worlds in a batch.")] = 64,
    vehicles: Vehicles = 30,
    pedestrians: Pedestrians = 20,
    threads: Annotated[int, typer.Option(min=2, max=256, help="Number of threads, compared with one.")] = 2,
    repeats: Annotated[int, typer.Option(min=2, max=99, help="Repeats per measurement; the median counts.")] = 9,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Batches of worlds on several threads, compared with one thread, and the vectorization modes of Gymnasium."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.vector import measure

        return measure(
            town,
            worlds=worlds,
            vehicles=vehicles,
            pedestrians=pedestrians,
            threads=threads,
            repeats=repeats,
            progress=progress,
        )

    _run("vector", measured, picture, as_json)


@app.command(cls=PictureCommand)
def camera(
    town: Town = "midtown",
    size: Annotated[
        list[str] | None, typer.Option(metavar="WxH", help="Size of the pictures; repeatable. Default: four.")
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(metavar="NAMES", help="all, or some such as rgb,depth,optical_flow; repeatable."),
    ] = None,
    vehicles: Vehicles = 60,
    pedestrians: Pedestrians = 60,
    seconds: Annotated[float, typer.Option(min=1.0, max=600.0, help="Length of the drive [s].")] = 30.0,
    cold: Annotated[
        bool, typer.Option("--cold", help="Measure the first picture without caches, too; takes minutes.")
    ] = False,
    seed: Seed = 0,
    repeats: Repeats = 5,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Pictures per second of the first-person camera by size and outputs, on one core, beside OpenGL and MetaDrive."""
    sizes, parts = [_size(text) for text in size or ()], [_outputs(text) for text in outputs or ()]

    def measured(progress: Progress) -> Figures:
        from benchmarks.camera import EVERYTHING, RGB, SIZES, measure

        return measure(
            town, sizes=sizes or SIZES, outputs=parts or (RGB, EVERYTHING), vehicles=vehicles, pedestrians=pedestrians,
            seconds=seconds, cold=cold, seed=seed, repeats=repeats, progress=progress,
        )  # fmt: skip

    _run("camera", measured, picture, as_json, pictures=True)


@app.command(cls=PictureCommand)
def lidar(
    town: Town = "midtown",
    vehicles: Vehicles = 60,
    pedestrians: Pedestrians = 60,
    seed: Seed = 0,
    repeats: Repeats = 5,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Turns of the lidar per second by channels and columns, on one core, compared with the ray casting of Embree."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.lidar import measure

        return measure(town, vehicles=vehicles, pedestrians=pedestrians, seed=seed, repeats=repeats, progress=progress)

    _run("lidar", measured, picture, as_json, pictures=True)


def _size(text: str) -> tuple[int, int]:
    """Returns width and height, as "480x320"; exits with code 2 for another text."""
    width, separator, height = text.partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        fail(f"--size {text}: give it as WIDTHxHEIGHT in pixels, for instance 480x320")
    from dorothie_gym.session.config import CameraConfig

    try:
        config = CameraConfig(width=int(width), height=int(height))
    except ValueError as error:
        fail(f"--size {text}: {error}")
    return config.width, config.height


def _outputs(text: str) -> tuple[CameraOutput, ...]:
    """Returns the outputs of a list of names; exits with code 2 for another name."""
    from dorothie_gym.session.config import CameraOutput

    if text == "all":
        return tuple(CameraOutput)
    names = text.split(",")
    known = [output.value for output in CameraOutput]
    for name in names:
        if name not in known or names.count(name) > 1:
            fail(f"--outputs {text}: give all, or different ones of {','.join(known)}")
    return tuple(CameraOutput(name) for name in names)


@app.command(cls=PictureCommand)
def rl(
    env: Annotated[str, typer.Option(metavar="ID", help="Id of the environment.")] = "dorothie_gym/Navigation-v0",
    algorithm: Annotated[str, typer.Option(help="ppo, maskable_ppo or a2c.")] = "ppo",
    observation: Annotated[
        str, typer.Option(metavar="KIND", help="What a driver of the navigation environments observes: vector, camera.")
    ] = "vector",
    environments: Annotated[
        int | None, typer.Option(min=1, max=4096, help="Parallel environments; default 256, with pictures 16.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=0, max=256, help="Processes that step them; default none for a batch, else one per core."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(min=256, help="Steps of the training; default 65,536, with pictures 4,096.")
    ] = None,
    town: Town = "brookside",
    traffic: Annotated[str, typer.Option(help="Traffic of the town: none, light, medium or heavy.")] = "light",
    exceptions: Annotated[float, typer.Option(min=0.0, max=4.0, help="Average number of exceptions.")] = 0.0,
    seed: Seed = 0,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Environment steps per second of the batch, its physics, one environment, and a whole training."""

    def measured(progress: Progress) -> Figures:
        try:
            from benchmarks.rl_training import measure
        except ImportError:
            fail("the benchmark rl needs torch and stable-baselines3; run: pip install 'dorothie-gym[baselines]'")
        from dorothie_gym.errors import SettingsError

        try:
            return measure(
                env, algorithm=algorithm, observation=observation, environments=environments, workers=workers,
                steps=steps, town=town, traffic=traffic, exceptions=exceptions, seed=seed, progress=progress,
            )  # fmt: skip
        except (SettingsError, ValueError) as error:
            fail(str(error))

    _run("rl", measured, picture, as_json, pictures=observation == "camera")


@app.command(cls=PictureCommand)
def sessions(
    town: Annotated[
        list[str] | None, typer.Option(metavar="NAME|FILE", help="Repeatable; default: midtown and brookside.")
    ] = None,
    co_wizard: Annotated[
        list[str] | None,
        typer.Option(metavar="POLICY", help="Repeatable; default: scripted and pretrained:co-wizard."),
    ] = None,
    count: Annotated[int, typer.Option("--sessions", min=1, max=1000, help="Number of sessions in each town.")] = 4,
    against: Annotated[
        str | None, typer.Option(metavar="REV", help="Revision of the checkout to measure alternately.")
    ] = None,
    record: Annotated[bool, typer.Option("--record", help="Record the sessions.")] = False,
    at_once: Annotated[
        int, typer.Option("--at-once", min=1, max=1000, help="Sessions of a town played at the same time.")
    ] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first session.")] = 5000,
    repeats: Annotated[int, typer.Option(min=1, max=99, help="Processes of each build; the median counts.")] = 3,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Decisions per second of whole sessions with talk, by part, compared with the build of another revision."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.sessions import CO_WIZARDS, TOWNS, measure

        try:
            return measure(
                town or TOWNS, co_wizards=co_wizard or CO_WIZARDS, sessions=count, seed=seed, record=record,
                at_once=at_once, against=against, repeats=repeats, progress=progress,
            )  # fmt: skip
        except ValueError as error:
            fail(str(error))

    _run("sessions", measured, picture, as_json)


@app.command(cls=PictureCommand)
def speech(
    sessions: Annotated[int, typer.Option(min=1, max=1000, help="Number of sessions whose talk is spoken.")] = 6,
    spans: Annotated[int, typer.Option(min=1, max=100_000, help="Number of spans that are drawn from them.")] = 150,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sessions, as of a corpus.")] = 31000,
    synthesizer: Annotated[str, typer.Option(metavar="NAME", help="hibari or flite.")] = "hibari",
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Word errors, understanding and times of synthesis and recognition on the talk of unseen sessions."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.speech import measure

        return measure(sessions=sessions, spans=spans, seed=seed, synthesizer=synthesizer, progress=progress)

    _run("speech", measured, picture, as_json)


@app.command(cls=PictureCommand)
def understanding(
    split: Annotated[str, typer.Option(help="Sentences to measure with: dev, test, or all.")] = "dev",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the word errors.")] = 0,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Moves, slots and plans understood of labelled everyday sentences, as written and with word errors."""
    if split not in ("dev", "test", "all"):
        fail(f"--split {split}: give dev, test or all")

    def measured(progress: Progress) -> Figures:
        from benchmarks.understanding import measure

        return measure(split=None if split == "all" else split, seed=seed, progress=progress)

    _run("understanding", measured, picture, as_json)


@app.command("import", cls=PictureCommand)
def importing(repeats: Repeats = 7, picture: Picture = None, as_json: AsJson = False) -> None:
    """Time to import the package and to create a first environment, compared with importing highway-env."""

    def measured(progress: Progress) -> Figures:
        from benchmarks.importing import measure

        return measure(repeats=repeats, progress=progress)

    _run("import", measured, picture, as_json)


@app.command(cls=PictureCommand)
def train(
    corpus: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Corpus; default: a small one that is generated once.")
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(min=1, max=256, help="Threads of torch; default all cores; 1 measures CPU time."),
    ] = None,
    batch: Annotated[int, typer.Option(min=1, max=1024, help="Points of a training step.")] = 64,
    repeats: Repeats = 5,
    picture: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Points per second in training at the published size, compared with the published loop and the matrix rate."""

    def measured(progress: Progress) -> Figures:
        try:
            from benchmarks.toto_training import measure
        except ImportError as error:
            fail(f"{error.name} is not installed; run: pip install 'dorothie-gym[baselines]'")
        from dorothie_gym.errors import CacheError
        from dorothie_gym.evaluation.rollout import default_corpus

        try:
            folder = corpus or default_corpus()
        except CacheError as error:
            fail(str(error))
        return measure(folder, threads=threads, batch_size=batch, repeats=repeats, progress=progress)

    _run("train", measured, picture, as_json)


@app.command()
def drives(
    records: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Driving tests as lines of JSON; default: those of the package.")
    ] = None,
    split: Annotated[str, typer.Option(metavar="NAME", help="dev, or test, which is to be used once.")] = "dev",
    only: Annotated[str | None, typer.Option(metavar="ID", help="Only tests whose id begins like this.")] = None,
    as_json: AsJson = False,
) -> None:
    """Share of driving tests, sentences of people-like speakers, that the scripted Co-Wizard drives and answers."""
    with reporting_errors(), _progress() as progress:
        from benchmarks.drives import RECORDS, measure

        figures = measure(records=records or RECORDS, split=split, only=only, progress=progress)
    if as_json:
        print_json(figures)
        return
    count = figures["tests"]
    stdout().print(f"{count} driving tests: {figures['as_expected']:.0%} as expected", style="bold", markup=False)
    stdout().print(f"driven {figures['driven']:.0%}, replied {figures['replied']:.0%}", markup=False)
    for kind, (passed, tests) in figures["kinds"].items():
        stdout().print(f"  {kind:<11} {passed} of {tests}", markup=False)
    for failure in figures["failures"]:
        wrong = "; ".join(filter(None, (failure["drive"], failure["reply"])))
        stdout().print(f"  {failure['id']}: {wrong}", markup=False, soft_wrap=True)


app.command()(release)


def _run(name: str, measure: Measure, picture: Path | None, as_json: bool, *, pictures: bool = False) -> None:
    """Runs a measurement, which may need the first-person camera, and shows its results."""
    if picture == Path(OWN_NAME):
        picture = Path(f"bench_{name}.png")
    if picture is not None:
        check_picture(picture)
    try:
        with reporting_errors():
            if name in SIMULATING:
                compile_first(batches=name in BATCHES, pictures=pictures)
            with _progress() as progress:
                figures = measure(progress)
    except KeyboardInterrupt:
        exit_interrupted("Interrupted; there are no results.")
    if as_json:
        print_json(figures)
    if as_json and picture is None:
        return
    from benchmarks import report as reports

    report: Report = getattr(reports, f"{name}_report")(figures)
    if not as_json:
        _show(report)
    if picture is not None:
        from benchmarks.report_chart import draw

        draw(report, picture)
        if not as_json:
            stdout().print(f"Chart: {picture}", markup=False, soft_wrap=True)


@contextmanager
def _progress() -> Iterator[Progress]:
    """Shows a progress bar on a terminal until all is done."""
    console = stderr()
    if not console.is_terminal:
        yield lambda part, share: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("measuring {task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("", total=1.0)
        yield lambda part, share: progress.update(bar, description=part, completed=share)


def _show(report: Report) -> None:
    console = stdout()
    console.print(report.title, style="bold", markup=False)
    console.print(report.setting, style="dim", markup=False)
    console.print(_table(report))
    console.print(report.headline[0].upper() + report.headline[1:] + ".", style="bold", markup=False)
    for note in report.notes:
        console.print(note[0].upper() + note[1:] + ".", markup=False)
    console.print(report.machine, style="dim", markup=False)


def _table(report: Report) -> Table:
    from rich.table import Table

    from benchmarks.report import number

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("", style="bold")
    table.add_column(report.unit, justify="right")
    best, spread = any(row.best is not None for row in report.rows), any(row.spread is not None for row in report.rows)
    if best:
        table.add_column("best", justify="right")
    if spread:
        table.add_column("spread", justify="right")
    for row in report.rows:
        cells = [row.label, number(row.value)]
        if best:
            cells.append("" if row.best is None else number(row.best))
        if spread:
            cells.append("" if row.spread is None else f"{row.spread:.1%}")
        table.add_row(*cells)
    return table


def main() -> None:
    """Runs the command line of the benchmarks."""
    exit_on_signals()
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep its greeting out of the output of --json
    app(prog_name="python -m benchmarks")
