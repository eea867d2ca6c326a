"""Options of language models as policies (`llm:MODEL`), which `run` and `rollout` share."""

from __future__ import annotations

import enum
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.options import needs
from dorothie_gym.cli.output import fail, stderr
from dorothie_gym.policies import language_model as asked

_PANEL = "Language models (llm:MODEL)"


class AnswerTime(enum.StrEnum):
    """Progress of the session while the model answers: `SimulatedTime`, whose import takes long."""

    WAITS = "waits"
    CHARGED = "charged"


LlmUrl = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        help="Endpoint with OpenAI's chat interface, such as http://localhost:8000/v1; default: $OPENAI_BASE_URL. The "
        f"key is read from $OPENAI_API_KEY ({needs('llm')}).",
        rich_help_panel=_PANEL,
    ),
]
LlmTimeout = Annotated[
    float, typer.Option(min=0.1, max=3600.0, help="Longest time of a call, retry included [s].", rich_help_panel=_PANEL)
]
LlmTokens = Annotated[
    int | None,
    typer.Option(
        min=16,
        max=100_000,
        help="Largest number of tokens of an answer; default: that of the profile, usually 300.",
        rich_help_panel=_PANEL,
    ),
]
LlmParameters = Annotated[
    str,
    typer.Option(
        metavar="PROFILE|NAME=VALUE|no-NAME,...",
        help="Parameters of requests: a profile (usual, completion-tokens, reasoning, shared-schema, plain), values, "
        "and those that are not sent; or a JSON object.",
        rich_help_panel=_PANEL,
    ),
]
LlmTime = Annotated[
    AnswerTime,
    typer.Option(
        help="The session waits for answers, or goes on: an answer then takes effect after the time of the call.",
        rich_help_panel=_PANEL,
    ),
]
LlmPictures = Annotated[
    bool,
    typer.Option("--llm-pictures", help="Send the picture of the car's camera too.", rich_help_panel=_PANEL),
]
LlmCassette = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.jsonl", help="Record calls in a file, and answer recorded ones from it.", rich_help_panel=_PANEL
    ),
]
LlmReplay = Annotated[
    bool,
    typer.Option("--llm-replay", help="Answer from --llm-cassette only, without network.", rich_help_panel=_PANEL),
]
LlmPrices = Annotated[
    str | None,
    typer.Option(
        metavar="IN,OUT", help="Price of a million tokens of prompts and of answers [$].", rich_help_panel=_PANEL
    ),
]


@dataclass(frozen=True, kw_only=True)
class LanguageModelOptions:
    """Options of language models as given on the command line."""

    url: str | None
    timeout: float
    tokens: int | None
    parameters: str
    time: AnswerTime
    pictures: bool
    cassette: Path | None
    replay: bool
    prices: str | None

    def config(self) -> asked.LanguageModelConfig:
        """Returns the settings; the name of the model is a placeholder. Exits if they are incomplete or wrong."""
        url = self.url or os.environ.get(asked.URL_VARIABLE, "")
        if not url and not self.replay:
            fail(f"llm:MODEL needs an endpoint: give --llm-url, or set the variable {asked.URL_VARIABLE}")
        try:
            parameters, tokens = asked.parse_parameters(self.parameters, self.tokens)
            return asked.LanguageModelConfig(
                model="MODEL",
                url=url,
                timeout=self.timeout,
                max_tokens=tokens,
                parameters=parameters,
                time=asked.SimulatedTime(self.time.value),
                pictures=self.pictures,
                cassette=self.cassette,
                offline=self.replay,
                prices=self._prices(),
            )
        except ValueError as error:
            fail(f"language model: {error}")

    def _prices(self) -> tuple[float, float] | None:
        if self.prices is None:
            return None
        try:
            first, second = map(float, self.prices.split(","))
        except ValueError:
            fail(f"--llm-prices is {self.prices!r}; give two numbers separated by a comma, such as 0.15,0.60")
        return first, second


def warn_of_usage(warnings: Sequence[str]) -> None:
    """Prints warnings about language models (`closed_loop.usage_warnings`) on standard error."""
    for line in warnings:
        stderr().print(f"Warning: {line}", style="yellow", markup=False, soft_wrap=True)
