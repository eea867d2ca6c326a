"""`dorothie-gym rollout`: agents in the loop, measured over many sessions."""

from __future__ import annotations

import shlex
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import (
    AdWizard,
    AsJson,
    CoWizard,
    MaxSeconds,
    Participant,
    Players,
    Ray,
    WordErrors,
    env_config,
)
from dorothie_gym.cli.output import FAILED, INTERRUPTED, fail, print_json, stderr, told_plainly, wide_stdout
from dorothie_gym.cli.players import find_cast
from dorothie_gym.cli.progress import processors, session_progress

if TYPE_CHECKING:
    from dorothie_gym.rollout.closed_loop import RolloutResult, RolloutSettings


def rollout(
    co_wizard: CoWizard = "scripted",
    participant: Participant = "scripted",
    ad_wizard: AdWizard = "scripted",
    sessions: Annotated[int, typer.Option(min=1, help="How many, in all towns together.")] = 20,
    towns: Annotated[str, typer.Option(metavar="seen|unseen|all|NAME,...", help="Where; towns take turns.")] = "unseen",
    workers: Players = None,
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal sessions, whoever plays.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep sessions and results here; a rollout that was begun is gone on with."),
    ] = None,
    max_seconds: MaxSeconds = None,
    word_errors: WordErrors = 0.0,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Let agents drive and talk through many sessions, and print what that was worth, with intervals.

    The same table comes out whatever the number of workers. When it is stopped, it tells how to go on.
    """
    with told_plainly():
        from dorothie_gym.rollout.closed_loop import RolloutSettings, parse_towns

        cast = find_cast(participant, co_wizard, ad_wizard)
        try:
            chosen = parse_towns(towns)
        except ValueError as error:
            fail(str(error))
        settings = RolloutSettings(
            cast=cast, towns=chosen, sessions=sessions, seed=seed, config=env_config(max_seconds, word_errors)
        )
        result = _play(settings, out, workers or processors(), ray, quiet=as_json)
    if as_json:
        print_json(result.to_json())
        return
    from dorothie_gym.rollout.closed_loop.results import print_result

    console = wide_stdout()
    print_result(result, console)
    if out is not None:
        console.print(f"Kept for `dorothie-gym replay` and `leaderboard`: {out}", style="dim", soft_wrap=True)


def _play(settings: RolloutSettings, out: Path | None, workers: int, ray: str | None, *, quiet: bool) -> RolloutResult:
    from dorothie_gym.errors import ProcessError
    from dorothie_gym.rollout.closed_loop import roll_out

    folder = Path(tempfile.mkdtemp(prefix="dorothie_gym-rollout-")) if out is None else out
    try:
        with session_progress(quiet=quiet) as on_session:
            result = roll_out(settings, folder, workers=workers, ray=ray, on_session=on_session)
    except KeyboardInterrupt:
        _tell_interruption(folder, settings)
    except ProcessError as error:
        fail(f"{error}; what was played until then is kept in {folder}", FAILED)
    if out is None:
        shutil.rmtree(folder)
    return result


def _tell_interruption(folder: Path, settings: RolloutSettings) -> None:
    from dorothie_gym.rollout.closed_loop.results import RESULT_FILE, read_result
    from dorothie_gym.rollout.closed_loop.running import command_of

    done = len(read_result(folder).rows) if (folder / RESULT_FILE).is_file() else 0
    stderr().print(
        f"Interrupted with {done} of {settings.sessions} sessions finished; their results are in "
        f"{folder / RESULT_FILE}; go on with: {command_of(settings.to_json())} --out {shlex.quote(str(folder))}",
        markup=False,
        soft_wrap=True,
    )
    raise typer.Exit(INTERRUPTED)
