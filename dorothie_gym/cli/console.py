"""`dorothie-gym console`: sessions with people in browsers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym import tasks
from dorothie_gym.cli.completion import complete_town
from dorothie_gym.cli.options import AsJson, Storyboard, WordErrors, needs
from dorothie_gym.cli.output import Facts, check_folder, fail, print_json, reporting_errors, stdout
from dorothie_gym.cli.serving import LOCAL, PORT, Host, Port, address, check_libraries, listen, serve
from dorothie_gym.cli.tier_options import TierName, tier_of
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.lab import console as seats
from dorothie_gym.maps.folds import DEFAULT_TOWN


def console(
    town: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help=f"A town's name, or a file (.xodr, .yaml); {DEFAULT_TOWN} if none is given.",
            autocompletion=complete_town,
        ),
    ] = None,
    storyboard: Storyboard = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first session; the next one has the next seed.")] = 0,
    roles: Annotated[
        str,
        typer.Option(
            metavar="ROLE=PLAYER,...",
            help="Who plays each role: human (the session waits for a person), open (a script plays until a person "
            "sits down), or a policy by name, file or class (module:Class). Roles that are not named are open.",
        ),
    ] = "",
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Record each session into a folder of its own in this folder.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Go on with the interrupted session of this folder: with its town, seed and roles, in a new folder.",
        ),
    ] = None,
    max_seconds: Annotated[
        float | None, typer.Option(min=1.0, max=86400.0, help="End a session after this simulated time [s].")
    ] = None,
    word_errors: WordErrors = None,
    tier: TierName = None,
    absence: Annotated[
        float, typer.Option(min=0.0, max=86400.0, help="Time that a person who must play has to come back [s].")
    ] = 60.0,
    after_absence: Annotated[
        str, typer.Option(metavar="end|script|wait", help="What happens after that time.")
    ] = "end",
    while_away: Annotated[
        str, typer.Option(metavar="pause|continue", help="What the session does while that person is away.")
    ] = "pause",
    pictures: Annotated[bool, typer.Option(help="Let participant and Co-Wizard look through the windscreen.")] = True,
    speech: Annotated[
        bool, typer.Option("--speech", help=f"Let people speak and hear, besides typing ({needs('speech')}).")
    ] = False,
    host: Host = LOCAL,
    port: Port = PORT,
    as_json: AsJson = False,
) -> None:
    """Play sessions with people in browsers, in real time: prints a link for each seat.

    Each link holds a secret and leads to one seat. A second browser at the seat of a role takes it over.
    """
    check_libraries("console")
    compile_first(pictures=pictures)
    with reporting_errors():
        found = tier_of(tier)
        config = replace(
            _config(max_seconds, word_errors, absence, after_absence, while_away, pictures), speech=speech, tier=tier
        )
        if resume is None:
            room = console_room(town or (found.town if found else DEFAULT_TOWN), storyboard, seed, roles, out, config)
        else:
            out = out or resume.resolve().parent
            room = _resumed_room(resume, town, storyboard, roles, out, config)
    listener = listen(host, port)
    links = seat_links(room, host, listener.getsockname()[1])
    if as_json:
        print_json({"links": links, "recorded": None if out is None else str(out)})
    else:
        _print_links(links, out)
    with reporting_errors():
        served = seats.Console([room])
    before = _folders(out)
    try:
        serve(served.app(), listener, host)
    finally:
        if not as_json:
            _print_recorded(before, out)


def _config(
    max_seconds: float | None, word_errors: float | None, absence: float, after: str, away: str, pictures: bool
) -> seats.ConsoleConfig:
    for name, value, choices in (
        ("--after-absence", after, seats.AfterAbsence),
        ("--while-away", away, seats.WhileAway),
    ):
        if value not in list(map(str, choices)):
            fail(f"{name} is {value!r}; it must be {' or '.join(map(str, choices))}")
    usual = seats.ConsoleConfig()
    return seats.ConsoleConfig(
        max_seconds=usual.max_seconds if max_seconds is None else max_seconds,
        word_error_rate=usual.word_error_rate if word_errors is None else word_errors,
        pictures=pictures,
        absence=seats.AbsenceRules(while_away=seats.WhileAway(away), seconds=absence, then=seats.AfterAbsence(after)),
    )


def console_room(
    town: str, storyboard: str | None, seed: int, roles: str, out: Path | None, config: seats.ConsoleConfig
) -> seats.Room:
    """Returns the room of a session; its town is read at once, so that the first browser is served quickly."""
    from dorothie_gym.lab.town_page import town_page
    from dorothie_gym.session.session_engine import SessionEngine

    if out is not None:
        check_folder(out)
    plans = seats.parse_roles(roles)
    engine = SessionEngine(town, storyboard, config=config.environment())
    room = seats.Room(engine, plans, config, seed=seed, folder=out)
    town_page(engine.town)  # the first browser is served at once
    return room


def _resumed_room(
    folder: Path, town: str | None, storyboard: str | None, roles: str, out: Path, config: seats.ConsoleConfig
) -> seats.Room:
    from dorothie_gym.lab.town_page import town_page

    resumed = seats.Resumed.load(folder)
    session = resumed.session
    template = None if storyboard is None else tasks.load_template(storyboard)
    engine = rollouts.begin_replay(session, rollouts.ReplaySources(town=town).town_of(session), storyboard=template)
    seed = engine.scenario.seed
    room = seats.Room(
        engine,
        seats.parse_roles(roles or resumed.roles),
        resumed.config(config),
        seed=seed,
        folder=out,
        resumed=resumed,
    )
    town_page(engine.town)
    return room


def seat_links(room: seats.Room, host: str, port: int) -> dict[str, str]:
    """Returns the link of each seat; its secret is behind the #, which browsers do not send and servers do not log."""
    return {name: f"{address(host, port)}/seat#{seat.token}" for name, seat in room.seats.items()}


def _folders(out: Path | None) -> set[Path]:
    return set() if out is None or not out.is_dir() else {each for each in out.iterdir() if each.is_dir()}


def _print_recorded(before: set[Path], out: Path | None) -> None:
    """Prints what was recorded since the start of the server."""
    screen = stdout()
    recorded = sorted(_folders(out) - before)
    if out is None or not recorded:
        screen.print("Nothing was recorded." if out is None else f"Nothing was recorded in {out}.", soft_wrap=True)
    interrupted = set() if out is None else set(seats.interrupted_sessions(out))
    for folder in recorded:
        ended = f"interrupted; --resume {folder} goes on with it" if folder in interrupted else "complete"
        screen.print(f"Recorded: {folder} ({ended})", soft_wrap=True)


def _print_links(links: Facts, out: Path | None) -> None:
    screen = stdout()
    for name, link in links.items():
        screen.print(f"{name.replace('_', '-').capitalize():<13} {link}", soft_wrap=True)
    if out is not None:
        for folder in seats.interrupted_sessions(out):
            screen.print(f"{folder} was interrupted; --resume {folder} goes on with it.", soft_wrap=True)
    recorded = f"Sessions are recorded in {out}." if out is not None else "Nothing is recorded; --out DIR records."
    screen.print(f"{recorded} Ctrl-C ends the session and the server.", soft_wrap=True)
