"""`dorothie-gym cross-play`: each of some Co-Wizards with each of some participants, as a matrix."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.completion import complete_policy, complete_towns
from dorothie_gym.cli.language_model import (
    AnswerTime,
    LanguageModelOptions,
    LlmCassette,
    LlmParameters,
    LlmPrices,
    LlmReplay,
    LlmTime,
    LlmTimeout,
    LlmTokens,
    LlmUrl,
    warn_of_usage,
)
from dorothie_gym.cli.options import AdWizard, AsJson, MaxSeconds, Players, Ray, WordErrors, env_config, find_cast
from dorothie_gym.cli.output import (
    FAILED,
    check_file,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    wide_stdout,
)
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.maps.folds import TownFold
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session import recording
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.policies.policy_loader import Player


USUAL = ["scripted", "silent"]
"""Players of both roles where none is given."""


def cross_play(
    co_wizard: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|FILE|MODULE:CLASS",
            help="A Co-Wizard, as in `rollout`; repeat it. Default: scripted and silent.",
            autocompletion=complete_policy("co_wizard"),
        ),
    ] = None,
    participant: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|FILE|MODULE:CLASS",
            help="A participant, as in `rollout`; repeat it. Default: scripted and silent.",
            autocompletion=complete_policy("participant"),
        ),
    ] = None,
    ad_wizard: AdWizard = "scripted",
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions of each pair, in all towns together.")] = 20,
    towns: Annotated[
        str,
        typer.Option(
            metavar="FOLD|all|NAME,...",
            help="Towns, which take turns: seen, development, validation, unseen, all, or names.",
            autocompletion=complete_towns,
        ),
    ] = TownFold.VALIDATION,
    workers: Players = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the scenarios, which are the same for all pairs.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder with a rollout for each pair; a started cross-play is resumed."),
    ] = None,
    page: Annotated[
        Path | None, typer.Option(metavar="FILE.md", help="Page to write, with the matrices and commands.")
    ] = None,
    max_seconds: MaxSeconds = None,
    word_errors: WordErrors = None,
    llm_url: LlmUrl = None,
    llm_timeout: LlmTimeout = 30.0,
    llm_tokens: LlmTokens = None,
    llm_parameters: LlmParameters = "",
    llm_time: LlmTime = AnswerTime.WAITS,
    llm_cassette: LlmCassette = None,
    llm_replay: LlmReplay = False,
    llm_prices: LlmPrices = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Measure every pair of some Co-Wizards and participants over the same sessions, with confidence intervals.

    The result does not depend on the number of workers. An interrupted run is resumed by the same command with --out.
    """
    with reporting_errors():
        if page is not None:
            if page.suffix != ".md":
                fail(f"{page}: the page is Markdown; give a name that ends in .md")
            check_file(page)
        asked = LanguageModelOptions(
            url=llm_url,
            timeout=llm_timeout,
            tokens=llm_tokens,
            parameters=llm_parameters,
            time=llm_time,
            pictures=False,
            cassette=llm_cassette,
            replay=llm_replay,
            prices=llm_prices,
        )
        drivers, guides, adversary = _players(co_wizard or USUAL, participant or USUAL, ad_wizard, asked)
        try:
            settings = closed_loop.CrossPlaySettings(
                co_wizards=drivers,
                participants=guides,
                ad_wizard=adversary,
                towns=closed_loop.parse_towns(towns),
                sessions=sessions,
                seed=seed,
                config=env_config(max_seconds, word_errors),
            )
        except ValueError as error:
            fail(str(error))
        folder = Path(tempfile.mkdtemp(prefix="dorothie_gym-cross-play-")) if out is None else out
        result = _play(settings, folder, workers or available_processors(), ray, quiet=as_json)
        if out is None:
            shutil.rmtree(folder)
        else:
            write_atomically(folder / closed_loop.RESULT_NAME, recording.to_page(result.to_json()))
        if page is not None:
            page.write_text(result.page(), encoding="utf-8")
    for cell in result.cells.values():
        warn_of_usage(closed_loop.usage_warnings(cell.usage()))
    if as_json:
        print_json(result.to_json())
        return
    console = wide_stdout()
    for table in result.tables():
        console.print(table)
    for written in (out, page):
        if written is not None:
            console.print(f"Written: {written}", style="dim", markup=False, soft_wrap=True)


def _players(
    drivers: list[str], guides: list[str], ad_wizard: str, asked: LanguageModelOptions
) -> tuple[list[Player], list[Player], Player]:
    """Returns the players of both roles and of the Ad-Wizard; exits if a name or file is unknown."""
    casts = [find_cast(guides[0], name, ad_wizard, asked) for name in drivers]
    first = casts[0]
    others = [find_cast(name, "silent", "silent", asked)[Role.PARTICIPANT] for name in guides[1:]]
    return [cast[Role.CO_WIZARD] for cast in casts], [first[Role.PARTICIPANT], *others], first[Role.AD_WIZARD]


def _play(
    settings: closed_loop.CrossPlaySettings, folder: Path, workers: int, ray: str | None, *, quiet: bool
) -> closed_loop.CrossPlayResult:
    from dorothie_gym.evaluation.closed_loop.cross_play import cross_play

    try:
        compile_first(pictures=False)
        with session_progress(quiet=quiet) as on_session:
            return cross_play(settings, folder, workers=workers, ray=ray, on_session=on_session)
    except KeyboardInterrupt:
        exit_interrupted(f"Interrupted; the finished sessions are in {folder}; resume with the same command and --out.")
    except ProcessError as error:
        fail(f"{error}; the finished sessions are kept in {folder}", FAILED)
