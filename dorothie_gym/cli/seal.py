"""`dorothie-gym seal`: seal of a model, before the beacon of its test is known; and the options of sealed tests."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.completion import complete_policy
from dorothie_gym.cli.language_model import (
    AnswerTime,
    LanguageModelOptions,
    LlmParameters,
    LlmPictures,
    LlmTime,
    LlmTimeout,
    LlmTokens,
    LlmUrl,
)
from dorothie_gym.cli.options import AsJson, env_config, find_cast
from dorothie_gym.cli.output import check_file, fail, print_json, reporting_errors, stdout
from dorothie_gym.cli.tier_options import TierName, find_pool, tier_of
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.evaluation.tiers import Tier

_PANEL = "Sealed tests"

BeaconText = Annotated[
    str | None,
    typer.Option(
        "--beacon",
        metavar="TEXT",
        rich_help_panel=_PANEL,
        help="With --tier: draw seed, towns, scenarios and partners from a text that nobody knew before.",
    ),
]

BeaconDate = Annotated[
    str | None,
    typer.Option(
        metavar="YYYY-MM-DD", rich_help_panel=_PANEL, help="Day on which the beacon became known, in universal time."
    ),
]

SealFile = Annotated[
    Path | None,
    typer.Option("--seal", metavar="FILE", rich_help_panel=_PANEL, help="Seal of the Co-Wizard, of an earlier day."),
]


def seal(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="The Co-Wizard, as in `rollout`: a name, a file or folder, module:Class, or llm:MODEL.",
            autocompletion=complete_policy("co_wizard"),
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE.json", help="File to write; an existing one is kept.")],
    tier: TierName = "standard",
    trials: Annotated[int, typer.Option(min=1, help="Sessions of each scenario, as in `rollout`.")] = 1,
    sessions: Annotated[
        int | None, typer.Option(min=1, help="Number of sessions; by default that of a submission.")
    ] = None,
    llm_url: LlmUrl = None,
    llm_timeout: LlmTimeout = 30.0,
    llm_tokens: LlmTokens = None,
    llm_parameters: LlmParameters = "",
    llm_time: LlmTime = AnswerTime.WAITS,
    llm_pictures: LlmPictures = False,
    as_json: AsJson = False,
) -> None:
    """Seal a model: write hashes of policy and code, the settings of the run, and today's date.

    After the beacon is known, `rollout --beacon TEXT --seal FILE` plays this model only. Publish the hash of the seal,
    so that its date need not be believed.
    """
    with reporting_errors():
        asked = LanguageModelOptions(
            url=llm_url,
            timeout=llm_timeout,
            tokens=llm_tokens,
            parameters=llm_parameters,
            time=llm_time,
            pictures=llm_pictures,
            cassette=None,
            replay=False,
            prices=None,
        )
        found = tier_of(tier)
        if found is None:
            fail("--tier is empty; give the name of a tier")
        if out.exists():
            fail(f"{out}: exists already; a seal is not replaced, choose another file")
        check_file(out)
        cast = find_cast(found.participants[0], model, found.ad_wizard, asked)
        try:
            settings = closed_loop.RolloutSettings(
                cast=cast,
                towns=found.towns,
                sessions=closed_loop.usual_sessions(trials) if sessions is None else sessions,
                config=closed_loop.sealed_config(env_config(None, None, pictures=llm_pictures, usual=found.config)),
                pool=find_pool(found.participants, cast[Role.PARTICIPANT], asked),
                trials=trials,
                tier=found.name,
                references=found.config.talk is None,
            )
            made = closed_loop.seal_of(settings.to_json())
        except ValueError as error:
            fail(str(error))
        closed_loop.write_seal(out, made)
    page = made.to_json()
    if as_json:
        print_json({"file": str(out), **page})
        return
    console = stdout()
    console.print(f"Sealed on {made.date}: {model}, tier {found.name}. Written: {out}", markup=False, soft_wrap=True)
    console.print(f"Publish the hash of the seal: {page['sha256']}", markup=False, soft_wrap=True)


def beacon_of(
    text: str | None, date: str | None, tier: Tier | None, replaced: dict[str, bool]
) -> closed_loop.Beacon | None:
    """Returns the beacon of a sealed test; None without one. Exits if options are missing or exclude each other.

    Args:
        text: option `--beacon`.
        date: option `--beacon-date`.
        tier: the tier.
        replaced: whether each option that a beacon replaces is given.
    """
    if text is None:
        if date is not None:
            fail("--beacon-date is the day of a beacon; give its text with --beacon")
        return None
    if tier is None:
        fail("--beacon draws the scenarios of a tier; give it with --tier")
    if date is None:
        fail("--beacon needs --beacon-date, the day on which the text became known")
    given = [option for option, is_given in replaced.items() if is_given]
    if given:
        fail(f"--beacon draws towns and seed; leave out {', '.join(given)}")
    try:
        return closed_loop.Beacon(text=text, date=date)
    except ValueError as error:
        fail(str(error))


def read_seal(file: Path | None, *, beacon: closed_loop.Beacon | None, oracle: bool) -> closed_loop.Seal | None:
    """Returns the seal in a file; None without one. Exits if it is damaged, or if there is no beacon."""
    if file is None:
        return None
    if beacon is None:
        fail("--seal is for sealed tests; give the text from which their scenarios are drawn with --beacon")
    if oracle:
        fail("--oracle plays no model that could be sealed; leave out --seal")
    try:
        return closed_loop.read_seal(file)
    except ValueError as error:
        fail(str(error))
