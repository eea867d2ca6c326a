"""Calls, tokens, latency and cost of a language model in a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Final, NotRequired, TypeAlias, TypedDict

from msgspec import Meta

if TYPE_CHECKING:
    from dorothie_gym.policies.language_model.cassette import Reply

SILENT_SHARE: Final = 0.02
"""Share of silent actions among the calls of a model above which its sessions do not show what it can do."""

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
    cached_tokens: NotRequired[Count]
    refused: NotRequired[list[str]]
    served: NotRequired[list[str]]


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
        cached_tokens: number of tokens of the prompts that the endpoint took from its cache; part of `prompt_tokens`.
        refused: parameters of requests that the endpoint has refused, in order of their names.
        served: names of the models that have answered, where they are not `model`, in order.
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
    cached_tokens: int = 0
    refused: Sequence[str] = ()
    served: Sequence[str] = ()

    @property
    def silent_share(self) -> float:
        """Share of the calls that ended in a silent action; 0 without calls."""
        return 1.0 - self.answers / self.calls if self.calls else 0.0

    @property
    def mostly_answered(self) -> bool:
        """Whether few enough calls ended in a silent action (`SILENT_SHARE`)."""
        return self.silent_share <= SILENT_SHARE

    def with_call(self, reply: Reply, prices: tuple[float, float] | None) -> ModelUsage:
        """Adds a call.

        Args:
            reply: outcome of the call.
            prices: price of a million tokens of prompts and of answers [US dollars]; cached tokens cost as much.
        """
        silences, tokens = dict(self.silences), reply.tokens
        if reply.fault is not None:
            silences[str(reply.fault)] = silences.get(str(reply.fault), 0) + 1
        cost = self.cost
        if prices is not None:
            cost = (cost or 0.0) + (tokens.prompt * prices[0] + tokens.completion * prices[1]) / 1e6
        return replace(
            self,
            calls=self.calls + 1,
            retries=self.retries + reply.retried,
            answers=self.answers + (reply.fault is None),
            prompt_tokens=self.prompt_tokens + tokens.prompt,
            completion_tokens=self.completion_tokens + tokens.completion,
            latency=round(self.latency + reply.latency, 6),
            slowest=max(self.slowest, reply.latency),
            cost=cost,
            silences=silences,
            cached_tokens=self.cached_tokens + tokens.cached,
            refused=_united([self.refused, reply.refused]),
            served=_united([self.served, (reply.model,) if reply.model not in ("", self.model) else ()]),
        )

    def to_json(self) -> UsagePage:
        """Returns the fields in JSON types."""
        page: UsagePage = {
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
        if self.cached_tokens:
            page["cached_tokens"] = self.cached_tokens
        if self.refused:
            page["refused"] = list(self.refused)
        if self.served:
            page["served"] = list(self.served)
        return page

    @classmethod
    def from_json(cls, page: UsagePage) -> ModelUsage:
        """Parses the output of `to_json`."""
        usage = cls(**page)
        return replace(usage, refused=tuple(usage.refused), served=tuple(usage.served))

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
            cached_tokens=sum(part.cached_tokens for part in parts),
            refused=_united([part.refused for part in parts]),
            served=_united([part.served for part in parts]),
        )


def _united(parts: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Returns the members of all sequences, each once, in order."""
    return tuple(sorted({each for part in parts for each in part}))
