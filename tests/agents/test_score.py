"""Scores: in [0, 1], never lowered by playing on, and ordered by what a player does."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import mean

import pytest

from dorothie_gym.agents import Outcome, TextSession
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.session.config import EnvConfig
from tests.agents.players import Gambler, Idler, Keywords, Talker, play, reader_of, score
from tests.portability.processors import SETTINGS, TOGETHER

SHORT = EnvConfig(max_seconds=120.0)
MINUTE = EnvConfig(max_seconds=60.0)
SEEDS = (20, 21, 23)


def ended_at_once(session: TextSession, seed: int) -> Outcome:
    session.reset(seed)
    return session.finish()


@pytest.mark.parametrize("role", ["co_wizard", "participant"])
def test_score_grows_with_progress_and_is_never_lowered_by_playing_on(role: str) -> None:
    session, reader = TextSession(role, "brookside", config=MINUTE), reader_of(role)
    turn = session.reset(20)
    scores = [session.score]
    while not turn.done:
        turn = session.answer(reader(turn.page))
        scores.append(session.score)
    assert scores == sorted(scores)
    assert scores[0] == 0.0 < scores[-1] <= 1.0 and session.finish().score == scores[-1]


@pytest.mark.long
def test_finished_task_has_the_whole_score() -> None:
    outcome = play(TextSession(town="brookside"), reader_of("co_wizard"), 3)
    assert (outcome.success, outcome.score, outcome.reached, outcome.reason) == (True, 1.0, outcome.live, "arrived")


def scores_by_player(seeds: Sequence[int]) -> dict[str, list[float]]:
    """Scores of each player of the Co-Wizard, from those that do least."""
    session = TextSession(town="brookside", config=SHORT)
    players: dict[str, Callable[[int], Outcome]] = {
        "end": lambda seed: ended_at_once(session, seed),
        "nothing": lambda seed: score(session, Idler(), seed),
        "talk": lambda seed: score(session, Talker(), seed),
        "random": lambda seed: score(session, Gambler(seed), seed),
        "keywords": lambda seed: score(session, Keywords(), seed),
        "reader": lambda seed: play(session, reader_of("co_wizard"), seed),
    }
    found = {name: [player(seed).score for seed in seeds] for name, player in players.items()}
    assert all(0.0 <= each <= 1.0 for scores in found.values() for each in scores)
    return found


@pytest.mark.long
@pytest.mark.timeout(900)
def test_scores_of_co_wizards_are_ordered_by_what_they_do() -> None:
    check_order({name: mean(scores) for name, scores in scores_by_player(SEEDS).items()})


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_scores_over_200_seeds_are_ordered_by_what_co_wizards_do() -> None:
    means = {name: mean(scores) for name, scores in scores_by_player(range(40_000, 40_200)).items()}
    print(means)
    check_order(means)


def check_order(means: Mapping[str, float]) -> None:
    assert means["end"] == 0.0
    assert means["nothing"] == pytest.approx(means["talk"], abs=0.03)  # the car rolls to the end of its lane
    assert max(means["nothing"], means["talk"]) < means["random"] < means["keywords"] < means["reader"]


@pytest.mark.long
def test_scores_of_participants_are_ordered_by_what_they_do() -> None:
    session = TextSession("participant", "brookside", config=SHORT)
    silent = [score(session, Idler(), seed).score for seed in SEEDS]
    guiding = [play(session, reader_of("participant"), seed).score for seed in SEEDS]
    assert 0.0 == ended_at_once(session, 20).score <= mean(silent) < mean(guiding) <= 1.0


def test_adversary_scores_only_with_a_change_in_a_finished_session() -> None:
    session = TextSession("ad_wizard", "brookside", config=MINUTE)
    assert score(session, Idler(), 20).score == 0.0
    turn = session.reset(20)
    turn = session.answer({"change": "weather: fog", "again": "20"})
    assert session.score == 0.0  # not finished
    while not turn.done:
        turn = session.answer({"again": "120"})
    assert 0.0 < session.finish().score <= 1.0


PLAYED = """
import json
from tests.agents.test_score import outcomes_by_role
print(json.dumps(outcomes_by_role()))
"""


def outcomes_by_role() -> dict[str, dict[str, object]]:
    """Outcome of a session of a minute by role, with every digit."""
    sessions = {role: TextSession(role, "brookside", config=MINUTE, pages="changes") for role in AGENT_ROLES}
    return {str(role): play(session, reader_of(role), 21).to_json() for role, session in sessions.items()}


@pytest.mark.long
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the settings name abilities of x86-64")
def test_outcomes_are_equal_on_other_processors() -> None:
    expected = json.loads(json.dumps(outcomes_by_role()))
    assert expected["co_wizard"]["score"] > 0.0
    root = str(Path(__file__).parents[2])
    for name in TOGETHER:
        environment = {**os.environ, **SETTINGS[name], "PYTHONPATH": root}
        done = subprocess.run([sys.executable, "-c", PLAYED], env=environment, cwd=root, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]
        assert json.loads(done.stdout) == expected, name
