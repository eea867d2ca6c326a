"""Records of a session that is played by text: one turn, and the outcome."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Turn of an agent: the page, the choices, and the reward since the last turn.

    Attributes:
        page: observation of the role in words, or its changes, or after a fault what was wrong.
        system: the role, the fields of an answer and their meanings; equal in all sessions of the role.
        choices: labels that each field of the answer may have now; no entry for fields of free words.
        schema: JSON schema of the answer; empty when the session is over.
        reward: sum of the rewards of the role since the last turn, as its environment gives them.
        time: simulated time [s].
        done: whether the session is over; further answers have no effect.
        truncated: whether it is over because a limit of turns or faults was reached.
        error: fault of the last answer in words; empty if there was none.
        picture: picture of the car's camera as an address with its PNG (`data:image/png;base64,...`); empty without a
            camera in the settings of the session or for the role, and when the session is over.
    """

    page: str
    system: str
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    schema: Mapping[str, object] = field(default_factory=dict)
    reward: float = 0.0
    time: float = 0.0
    done: bool = False
    truncated: bool = False
    error: str = ""
    picture: str = ""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Outcome of a session, finished or not.

    Attributes:
        score: in [0, 1], see `dorothie_gym.agents.score`.
        success: whether every live subgoal was reached without a collision caused by the car; in a talk task, whether
            the Co-Wizard has reacted rightly.
        reached: number of subgoals reached.
        live: number of live subgoals.
        seconds: simulated time [s].
        reason: reason of the end; "unfinished" if the session was not over.
        reward: sum of the rewards of the role.
        collisions: number of collisions caused by the car.
        infractions: number of infractions of traffic rules.
        turns: number of answers and tool calls.
        faults: number of those that were refused.
        expired: number of chosen actions that were no longer possible when they were due.
        characters: number of characters of the pages that were handed out, the system text once included.
        cause: what has decided a talk task, in a few words; empty in other sessions.
        usage: cost of policies of the other roles, by role; empty without language models.
    """

    score: float
    success: bool
    reached: int
    live: int
    seconds: float
    reason: str
    reward: float
    collisions: int
    infractions: int
    turns: int
    faults: int
    expired: int
    characters: int
    cause: str = ""
    usage: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types."""
        return asdict(self)

    def numbers(self) -> dict[str, float]:
        """Returns all figures as numbers, for frameworks that log numbers only."""
        return {name: float(value) for name, value in asdict(self).items() if isinstance(value, bool | int | float)}
