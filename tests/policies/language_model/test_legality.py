"""Answers under a schema are actions that the mask of the role allows."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.language_model import LanguageModelPolicy
from dorothie_gym.policies.language_model.answer_schema import AnswerSchema, ChoiceField, WordsField
from dorothie_gym.policies.language_model.cassette import Reply
from dorothie_gym.policies.language_model.faults import CallError
from dorothie_gym.policies.language_model.language_model import LanguageModel, Prompt
from dorothie_gym.policies.policy import policy_inputs
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import action_space, plain_text
from tests.policies.language_model.sessions import NOWHERE
from tests.policies.language_model.simple_readers import Dice

SCHEMA = AnswerSchema(
    name="test",
    fields=(
        ChoiceField(name="drive", labels=("none", "Stop"), meaning="what to do"),
        WordsField(name="say", length=20, meaning="what to say"),
    ),
)


class DiceModel(LanguageModel):
    def __init__(self, seed: int) -> None:
        self.dice, self.calls = Dice(seed), 0

    def ask(self, prompt: Prompt) -> Reply:
        self.calls += 1
        return Reply(answer=json.dumps(self.dice.draw(prompt.schema)))


def forbidden(action: dict[str, Any], mask: dict[str, Any]) -> list[str]:
    """Fields of an action whose values a mask does not allow; an angle counts for the actions that take one."""
    found = []
    turns = action.get("physical") in (PhysicalAction.J_TURN, PhysicalAction.LANE_SWITCH)
    for name, values in mask.items():
        if name == "angle" and not turns:
            continue
        if isinstance(values, tuple):
            if not all(each[chosen] for each, chosen in zip(values, action[name], strict=True)):
                found.append(name)
        elif values is not None and not values[int(action[name]) + (180 if name == "angle" else 0)]:
            found.append(f"{name} {action[name]}")
    return found


@pytest.mark.long
@pytest.mark.parametrize("role", AGENT_ROLES)
@pytest.mark.parametrize("town", ["brookside", "midtown"])
def test_drawn_answers_are_allowed_and_carried_out(role: Role, town: str) -> None:
    engine = SessionEngine(town, config=EnvConfig(max_seconds=400.0))
    policies = {each: make_policy("scripted", each, engine.limits) for each in AGENT_ROLES}
    model = DiceModel(7)
    policies[role] = LanguageModelPolicy(role, NOWHERE, engine.limits, model)
    engine.reset(seed=12)
    states = {each: policies[each].initial_state(policy_seed(12, each), engine.town) for each in AGENT_ROLES}
    space, made, refused = action_space(role, engine.limits), 0, list[str]()
    while not engine.over:
        inputs, actions = policy_inputs(engine, policies), {}
        for each in AGENT_ROLES:
            actions[str(each)], states[each] = policies[each].step(inputs[each], states[each])
        action = actions[str(role)]
        assert space.contains({name: np.asarray(v) if not isinstance(v, str) else v for name, v in action.items()})
        assert forbidden(action, inputs[role]["action_mask"]) == []
        engine.step(actions)
        made += any(action.get(name, 0) for name in ("physical", "mental", "exception"))
        refused += [reason for reason in engine.session.log.refused[role] if "acts in this utterance" not in reason]
    assert model.calls >= 3
    assert role is Role.PARTICIPANT or made >= 3
    assert len(refused) <= 0.2 * made, refused  # masks hold for each field, not for all combinations


@given(words=st.text(max_size=60), drive=st.sampled_from(["none", "Stop"]))
def test_answer_of_the_schema_is_read_with_words_that_can_be_spoken(words: str, drive: str) -> None:
    read = SCHEMA.read(json.dumps({"drive": drive, "say": words}))
    assert read["drive"] == drive
    assert len(read["say"]) <= 20 and read["say"].isascii()


def test_words_are_cut_after_a_whole_word() -> None:
    assert SCHEMA.read('{"say": "I am going to turn left soon"}') == {"drive": "none", "say": "I am going to turn"}


@pytest.mark.parametrize(
    ("text", "cut"),
    [
        ("Wolframsbruckenstrasse", "Wolframsbruckenstras"),
        ("Wolframsbruckenstrasse is the place", "Wolframsbruckenstras"),
        ("exactly-twenty-charac", "exactly-twenty-chara"),
        ("twenty-characters-xx and more", "twenty-characters-xx"),
        ("\U0001f600 Wolframsbruckenstrasse", "Wolframsbruckenstras"),
        ("a \U0001f600 b", "a b"),
    ],
)
def test_word_that_is_longer_than_the_field_is_cut_not_lost(text: str, cut: str) -> None:
    assert SCHEMA.read(json.dumps({"say": text}))["say"] == cut


@given(st.text(st.sampled_from("ab ,\u00e9\U0001f600\n"), max_size=60))
def test_words_are_the_beginning_of_what_was_said(text: str) -> None:
    read = SCHEMA.read(json.dumps({"say": text}))["say"]
    spoken = " ".join(plain_text(" ".join(text.split()), 1000).split())
    assert spoken.startswith(read) and read == read.strip() and bool(read) == bool(spoken)
    assert len(read) == len(spoken) <= 20 or (len(spoken) > 20 and (spoken[len(read)] == " " or len(read) == 20))


@given(
    st.text(max_size=40)
    | st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
        max_leaves=5,
    ).map(json.dumps)
)
def test_any_other_answer_is_refused_with_a_reason(text: str) -> None:
    try:
        read = SCHEMA.read(text)
    except CallError as error:
        assert error.reason and "\n" not in error.reason
    else:
        assert set(read) == {"drive", "say"}


def test_json_schema_is_strict() -> None:
    schema = SCHEMA.response_format()["json_schema"]
    assert schema["strict"] is True
    assert schema["schema"]["required"] == ["drive", "say"]
    assert schema["schema"]["additionalProperties"] is False
    assert schema["schema"]["properties"]["drive"]["enum"] == ["none", "Stop"]
