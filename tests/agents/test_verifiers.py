"""Taskset and harness of verifiers, found by their module, with the rule program as an endpoint.

They need an environment of their own:
`pip install -c constraints.txt '.[verifiers]' pytest pytest-timeout hypothesis`, then
`python -m pytest -W default -m integrations tests/agents/test_verifiers.py`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.agents import tasks
from tests.agents.players import play, reader_of
from tests.policies.language_model.fake_server import FakeServer, serving
from tests.policies.language_model.reader_server import answer_by_role

vf = pytest.importorskip("verifiers.v1", reason="needs an environment with the extra 'verifiers'")
pytestmark = [pytest.mark.integrations, pytest.mark.filterwarnings("default")]


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with serving(answer_by_role) as found:
        yield found


def evaluate(server: FakeServer, folder: Path, *options: str) -> list[Mapping[str, Any]]:
    """Runs the command of the documentation; returns the traces, one for each episode."""
    command = [
        str(Path(sys.executable).with_name("vf-eval")), "dorothie-sessions", "--model", "reader",
        "--client.base-url", server.url, "--env.agent.runtime.type", "subprocess", "--no-push",
        "--output-dir", str(folder), *options,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
    (found,) = folder.rglob("traces.jsonl")
    episodes = [json.loads(line) for line in found.read_text().splitlines()]
    return [trace for episode in episodes for trace in episode["traces"]]


def test_ten_sessions_succeed_and_are_those_of_the_text_session(server: FakeServer, tmp_path: Path) -> None:
    traces = evaluate(server, tmp_path, "-n", "10", "--env.taskset.stage", "pair")
    assert len(traces) == 10
    expected = {task.seed: task for task in tasks("train", "pair")}
    for trace in traces:
        task = expected[trace["task"]["data"]["seed"]]
        outcome = play(task.session(), reader_of("co_wizard"), task.seed)
        assert trace["info"]["session"] == outcome.numbers()
        assert trace["rewards"]["session_score"]["score"] == outcome.score and not trace["errors"]
        assert trace["metrics"]["reference"] == task.reference
    assert sum(trace["metrics"]["success"] for trace in traces) >= 9


def test_malformed_answers_and_a_limit_of_turns_are_scores_not_errors(server: FakeServer, tmp_path: Path) -> None:
    server.answerer = lambda request: {"drive": "Fly"}
    (trace,) = evaluate(server, tmp_path / "wrong", "-n", "1", "--env.taskset.stage", "street")
    assert (trace["rewards"]["session_score"]["score"], trace["info"]["session"]["faults"], trace["errors"]) == (
        0.0,
        20.0,
        [],
    )
    server.answerer = answer_by_role
    limit = ("--env.agent.harness.id", "dorothie-sessions", "--env.agent.harness.max-turns", "3")
    (trace,) = evaluate(server, tmp_path / "short", "-n", "1", "--env.taskset.stage", "street", *limit)
    assert trace["info"]["session"]["turns"] == 3.0 and 0.0 <= trace["rewards"]["session_score"]["score"] < 1.0
