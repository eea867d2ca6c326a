"""Misbehaving endpoints over real HTTP: each fault ends in a named silent action in time, and the session goes on."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import pytest

from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model import Fault, LanguageModelConfig
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField
from dorothie_gym.policies.language_model.language_model import LanguageModel, Prompt
from dorothie_gym.session.config import EnvConfig
from tests.policies.language_model.fake_server import FakeServer, serving
from tests.policies.language_model.sessions import play

TIMEOUT = 0.6
SLACK = 0.4  # for a busy machine
PROMPT = Prompt(
    system="Choose.",
    text="Left or right?",
    schema=AnswerSchema(name="way", fields=(ChoiceField(name="drive", labels=("left", "right"), meaning="the way"),)),
)

FAULTS = {
    "rate limit": Fault.RATE_LIMITED,
    "long rate limit": Fault.RATE_LIMITED,
    "error": Fault.SERVER_ERROR,
    "wrong key": Fault.REJECTED,
    "redirect": Fault.REJECTED,
    "hang": Fault.TIMEOUT,
    "trickle": Fault.TIMEOUT,
    "html": Fault.NOT_A_COMPLETION,
    "other json": Fault.NOT_A_COMPLETION,
    "broken gzip": Fault.NOT_A_COMPLETION,
    "hang up": Fault.NO_CONNECTION,
    "cut": Fault.CUT_OFF,
    "half json": Fault.NOT_JSON,
    "prose": Fault.NOT_JSON,
    "refusal": Fault.REFUSED,
    "wrong field": Fault.WRONG_SCHEMA,
    "impossible": Fault.WRONG_SCHEMA,
}


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with serving(lambda request: {"drive": "right"}) as found:
        yield found


def config_of(server: FakeServer) -> LanguageModelConfig:
    return LanguageModelConfig(model="m", url=server.url, timeout=TIMEOUT)


@pytest.mark.parametrize(("fault", "name"), FAULTS.items())
def test_fault_of_an_endpoint_has_a_name_and_ends_in_time(server: FakeServer, fault: str, name: Fault) -> None:
    server.fault = fault
    begun = time.monotonic()
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert time.monotonic() - begun < TIMEOUT + SLACK
    assert (reply.answer, reply.fault) == (None, name)
    assert reply.reason


@pytest.mark.parametrize("fault", ["error", "rate limit", "html", "cut", "refusal", "impossible", "prose"])
def test_second_attempt_answers_after_a_passing_fault(server: FakeServer, fault: str) -> None:
    server.fault, server.fault_calls = fault, 1
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert reply.answer == '{"drive": "right"}'
    assert reply.retried and len(server.requests) == 2


def test_model_is_told_what_was_wrong_with_its_answer(server: FakeServer) -> None:
    server.fault, server.fault_calls = "impossible", 1
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    first, second = (request["messages"] for request in server.requests)
    assert second[: len(first)] == first
    assert second[-2] == {"role": "assistant", "content": '{"drive": "Fly"}'}
    assert 'drive is \'Fly\'; it must be one of "left", "right"' in second[-1]["content"]
    assert reply.tokens[:2] == (200, 14)  # the tokens of both attempts are paid for


def test_server_is_asked_again_only_when_it_wants(server: FakeServer) -> None:
    server.fault = "long rate limit"
    assert LanguageModel(config_of(server)).ask(PROMPT).fault is Fault.RATE_LIMITED
    assert len(server.requests) == 1  # an hour is beyond the time of a call
    server.fault = "hang up"
    LanguageModel(config_of(server)).ask(PROMPT)
    assert len(server.requests) == 2


def test_code_fence_around_an_answer_is_no_fault(server: FakeServer) -> None:
    server.fault = "fences"
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert PROMPT.schema.read(reply.answer or "") == {"drive": "right"}
    assert not reply.retried


@pytest.mark.parametrize("address", ["http://127.0.0.1:9/v1", "https://127.0.0.1:{port}/v1", "http://no.invalid/v1"])
def test_server_out_of_reach_and_tls_errors_have_a_name(server: FakeServer, address: str) -> None:
    config = replace(config_of(server), url=address.format(port=server.server_port), timeout=5.0)
    reply = LanguageModel(config).ask(PROMPT)
    assert reply.fault is Fault.NO_CONNECTION
    assert "Error" in reply.reason


@pytest.mark.parametrize("fault", ["hang", "trickle", "prose", "error"])
def test_session_goes_on_in_silence(server: FakeServer, fault: str) -> None:
    server.fault = fault
    config = replace(config_of(server), timeout=0.1)
    summary = play({Role.CO_WIZARD: config}, config=EnvConfig(max_seconds=20.0))
    assert summary["seconds"] == 20.0
    usage = summary["usage"]["co_wizard"]
    assert usage["answers"] == 0 and usage["calls"] >= 2
    assert usage["silences"] == {str(FAULTS[fault]): usage["calls"]}
    assert summary["physical_actions"] == 0


def test_session_recovers_with_the_endpoint() -> None:
    with serving() as server:
        server.fault, server.fault_calls = "html", 8
        summary = play({Role.CO_WIZARD: LanguageModelConfig(model="m", url=server.url)})
    usage = summary["usage"]["co_wizard"]
    assert usage["silences"] == {"not a completion": 4}  # two attempts each
    assert summary["success"]
