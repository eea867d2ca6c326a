import dataclasses
from collections import Counter

import numpy as np
import pytest

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role
from dorothie_gym.policies import ScriptedParticipant
from dorothie_gym.policies.heard_utterance import heard_utterance
from dorothie_gym.policies.participant.advance_directions import needs_no_reminder, take_up_confirmation
from dorothie_gym.policies.participant.route_description import way_remarks
from dorothie_gym.policies.persona import Directions
from dorothie_gym.policies.policy import replace
from tests.policies.participant.test_route_description import Drive
from tests.policies.said import with_words
from tests.policies.walk import play

M = DialogueMove
KEY = ("turn", 1, 2)


@pytest.fixture
def told():
    """Participant who has just described a way with a left and a right turn."""
    drive = Drive("brookside", 1)
    ways = (steps for manner in Directions for _, steps in drive.ways(manner))
    steps = next(way for way in ways if len([one for one in way if one.wording.direction is not None]) == 2)
    items = way_remarks(steps, M.INSTRUCT)
    drive.state.speech = replace(drive.state.speech, said=items, last=items[-1], last_end=drive.view.time)
    return drive, [one.wording.direction for one in steps if one.wording.direction is not None]


def confirmed(drive, text):
    act = DialogueAct.of(M.CONFIRM, ActionValue.J_TURN)
    heard = heard_utterance(with_words(dict(drive.view.raw), Role.CO_WIZARD, text, act), Role.CO_WIZARD)
    return take_up_confirmation(drive.state, drive.view, heard, np.random.default_rng(0))


def test_right_repetition_is_taken_up(told):
    drive, sides = told
    assert confirmed(drive, f"{sides[0]}, then {sides[1]}, got it.")
    assert drive.state.guidance.way_taken_up
    assert not [item for item in drive.state.speech.queue if item.act.move is M.CLARIFY]


def test_wrong_repetition_is_corrected_once(told):
    drive, sides = told
    other = {Direction.LEFT: "right", Direction.RIGHT: "left"}
    wrong = f"{sides[0]}, then {other[sides[1]]}, got it."
    assert confirmed(drive, wrong)
    queued = drive.state.speech.queue
    assert [item.act.move for item in queued] == [M.CLARIFY] * len(queued) and len(queued) >= 2
    drive.state.speech = replace(drive.state.speech, said=queued, last=queued[-1], queue=())
    assert not confirmed(drive, wrong)


def test_plain_okay_is_no_repetition(told):
    drive, _ = told
    assert not confirmed(drive, "okay.")
    assert not drive.state.guidance.way_taken_up


def reminders(drive, *, taken_up, age):
    count = 0
    for seed in range(200):
        guidance = dataclasses.replace(
            drive.state.guidance, way=(KEY,), way_at=drive.view.time - age, way_taken_up=taken_up
        )
        drive.state.guidance = guidance
        count += not needs_no_reminder(drive.state, drive.view, KEY, np.random.default_rng(seed))
    return count / 200


def test_steps_that_were_understood_are_rarely_repeated():
    drive = Drive("brookside", 1)
    assert reminders(drive, taken_up=True, age=20.0) < 0.25 < reminders(drive, taken_up=False, age=20.0)
    assert reminders(drive, taken_up=True, age=5.0) == 0.0


def test_steps_of_a_former_way_are_announced():
    drive = Drive("brookside", 1)
    assert not needs_no_reminder(drive.state, drive.view, KEY, np.random.default_rng(0))


def several_steps_of(manner, seeds):
    """Counts the directions with several turns that a participant gives in sessions."""
    count, traits = 0, {"directions": manner, "knowledge": (1.0, 1.0), "talkativeness": (1.0, 1.0)}
    for seed in seeds:
        played = play(seed, decisions=500, policies={"participant": ScriptedParticipant(traits=traits)})
        acts = Counter(
            event.data["end"]
            for event in played.events
            if event.type == "DialogueMove" and event.source is Role.PARTICIPANT and event.data["move"] == "Instruct"
            if any(row["predicate"] == "will" and row.get("action") == "JTurn" for row in event.data.get("meaning", []))
        )
        count += sum(turns > 1 for turns in acts.values())
    return count


@pytest.mark.long
@pytest.mark.parametrize("manner", ["turns", "streets"])
def test_personas_who_plan_describe_several_steps(manner):
    assert several_steps_of(manner, seeds=(2, 3, 4, 10, 11, 12, 13)) >= 3


def test_personas_who_plan_lead_more_often_than_vague_ones():
    town = load_town("brookside")
    leads = {
        manner: [
            ScriptedParticipant(traits={"directions": manner}).initial_state(seed, town).style.leads
            for seed in range(20)
        ]
        for manner in ("turns", "landmarks", "vague")
    }
    assert min(leads["turns"] + leads["landmarks"]) > max(leads["vague"])
