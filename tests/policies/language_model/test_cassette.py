"""Calls that are recorded in a file and replay without network, equal to the bit."""

from __future__ import annotations

import json
import socket
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from dorothie_gym.archive import compare_folders
from dorothie_gym.errors import EndpointError, PolicyLoadError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, find_player
from dorothie_gym.policies.language_model import LanguageModelConfig, SimulatedTime
from dorothie_gym.policies.language_model.cassette import Cassette, Reply
from dorothie_gym.policies.language_model.chat_endpoint import Tokens
from dorothie_gym.session.config import EnvConfig
from tests.policies.language_model.fake_server import serving
from tests.policies.language_model.sessions import play

SECRET = "sk-very-secret-key"
MINUTE = EnvConfig(max_seconds=60.0)


def block_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a socket was opened")

    for name in ("connect", "connect_ex", "bind"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)


def recorded(tape: Path, *, fault: str = "", calls: int = 10**9, **settings: object) -> LanguageModelConfig:
    """Records a rollout of two sessions of a minute; returns its settings without the server."""
    with serving() as server:
        server.fault, server.fault_calls = fault, calls
        config = LanguageModelConfig(model="m", url=server.url, cassette=tape, **settings)  # type: ignore[arg-type]
        roll_out(rollout_of(config), tape.parent / "recorded")
    return replace(config, url="", offline=True)


def rollout_of(config: LanguageModelConfig) -> RolloutSettings:
    return RolloutSettings(
        cast={**ALL_SCRIPTED, Role.CO_WIZARD: find_player("llm:m", Role.CO_WIZARD, config)},
        towns=("brookside", "midtown"),
        sessions=2,
        config=MINUTE,
    )


@pytest.mark.parametrize("time", SimulatedTime)
def test_rollout_replays_without_network_and_equal_to_the_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, time: SimulatedTime
) -> None:
    config = recorded(tmp_path / "tape.jsonl", fault="impossible", calls=6, time=time)
    block_network(monkeypatch)
    result = roll_out(rollout_of(config), tmp_path / "again")
    assert result.errored == 0
    assert all(difference is None for _, difference in compare_folders(tmp_path / "recorded", tmp_path / "again"))
    for name in ("rollout.json", "settings.json"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "recorded" / name).read_bytes()
    usage = result.usage()["co_wizard"]
    assert usage.retries == 3 and usage.silences == {"wrong schema": 3}
    assert usage.latency > 0.0  # as recorded


def test_calls_are_answered_from_the_cassette_while_it_is_recorded(tmp_path: Path) -> None:
    with serving() as server:
        config = LanguageModelConfig(model="m", url=server.url, cassette=tmp_path / "tape.jsonl")
        first = play({Role.CO_WIZARD: config}, config=MINUTE)
        asked = len(server.requests)
        again = play({Role.CO_WIZARD: config}, config=MINUTE)
        assert len(server.requests) == asked > 0
    assert again == first


def test_unrecorded_call_is_an_error_and_no_silence(tmp_path: Path) -> None:
    config = recorded(tmp_path / "tape.jsonl")
    with pytest.raises(PolicyLoadError, match=r"tape\.jsonl: the call is not recorded"):
        play({Role.CO_WIZARD: config}, seed=99, config=MINUTE)


@pytest.mark.parametrize("fault", ["", "wrong key"])
def test_key_is_sent_and_never_recorded(
    tmp_path: Path, fault: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", SECRET)
    caplog.set_level("DEBUG")
    with serving() as server:
        server.fault = fault
        config = LanguageModelConfig(model="m", url=server.url, cassette=tmp_path / "tape.jsonl")
        with pytest.raises(EndpointError, match="wrong key") if fault else nullcontext() as raised:
            roll_out(rollout_of(config), tmp_path / "rollout")
        assert server.headers[0]["Authorization"] == f"Bearer {SECRET}"
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) > (3 if fault else 8)
    assert not [path for path in files if SECRET.encode() in path.read_bytes()]
    assert SECRET not in caplog.text and SECRET not in repr(config)
    if fault:
        assert raised is not None and SECRET not in str(raised.value)
        assert "status 401: wrong key: Bearer [key]" in (tmp_path / "tape.jsonl").read_text()


def test_cut_off_last_line_does_not_count_and_other_damage_is_reported(tmp_path: Path) -> None:
    tape = tmp_path / "tape.jsonl"
    Cassette(tape).add({"model": "m"}, Reply(answer="{}", latency=0.25, tokens=Tokens(3, 4)))
    Cassette(tape).add({"model": "n"}, Reply(answer="{}"))
    tape.write_text(tape.read_text()[:-20])
    assert Cassette(tape).find({"model": "m"}) == Reply(answer="{}", latency=0.25, tokens=Tokens(3, 4))
    assert Cassette(tape).find({"model": "n"}) is None
    for damage in ("{}\n", "no json\n", '{"key": 1, "tokens": [1], "answer": "", "retried": false, "latency": 0}\n'):
        tape.write_text(damage)
        with pytest.raises(PolicyLoadError, match=r"line 1.*: .*give a cassette"):
            Cassette(tape)


def test_several_writers_lose_no_call(tmp_path: Path) -> None:
    tape = tmp_path / "tape.jsonl"

    def write(number: int) -> None:
        Cassette(tape).add({"number": number}, Reply(answer="x" * 5000))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(64)))
    assert {json.loads(line)["request"]["number"] for line in tape.read_text().splitlines()} == set(range(64))
    assert all(Cassette(tape).find({"number": number}) is not None for number in range(64))
