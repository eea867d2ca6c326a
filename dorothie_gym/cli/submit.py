"""`dorothie-gym submit`: check of a rollout for the leaderboard, and its submission as a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import AsJson, Players
from dorothie_gym.cli.output import (
    FAILED,
    check_file,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    stdout,
)
from dorothie_gym.cli.tier_options import References, read_references
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError
from dorothie_gym.session import recording
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.submission import SubmissionCheck
    from dorothie_gym.session.scenario import ReferenceDrive


FAULTY = 1
"""Exit code for a rollout that cannot be submitted."""

ALL = "all"


def submit(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a rollout (`rollout --out DIR`).")],
    out: Annotated[Path, typer.Option(metavar="FILE.json", help="File to write.")] = Path("submission.json"),
    sample: Annotated[
        str, typer.Option(metavar="N|all", help="Number of sessions to play again; the others are read and measured.")
    ] = ALL,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the sample; by default a random one, which nobody can know.")
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="Compare this submission with the folder instead of writing one."),
    ] = None,
    references: References = None,
    workers: Players = None,
    as_json: AsJson = False,
) -> None:
    """Check a rollout for the leaderboard, and write its submission with hashes; exit code 1 if there are faults.

    Towns, seeds and settings must be those of the leaderboard, of a tier, or of the beacon of a sealed test, whose seal
    must be older. Every session is drawn and played again from its seed by the partners of these conditions, with the
    recorded actions of the Co-Wizard, or by its policy if the package has it.
    What nothing can check is listed as claimed.
    """
    if sample != ALL and not (sample.isdecimal() and 1 <= int(sample) <= 10**6):
        fail(f"--sample is {sample!r}; give a number of sessions, or all")
    if check is None:
        check_file(out)
    with reporting_errors():
        from dorothie_gym.evaluation.closed_loop import submission

        drives = read_references(references)
        found = _check(folder, None if sample == ALL else int(sample), seed, workers, drives, quiet=as_json)
        faults = found.faults
        if found.submission is not None and check is not None:
            faults = submission.differences_from(check, found.submission)
        elif found.submission is not None:
            write_atomically(out, recording.to_page(found.submission))
    written = None if faults or check is not None else str(out)
    if as_json:
        print_json(
            {
                "faults": list(faults),
                "resimulated": list(found.resimulated),
                "sessions": found.sessions,
                "seed": found.seed,
                "co_wizard_played": found.played,
                "claims": list(found.claims),
                "submission": written,
            }
        )
    else:
        _print(found, faults, written)
    if faults:
        raise typer.Exit(FAULTY)


def _check(
    folder: Path,
    sample: int | None,
    seed: int | None,
    workers: int | None,
    drives: dict[str, ReferenceDrive],
    *,
    quiet: bool,
) -> SubmissionCheck:
    from dorothie_gym.evaluation.closed_loop import protocol, submission

    try:
        compile_first(pictures=False)
        with session_progress(quiet=quiet) as on_session:
            return submission.check_submission(
                folder,
                sample=sample,
                seed=seed,
                protocol=protocol.PROTOCOL,
                workers=workers or available_processors(),
                on_session=on_session,
                drives=drives,
            )
    except KeyboardInterrupt:
        exit_interrupted("Interrupted; nothing was written.")
    except ProcessError as error:
        fail(str(error), FAILED)


def _print(found: SubmissionCheck, faults: Sequence[str], written: str | None) -> None:
    console = stdout()
    for fault in faults:
        console.print(fault, markup=False, soft_wrap=True)
    console.print(
        f"{len(found.resimulated)} sessions simulated again; "
        + (f"{len(faults)} faults" if faults else f"no fault. Written: {written}" if written else "no fault"),
        markup=False,
        soft_wrap=True,
    )
    if faults:
        return
    drawn = "" if found.seed is None else f", drawn with seed {found.seed}"
    whose = "by its own policy" if found.played else "by its recorded actions"
    console.print(
        f"Simulated: {len(found.resimulated)} of {found.sessions} sessions{drawn}; the Co-Wizard acted {whose}.",
        markup=False,
        soft_wrap=True,
    )
    console.print(f"Claimed, not checked: {', '.join(found.claims) or 'nothing'}", markup=False, soft_wrap=True)
