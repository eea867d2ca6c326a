import numpy as np
import pytest

from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ScriptedParticipant
from dorothie_gym.policies.participant.mind import Style
from tests.policies.walk import play

BY_GOALS = Style(guides=0.0, names_goal=1.0, names_street=0.5, hurries=1.0, patience=10.0, chat=1e4)
BY_STEPS = Style(guides=1.0, names_goal=0.0, names_street=0.0, hurries=1.0, patience=10.0, chat=1e4)


def first_words(style: Style) -> str:
    played = play(4, decisions=16, policies={"participant": ScriptedParticipant(style=style)})
    said = [e for e in played.events if e.type == "DialogueMove" and e.source is Role.PARTICIPANT]
    return str(said[0].data["slots"])


def test_goal_level_participants_name_a_place_and_step_level_ones_an_action():
    assert "Landmark" in first_words(BY_GOALS)
    assert "Action" in first_words(BY_STEPS)


@pytest.mark.parametrize("seed", [0, 1])
def test_tasks_are_done_by_talk(seed):
    played = play(seed, names={"ad_wizard": "silent"})
    assert played.env.summary()["arrived"]
    assert "Complete" in {
        value for e in played.events if e.type == "DialogueMove" for value in e.data["slots"].get("Status", [])
    }


def test_tasks_are_done_where_acts_are_not_seen():
    played = play(1, names={"ad_wizard": "silent"}, config=EnvConfig(observe_acts=False))
    assert played.env.summary()["arrived"]


def test_nothing_is_reached_without_a_car_that_listens():
    played = play(0, decisions=200, names={"co_wizard": "silent", "ad_wizard": "silent"})
    assert played.env.summary()["subgoals"]["reached"] == 0
    assert played.moves(Role.PARTICIPANT).count("Instruct") >= 2


def test_utterances_do_not_pour_out():
    played = play(0, decisions=240, names={"co_wizard": "silent", "ad_wizard": "silent"})
    assert len(played.moves(Role.PARTICIPANT)) < 25


def test_same_seed_same_session():
    first, second = play(5, decisions=160), play(5, decisions=160)
    for a, b in zip(first.actions, second.actions, strict=True):
        for role in a:
            assert all(np.array_equal(a[role][key], b[role][key]) for key in a[role])
