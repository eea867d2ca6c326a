"""Language models on the command line: `dorothie-gym run` and `rollout` with `llm:MODEL`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.evaluation.closed_loop import read_result
from tests.policies.language_model.fake_server import serving

SHORT = ("--co-wizard", "llm:reader", "--max-seconds", "20")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("OPENAI_BASE_URL", raising=False)


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_run_reports_calls_tokens_and_cost() -> None:
    with serving() as server:
        done = invoke("run", *SHORT, "--llm-url", server.url, "--llm-prices", "1,2", "--json")
        calls = len(server.requests)
    assert done.exit_code == 0, done.output
    usage = json.loads(done.stdout)["usage"]["co_wizard"]
    assert usage["model"] == "reader"
    assert usage["calls"] == usage["answers"] == calls > 0
    assert usage["prompt_tokens"] == 100 * calls
    assert usage["cost"] == pytest.approx((100 * 1 + 7 * 2) * calls / 1e6)


def test_rollout_has_usage_and_replays_from_its_cassette(monkeypatch: pytest.MonkeyPatch) -> None:
    rollout = ("rollout", *SHORT, "--sessions", 1, "--towns", "brookside", "--workers", 1)
    with serving() as server:
        monkeypatch.setenv("OPENAI_BASE_URL", server.url)
        done = invoke(*rollout, "--llm-cassette", "tape.jsonl", "--out", "one")
    assert done.exit_code == 0, done.output
    assert "Language models" in done.stdout and "reader" in done.stdout
    monkeypatch.delenv("OPENAI_BASE_URL")
    again = invoke(*rollout, "--llm-cassette", "tape.jsonl", "--llm-replay", "--out", "two")
    assert again.exit_code == 0, again.output
    assert Path("one/rollout.json").read_bytes() == Path("two/rollout.json").read_bytes()
    page = json.loads(Path("one/rollout.json").read_text())
    assert page["usage"]["co_wizard"]["calls"] == page["rows"][0]["usage"]["co_wizard"]["calls"] > 0
    assert page["settings"]["language_models"]["co_wizard"]["time"] == "waits"
    assert server.url not in Path("one/rollout.json").read_text()
    assert read_result(Path("one")).to_json() == page


def test_leaderboard_has_the_cost_of_language_models() -> None:
    with serving() as server:
        invoke("rollout", *SHORT, "--sessions", 1, "--towns", "brookside", "--workers", 1, "--out", "one",
               "--llm-url", server.url, "--llm-prices", "1,2")  # fmt: skip
    done = invoke("leaderboard", "one")
    assert done.exit_code == 0, done.output
    page = Path("leaderboard.md").read_text()
    assert "## Language models" in page
    assert "--co-wizard llm:reader" in page and "--llm-url URL" in page


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "llm:MODEL needs an endpoint: give --llm-url, or set the variable OPENAI_BASE_URL"),
        (("--llm-url", "localhost"), "it must begin with http:// or https://"),
        (("--llm-url", "http://me:secret@host/v1"), "give the key by the variable OPENAI_API_KEY"),
        (("--llm-replay",), "give the file with the recorded calls"),
        (("--llm-url", "http://localhost/v1", "--llm-prices", "free"), "give two numbers separated by a comma"),
        (("--llm-replay", "--llm-cassette", "no/such/tape.jsonl"), "the call is not recorded"),
    ],
)
def test_wrong_options_end_with_one_line(arguments: tuple[str, ...], message: str) -> None:
    done = invoke("run", *SHORT, *arguments)
    assert done.exit_code != 0
    assert message in " ".join(done.stderr.split())
    assert "secret" not in done.output


def test_model_without_a_name_is_refused() -> None:
    done = invoke("run", "--co-wizard", "llm:", "--llm-url", "http://localhost/v1")
    assert done.exit_code != 0 and "give the name of a model" in done.stderr


@pytest.mark.parametrize("command", [("run", "--max-seconds", 60), ("rollout", "--sessions", 4, "--workers", 1)])
def test_endpoint_that_rejects_all_calls_ends_the_command(command: tuple[object, ...]) -> None:
    with serving() as server:
        server.fault = "unknown model"
        towns = ("--towns", "brookside") if "rollout" in command else ()
        done = invoke(*command, *towns, "--co-wizard", "llm:m", "--llm-url", server.url)
        asked = len(server.requests)
    assert done.exit_code == 2
    assert "The model `m` does not exist" in done.stderr and "status 404" in done.stderr
    assert asked == 3


@pytest.mark.long
def test_endpoint_that_rejects_calls_of_another_process_ends_the_rollout() -> None:
    with serving() as server:
        server.fault = "wrong key"
        done = invoke("rollout", "--co-wizard", "llm:m", "--towns", "brookside", "--sessions", 2, "--workers", 2,
                      "--llm-url", server.url)  # fmt: skip
    assert done.exit_code == 2 and "wrong key" in done.stderr


def test_refused_parameters_and_other_models_are_told() -> None:
    with serving() as server:
        server.refuses, server.fault = ("max_tokens",), "other model"
        done = invoke("run", *SHORT, "--llm-url", server.url, "--json", "--llm-parameters", "no-seed")
    assert done.exit_code == 0, done.output
    usage = json.loads(done.stdout)["usage"]["co_wizard"]
    assert usage["refused"] == ["max_tokens"] and usage["served"] == ["m-2026-11"]
    assert usage["answers"] == usage["calls"] > 0
    assert "refused or changed these parameters: max_tokens" in done.stderr and "m-2026-11" in done.stderr


def test_rollout_with_silent_actions_is_marked_on_the_board() -> None:
    for name, calls in (("good", 0), ("silent", 4)):
        with serving() as server:
            server.fault, server.fault_calls = "html", calls
            done = invoke("rollout", "--co-wizard", f"llm:{name}", "--max-seconds", 60, "--sessions", 1, "--towns",
                          "brookside", "--workers", 1, "--out", name, "--llm-url", server.url)  # fmt: skip
            assert done.exit_code == 0, done.output
            assert ("ended in a silent action" in done.stderr) == (name == "silent")
    assert invoke("leaderboard", "silent", "good").exit_code == 0
    page = Path("leaderboard.md").read_text()
    assert "more than 2 % of the calls" in page
    marked = {
        name: [line for line in page.splitlines() if line.startswith(f"| llm:{name} (")] for name in ("good", "silent")
    }
    assert marked["good"] and not any("silent in many calls" in line for line in marked["good"])
    assert marked["silent"] and "silent in many calls" in marked["silent"][0]
