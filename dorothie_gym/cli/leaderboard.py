"""`dorothie-gym leaderboard`: ranking of policies by their rollouts, which it plays on request, as a page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym import maps as town_maps
from dorothie_gym.cli.completion import complete_policy
from dorothie_gym.cli.language_model import AnswerTime, LanguageModelOptions
from dorothie_gym.cli.options import AsJson, MaxSeconds, Players, Ray, env_config, find_cast
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
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError, RolloutError
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.ontology.roles import Role
from dorothie_gym.support.processors import available_processors

PAGE = Path("leaderboard.md")
"""Default page of the leaderboard, in the present folder."""

DEFINITIONS = "closed-loop.md"
"""Page with the definitions of the metrics; linked where it lies beside the leaderboard, as in docs."""

_PANEL = "Playing (--play)"


def leaderboard(
    folders: Annotated[
        list[Path],
        typer.Argument(metavar="DIR...", help="Folders of rollouts, or folders that contain them; one with --play."),
    ],
    out: Annotated[
        Path,
        typer.Option(metavar="FILE.md", help="Page to write; its picture is written beside it as .png."),
    ] = PAGE,
    play: Annotated[
        bool,
        typer.Option(
            "--play", help="First play what is missing, into DIR; a started run is resumed.", rich_help_panel=_PANEL
        ),
    ] = False,
    row: Annotated[
        list[str] | None,
        typer.Option(
            "--row",
            metavar="NAME|FILE|MODULE:CLASS",
            rich_help_panel=_PANEL,
            autocompletion=complete_policy("co_wizard"),
            help="A Co-Wizard, as in `rollout`; repeat it. Default: scripted, lane-follow, random, all shipped models.",
        ),
    ] = None,
    parts: Annotated[
        str,
        typer.Option(metavar="PART,...", help="Parts to play: seen, development, unseen.", rich_help_panel=_PANEL),
    ] = "seen,unseen",
    imported: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE.xodr",
            help="An OpenDRIVE file for the part of imported towns; repeat it.",
            rich_help_panel=_PANEL,
        ),
    ] = None,
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions of each row.", rich_help_panel=_PANEL)] = 100,
    max_seconds: MaxSeconds = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Play all sessions of the protocol again, as `submit` does; otherwise figures are claims."
        ),
    ] = False,
    workers: Players = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Rank policies by their rollouts, on a page with intervals, cost and commands, and in a picture.

    With --play, one command makes the whole page again: it plays all rows with seed 0, then writes the page. What
    nothing has checked is marked as claimed.
    """
    with reporting_errors():
        if out.suffix != ".md":
            fail(f"{out}: the page is Markdown; give a name that ends in .md")
        check_file(out)
        if play:
            if len(folders) != 1:
                fail("--play takes one folder, for all rollouts")
            plan = _plan(row, parts, imported or [], sessions, max_seconds)
            _check_weights(plan, folders[0])
            _play(plan, folders[0], workers, ray, quiet=as_json)
        try:
            entries = closed_loop.read_entries(folders)
        except RolloutError as error:
            fail(str(error))
        if check:
            entries = _checked(entries, workers, quiet=as_json)
        picture = closed_loop.draw_leaderboard(entries, out.with_suffix(".png"))
        definitions = DEFINITIONS if (out.parent / DEFINITIONS).is_file() else None
        out.write_text(closed_loop.leaderboard_page(entries, picture.name, definitions), encoding="utf-8")
    if as_json:
        rows = [
            {"policy": entry.policy, "towns": entry.part, "claims": list(entry.claims), **entry.table.to_json()}
            for entry in entries
        ]
        print_json(
            {"page": str(out), "picture": str(picture), "sha256": closed_loop.figures_sha256(entries), "rows": rows}
        )
        return
    _print(entries, out, picture)


def _print(entries: Sequence[closed_loop.LeaderboardEntry], out: Path, picture: Path) -> None:
    console, labels = stdout(), closed_loop.labels_of(entries)
    for entry in entries:
        success = entry.table.figures["success"]["mean"]
        share = "-" if success is None else f"{100 * success:.1f} %"
        claims = f" (claimed: {', '.join(entry.claims)})" if entry.claims else ""
        console.print(f"{entry.part:8} {labels[entry.policy]}: success {share}{claims}", markup=False, soft_wrap=True)
    console.print(f"Written: {out}, {picture}", style="dim", markup=False, soft_wrap=True)


def _checked(
    entries: Sequence[closed_loop.LeaderboardEntry], workers: int | None, *, quiet: bool
) -> tuple[closed_loop.LeaderboardEntry, ...]:
    """Returns the rollouts with the outcome of their check; exits if one has faults."""
    from dorothie_gym.evaluation.closed_loop import protocol

    try:
        compile_first(pictures=False)
        with session_progress(quiet=quiet) as on_session:
            return closed_loop.checked_entries(
                entries, protocol.PROTOCOL, workers=workers or available_processors(), on_session=on_session
            )
    except KeyboardInterrupt:
        exit_interrupted("Interrupted; no page was written.")
    except (RolloutError, ProcessError) as error:
        fail(str(error), FAILED)


def _plan(
    row: list[str] | None, parts: str, imported: list[str], sessions: int, max_seconds: float | None
) -> closed_loop.LeaderboardPlan:
    """Returns the rollouts to be played; exits if a name or file is unknown."""
    for file in imported:
        town_maps.load_town(file)
    asked = LanguageModelOptions(
        url=None,
        timeout=30.0,
        tokens=None,
        parameters="",
        time=AnswerTime.WAITS,
        pictures=False,
        cassette=None,
        replay=False,
        prices=None,
    )
    names = row or list(closed_loop.usual_rows())
    players = [find_cast("scripted", name, "scripted", asked)[Role.CO_WIZARD] for name in names]
    try:
        return closed_loop.LeaderboardPlan(
            co_wizards=players,
            parts=tuple(part.strip() for part in parts.split(",") if part.strip()),
            imported=tuple(imported),
            sessions=sessions,
            config=env_config(max_seconds, None),
        )
    except ValueError as error:
        fail(str(error))


def _check_weights(plan: closed_loop.LeaderboardPlan, folder: Path) -> None:
    """Exits if the folder has a row of a planned model with other weights: the page could not have both."""
    for name, settings in plan.rollouts().items():
        player = settings.players[Role.CO_WIZARD]
        if player.sha256 is None:
            continue
        stem = name.removesuffix(player.sha256[:8])
        others = [
            other for other in sorted(folder.glob(f"{stem}*")) if re.fullmatch("[0-9a-f]{8}", other.name[len(stem) :])
        ]
        found = next((other for other in others if other.name != name), None)
        if found is not None:
            fail(f"{found}: sessions of other weights of {player.name}; move or delete them, or choose another folder")


def _play(
    plan: closed_loop.LeaderboardPlan, folder: Path, workers: int | None, ray: str | None, *, quiet: bool
) -> None:
    try:
        compile_first(pictures=False)
        with session_progress(quiet=quiet) as on_session:
            closed_loop.roll_out_all(
                plan.rollouts(), folder, workers=workers or available_processors(), ray=ray, on_session=on_session
            )
    except KeyboardInterrupt:
        exit_interrupted(f"Interrupted; the finished sessions are in {folder}; resume with the same command.")
    except ProcessError as error:
        fail(f"{error}; the finished sessions are kept in {folder}", FAILED)
