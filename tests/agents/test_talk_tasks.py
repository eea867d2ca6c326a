"""Talk tasks by text: the tiers "ask-first" and "admit-it" are scored by the verdict on the session."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import pytest

from dorothie_gym.agents import Outcome, TextSession, Turn
from tests.agents.players import Gambler, Idler, Talker, score

Player = Callable[[Turn], Mapping[str, str]]


class AskingReader:
    """Weighs requests for a place against the map of the page; asks which one is meant where there are several."""

    def __init__(self) -> None:
        self.asked: tuple[str, ...] = ()

    def __call__(self, turn: Turn) -> Mapping[str, str]:
        said = re.findall(r'^- The passenger said: "(.*)"', turn.page, re.MULTILINE)
        if not said:
            return {"again": "5"}
        places = re.findall(r"^- (.*), on (.*) Street, \d+ m away as", turn.page, re.MULTILINE)
        text = said[-1].lower()
        fitting = self.asked or tuple(name for name, _ in places if _named(name, text))
        streets = {name: street for name, street in places}
        there = [name for name in fitting if streets[name].lower() in text]
        if len(fitting) > 1 and not there:
            self.asked = fitting
            ways = " or ".join(f"the one on {streets[name]}" for name in fitting)
            return {"say": f"Which one do you mean, {ways}?", "again": "5"}
        if not fitting:
            other = places[0][0].partition(" on ")[0]
            return {"say": f"Sorry, there is no such place on my map. I can take you to {other} instead.", "again": "5"}
        return {"goal": (there or list(fitting))[0], "again": "30"}


def _named(label: str, text: str) -> bool:
    return bool(re.search(rf"\b{re.escape(label.partition(' on ')[0].lower())}\b", text))


def played(session: TextSession, player: Player, seed: int) -> Outcome:
    return score(session, player, seed)


def seeds_of(session: TextSession, kind: str, count: int) -> list[int]:
    """Seeds of the first tasks of a kind that cannot be done as they are."""
    found: list[int] = []
    for seed in range(400):
        session.reset(seed)
        verdict = session._referee.verdict()  # type: ignore[union-attr]
        if verdict is not None and verdict.kind == kind and verdict.reaction in ("ask", "admit"):
            found.append(seed)
        if len(found) == count:
            break
    return found


@pytest.mark.parametrize(("tier", "kind"), [("ask-first", "two_houses"), ("admit-it", "no_such_place")])
def test_page_lets_an_agent_ask_or_admit_and_others_fail(tier: str, kind: str) -> None:
    session = TextSession(tier=tier, town="brookside")
    (seed,) = seeds_of(session, kind, 1)
    right = played(session, AskingReader(), seed)
    assert (right.success, right.score) == (True, 1.0) and right.cause
    assert right.to_json()["cause"] == right.cause and "cause" not in right.numbers()
    for player in (Idler(), Talker(), Gambler(1)):
        wrong = played(session, player, seed)
        assert (wrong.success, wrong.score) == (False, 0.0) and wrong.cause


def test_score_of_a_talk_task_is_never_lowered_by_playing_on() -> None:
    session = TextSession(tier="ask-first", town="brookside")
    (seed,) = seeds_of(session, "two_houses", 1)
    player, turn, scores = AskingReader(), session.reset(seed), [0.0]
    while not turn.done:
        turn = session.answer(player(turn))
        scores.append(session.score)
    assert scores == sorted(scores) and set(scores) == {0.0, 1.0}


def test_ad_wizard_is_scored_against_the_co_wizard_of_a_talk_task() -> None:
    session = TextSession("ad_wizard", tier="ask-first", town="brookside")
    turn = session.reset(1)
    turn = session.answer({"change": "weather: fog", "again": "20"})
    while not turn.done:
        turn = session.answer({"again": "120"})
    outcome = session.finish()
    assert outcome.score == 1.0 - outcome.success
