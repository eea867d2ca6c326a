"""`dorothie-gym play`: one seat for you, in the browser or by keys, with scripted partners."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from dorothie_gym.cli.completion import complete_town
from dorothie_gym.cli.console import console_room, seat_links
from dorothie_gym.cli.options import Storyboard, env_config
from dorothie_gym.cli.output import fail, reporting_errors, stdout
from dorothie_gym.cli.serving import LOCAL, check_libraries, listen, serve
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import did_you_mean
from dorothie_gym.lab import console as seats
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.ontology.roles import AGENT_ROLES, Role

if TYPE_CHECKING:
    from rich.console import Console

    from dorothie_gym.cli import terminal_play

NAVIGATION: Final = "navigation"
ROLES: Final = (*(str(role).replace("_", "-") for role in AGENT_ROLES), NAVIGATION)


def play(
    role: Annotated[str, typer.Argument(metavar="[ROLE]", help=f"Your seat: {', '.join(ROLES)}.")] = "co-wizard",
    town: Annotated[
        str,
        typer.Option(metavar="NAME|FILE", help="Name or file of a town (.xodr, .yaml).", autocompletion=complete_town),
    ] = DEFAULT_TOWN,
    storyboard: Storyboard = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the session.")] = 0,
    max_seconds: Annotated[
        float | None, typer.Option(min=1.0, max=86400.0, help="End the session after this simulated time [s].")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Record the session into a folder in this folder (browser).")
    ] = None,
    terminal: Annotated[
        bool, typer.Option("--terminal", help="Play by keys in the terminal: co-wizard or navigation.")
    ] = False,
) -> None:
    """Play one role yourself: opens your seat in the browser, with scripted partners.

    With --terminal, the Co-Wizard drives and talks by keys, and `navigation` drives by the participant's instructions.
    """
    name = role.strip().lower().replace("_", "-")
    if name not in ROLES:
        fail(f"there is no role {role!r}; {did_you_mean(name, ROLES)}the roles are {', '.join(ROLES)}")
    if terminal or name == NAVIGATION:
        _play_by_keys(name, town, storyboard, seed, max_seconds, out)
    else:
        _play_in_browser(Role(name.replace("-", "_")), town, storyboard, seed, max_seconds, out)


def _play_by_keys(
    name: str, town: str, storyboard: str | None, seed: int, max_seconds: float | None, out: Path | None
) -> None:
    from dorothie_gym.cli import terminal_play

    if name not in ("co-wizard", NAVIGATION):
        fail(f"--terminal plays co-wizard and {NAVIGATION}; {name} is played in the browser, without --terminal")
    if out is not None or storyboard is not None:
        fail("--out and --storyboard are for the browser; leave them out with --terminal")
    compile_first(pictures=False)
    screen = stdout()
    with reporting_errors():
        game: terminal_play.KeyGame = (
            terminal_play.NavigationGame(town, max_seconds or 600.0)
            if name == NAVIGATION
            else terminal_play.CoWizardGame(town, env_config(max_seconds, None))
        )
        ending = terminal_play.play(game, seed, screen)
    _print_ending(game, ending, screen)


def _print_ending(game: terminal_play.KeyGame, ending: terminal_play.Ending, screen: Console) -> None:
    """Prints how a session by keys has ended; fails if there was no key at all."""
    from dorothie_gym.cli.terminal_play import Ending

    if ending is Ending.NO_INPUT:
        fail("there are no keys: the input is empty; play in a terminal, or pipe keys (? lists them, q quits)")
    if ending is Ending.OVER:
        screen.print("You did it: all errands are done." if game.info["is_success"] else "The session is over.")
    else:
        why = "You have left" if ending is Ending.LEFT else "The input has ended; so has"
        screen.print(f"{why} the session.")


def _play_in_browser(
    role: Role, town: str, storyboard: str | None, seed: int, max_seconds: float | None, out: Path | None
) -> None:
    check_libraries("play")
    compile_first(pictures=True)
    roles = ",".join(f"{each}={'human' if each is role else 'scripted'}" for each in AGENT_ROLES)
    usual = seats.ConsoleConfig()
    config = seats.ConsoleConfig(max_seconds=usual.max_seconds if max_seconds is None else max_seconds)
    with reporting_errors():
        room = console_room(town, storyboard, seed, roles, out, config)
        served = seats.Console([room])
    listener = listen(LOCAL, 0)
    link = seat_links(room, LOCAL, listener.getsockname()[1])[str(role)]
    screen = stdout()
    if not _open(link):
        screen.print("No browser can be opened here; open the link, or play by keys with --terminal.")
    screen.print(f"Your seat: {link}", soft_wrap=True)
    recorded = f"The session is recorded in {out}." if out is not None else "Nothing is recorded; --out DIR records."
    screen.print(f"{recorded} Ctrl-C ends the session.", soft_wrap=True)
    serve(served.app(), listener, LOCAL)


def _open(link: str) -> bool:
    """Opens a link in a browser with windows; returns whether there is one. A text browser would take the terminal."""
    windows = sys.platform in ("darwin", "win32") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))
    if not windows:
        return False
    try:
        return webbrowser.open(link)
    except webbrowser.Error:
        return False
