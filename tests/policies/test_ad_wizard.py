import json

import numpy as np
import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import ExceptionKind, Role
from dorothie_gym.policies import ScriptedAdWizard, Trick
from dorothie_gym.policies.ad_wizard import idle_until
from dorothie_gym.policies.task_exceptions import task_message
from dorothie_gym.session.recording import EventType, Session
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import AdWizardAction, SpaceLimits, noop, plain_text
from dorothie_gym.session.spaces.fields import MESSAGE_LENGTH
from dorothie_gym.tasks import TaskState, bind, load_template, parse_template, template_names
from tests.policies.walk import play

TOWN = load_town("brookside")


def test_one_to_four_tricks_are_planned_and_none_at_rate_zero():
    counts = {len(ScriptedAdWizard().initial_state(seed, TOWN).planned) for seed in range(40)}
    assert counts <= {1, 2, 3, 4} and len(counts) > 2
    assert not ScriptedAdWizard(rate=0.0).initial_state(1, TOWN).planned


def test_only_permitted_kinds_are_planned():
    wizard = ScriptedAdWizard(rate=4.0, kinds=["weather"])
    tricks = {item.trick for seed in range(10) for item in wizard.initial_state(seed, TOWN).planned}
    assert tricks == {Trick.WEATHER}


def test_invalid_arguments_raise_value_error():
    with pytest.raises(ValueError, match="rate is 9"):
        ScriptedAdWizard(rate=9.0)
    with pytest.raises(ValueError, match="earthquake"):
        ScriptedAdWizard(kinds=["earthquake"])


TASK_EXCEPTIONS = {
    ExceptionKind.TASK_TRIGGER: "trigger",
    ExceptionKind.TASK_DELETE: "delete",
    ExceptionKind.TASK_CHANGE: "change",
}


@pytest.mark.parametrize("kind", TASK_EXCEPTIONS)
def test_messages_are_those_of_the_storyboard(kind):
    told = 0
    for name in template_names():
        engine = SessionEngine(TOWN, load_template(name))
        seen = engine.reset(seed=len(name))["ad_wizard"]
        for number, subgoal in enumerate(engine.scenario.storyboard.subgoals):
            message = subgoal.messages.of(kind)
            if message is None:
                continue
            text = task_message(seen, kind, number)
            assert text == plain_text(str(message), 1000) and len(text) <= MESSAGE_LENGTH
            action = AdWizardAction(exception=kind, item=number, message=text)
            assert AdWizardAction.decode(action.encode(SpaceLimits()), SpaceLimits()).message == text
            told += 1
    assert told >= 5


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (ExceptionKind.TASK_TRIGGER, "New on your list: Buy tea at Coco, because Noor is thirsty"),
        (ExceptionKind.TASK_DELETE, "Off your list: Buy tea at Coco"),
        (ExceptionKind.TASK_CHANGE, "Change of plan: Coco is full: buy tea at KFC"),
    ],
)
def test_messages_are_made_of_the_texts_where_the_storyboard_gives_none(kind, expected):
    seen = {
        "tasks": "Stop at Ikea\nBuy tea at Coco, because Noor is thirsty",
        "changes": "\nCoco is full: buy tea at KFC",
        **dict.fromkeys(("trigger_messages", "delete_messages", "change_messages"), "\n"),
    }
    assert task_message(seen, kind, 1) == expected
    assert len(task_message({**seen, "tasks": "\n" + "Buy tea " * 60}, ExceptionKind.TASK_TRIGGER, 1)) <= MESSAGE_LENGTH


def test_task_exceptions_of_a_session_come_with_the_messages_of_the_storyboard():
    wizard = ScriptedAdWizard(rate=4.0, kinds=["task"])
    silent = {"participant": "silent", "co_wizard": "silent"}
    played = play(3, decisions=400, names=silent, policies={"ad_wizard": wizard}, storyboard="bake_sale")
    subgoals = played.env.scenario.storyboard.subgoals
    given = {str(message) for subgoal in subgoals for _, message in subgoal.messages.given()}
    told = [str(event.data["text"]) for event in played.events if event.type is EventType.MESSAGE]
    assert told and set(told) <= given


def test_bad_weather_comes_and_clears_up():
    wizard = ScriptedAdWizard(rate=1.0, kinds=["weather"])
    played = play(
        1, decisions=860, names={"participant": "silent", "co_wizard": "silent"}, policies={"ad_wizard": wizard}
    )
    values = [e.data["value"] for e in played.events if e.type == "Exception" and e.data["kind"] == "weather"]
    assert len(values) == 2 and values[0] != values[1]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_idle_decisions_are_only_counted(seed):
    engine = SessionEngine(TOWN)
    observations = engine.reset(seed=seed)
    wizard = ScriptedAdWizard(engine.limits, rate=4.0)
    state, nothing, idle = wizard.initial_state(seed, TOWN), AdWizardAction().encode(engine.limits), 0
    silent = {str(role): noop(role, engine.limits) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
    for decision in range(600):
        seen = observations["ad_wizard"]
        waits = seen["time"][0] < idle_until(wizard, state, seen["story"])
        action, after = wizard.step(seen, state)
        if waits:
            assert after == state.advanced()
            assert all(np.array_equal(action[name], nothing[name]) for name in nothing), decision
            idle += 1
        state = after
        engine.step({**silent, "ad_wizard": action})
        observations = engine.observations
    assert 200 < idle < 600


ON_CALL = {
    "variables": [["P1", "people"], ["P2", "places.cafe"]],
    "story": "You are on patrol today and wait for a call.",
    "subgoals": [
        {"destination": "$P1", "description": "Pick up the child", "trigger": True},
        {"destination": "$P2", "description": "Bring the child to $P2", "trigger": True},
    ],
}
FULL_DAY = {
    "variables": [
        ["A", "places.stores"],
        ["B", "places.restaurants"],
        ["C", "places.cafe"],
        ["D", "places.residential"],
    ],
    "story": "The list is long today, and the telephone does not stop.",
    "subgoals": [
        {"destination": "$A", "description": "Shop", "delete": True},
        {"destination": "$B", "description": "Eat", "change": "Eat something else, at $C", "change_destination": "$C"},
        {"destination": "$C", "description": "Coffee", "trigger": True},
        {"destination": "$D", "description": "Home"},
    ],
}


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        (ON_CALL, [("task_trigger", 0), ("task_trigger", 1)]),
        (FULL_DAY, [("task_change", 1), ("task_delete", 0), ("task_trigger", 2)]),
    ],
)
def test_every_exception_of_a_template_of_ones_own_is_played(tmp_path, fields, expected, seed):
    path = tmp_path / "own.json"
    path.write_text(json.dumps(fields))
    result = CliRunner().invoke(
        app,
        ["run", "--town", "brookside", "--seed", str(seed), "--storyboard", str(path), "--json"]
        + ["--out", str(tmp_path / "s")],
    )
    assert result.exit_code == 0, result.output
    session = Session.load(tmp_path / "s")
    exceptions = [event.data for event in session.of_type(EventType.EXCEPTION)]
    played = [(data["kind"], data["subgoal"]) for data in exceptions if str(data["kind"]).startswith("task_")]
    assert sorted(played) == expected
    told = [str(event.data["text"]) for event in session.of_type(EventType.MESSAGE)]
    assert len(told) == len(played)
    for text, (kind, subgoal) in zip(told, played, strict=True):
        written = fields["subgoals"][subgoal]["change" if kind == "task_change" else "description"]
        assert written.partition("$")[0] in text
    assert json.loads(result.output)["subgoals"]["live"] == len(fields["subgoals"]) - (fields is FULL_DAY)


def test_nothing_is_to_be_done_before_the_first_trigger():
    template = parse_template(json.dumps(ON_CALL), "on_call")
    state = TaskState(bind(template, TOWN.sites, np.random.default_rng(0)))
    assert state.live == () and not state.done and not state.success
    assert state.arrive(state.landmark_of(0)) == []
    state.trigger(0)
    assert state.live == (0,) and state.arrive(state.landmark_of(0)) == [0] and state.done
