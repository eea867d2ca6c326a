"""`dorothie-gym generate`: generation of a corpus."""

from __future__ import annotations

import json
import shlex
import time
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym import maps as town_maps
from dorothie_gym.cli.completion import complete_towns
from dorothie_gym.cli.options import AsJson, MaxSeconds, Perception, Players, Ray, Speech, WordErrors, env_config
from dorothie_gym.cli.output import (
    FAILED,
    Facts,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    stdout,
)
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.session.config import PerceptionModel
from dorothie_gym.support.processors import available_processors


def generate(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the corpus; a started corpus is resumed.")],
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions, divided into folds as in the paper.")] = 183,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the corpus; equal seeds give equal corpora.")] = 0,
    towns: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Towns of the seen folds, which take turns: seen|development|NAME,...; generated is another town for"
            " each session.",
            autocompletion=complete_towns,
        ),
    ] = None,
    workers: Players = None,
    max_seconds: MaxSeconds = None,
    word_errors: WordErrors = None,
    perception: Perception = PerceptionModel.SYMBOLIC,
    speech: Speech = False,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Generate a corpus: the scripted roles play sessions, divided into train, val and test, seen and unseen towns.

    The bytes do not depend on the number of workers. After an interruption the same command resumes.
    """
    with reporting_errors():
        config = env_config(max_seconds, word_errors, perception, speech)
        seen = town_maps.SEEN_TOWNS if towns is None else closed_loop.parse_towns(towns)
        try:
            compile_first(pictures=perception is PerceptionModel.CAMERA)
            begun = time.perf_counter()
            with session_progress(quiet=as_json) as on_session:
                made = rollouts.generate_corpus(
                    out,
                    sessions=sessions,
                    seed=seed,
                    towns=seen,
                    workers=workers or available_processors(),
                    ray=ray,
                    config=config,
                    on_session=on_session,
                )
        except KeyboardInterrupt:
            _exit_interrupted(out, sessions, seed, towns, max_seconds, word_errors, perception, speech)
        except ProcessError as error:
            fail(str(error), FAILED)
    facts = _facts(made, seed, time.perf_counter() - begun)
    if as_json:
        print_json(facts)
    else:
        folds = ", ".join(f"{fold} {count}" for fold, count in facts["folds"].items())
        stdout().print(
            f"{facts['sessions']} sessions in {out} ({folds}); {facts['played']} played now in "
            f"{facts['wall_seconds']:.0f} s. Hashes: {made.manifest}",
            markup=False,
            soft_wrap=True,
        )


def _exit_interrupted(
    out: Path,
    sessions: int,
    seed: int,
    towns: str | None,
    max_seconds: float | None,
    word_errors: float | None,
    perception: PerceptionModel,
    speech: bool,
) -> None:
    seen = town_maps.SEEN_TOWNS if towns is None else closed_loop.parse_towns(towns)
    done = rollouts.finished_sessions(out, sessions=sessions, seed=seed, towns=seen)
    command = f"dorothie-gym generate --sessions {sessions} --seed {seed} --out {out}"
    if towns is not None:
        command += f" --towns {shlex.quote(towns)}"
    if max_seconds is not None:
        command += f" --max-seconds {max_seconds:g}"
    if word_errors is not None:
        command += f" --word-errors {word_errors:g}"
    if perception is not PerceptionModel.SYMBOLIC:
        command += f" --perception {perception}"
    if speech:
        command += " --speech"
    exit_interrupted(f"Interrupted with {done} of {sessions} sessions finished; resume with: {command}")


def _facts(made: rollouts.Generated, seed: int, wall: float) -> Facts:
    folds: dict[str, int] = {}
    for row in made.rows:
        fold = str(row["fold"])
        folds[fold] = folds.get(fold, 0) + 1
    return {
        "out": str(made.root),
        "sessions": len(made.rows),
        "seed": seed,
        "folds": folds,
        "played": made.played,
        "wall_seconds": round(wall, 3),
        "manifest": str(made.manifest),
        "sha256": json.loads(made.manifest.read_text(encoding="utf-8"))["sha256"],
    }
