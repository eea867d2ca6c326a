"""`dorothie-gym leaderboard`: ranking of policies as a Markdown page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import check_file, fail, print_json, reporting_errors, stdout

PAGE = Path("docs/leaderboard.md")


def leaderboard(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Folders of rollouts, or folders that contain them.")
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE.md", help="Page to write; its picture is written beside it as .png.")
    ] = PAGE,
    as_json: AsJson = False,
) -> None:
    """Rank policies by their rollouts, on a page with intervals, cost and commands, and in a picture."""
    with reporting_errors():
        from dorothie_gym.errors import RolloutError
        from dorothie_gym.rollout.closed_loop.leaderboard import draw_leaderboard, leaderboard_page, read_entries

        if out.suffix != ".md":
            fail(f"{out}: the page is Markdown; give a name that ends in .md")
        check_file(out)
        try:
            entries = read_entries(folders)
        except RolloutError as error:
            fail(str(error))
        picture = draw_leaderboard(entries, out.with_suffix(".png"))
        out.write_text(leaderboard_page(entries, picture.name), encoding="utf-8")
    if as_json:
        rows = [{"policy": entry.policy, "towns": entry.part, **entry.page} for entry in entries]
        print_json({"page": str(out), "picture": str(picture), "rows": rows})
        return
    console = stdout()
    for entry in entries:
        success = entry.page["success"]["mean"]
        share = "-" if success is None else f"{100 * success:.1f} %"
        console.print(f"{entry.part:7} {entry.policy}: success {share}", markup=False, soft_wrap=True)
    console.print(f"Written: {out}, {picture}", style="dim", markup=False, soft_wrap=True)
