"""Application `dorothie-gym` and its commands, which import their modules when they run to keep `--help` fast."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated

import typer

from dorothie_gym._startup import exit_on_signals
from dorothie_gym._version import __version__
from dorothie_gym.cli.annotate import annotate
from dorothie_gym.cli.annotations import agreement, annotations_app
from dorothie_gym.cli.console import console
from dorothie_gym.cli.convert import convert
from dorothie_gym.cli.cross_play import cross_play
from dorothie_gym.cli.evaluate import evaluate
from dorothie_gym.cli.frames import frames
from dorothie_gym.cli.generate import generate
from dorothie_gym.cli.leaderboard import leaderboard
from dorothie_gym.cli.listings import envs, policies, storyboards, towns
from dorothie_gym.cli.options import CommandGroup, PictureCommand
from dorothie_gym.cli.play import play
from dorothie_gym.cli.reference_times import reference_times
from dorothie_gym.cli.rollout import rollout
from dorothie_gym.cli.run import run
from dorothie_gym.cli.seal import seal
from dorothie_gym.cli.serve import serve
from dorothie_gym.cli.sessions import compare, film, replay
from dorothie_gym.cli.show import show
from dorothie_gym.cli.stats import stats
from dorothie_gym.cli.study import study
from dorothie_gym.cli.submit import submit
from dorothie_gym.cli.train import table, train
from dorothie_gym.cli.train_rl import train_rl
from dorothie_gym.cli.warm_up import warm_up
from dorothie_gym.support.interruption import end_process

_INTERRUPTED = (128 + signal.SIGINT, 128 + signal.SIGTERM)

app = typer.Typer(
    name="dorothie-gym",
    cls=CommandGroup,
    help="Simulation of situated dialogue between a passenger and a car that drives through a town, with an adversary.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_show_locals=False,
)
app.command()(run)
app.command()(play)
app.command()(console)
app.add_typer(study, name="study")
app.command()(annotate)
app.add_typer(annotations_app, name="annotations")
app.command()(agreement)
app.command(cls=PictureCommand)(towns)
app.command()(storyboards)
app.command()(envs)
app.command()(policies)
app.command()(evaluate)
app.command()(convert)
app.command(cls=PictureCommand)(stats)
app.command()(generate)
app.command()(rollout)
app.command("reference-times")(reference_times)
app.command("cross-play")(cross_play)
app.command()(leaderboard)
app.command()(seal)
app.command()(submit)
app.command()(serve)
app.command()(replay)
app.command()(film)
app.command()(frames)
app.command()(compare)
app.command()(show)
app.command("train-rl")(train_rl)
app.command()(train)
app.command()(table)
app.command("warm-up")(warm_up)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"dorothie-gym {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Runs the command line."""
    exit_on_signals()
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep its greeting out of the output of --json
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # terminals print "?" for letters that they cannot encode
    try:
        app(prog_name="dorothie-gym")
    except SystemExit as ending:
        if ending.code in _INTERRUPTED:
            end_process(ending.code)
        raise
