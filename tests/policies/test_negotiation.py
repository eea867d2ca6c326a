from dataclasses import replace

import pytest

from dorothie_gym.dialogue import Wording
from dorothie_gym.maps.routing import router
from dorothie_gym.ontology import DialogueAct, DialogueMove, GoalStatus, LandmarkName, Slot, StreetName
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.route_progress import first_new_street
from dorothie_gym.session.spaces import Speech
from tests.policies.test_co_wizard import Talk
from tests.policies.test_repairs import Human

M = DialogueMove


def driving_far() -> tuple[Talk, LandmarkName, LandmarkName]:
    """Returns a car on its way to the farther of two places, and both names."""
    talk = Talk(seed=2)
    talk.state = replace(talk.state, style=replace(talk.state.style, offers=1.0, mishears=0.0, checks=0.0))
    here = int(talk.observations["co_wizard"]["lane"]), float(talk.observations["co_wizard"]["station"][0])
    marks = {mark.name: mark for mark in talk.landmarks(hidden=False)}
    lengths = {
        name: route.length
        for name, mark in marks.items()
        if (route := router(talk.env.town).route(here, (mark.lane, mark.station))) is not None
    }
    near, far = min(lengths, key=lengths.__getitem__), max(lengths, key=lengths.__getitem__)
    talk.say(M.INSTRUCT, far, decisions=4)
    assert talk.state.beliefs.goal is far
    return talk, near, far


def said_about(talk: Talk, move: DialogueMove, name: LandmarkName) -> bool:
    return any(a.speech and a.speech.act.move is move and name in a.speech.act.slots for a in talk.actions)


def statuses(state: CoWizardState) -> dict[LandmarkName, GoalStatus]:
    return dict(state.beliefs.statuses)


@pytest.mark.parametrize(("answer", "accepted"), [(M.REPLY_Y, True), (M.REPLY_N, False)])
def test_nearer_task_is_offered_first_and_answer_is_followed(answer, accepted):
    talk, near, far = driving_far()
    talk.say(M.INSTRUCT, near, GoalStatus.PENDING, decisions=14)
    assert said_about(talk, M.QUERY_YN, near)
    talk.say(answer, decisions=4)
    assert talk.state.beliefs.goal is (near if accepted else far)
    assert statuses(talk.state)[far] is (GoalStatus.PENDING if accepted else GoalStatus.ONGOING)


def test_replaced_later_task_does_not_change_goal():
    talk, near, far = driving_far()
    talk.state = replace(talk.state, style=replace(talk.state.style, offers=0.0))
    talk.say(M.INSTRUCT, near, GoalStatus.PENDING, decisions=14)
    other = next(name for name in (LandmarkName.COCO, LandmarkName.SHELL) if name not in (near, far))
    talk.state.speech = talk.state.speech.cleared()
    wording = Wording(topic="changed_later", dropped=near)
    talk.say(M.INSTRUCT, near, other, GoalStatus.ABANDONED, GoalStatus.PENDING, wording=wording, decisions=16)
    assert talk.state.beliefs.goal is far
    assert statuses(talk.state)[near] is GoalStatus.ABANDONED
    assert statuses(talk.state)[other] is GoalStatus.PENDING


@pytest.mark.parametrize("agrees", [True, False])
def test_participant_accepts_own_detour_and_insists_on_it_otherwise(agrees):
    human = Human()
    own = first_new_street(human.observation, human.env.town, human.view.lane, human.state.route.progress)
    assert own is not None
    other = next(name for name in StreetName if name not in (own, StreetName.UNKNOWN, StreetName.QUERIED))
    human.hears(M.QUERY_YN, own if agrees else other)
    assert human.moves() == ([M.REPLY_Y] if agrees else [M.REPLY_N, M.INSTRUCT])
    if not agrees:
        assert own in human.state.speech.queue[1].act.values(Slot.STREET)


def test_unanswered_question_is_followed_by_confusion():
    talk, _, _ = driving_far()
    talk.state.dialogue = talk.state.dialogue.after_asking(float(talk.observations["co_wizard"]["time"][0]))
    talk.step(Speech(act=DialogueAct.of(M.REPLY_W), text="hm hm"))
    for _ in range(6):
        talk.step()
    assert M.CONFUSE in talk.moves()


def test_order_of_tasks_is_answered():
    human = Human()
    human.hears(M.QUERY_W, human.state.task.goal.name, wording=Wording(topic="order"))
    first, *others = human.state.speech.queue
    assert first.act.move is M.REPLY_W
    assert all(human.state.task.goal.name in item.act.slots for item in others)
