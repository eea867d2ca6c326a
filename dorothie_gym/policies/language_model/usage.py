"""Calls, tokens, latency and cost of a language model in a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, TypeAlias, TypedDict

from msgspec import Meta

if TYPE_CHECKING:
    from dorothie_gym.policies.language_model.faults import Fault

Count: TypeAlias = Annotated[int, Meta(ge=0, lt=2**53)]
Amount: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e12)]


class UsagePage(TypedDict):
    """Usage in JSON types; fields as in `ModelUsage`."""

    model: str
    calls: Count
    retries: Count
    answers: Count
    expired: Count
    prompt_tokens: Count
    completion_tokens: Count
    latency: Amount
    slowest: Amount
    cost: Amount | None
    silences: dict[str, Count]


@dataclass(frozen=True, kw_only=True)
class ModelUsage:
    """Usage of a language model by one role in one session, or in several.

    Attributes:
        model: name of the model.
        calls: number of calls, of which each ends in an answer or in silence.
        retries: number of second attempts.
        answers: number of calls that brought an answer of the schema.
        expired: number of chosen actions that were no longer possible when they were due, or refused for it.
        prompt_tokens: number of tokens of the prompts, as the endpoint counts them.
        completion_tokens: number of tokens of the answers.
        latency: time spent waiting for the endpoint [s].
        slowest: longest call [s].
        cost: price of the tokens [US dollars]; None if the prices are unknown.
        silences: number of calls that ended in a silent action, by fault.
    """

    model: str
    calls: int = 0
    retries: int = 0
    answers: int = 0
    expired: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    latency: float = 0.0
    slowest: float = 0.0
    cost: float | None = None
    silences: Mapping[str, int] = field(default_factory=dict)

    def with_call(
        self,
        *,
        fault: Fault | None,
        retried: bool,
        tokens: tuple[int, int],
        latency: float,
        prices: tuple[float, float] | None,
    ) -> ModelUsage:
        """Adds a call.

        Args:
            fault: fault that it ended in; None for an answer.
            retried: whether a second attempt was made.
            tokens: number of tokens of prompts and answers.
            latency: time of the call [s].
            prices: price of a million tokens of prompts and of answers [US dollars].
        """
        silences = dict(self.silences)
        if fault is not None:
            silences[str(fault)] = silences.get(str(fault), 0) + 1
        cost = self.cost
        if prices is not None:
            cost = (cost or 0.0) + sum(count * price for count, price in zip(tokens, prices, strict=True)) / 1e6
        return replace(
            self,
            calls=self.calls + 1,
            retries=self.retries + retried,
            answers=self.answers + (fault is None),
            prompt_tokens=self.prompt_tokens + tokens[0],
            completion_tokens=self.completion_tokens + tokens[1],
            latency=round(self.latency + latency, 6),
            slowest=max(self.slowest, latency),
            cost=cost,
            silences=silences,
        )

    def to_json(self) -> UsagePage:
        """Returns the fields in JSON types."""
        return {
            "model": self.model,
            "calls": self.calls,
            "retries": self.retries,
            "answers": self.answers,
            "expired": self.expired,
            "prompt_tokens": self.prompt_tokens,
            "completion_tokens": self.completion_tokens,
            "latency": self.latency,
            "slowest": self.slowest,
            "cost": None if self.cost is None else round(self.cost, 9),
            "silences": dict(sorted(self.silences.items())),
        }

    @classmethod
    def from_json(cls, page: UsagePage) -> ModelUsage:
        """Parses the output of `to_json`."""
        return cls(**page)

    @classmethod
    def total(cls, parts: Sequence[ModelUsage]) -> ModelUsage:
        """Returns the total usage of one or more sessions, under the name of the first model."""
        silences: dict[str, int] = {}
        for part in parts:
            for name, count in part.silences.items():
                silences[name] = silences.get(name, 0) + count
        costs = [part.cost for part in parts if part.cost is not None]
        return cls(
            model=parts[0].model,
            calls=sum(part.calls for part in parts),
            retries=sum(part.retries for part in parts),
            answers=sum(part.answers for part in parts),
            expired=sum(part.expired for part in parts),
            prompt_tokens=sum(part.prompt_tokens for part in parts),
            completion_tokens=sum(part.completion_tokens for part in parts),
            latency=round(sum(part.latency for part in parts), 6),
            slowest=max(part.slowest for part in parts),
            cost=sum(costs) if costs else None,
            silences=silences,
        )
