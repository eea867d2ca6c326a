"""`dorothie-gym compare`: first differences of two sessions, or of two folders of sessions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import print_json, reporting_errors, stdout

if TYPE_CHECKING:
    from dorothie_gym.recording import Difference

_DIFFERENT = 1
"""Exit code where a session differs."""


def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="A session, or a folder of sessions (corpus, rollout).")],
    second: Annotated[Path, typer.Argument(metavar="B", help="The session or folder to compare it with.")],
    as_json: AsJson = False,
) -> None:
    """Compare two sessions, or two folders of sessions, event by event and frame by frame.

    Sessions of folders are compared with those of the same path. The exit code is 1 if any of them differs.
    """
    from dorothie_gym.recording import compare_folders

    rows: list[tuple[str, Difference | None]] = []
    with reporting_errors():
        for name, difference in compare_folders(first, second):
            rows.append((name, difference))
            if not as_json:
                stdout().print(f"{name}: {_in_words(difference)}", markup=False, soft_wrap=True)
    equal = sum(difference is None for _, difference in rows)
    if as_json:
        sessions = [{"session": name, "equal": found is None, "difference": _page(found)} for name, found in rows]
        print_json({"compared": len(rows), "equal": equal == len(rows), "sessions": sessions})
    elif len(rows) > 1:
        stdout().print(f"{equal} of {len(rows)} sessions are equal")
    if equal < len(rows):
        raise typer.Exit(_DIFFERENT)


def _in_words(difference: Difference | None) -> str:
    if difference is None:
        return "equal"
    if difference.field == "session":  # one of the two folders has no such session
        return f"first: {difference.recorded}, second: {difference.replayed}"
    when = "before it begins" if difference.frame < 0 else f"at frame {difference.frame}"
    return f"differs first {when}, {difference.field}: {difference.recorded} and {difference.replayed}"


def _page(difference: Difference | None) -> dict[str, int | str] | None:
    if difference is None:
        return None
    return {
        "frame": difference.frame,
        "field": difference.field,
        "first": difference.recorded,
        "second": difference.replayed,
    }
