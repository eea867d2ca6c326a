"""Options that several commands share, and the settings and players that they select."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer
from typer.core import TyperCommand, TyperGroup

from dorothie_gym import policies as players
from dorothie_gym.cli.completion import complete_policy, complete_storyboard, complete_town
from dorothie_gym.cli.output import exit_interrupted, fail
from dorothie_gym.errors import PolicyLoadError, SpeechError
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session import spaces
from dorothie_gym.session.config import PerceptionModel, RenderView
from dorothie_gym.support.interruption import message, raising_interrupts
from dorothie_gym.support.optional_modules import check_installed

if TYPE_CHECKING:
    from dorothie_gym.cli.language_model import LanguageModelOptions
    from dorothie_gym.session.config import EnvConfig


def needs(extra: str) -> str:
    """Returns "needs dorothie-gym[EXTRA]" for help texts, which are rich's markup."""
    return rf"needs dorothie-gym\[{extra}]"


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]

Maps = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns that are not shipped (Town01.xodr).")
]

SessionTown = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Town of the session, if it is not shipped (.xodr, .yaml).",
        autocompletion=complete_town,
    ),
]

Storyboard = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Name of a storyboard, or a file (.json); default: drawn.",
        autocompletion=complete_storyboard,
    ),
]

Players = Annotated[int | None, typer.Option(min=1, help="Number of worker processes; default one per processor.")]

Participant = Annotated[
    str,
    typer.Option(
        metavar="scripted[:TRAITS]|silent|random|llm:MODEL|FILE|MODULE:CLASS",
        help="Policy of the participant; a file holds a learned policy. Traits fix the persona: "
        "scripted:patience=0..0.2,directions=vague.",
        autocompletion=complete_policy("participant"),
    ),
]

CoWizard = Annotated[
    str,
    typer.Option(
        metavar="NAME|FILE|MODULE:CLASS",
        help="Policy of the Co-Wizard: scripted (also with traits), silent, random, lane-follow, "
        "pretrained:maskable-ppo, always-asks (see `policies`), llm:MODEL, the folder of a learned policy, or a class "
        "of yours.",
        autocompletion=complete_policy("co_wizard"),
    ),
]

AdWizard = Annotated[
    str,
    typer.Option(
        metavar="scripted[:OPTIONS]|silent|random|llm:MODEL|FILE|MODULE:CLASS",
        help="Policy of the Ad-Wizard; a file holds a learned policy. Options fix what it does: "
        "scripted:rate=4,spacing=12.",
        autocompletion=complete_policy("ad_wizard"),
    ),
]

TierParticipant = Annotated[
    str | None,
    typer.Option(
        metavar="scripted[:TRAITS]|silent|random|llm:MODEL|FILE|MODULE:CLASS[+...]",
        help="Policy of the participant, by default scripted or those of the tier; several, joined by +, take turns.",
        autocompletion=complete_policy("participant"),
    ),
]

TierAdWizard = Annotated[
    str | None,
    typer.Option(
        metavar="scripted[:OPTIONS]|silent|random|llm:MODEL|FILE|MODULE:CLASS",
        help="Policy of the Ad-Wizard, by default scripted or that of the tier. Options fix what it does: "
        "scripted:rate=4,spacing=12.",
        autocompletion=complete_policy("ad_wizard"),
    ),
]

MaxSeconds = Annotated[
    float | None, typer.Option(min=1.0, max=86400.0, help="Truncate sessions after this simulated time [s].")
]

WordErrors = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        max=0.95,
        help="Word error rate of the speech recogniser between participant and Co-Wizard; 0 for an exact one, by "
        "default 0.05.",
    ),
]

Perception = Annotated[
    PerceptionModel,
    typer.Option(
        help="What participant and Co-Wizard see: all bodies that are near enough, or those in the car's camera.",
    ),
]

Speech = Annotated[
    bool,
    typer.Option(
        "--speech",
        help=f"Speak: talk is synthesised, mixed with the noise of the car, and recognised ({needs('speech')}).",
    ),
]

View = Annotated[
    RenderView, typer.Option(help="What the video shows: the map, the windscreen (camera), or both side by side.")
]

Ray = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help=f"Play on a Ray cluster: auto, HOST:PORT, ray://HOST:PORT or local ({needs('ray')}).",
    ),
]


def env_config(
    max_seconds: float | None,
    word_errors: float | None,
    perception: PerceptionModel = PerceptionModel.SYMBOLIC,
    speech: bool = False,
    *,
    pictures: bool = False,
    usual: EnvConfig | None = None,
) -> EnvConfig:
    """Returns the engine settings of a command line; exits if options exclude each other, or speech is not installed.

    Args:
        max_seconds: simulated time after which a session is truncated, in place of a multiple of the reference [s];
            None keeps the usual time.
        word_errors: word error rate of simulated recognition, also in place of speech; None keeps the usual channel.
        perception: what participant and Co-Wizard see.
        speech: whether they speak; a word error rate is then refused.
        pictures: whether they observe the picture of the car's camera.
        usual: settings that the options change, those of a tier; None for the default ones.
    """
    from dorothie_gym.session.config import CameraConfig, ChannelKind, EnvConfig

    if speech and word_errors is not None:
        fail("--word-errors is for simulated recognition; leave it out with --speech, where speech is recognised")
    config = EnvConfig() if usual is None else usual
    if max_seconds is not None:
        config = replace(config, max_seconds=max_seconds, time_factor=None)
    if word_errors is not None:
        config = replace(config, word_error_rate=word_errors, channel=ChannelKind.TEXT)
    if speech:
        config = replace(config, channel=ChannelKind.SPEECH)
    if config.channel is ChannelKind.SPEECH:
        try:
            check_installed()
        except SpeechError as error:
            fail(str(error) if speech else f"{error}; --word-errors RATE replaces speech by simulated recognition")
    return replace(config, perception=perception, camera=CameraConfig() if pictures else None)


# --- Players ----------------------------------------------------------------------------------------------------------


def find_cast(
    participant: str, co_wizard: str, ad_wizard: str, language_model: LanguageModelOptions
) -> dict[Role, players.Player]:
    """Returns the player of each role; exits if a name or file is unknown.

    Args:
        participant: name of a policy, or file of a learned policy.
        co_wizard: as for the participant.
        ad_wizard: as for the participant.
        language_model: options of the policies `llm:MODEL`.
    """
    return find_players(dict(zip(AGENT_ROLES, (participant, co_wizard, ad_wizard), strict=True)), language_model)


def find_players(given: Mapping[Role, str], language_model: LanguageModelOptions) -> dict[Role, players.Player]:
    """Returns the players of roles by their names or files; exits if one is unknown or cannot be loaded."""
    asks = any(name.startswith(players.LANGUAGE_MODEL) for name in given.values())
    config = language_model.config() if asks else None
    try:
        cast = {role: players.find_player(name, role, config) for role, name in given.items()}
    except PolicyLoadError as error:
        fail(str(error))
    for role, player in cast.items():
        if player.trained or player.language_model is not None:
            _check_loads(player, role)
    return cast


def _check_loads(player: players.Player, role: Role) -> None:
    """Makes a policy once, so that a damaged file or a missing package is reported before the first session."""
    try:
        player.make(role, spaces.SpaceLimits())
    except ValueError as error:
        fail(f"{role}: {error}")


# --- Options with an optional value -----------------------------------------------------------------------------------

OWN_NAME = "<own name>"
"""Value of `--picture` without a file name: the command chooses the name."""

_TOWNS = (".yaml", ".yml", ".xodr")

CommandContext: TypeAlias = Any
"""`Context` of click, or of typer's own copy of click, depending on its version."""


_UsageError: Final[Any] = typer.BadParameter.__base__
"""`UsageError` of click, or of the copy of click in newer releases of typer."""


class CommandGroup(TyperGroup):
    """Commands, of which each ends at Ctrl-C, at SIGTERM and at a wrong option with one line."""

    def make_context(self, *args: Any, **settings: Any) -> Any:
        """Reads the options before the command."""
        with _reporting_usage(self.name):
            return super().make_context(*args, **settings)

    def invoke(self, ctx: Any) -> Any:  # the context of click, or of its copy
        """Runs a command and returns its result."""
        try:
            with raising_interrupts(), _reporting_usage(self.name):
                return super().invoke(ctx)
        except KeyboardInterrupt:
            exit_interrupted(message())


@contextmanager
def _reporting_usage(program: str | None) -> Iterator[None]:
    """Turns the box in which typer prints wrong options and arguments into one message."""
    try:
        yield
    except _UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # its text is the help of a command without arguments
            raise
        text = error.format_message().replace("Value error, ", "").rstrip(".")  # pydantic's, in newer releases of typer
        command = program if error.ctx is None else error.ctx.command_path
        fail(f"{text}; see {command} --help", error.exit_code)


class PictureCommand(TyperCommand):
    """Command with an option `--picture` whose value may be omitted, which typer does not support."""

    def parse_args(self, ctx: CommandContext, args: list[str]) -> list[str]:
        """Inserts the omitted value: the next word is the value only if it can be the name of a picture."""
        given: list[str] = []
        for k, arg in enumerate(args):
            given.append(arg)
            suffix = PurePath(args[k + 1]).suffix.lower() if k + 1 < len(args) else ""
            if arg == "--picture" and suffix in ("", *_TOWNS):
                given.append(OWN_NAME)
        return super().parse_args(ctx, given)
