"""Ceilings of prompted agents: rule programs over pages, also with spoilt answers: `python -m tests.agents.ceilings`.

A program that sees nothing but the pages shows what a perfect reader of them could reach, beside the scripted policy of
the role in the same scenarios. A spoilt answer is drawn at random from the choices of the turn; with several trials,
the rows show what Pass^k means.
"""

from __future__ import annotations

import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import typer

from dorothie_gym.agents import Outcome, TextSession, Turn, merged_page
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.evaluation.tiers import find_tier
from dorothie_gym.ontology import Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.casting import partners_of
from tests.agents.players import reader_of

HEAD = """\
| tier | role | player | sessions | subgoals | success | all trials | score | tokens in |
|---|---|---|---|---|---|---|---|---|"""


class SpoiltReader:
    """The rule program of a role over pages of changes; some of its answers are drawn at random."""

    def __init__(self, role: Role, rate: float, seed: int) -> None:
        self.reader, self.rate, self.random, self.page = reader_of(role), rate, random.Random(seed), ""

    def __call__(self, turn: Turn) -> Mapping[str, Any]:
        self.page = merged_page(self.page, turn.page) if self.page else turn.page
        answer = self.reader(self.page)
        if self.random.random() < self.rate:
            return {name: self.random.choice(labels) for name, labels in turn.choices.items()}
        return answer


@dataclass(frozen=True, kw_only=True)
class Row:
    """Figures of a player in a tier: numbers of subgoals, and shares of scenarios."""

    tier: str
    role: str
    player: str
    sessions: int
    reached: int
    live: int
    success: float
    pass_k: float
    score: float
    tokens: float

    def line(self) -> str:
        return (
            f"| {self.tier} | {self.role} | {self.player} | {self.sessions} | {self.reached} of {self.live} "
            f"({self.reached / max(self.live, 1):.0%}) | {self.success:.0%} | {self.pass_k:.0%} | "
            + (f"{self.score:.2f} | {self.tokens:.0f} |" if self.tokens else "| |")
        )


def spoilt(session: TextSession, seed: int, rate: float, trial: int) -> Outcome:
    """Plays a session with spoilt answers."""
    player, turn = SpoiltReader(session.role, rate, 1000 * seed + trial), session.reset(seed)
    while not turn.done:
        turn = session.answer(json.dumps(player(turn)))
    return session.finish()


def read_row(tier: str, role: Role, sessions: Sequence[tuple[TextSession, int]], rate: float, trials: int) -> Row:
    """Figures of the rule program."""
    tries = [[spoilt(session, seed, rate, trial) for trial in range(trials)] for session, seed in sessions]
    played = [outcome for each in tries for outcome in each]
    return Row(
        tier=tier, role=str(role), player="reader" if rate == 0.0 else f"reader, {rate:.0%} spoilt",
        sessions=len(played), reached=sum(each.reached for each in played), live=sum(each.live for each in played),
        success=sum(each.success for each in played) / len(played),
        pass_k=sum(all(outcome.success for outcome in each) for each in tries) / len(tries),
        score=sum(each.score for each in played) / len(played),
        tokens=sum(each.characters for each in played) / len(played) / 4,
    )  # fmt: skip


def scripted_row(tier: str, role: Role, sessions: Sequence[tuple[TextSession, int]]) -> Row:
    """Figures of the scripted policy of the role."""
    summaries = []
    for session, seed in sessions:
        limits = session.engine.limits
        policies = partners_of(role, tier_settings(tier, role).partners, limits)
        summaries.append(
            play_session(session.engine, {**policies, role: make_policy("scripted", role, limits)}, seed=seed)
        )
    success = sum(bool(summary["success"]) for summary in summaries) / len(summaries)
    return Row(
        tier=tier, role=str(role), player="scripted", sessions=len(summaries),
        reached=sum(summary["subgoals"]["reached"] for summary in summaries),
        live=sum(summary["subgoals"]["live"] for summary in summaries),
        success=success, pass_k=success, score=0.0, tokens=0.0,
    )  # fmt: skip


def main(
    tiers: Annotated[str, typer.Option("--tiers", help="tiers, separated by commas")] = "standard,rough",
    roles: Annotated[str, typer.Option(help="roles, separated by commas")] = "co_wizard,participant",
    count: Annotated[int, typer.Option("--sessions", min=1, help="scenarios of a tier; towns take turns")] = 8,
    rates: Annotated[str, typer.Option("--spoilt", help="rates of spoilt answers")] = "0",
    trials: Annotated[int, typer.Option(min=1, help="trials of a scenario with spoilt answers")] = 3,
    first_seed: Annotated[int, typer.Option(help="seed of the first scenario")] = 9100,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON and nothing else")] = False,
) -> None:
    """Prints a table."""
    rows = list[Row]()

    def show(row: Row) -> None:
        rows.append(row)
        if not as_json:
            print(row.line(), flush=True)

    if not as_json:
        print(HEAD, flush=True)
    for tier in tiers.split(","):
        towns = find_tier(tier).towns
        for role in map(Role, roles.split(",")):
            played = [
                (TextSession(role, towns[number % len(towns)], tier=tier, pages="changes"), first_seed + number)
                for number in range(count)
            ]
            show(scripted_row(tier, role, played))
            for rate in map(float, rates.split(",")):
                show(read_row(tier, role, played, rate, trials if rate else 1))
    if as_json:
        print(json.dumps([asdict(row) for row in rows]))


if __name__ == "__main__":
    typer.run(main)
