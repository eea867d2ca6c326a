"""`dorothie-gym submit`: check of a rollout for the leaderboard, and its submission as a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import check_file, fail, print_json, reporting_errors, session_progress, stdout

FAULTY = 1
"""Exit code for a rollout that cannot be submitted."""

ALL = "all"


def submit(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a rollout (`rollout --out DIR`).")],
    out: Annotated[Path, typer.Option(metavar="FILE.json", help="File to write.")] = Path("submission.json"),
    sample: Annotated[
        str, typer.Option(metavar="N|all", help="Number of sessions to simulate again from their actions.")
    ] = "10",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sample.")] = 0,
    check: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="Compare this submission with the folder instead of writing one."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check a rollout for the leaderboard, and write its submission with hashes; exit code 1 if there are faults.

    Towns, seeds and settings must be those of the leaderboard; every session is measured again, and a sample is
    simulated again from its seed and recorded actions.
    """
    if sample != ALL and not (sample.isdecimal() and 1 <= int(sample) <= 10**6):
        fail(f"--sample is {sample!r}; give a number of sessions, or all")
    if check is None:
        check_file(out)
    with reporting_errors():
        from dorothie_gym.files import write_atomically
        from dorothie_gym.recording.json_io import to_page
        from dorothie_gym.rollout.closed_loop import submission

        with session_progress(quiet=as_json) as on_session:
            found = submission.check_submission(
                folder,
                sample=None if sample == ALL else int(sample),
                seed=seed,
                protocol=submission.PROTOCOL,
                on_session=on_session,
            )
        faults = found.faults
        if found.submission is not None and check is not None:
            faults = submission.differences_from(check, found.submission)
        elif found.submission is not None:
            write_atomically(out, to_page(found.submission))
    written = None if faults or check is not None else str(out)
    if as_json:
        print_json({"faults": list(faults), "resimulated": list(found.resimulated), "submission": written})
    else:
        console = stdout()
        for fault in faults:
            console.print(fault, markup=False, soft_wrap=True)
        console.print(
            f"{len(found.resimulated)} sessions simulated again; "
            + (f"{len(faults)} faults" if faults else f"no fault. Written: {out}" if written else "no fault"),
            markup=False,
            soft_wrap=True,
        )
    if faults:
        raise typer.Exit(FAULTY)
