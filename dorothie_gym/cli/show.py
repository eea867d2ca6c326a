"""`dorothie-gym show`: annotated transcripts of sessions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.output import reporting_errors


def show(
    session: Annotated[list[Path], typer.Argument(metavar="SESSION...", help="Sessions of any layout.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE.md", help="File to write; default standard output.")] = None,
    maps: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns that are not shipped (Town01.xodr).")
    ] = None,
) -> None:
    """Write annotated transcripts as Markdown: utterances, dialogue acts, exchanges, transactions and other events."""
    with reporting_errors():
        from dorothie_gym.analysis.transcript import markdown
        from dorothie_gym.recording import read_session

        page = "\n".join(markdown(read_session(path, maps=maps)) for path in session)
        if out is not None:
            out.write_text(page, encoding="utf-8", newline="\n")
        else:
            typer.echo(page, nl=False)
