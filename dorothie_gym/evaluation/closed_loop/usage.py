"""Usage of language models in the sessions of a rollout: calls, tokens, latency, cost, and silent actions by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from rich.table import Table

from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.play import USAGE_FILE
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.policies.language_model.usage import ModelUsage, UsagePage
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, raising, read_json

SessionUsage: TypeAlias = Mapping[str, ModelUsage]
"""Usage of language models in a session, by role."""


def read_usage(folder: Path) -> dict[str, ModelUsage]:
    """Returns the usage recorded next to a session; empty if there is none.

    Raises:
        SessionError: the file is damaged.
    """
    file = folder / USAGE_FILE
    if not file.exists():
        return {}
    with raising(SessionError):
        return usage_from_json(checked(read_json(file, MAX_SMALL_JSON), dict[str, UsagePage], file))


def usage_from_json(page: Mapping[str, Any]) -> dict[str, ModelUsage]:
    """Parses the output of `usage_to_json`."""
    return {role: ModelUsage.from_json(each) for role, each in page.items()}


def usage_to_json(usage: SessionUsage) -> dict[str, UsagePage]:
    """Returns the usage of each role in JSON types."""
    return {role: each.to_json() for role, each in usage.items()}


def total_usage(sessions: Sequence[SessionUsage]) -> dict[str, ModelUsage]:
    """Returns the total usage of each role in several sessions; empty if there is none."""
    found: dict[str, ModelUsage] = {}
    for role in map(str, AGENT_ROLES):
        parts = [usage[role] for usage in sessions if role in usage]
        if parts:
            found[role] = ModelUsage.total(parts)
    return found


def usage_warnings(usage: SessionUsage) -> list[str]:
    """Returns what a reader of figures with language models must know, a line each; empty if there is nothing."""
    found = []
    for role, each in usage.items():
        if not each.mostly_answered:
            silences = ", ".join(f"{count} x {name}" for name, count in sorted(each.silences.items()))
            found.append(
                f"{role}: {100 * each.silent_share:.1f} % of {each.calls} calls to {each.model} ended in a silent "
                f"action ({silences}); the figures do not show what the model can do"
            )
        if each.refused:
            found.append(f"{role}: the endpoint refused or changed these parameters: {', '.join(each.refused)}")
        if each.served:
            found.append(f"{role}: {each.model} was requested, and answered by {', '.join(each.served)}")
        if each.answers and not (each.prompt_tokens and each.completion_tokens):
            missing = "answers" if each.prompt_tokens else "prompts"
            found.append(
                f"{role}: the endpoint reports no tokens of {missing}; the numbers of tokens and the cost are too low"
            )
    return found


def tokens_text(usage: ModelUsage) -> str:
    """Returns the numbers of tokens of prompts and answers, with those of cached prompts."""
    cached = f" ({usage.cached_tokens:,} cached)" if usage.cached_tokens else ""
    return f"{usage.prompt_tokens:,}{cached}, {usage.completion_tokens:,}"


def usage_table(usage: SessionUsage, sessions: int) -> Table:
    """Returns a table for the terminal, with a row for each role.

    Args:
        usage: usage in all sessions.
        sessions: number of sessions.
    """
    table = Table(
        "role", "model", "calls", "answered", "retries", "silent actions", "tokens in, out", "seconds / call", "cost",
        title="Language models",
    )  # fmt: skip
    for role, each in usage.items():
        silences = ", ".join(f"{count} x {name}" for name, count in sorted(each.silences.items())) or "none"
        cost = "-" if each.cost is None else f"{each.cost:.4f} $, {each.cost / max(sessions, 1):.4f} $ a session"
        share = 100 * each.answers / each.calls if each.calls else 0.0
        table.add_row(
            role,
            each.model,
            str(each.calls),
            f"{share:.1f} %",
            str(each.retries),
            silences,
            tokens_text(each),
            f"{each.latency / max(each.calls, 1):.2f} (at most {each.slowest:.2f})",
            cost,
        )
    return table
