import pytest

from dorothie_gym.baselines.roles.co_wizard.answers import SAID_AGAIN_AFTER, answer_to, is_sayable, said_again
from dorothie_gym.baselines.roles.co_wizard.memory import VARIABLES, Update, WorkingMemory
from dorothie_gym.baselines.roles.co_wizard.remarks import form_of, sources
from dorothie_gym.baselines.roles.learned_role.remark_forms import filled
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import Utterance
from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.dialogue import Predicate, Proposition, Wording, understand
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, ObjectClass, Role, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.answers import RECENT_STOP
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.knowledge import TOLD_TO_STOP, Standstill
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import intend
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.state.codes import Motion

STANDS = Proposition.of(Predicate.STANDS, action=ActionValue.STOP)


def with_value(memory, name, value):
    return tuple(value if one == name else old for one, old in zip(VARIABLES, memory.values, strict=True))


@pytest.fixture(scope="module")
def scene():
    engine = SessionEngine("midtown")
    engine.reset(seed=4)
    observation = {
        **engine.observations.of([Role.CO_WIZARD])[str(Role.CO_WIZARD)],
        "action_mask": engine.mask(Role.CO_WIZARD),
    }
    view = CoWizardView.read(observation, engine.town)
    return view, WorkingMemory(town=engine.town)


def heard(view, text, move, *values):
    return Utterance(
        time=view.time, heard=HeardUtterance(acts=(DialogueAct.of(move, *values),), words=understand(text))
    )


def answer(scene, text, move, *values, memory=None):
    view, usual = scene
    return answer_to(heard(view, text, move, *values), memory or usual, view)


def test_yes_and_no_follow_from_what_the_observation_shows(scene):
    view = scene[0]
    here = next(mark for mark in view.landmarks if mark.street is not StreetName.UNKNOWN)
    elsewhere = StreetName.BEAL if here.street is not StreetName.BEAL else StreetName.MURFIN
    for street, move in ((here.street, DialogueMove.REPLY_Y), (elsewhere, DialogueMove.REPLY_N)):
        said = answer(scene, "", DialogueMove.QUERY_YN, here.name, street)
        assert said.act.move is move
        held = Proposition.of(Predicate.LOCATED, place=here.name, street=street)
        assert said.meaning == ((held,) if move is DialogueMove.REPLY_Y else (held.opposite,))


def test_what_cannot_be_known_is_answered_so(scene):
    said = answer(scene, "are we close?", DialogueMove.QUERY_YN)
    assert said.act.move is DialogueMove.REPLY_U


def test_check_of_the_destination_is_confirmed_or_denied(scene):
    bound = replace(scene[1], goal=LandmarkName.KFC)
    asked = ("KFC, right?", DialogueMove.CHECK, LandmarkName.KFC)
    assert answer(scene, *asked, memory=bound).act.move is DialogueMove.CONFIRM
    assert answer(scene, *asked).act.move is DialogueMove.REPLY_N


def test_misheard_why_is_not_answered_by_yes_or_no(scene):
    said = answer(scene, "way did we stop?", DialogueMove.QUERY_YN, ActionValue.STOP)
    assert said.act.move not in (DialogueMove.REPLY_Y, DialogueMove.REPLY_N)
    view, memory = scene
    asked = heard(view, "way did we stop?", DialogueMove.QUERY_YN, ActionValue.STOP)
    stops = Proposition.of(Predicate.DOES, action=ActionValue.STOP)
    assert not is_sayable(intend(Function.AFFIRMATIVE_ANSWER, stops), "does", memory, view, asked)


def why_stopped(view, memory):
    return answer_to(heard(view, "why did we stop?", DialogueMove.QUERY_W, ActionValue.STOP), memory, view)


def test_car_says_for_what_it_stands(scene):
    view, memory = scene
    bound, waits = replace(memory, goal=LandmarkName.KFC), replace(view, speed=0.0, motion=Motion.HAZARD)
    said = why_stopped(replace(waits, hazard=ObjectClass.PEDESTRIAN), bound)
    hinders = Proposition.of(Predicate.HINDERS, object=ObjectClass.PEDESTRIAN)
    assert said.meaning == (Proposition.of(Predicate.BECAUSE, effect=STANDS, cause=hinders, at=None),)
    assert why_stopped(waits, replace(bound, values=with_value(bound, "arrived", 1))).meaning[0].get("cause") == (
        Proposition.of(Predicate.ARRIVED, place=LandmarkName.KFC)
    )


def test_reason_for_an_earlier_standstill_is_remembered_with_its_time(scene):
    view, memory = scene
    stands = replace(view, time=20.0, speed=0.0, motion=Motion.HAZARD, hazard=ObjectClass.PEDESTRIAN)
    drives = replace(view, time=26.0, speed=8.0, motion=Motion.DRIVING, hazard=ObjectClass.UNLABELED)
    memory = replace(memory, goal=LandmarkName.KFC).seen(stands, heard=False).seen(drives, heard=False)
    said = why_stopped(drives, memory).meaning[0]
    assert said.get("cause") == Proposition.of(Predicate.HINDERS, object=ObjectClass.PEDESTRIAN)
    assert said.get("at") == 20
    much_later = replace(drives, time=20.0 + 2.0 * RECENT_STOP)
    assert why_stopped(much_later, memory).meaning == (STANDS.opposite,)


def test_driver_that_was_told_to_stop_says_so_and_does_not_claim_it_otherwise(scene):
    view, memory = scene
    view = replace(view, time=30.0, speed=0.0)
    bound = replace(memory, goal=LandmarkName.KFC, goal_mark=0, standstill=Standstill(since=None))
    halting = Update(values=with_value(bound, "halted", 1), fresh=(False,) * 3)
    told = replace(bound, heard_at=29.0).updated(halting, view, (), (), None).seen(view, heard=False)
    unasked = replace(bound, heard_at=2.0).updated(halting, view, (), (), None).seen(view, heard=False)
    assert why_stopped(view, told).meaning[0].get("cause") == TOLD_TO_STOP
    assert why_stopped(view, unasked).act.move is DialogueMove.REPLY_U


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"told_to_turn_round_at": 0.0}, Predicate.TOLD),
        ({"goal": LandmarkName.KFC, "goal_mark": 0}, Predicate.BEHIND),
        ({}, None),
    ],
)
def test_car_says_why_it_turns_round(scene, change, cause):
    memory = scene[1]
    said = answer(
        scene, "why do we turn round?", DialogueMove.QUERY_W, ActionValue.U_TURN, memory=replace(memory, **change)
    )
    if cause is None:
        assert said.act.move is DialogueMove.REPLY_U
    else:
        assert said.meaning[0].get("cause").predicate is cause


def test_arrival_that_cannot_be_told_is_answered_so(scene):
    said = answer(scene, "when will we be there?", DialogueMove.QUERY_W)
    assert said.act.move is DialogueMove.REPLY_U


def test_answer_that_follows_from_the_evidence_is_sayable_however_the_question_was_understood(scene):
    view, memory = scene
    bound = replace(memory, goal=LandmarkName.KFC)
    asked = heard(view, "The next stop is the KFC, right?", DialogueMove.CHECK, LandmarkName.KFC)
    said = answer_to(asked, bound, view)
    assert is_sayable(said, "goal", bound, view, asked, said)
    just_said = replace(bound, heard_at=view.time - 2.0).spoken(said, "goal", view, asks=False, asks_way=False)
    assert not is_sayable(said, "goal", just_said, view, asked, said)


@pytest.mark.parametrize(
    "remark",
    [
        intend(Function.ANSWER, Proposition.of(Predicate.BECAUSE, effect=STANDS, cause=TOLD_TO_STOP, at=None)),
        intend(Function.UNCERTAIN_ANSWER),
    ],
)
def test_reason_of_the_corpus_becomes_the_reason_of_the_moment(scene, remark):
    view, memory = scene
    asked = heard(view, "why did we stop?", DialogueMove.QUERY_W, ActionValue.STOP)
    available = sources(replace(memory, goal=LandmarkName.KFC), view, (asked,))
    assert form_of(remark, available) == form_of(available["answer"], available)


def test_no_answer_without_a_question(scene):
    assert answer(scene, "turn left", DialogueMove.INSTRUCT, ActionValue.J_TURN) is None
    assert answer_to(None, scene[1], scene[0]) is None


def test_answer_of_the_corpus_becomes_the_answer_to_another_question(scene):
    view, memory = scene
    before = heard(view, "do you see anybody?", DialogueMove.QUERY_YN, ObjectClass.PEDESTRIAN)
    seen = Proposition.of(Predicate.SEES, object=ObjectClass.PEDESTRIAN)
    form = form_of(intend(Function.AFFIRMATIVE_ANSWER, seen, elided=("object",)), sources(memory, view, (before,)))
    shown = {mark.name for mark in view.landmarks}
    missing = next(name for name in LandmarkName if name not in shown and name.label not in ("Unknown", "Queried"))
    now = heard(view, "", DialogueMove.QUERY_YN, missing)
    said = filled(form, sources(memory, view, (now,)))
    assert said.act.move is DialogueMove.REPLY_N  # no such place is on the map
    assert said.meaning[0].predicate is Predicate.KNOWS


def test_last_remark_is_said_again_where_it_was_not_understood(scene):
    view, memory = scene
    asked = intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED))
    memory = memory.spoken(asked, "goal", view, asks=True, asks_way=False)
    assert said_again(heard(view, "what?", DialogueMove.CONFUSE), memory) == asked
    assert said_again(heard(view, "okay", DialogueMove.ACKNOWLEDGE), memory) is None


@pytest.mark.parametrize("lit", [False, True])
def test_statement_that_the_observation_denies_is_not_sayable(scene, lit):
    view, memory = scene
    said = intend(Function.INFORM, Proposition.of(Predicate.LIGHTS_ON, negated=not lit))
    assert is_sayable(said, "lights_on", memory, view, None) is (lit == view.lights)


def test_reason_that_does_not_hold_is_not_sayable(scene):
    view, memory = scene
    red = Proposition.of(
        Predicate.BECAUSE, effect=STANDS, cause=Proposition.of(Predicate.HINDERS, object=ObjectClass.PEDESTRIAN)
    )
    said = intend(Function.INFORM, red, elided=("effect",), wording=Wording(topic="because"))
    assert not is_sayable(said, "because", memory, view, None)


def test_answer_about_something_else_is_not_sayable(scene):
    view, memory = scene
    asked = heard(view, "when will we be there?", DialogueMove.QUERY_W)
    said = intend(Function.ANSWER, STANDS)
    assert not is_sayable(said, "stands", memory, view, asked)
    time = intend(Function.ANSWER, Proposition.of(Predicate.ARRIVES_IN, place=LandmarkName.KFC, seconds=30))
    assert is_sayable(time, "arrives_in", memory, view, asked)


@pytest.mark.parametrize(
    ("text", "value", "about"),
    [
        ("why did we stop?", ActionValue.STOP, STANDS),
        ("which way now?", ActionValue.QUERIED, act_builders.action(ActionValue.LANE_FOLLOW)),
        ("what street is this?", StreetName.QUERIED, Proposition.of(Predicate.ON_STREET, street=StreetName.BEAL)),
    ],
)
def test_open_question_rules_out_answers_about_something_else(scene, text, value, about):
    view, memory = scene
    asked = heard(view, text, DialogueMove.QUERY_W, value)
    here = street_of(view.raw, memory.town, view.lane)
    answers = (STANDS, act_builders.action(ActionValue.LANE_FOLLOW), Proposition.of(Predicate.ON_STREET, street=here))
    sayable = [
        said.predicate
        for said in answers
        if is_sayable(intend(Function.ANSWER, said), str(said.predicate), memory, view, asked)
    ]
    assert sayable == [about.predicate]


def test_question_is_not_acknowledged_but_an_instruction_is(scene):
    view, memory = scene
    okay = intend(Function.POSITIVE_FEEDBACK)
    asked = heard(view, "why did we stop?", DialogueMove.QUERY_W, ActionValue.STOP)
    told = heard(view, "turn left", DialogueMove.INSTRUCT, ActionValue.J_TURN)
    assert not is_sayable(okay, "Acknowledge", memory, view, asked)
    assert is_sayable(okay, "Acknowledge", memory, view, told)
    assert is_sayable(okay, "Acknowledge", replace(memory, spoke_at=view.time), view, asked)


def test_same_is_not_said_twice_unless_the_participant_spoke_or_time_has_passed(scene):
    view, memory = scene
    asked = intend(Function.SET_QUESTION, act_builders.destination(LandmarkName.QUERIED))
    memory = memory.spoken(asked, "goal", view, asks=True, asks_way=False)
    assert not is_sayable(asked, "goal", memory, view, None)
    assert is_sayable(asked, "goal", replace(memory, heard_at=view.time), view, None)
    earlier = replace(memory, said_at=(("goal", view.time - SAID_AGAIN_AFTER),))
    assert is_sayable(asked, "goal", earlier, view, None)
