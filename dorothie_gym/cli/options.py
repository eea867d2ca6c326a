"""Options that several commands have, and what they mean for an environment."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from dorothie_gym.engine.config import EnvConfig

AsJson = Annotated[bool, typer.Option("--json", help="Write one JSON object, and nothing else.")]

Maps = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder with maps of towns that are not shipped (Town01.xodr).")
]

Players = Annotated[int | None, typer.Option(min=1, help="Processes that play; as many as there are processors.")]

Participant = Annotated[str, typer.Option(metavar="scripted|silent|random|FILE", help="Who plays the participant.")]

CoWizard = Annotated[
    str,
    typer.Option(
        metavar="scripted|silent|random|lane-follow|FILE",
        help="Who plays the Co-Wizard; a file holds a learned policy.",
    ),
]

AdWizard = Annotated[str, typer.Option(metavar="scripted|silent|random|FILE", help="Who plays the Ad-Wizard.")]

MaxSeconds = Annotated[
    float | None, typer.Option(min=1.0, max=86400.0, help="Cut sessions off after so many simulated seconds.")
]

WordErrors = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=0.95,
        help="Word error rate of the recogniser through which the participant and the Co-Wizard hear each other.",
    ),
]

Ray = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Let a Ray cluster play: auto, HOST:PORT, ray://HOST:PORT, or local (needs dorothie-gym[ray]).",
    ),
]


def env_config(max_seconds: float | None, word_errors: float) -> EnvConfig:
    """The configuration of an environment that a command line asks for.

    Args:
        max_seconds: simulated seconds after which a session is cut off; None for what is usual.
        word_errors: word error rate of the recogniser.
    """
    from dorothie_gym.engine.config import EnvConfig

    if max_seconds is None:
        return EnvConfig(word_error_rate=word_errors)
    return EnvConfig(max_seconds=max_seconds, word_error_rate=word_errors)
