"""`dorothie-gym run`: play of one session."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym import pictures as drawing
from dorothie_gym.cli.completion import complete_town
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
    Perception,
    Speech,
    Storyboard,
    TierAdWizard,
    TierParticipant,
    View,
    WordErrors,
    env_config,
    find_cast,
    needs,
)
from dorothie_gym.cli.output import (
    Facts,
    check_picture,
    check_video,
    exit_interrupted,
    fail,
    print_json,
    reporting_errors,
    stdout,
)
from dorothie_gym.cli.tier_options import TierName, participant_of, tier_config, tier_of
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.evaluation import closed_loop
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.session.config import PerceptionModel, RenderView

if TYPE_CHECKING:
    from dorothie_gym.cli.live import Pace
    from dorothie_gym.cli.live_film import Film
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.session_log import SessionSummary


PICTURE = Path("dorothie.png")
"""Picture that is written by default."""


@dataclass(frozen=True, kw_only=True)
class _Plan:
    """Options of the command line."""

    town: str
    storyboard: str | None
    seed: int
    out: Path | None
    picture: Path | None
    video: Path | None
    view: RenderView
    players: tuple[str, str, str]
    config: EnvConfig
    language_model: LanguageModelOptions
    speed: float | None


def run(
    town: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help=f"A town's name, or a file (.xodr, .yaml); default {DEFAULT_TOWN}, or that of the tier.",
            autocompletion=complete_town,
        ),
    ] = None,
    storyboard: Storyboard = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed; equal seeds give equal sessions.")] = 0,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Record the session into this new folder.")] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="P.png", help=f"Draw how it ended; {PICTURE} unless --no-picture or --json is given."),
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Draw no picture.")] = False,
    video: Annotated[
        Path | None, typer.Option(metavar="V.mp4", help=f"Write a video of the session ({needs('video')}).")
    ] = None,
    view: View = RenderView.BOTH,
    participant: TierParticipant = None,
    co_wizard: CoWizard = "scripted",
    ad_wizard: TierAdWizard = None,
    tier: TierName = None,
    max_seconds: Annotated[
        float | None, typer.Option(min=1.0, max=86400.0, help="Truncate the session after this simulated time [s].")
    ] = None,
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
    speed: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            max=1000.0,
            metavar="FACTOR",
            help="Play at this multiple of real time (1 to watch); default: as fast as possible.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Play one session with the three roles.

    The times of the dialogue, on the terminal and in pictures, are those at which an utterance is heard, at its end.
    """
    if no_picture and picture is not None:
        fail("--picture and --no-picture exclude each other; give one of them")
    found = tier_of(tier)
    ad_wizard = ad_wizard or (found.ad_wizard if found else "scripted")
    usual = tier_config(found)
    config = env_config(max_seconds, word_errors, perception, speech, pictures=llm_pictures, usual=usual)
    plan = _Plan(
        town=town or (found.town if found else DEFAULT_TOWN),
        storyboard=storyboard,
        seed=seed,
        out=out,
        picture=picture if picture or no_picture or as_json else PICTURE,
        video=video,
        view=view,
        players=(participant_of(participant, found, seed), co_wizard, ad_wizard),
        config=config,
        language_model=LanguageModelOptions(
            url=llm_url,
            timeout=llm_timeout,
            tokens=llm_tokens,
            parameters=llm_parameters,
            time=llm_time,
            pictures=llm_pictures,
            cassette=llm_cassette,
            replay=llm_replay,
            prices=llm_prices,
        ),
        speed=speed,
    )
    _check_outputs(plan)
    with reporting_errors():
        facts = _play(plan, quiet=as_json)
    if as_json:
        print_json(facts)
        return
    from dorothie_gym.cli.live import summary

    console = stdout()
    console.print(summary(facts, _written(plan), console))


def _check_outputs(plan: _Plan) -> None:
    """Fails early if an output file cannot be written."""
    if plan.picture is not None:
        check_picture(plan.picture)
    if plan.video is not None:
        check_video(plan.video)


def _play(plan: _Plan, *, quiet: bool) -> Facts:
    """Plays the session and returns what --json writes."""
    from dorothie_gym.session.session_engine import SessionEngine

    cast = find_cast(*plan.players, plan.language_model)
    filmed = plan.video is not None and plan.view is not RenderView.MAP
    drawn = plan.config.perception is PerceptionModel.CAMERA or plan.config.camera is not None
    compile_first(pictures=filmed or drawn)
    engine = SessionEngine(plan.town, plan.storyboard, config=plan.config)
    engine.reset(seed=plan.seed)
    try:
        policies = {role: player.make(role, engine.limits) for role, player in cast.items()}
    except ValueError as error:
        fail(str(error))
    begun = time.perf_counter()
    with ExitStack() as stack:
        film, pace, watchers = _watchers(plan, stack, quiet=quiet)

        def watch(engine: SessionEngine) -> None:
            for watcher in watchers:
                watcher(engine)

        try:
            ending = rollouts.play_session(engine, policies, seed=plan.seed, folder=plan.out, on_step=watch)
        except KeyboardInterrupt:
            stack.close()
            _exit_interrupted(engine, plan)
    filming, waiting = film.seconds if film is not None else 0.0, pace.seconds if pace is not None else 0.0
    wall = time.perf_counter() - begun - filming - waiting
    if "usage" in ending:
        warn_of_usage(closed_loop.usage_warnings(closed_loop.usage_from_json(ending["usage"])))
    if plan.picture is not None:
        draw_session(engine, plan.picture)
    return _facts(engine, ending, wall, plan.out)


def _watchers(
    plan: _Plan, stack: ExitStack, *, quiet: bool
) -> tuple[Film | None, Pace | None, list[Callable[[SessionEngine], None]]]:
    """Returns the video, the delay, and all observers of the session, with the display on the terminal."""
    film: Film | None = None
    pace: Pace | None = None
    watchers: list[Callable[[SessionEngine], None]] = []
    if plan.video is not None:
        from dorothie_gym.cli.live_film import Film

        film = stack.enter_context(Film(plan.video, plan.view))
        watchers.append(film)
    if plan.speed is not None:
        from dorothie_gym.cli.live import Pace

        pace = Pace(plan.speed)
        watchers.append(pace)
    if not quiet:
        from dorothie_gym.cli.live import LiveShow

        watchers.append(stack.enter_context(LiveShow(stdout(), film, pace)))
    return film, pace, watchers


def _exit_interrupted(engine: SessionEngine, plan: _Plan) -> None:
    if plan.out is None:
        kept = "nothing was recorded (--out DIR records)"
    else:
        kept = f"the recording until then is in {plan.out}"
    exit_interrupted(f"Interrupted after {engine.session.world.time:.1f} simulated seconds; {kept}.")


def draw_session(engine: SessionEngine, path: Path) -> None:
    """Draws the whole town at the end of the session, with route and dialogue."""
    scenario = engine.scenario
    caption = f"{engine.town.name} · {scenario.storyboard.name} · seed {scenario.seed}"
    drawing.SceneRenderer(drawing.PICTURE_SIZE, transcript=True).save(
        drawing.scene_of(engine.session, caption), path, follow=False
    )


def _facts(engine: SessionEngine, ending: SessionSummary, wall: float, out: Path | None) -> Facts:
    return {
        "town": engine.town.name,
        "storyboard": engine.scenario.storyboard.name,
        "seed": engine.scenario.seed,
        **{key: ending[key] for key in ("success", "subgoals", "arrived", "collisions", "seconds")},
        "wall_seconds": round(wall, 3),
        **{key: ending[key] for key in ("utterances", "acts", "physical_actions", "exceptions")},
        **({"usage": ending["usage"]} if "usage" in ending else {}),
        "session": None if out is None else str(out),
    }


def _written(plan: _Plan) -> dict[str, str]:
    files = {"session": plan.out, "picture": plan.picture, "video": plan.video}
    return {name: str(path) for name, path in files.items() if path is not None}
