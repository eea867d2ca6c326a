"""Action and observation of a session over OpenEnv."""

from __future__ import annotations

from openenv.core.env_server.types import Action, Observation
from pydantic import Field


class TextAction(Action):
    """One answer, or one call of a tool.

    Attributes:
        tool: "answer", or the name of a tool.
        value: JSON object of the answer, or the argument of the tool; empty for none.
    """

    tool: str = Field("answer", description="answer, or the name of a tool: say, drive, set_goal, look, wait, ...")
    value: str = Field("", description="JSON object of the answer, or the argument of the tool")


class TextObservation(Observation):
    """One turn; fields as in `dorothie_gym.agents.Turn`. The reward is the gain in score since the last turn.

    Attributes:
        outcome: figures of the outcome when the session is over; empty before.
    """

    page: str = ""
    system: str = ""
    choices: dict[str, list[str]] = Field(default_factory=dict)
    time: float = 0.0
    truncated: bool = False
    error: str = ""
    outcome: dict[str, float] = Field(default_factory=dict)
