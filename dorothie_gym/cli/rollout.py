"""`dorothie-gym rollout`: closed-loop evaluation of policies."""

from __future__ import annotations

import shlex
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.completion import complete_towns
from dorothie_gym.cli.language_model import (
    AnswerTime,
    LanguageModelOptions,
    LlmCassette,
    LlmParameters,
    LlmPictures,
    LlmPrices,
    LlmReplay,
    LlmTime,
    LlmTimeout,
    LlmTokens,
    LlmUrl,
    warn_of_usage,
)
from dorothie_gym.cli.options import (
    AsJson,
    CoWizard,
    MaxSeconds,
    Perception,
    Players,
    Ray,
    Speech,
    TierAdWizard,
    TierParticipant,
    WordErrors,
    env_config,
    find_cast,
)
from dorothie_gym.cli.output import (
    FAILED,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    wide_stdout,
)
from dorothie_gym.cli.seal import BeaconDate, BeaconText, SealFile, beacon_of, read_seal
from dorothie_gym.cli.tier_options import (
    References,
    TierName,
    check_oracle,
    find_pool,
    participants_of,
    read_references,
    tier_config,
    tier_of,
)
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.maps.folds import TownFold
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import PerceptionModel
from dorothie_gym.support.processors import available_processors

if TYPE_CHECKING:
    from dorothie_gym.evaluation.tiers import Tier
    from dorothie_gym.session.scenario import ReferenceDrive


def rollout(
    co_wizard: CoWizard = "scripted",
    participant: TierParticipant = None,
    ad_wizard: TierAdWizard = None,
    tier: TierName = None,
    oracle: Annotated[
        bool,
        typer.Option("--oracle", help="With --tier: exact words and acts, and brakes for all that is in the world."),
    ] = False,
    trials: Annotated[
        int, typer.Option(min=1, help="Sessions of each scenario, with other seeds of the players; 3 for Pass^3.")
    ] = 1,
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions in all towns together.")] = 20,
    towns: Annotated[
        str | None,
        typer.Option(
            metavar="FOLD|all|NAME,...",
            help="Towns, which take turns: seen, development, validation (default), unseen, all, or names.",
            autocompletion=complete_towns,
        ),
    ] = None,
    workers: Players = None,
    seed: Annotated[
        int | None, typer.Option(min=0, show_default="0", help="Seed of the scenarios, for any policies.")
    ] = None,
    beacon: BeaconText = None,
    beacon_date: BeaconDate = None,
    seal: SealFile = None,
    references: References = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for sessions and result; a started rollout is resumed."),
    ] = None,
    max_seconds: MaxSeconds = None,
    word_errors: WordErrors = None,
    perception: Perception = PerceptionModel.SYMBOLIC,
    speech: Speech = False,
    llm_url: LlmUrl = None,
    llm_timeout: LlmTimeout = 30.0,
    llm_tokens: LlmTokens = None,
    llm_parameters: LlmParameters = "",
    llm_time: LlmTime = AnswerTime.WAITS,
    llm_pictures: LlmPictures = False,
    llm_cassette: LlmCassette = None,
    llm_replay: LlmReplay = False,
    llm_prices: LlmPrices = None,
    ray: Ray = None,
    as_json: AsJson = False,
) -> None:
    """Evaluate policies in closed loop over many sessions, and print the metrics with confidence intervals.

    The table does not depend on the number of workers. After an interruption it prints the command that resumes.
    """
    with reporting_errors():
        asked = LanguageModelOptions(
            url=llm_url,
            timeout=llm_timeout,
            tokens=llm_tokens,
            parameters=llm_parameters,
            time=llm_time,
            pictures=llm_pictures,
            cassette=llm_cassette,
            replay=llm_replay,
            prices=llm_prices,
        )
        found = tier_of(tier)
        if oracle:
            replaced = {
                "--co-wizard": co_wizard != "scripted",
                "--word-errors": word_errors is not None,
                "--speech": speech,
                "--perception": perception is not PerceptionModel.SYMBOLIC,
            }
            check_oracle(found, replaced)
        drawn = beacon_of(beacon, beacon_date, found, {"--towns": towns is not None, "--seed": seed is not None})
        usual = tier_config(found, oracle=oracle)
        config = env_config(max_seconds, word_errors, perception, speech, pictures=llm_pictures, usual=usual)
        pool = participants_of(participant, found)
        ad_wizard = ad_wizard or (found.ad_wizard if found else "scripted")
        if oracle and found is not None:
            co_wizard = found.oracle_player
        cast = find_cast(pool[0], co_wizard, ad_wizard, asked)
        try:
            settings = closed_loop.RolloutSettings(
                cast=cast,
                towns=_towns(towns, found) if drawn is None else drawn.towns,
                sessions=sessions,
                seed=(seed or 0) if drawn is None else drawn.seed,
                config=config if drawn is None else closed_loop.sealed_config(config),
                pool=find_pool(pool, cast[Role.PARTICIPANT], asked),
                trials=trials,
                tier=tier,
                oracle=oracle,
                references=config.talk is None and (found is not None or trials > 1),
                beacon=drawn,
                seal=read_seal(seal, beacon=drawn, oracle=oracle),
            )
        except ValueError as error:
            fail(str(error))
        drives = read_references(references)
        result = _play(settings, out, workers or available_processors(), ray, drives, seal, quiet=as_json)
    warn_of_usage(closed_loop.usage_warnings(result.usage()))
    if as_json:
        print_json(result.to_json())
        return
    console = wide_stdout()
    closed_loop.print_result(result, console)
    if out is not None:
        console.print(f"Folder for `dorothie-gym replay` and `leaderboard`: {out}", style="dim", soft_wrap=True)


def _towns(given: str | None, tier: Tier | None) -> tuple[str, ...]:
    """Returns the towns of a rollout; raises `ValueError` if one is unknown."""
    if given is None and tier is not None:
        return tier.towns
    return closed_loop.parse_towns(given or TownFold.VALIDATION)


def _play(
    settings: closed_loop.RolloutSettings,
    out: Path | None,
    workers: int,
    ray: str | None,
    drives: dict[str, ReferenceDrive],
    seal: Path | None,
    *,
    quiet: bool,
) -> closed_loop.RolloutResult:
    folder = Path(tempfile.mkdtemp(prefix="dorothie_gym-rollout-")) if out is None else out
    try:
        compile_first(
            pictures=settings.config.perception is PerceptionModel.CAMERA or settings.config.camera is not None
        )
        with session_progress(quiet=quiet) as on_session:
            result = closed_loop.roll_out(
                settings, folder, workers=workers, ray=ray, on_session=on_session, drives=drives
            )
    except KeyboardInterrupt:
        _exit_interrupted(folder, closed_loop.command_of(settings.to_json(), seal or ""), settings.sessions)
    except ProcessError as error:
        fail(f"{error}; the finished sessions are kept in {folder}", FAILED)
    if out is None:
        shutil.rmtree(folder)
    return result


def _exit_interrupted(folder: Path, command: str, sessions: int) -> None:
    done = len(closed_loop.read_result(folder).rows) if (folder / closed_loop.RESULT_FILE).is_file() else 0
    exit_interrupted(
        f"Interrupted with {done} of {sessions} sessions finished; their results are in "
        f"{folder / closed_loop.RESULT_FILE}; resume with: {command} --out {shlex.quote(str(folder))}"
    )
