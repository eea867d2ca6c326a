"""`dorothie-gym show`: sessions as pages that people read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.output import told_plainly


def show(
    session: Annotated[list[Path], typer.Argument(metavar="SESSION...", help="Sessions of any layout.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.md", help="Write the page there; else to standard output.")
    ] = None,
    maps: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns that are not shipped (Town01.xodr).")
    ] = None,
) -> None:
    """Write annotated transcripts as Markdown: words, acts, exchanges, transactions, and what happens in between."""
    with told_plainly():
        from dorothie_gym.analysis.transcript import markdown
        from dorothie_gym.recording import read_session

        page = "\n".join(markdown(read_session(path, maps=maps)) for path in session)
        if out is not None:
            out.write_text(page, encoding="utf-8", newline="\n")
        else:
            typer.echo(page, nl=False)
