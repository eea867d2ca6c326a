"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

if TYPE_CHECKING:
    from dorothie_gym.engine.config import EnvConfig


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]

Maps = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns that are not shipped (Town01.xodr).")
]

Players = Annotated[int | None, typer.Option(min=1, help="Number of worker processes; default one per processor.")]

Participant = Annotated[
    str,
    typer.Option(
        metavar="scripted|silent|random|FILE", help="Policy of the participant; a file holds a learned policy."
    ),
]

CoWizard = Annotated[
    str,
    typer.Option(
        metavar="scripted|silent|random|lane-follow|FILE",
        help="Policy of the Co-Wizard; a file holds a learned policy.",
    ),
]

AdWizard = Annotated[
    str,
    typer.Option(metavar="scripted|silent|random|FILE", help="Policy of the Ad-Wizard; a file holds a learned policy."),
]

MaxSeconds = Annotated[
    float | None, typer.Option(min=1.0, max=86400.0, help="Truncate sessions after this simulated time [s].")
]

WordErrors = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=0.95,
        help="Word error rate of the speech recogniser between participant and Co-Wizard.",
    ),
]

Ray = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Play on a Ray cluster: auto, HOST:PORT, ray://HOST:PORT or local (needs dorothie-gym[ray]).",
    ),
]


def env_config(max_seconds: float | None, word_errors: float) -> EnvConfig:
    """Returns the engine settings of a command line.

    Args:
        max_seconds: simulated time after which a session is truncated [s]; None keeps the default.
        word_errors: word error rate of the speech recogniser.
    """
    from dorothie_gym.engine.config import EnvConfig

    if max_seconds is None:
        return EnvConfig(word_error_rate=word_errors)
    return EnvConfig(max_seconds=max_seconds, word_error_rate=word_errors)


# --- Options with an optional value -----------------------------------------------------------------------------------

OWN_NAME = "<own name>"
"""Value of `--picture` without a file name: the command chooses the name."""

_TOWNS = (".yaml", ".yml", ".xodr")


class PictureCommand(TyperCommand):
    """Command with an option `--picture` whose value may be omitted, which typer does not support."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # Context of click, or of typer's copy of it
        """Inserts the omitted value: the next word is the value only if it can be the name of a picture."""
        given: list[str] = []
        for k, arg in enumerate(args):
            given.append(arg)
            suffix = PurePath(args[k + 1]).suffix.lower() if k + 1 < len(args) else ""
            if arg == "--picture" and suffix in ("", *_TOWNS):
                given.append(OWN_NAME)
        return super().parse_args(ctx, given)
