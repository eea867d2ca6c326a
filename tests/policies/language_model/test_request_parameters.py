"""Parameters of requests: profiles, and endpoints that refuse some, over real HTTP."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.errors import EndpointError
from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model import Fault, LanguageModelConfig, ModelUsage, parse_parameters
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField
from dorothie_gym.policies.language_model.cassette import Cassette
from dorothie_gym.policies.language_model.chat_endpoint import Tokens
from dorothie_gym.policies.language_model.event_stream import joined_completion
from dorothie_gym.policies.language_model.language_model import LanguageModel
from dorothie_gym.session.config import EnvConfig
from tests.policies.language_model.fake_server import FakeServer, serving
from tests.policies.language_model.sessions import play
from tests.policies.language_model.test_faults import PROMPT

RIGHT = '{"drive": "right"}'


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with serving(lambda request: {"drive": "right"}) as found:
        yield found


def config_of(server: FakeServer, text: str = "", **settings: Any) -> LanguageModelConfig:
    parameters, tokens = parse_parameters(text)
    return LanguageModelConfig(
        model="m", url=server.url, timeout=5.0, parameters=parameters, max_tokens=tokens, **settings
    )


# --- Settings ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", {"temperature": 0.0, "max_tokens": 300, "seed": 0}),
        ("usual", {"temperature": 0.0, "max_tokens": 300, "seed": 0}),
        ("completion-tokens", {"temperature": 0.0, "max_completion_tokens": 300, "seed": 0}),
        ("reasoning", {"max_completion_tokens": 4000, "reasoning_effort": "low"}),
        ("reasoning,reasoning_effort=high", {"max_completion_tokens": 4000, "reasoning_effort": "high"}),
        ("no-seed,no-temperature", {"max_tokens": 300}),
        ("temperature=0.7, top_p=0.9", {"temperature": 0.7, "top_p": 0.9, "max_tokens": 300, "seed": 0}),
        ('{"seed": null, "min_p": 0.1}', {"temperature": 0.0, "min_p": 0.1, "max_tokens": 300}),
    ],
)
def test_request_has_the_parameters_of_the_text(server: FakeServer, text: str, expected: Mapping[str, Any]) -> None:
    config = config_of(server, text)
    LanguageModel(config).ask(PROMPT)
    sent = {name: value for name, value in server.requests[0].items() if name not in ("model", "messages")}
    assert sent.pop("response_format")["type"] == "json_schema"
    assert sent == expected
    again, _ = parse_parameters(json.dumps(config.record().get("parameters", {})))
    assert dict(config.parameters) == again  # as `command_of` writes them


def test_schema_that_is_shared_by_all_calls_lists_no_choices_of_the_moment(server: FakeServer) -> None:
    fields = (
        ChoiceField(name="drive", labels=("left", "right"), meaning="the way", listed="one of those in the page"),
        ChoiceField(name="again", labels=("10", "1"), meaning="the time"),
    )
    prompt = replace(PROMPT, schema=AnswerSchema(name="way", fields=fields))
    for text in ("reasoning,shared-schema", "response_format=shared", "no-seed"):
        LanguageModel(config_of(server, text)).ask(prompt)
    shared, again, exact = (each["response_format"]["json_schema"]["schema"] for each in server.requests)
    assert shared == again and "enum" not in shared["properties"]["drive"]
    assert shared["properties"]["drive"]["description"] == "the way: one of those in the page"
    assert shared["properties"]["again"] == exact["properties"]["again"] and exact["properties"]["drive"]["enum"]


def test_profile_without_a_schema_sends_none(server: FakeServer) -> None:
    LanguageModel(config_of(server, "plain")).ask(PROMPT)
    assert server.requests[0].keys() == {"model", "messages", "max_tokens"}


def test_given_limit_of_tokens_is_that_of_any_profile() -> None:
    parameters, tokens = parse_parameters("reasoning", 900)
    assert (parameters["max_completion_tokens"], parameters["max_tokens"], tokens) == (900, None, 900)


@pytest.mark.parametrize("text", ["resoning", "{no json", "model=x", "=3", "no-", "messages=[]"])
def test_wrong_parameters_are_refused_with_a_reason(text: str) -> None:
    with pytest.raises(ValueError, match="parameters"):
        LanguageModelConfig(model="m", url="http://localhost/v1", parameters=parse_parameters(text)[0])


# --- Negotiation ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        "Unsupported parameter: '{name}' is not supported with this model. Use another one instead.",
        "{name}: Extra inputs are not permitted",
        "Unsupported value: '{name}' does not support 0 with this model. Only the default (1) value is supported.",
    ],
)
@pytest.mark.parametrize("name", ["max_tokens", "temperature", "seed", "response_format"])
def test_refused_parameter_is_left_out_and_stays_out(server: FakeServer, name: str, words: str) -> None:
    server.refuses, server.words = (name,), words
    model = LanguageModel(config_of(server))
    replies = [model.ask(PROMPT), model.ask(replace(PROMPT, seed=1))]
    assert [reply.answer for reply in replies] == [RIGHT, RIGHT]
    assert [reply.refused for reply in replies] == [(name,), (name,)]
    assert not any(reply.retried for reply in replies)
    assert [name in request for request in server.requests] == [True, False, False]
    limit = "max_completion_tokens" if name == "max_tokens" else "max_tokens"
    assert server.requests[-1][limit] == 300  # an answer is limited in any case
    if name == "response_format":
        assert '"enum":["left","right"]' in server.requests[-1]["messages"][-1]["content"]


def test_several_refused_parameters_are_left_out_one_by_one(server: FakeServer) -> None:
    server.refuses = ("max_tokens", "temperature", "seed", "response_format", "max_completion_tokens")
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert reply.answer == RIGHT
    assert reply.refused == tuple(sorted(server.refuses))
    assert server.requests[-1].keys() == {"model", "messages"}


@pytest.mark.parametrize("words", ["The request is not good.", "max_tokens is too small for a model of this size"])
def test_request_that_stays_refused_is_a_fault(server: FakeServer, words: str) -> None:
    server.refuses, server.words = ("messages",), words
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert reply.fault is Fault.REJECTED
    assert len(server.requests) <= 3


def test_error_of_a_web_framework_names_the_field(server: FakeServer) -> None:
    server.refuses = ("seed",)
    server.words = "no"
    reply = LanguageModel(config_of(server)).ask(PROMPT)
    assert reply.fault is Fault.REJECTED  # nothing names the field
    from dorothie_gym.policies.language_model.request_parameters import refused_parameter

    detail = json.dumps({"detail": [{"type": "extra_forbidden", "loc": ["body", "seed"], "msg": "Extra inputs"}]})
    assert refused_parameter(422, detail.encode(), ["model", "seed", "temperature"]) == "seed"
    param = json.dumps({"error": {"message": "temperature? seed?", "param": "seed"}})
    assert refused_parameter(400, param.encode(), ["temperature", "seed"]) == "seed"
    assert refused_parameter(500, param.encode(), ["temperature", "seed"]) == ""


def test_refusals_are_recorded_and_replay_without_network(server: FakeServer, tmp_path: Path) -> None:
    server.refuses = ("seed",)
    config = config_of(server, cassette=tmp_path / "tape.jsonl")
    first = LanguageModel(config).ask(PROMPT)
    again = LanguageModel(replace(config, url="", offline=True)).ask(PROMPT)
    assert first == again and again.refused == ("seed",)


# --- Other endpoints --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["streams", "streams only"])
def test_endpoint_that_only_streams_is_read(server: FakeServer, kind: str) -> None:
    server.fault = kind
    model = LanguageModel(config_of(server))
    for seed in (0, 1):
        reply = model.ask(replace(PROMPT, seed=seed))
        assert (reply.answer, reply.tokens) == (RIGHT, Tokens(100, 7))
    assert reply.refused == (("stream",) if kind == "streams only" else ())


def test_separators_of_unicode_do_not_end_the_line_of_an_event() -> None:
    parts = [{"choices": [{"delta": {"content": words}}]} for words in ("Turn\u2028left, ", "then\u0085right.")]
    lines = [f"data:{json.dumps(part, ensure_ascii=False)}" for part in parts]
    for end in ("\n\n", "\r\n\r\n", "\r\r"):
        (choice,) = joined_completion(end.join([": hello", *lines, "data: [DONE]", ""]))["choices"]
        assert choice["message"]["content"] == "Turn\u2028left, then\u0085right."


@pytest.mark.parametrize(
    ("kind", "tokens"), [("cached", Tokens(100, 7, 64)), ("no usage", Tokens()), ("other usage", Tokens())]
)
def test_tokens_are_counted_as_far_as_the_endpoint_says(server: FakeServer, kind: str, tokens: Tokens) -> None:
    server.fault = kind
    assert LanguageModel(config_of(server)).ask(PROMPT).tokens == tokens


def test_model_that_answers_under_another_name_is_recorded(server: FakeServer, tmp_path: Path) -> None:
    server.fault = "other model"
    config = config_of(server, cassette=tmp_path / "tape.jsonl")
    reply = LanguageModel(config).ask(PROMPT)
    usage = ModelUsage(model="m").with_call(reply, None)
    assert usage.served == ("m-2026-11",)
    assert ModelUsage.from_json(usage.to_json()) == usage
    assert next(iter(Cassette(tmp_path / "tape.jsonl")._replies.values())).model == "m-2026-11"


# --- Sessions ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fault", "words"), [("wrong key", "status 401: wrong key"), ("unknown model", "status 404.*does not exist")]
)
def test_session_that_begins_with_rejected_calls_ends(server: FakeServer, fault: str, words: str) -> None:
    server.fault = fault
    with pytest.raises(EndpointError, match=f"first 3 calls.*{words}.*--llm-parameters"):
        play({Role.CO_WIZARD: config_of(server)}, config=EnvConfig(max_seconds=60.0))
    assert len(server.requests) == 3


def test_rejections_after_an_answer_are_silent_actions_that_count(server: FakeServer) -> None:
    server.answerer = lambda request: {"drive": "none"}
    server.fault, server.fault_calls = "unknown model", 2
    summary = play({Role.CO_WIZARD: config_of(server)}, config=EnvConfig(max_seconds=60.0))
    usage = ModelUsage.from_json(summary["usage"]["co_wizard"])  # type: ignore[arg-type]
    assert usage.silences == {"rejected": 2} and not usage.mostly_answered
