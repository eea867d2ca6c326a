import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology import ActionValue, Role, Slot
from dorothie_gym.policies import ScriptedParticipant
from dorothie_gym.policies.participant.config import ParticipantStyle
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import ParticipantAction
from tests.policies.walk import play

BY_GOALS = ParticipantStyle(guides=0.0, names_street=0.5, hurries=1.0, patience=10.0, chat=1e4)
BY_STEPS = ParticipantStyle(guides=1.0, names_street=0.0, hurries=1.0, patience=10.0, chat=1e4)


def orders(style: ParticipantStyle) -> list[list[str]]:
    """Returns the slots of each instruction of the first 40 seconds."""
    played = play(4, decisions=80, policies={"participant": ScriptedParticipant(style=style)})
    said = [e.data for e in played.events if e.type == "DialogueMove" and e.source is Role.PARTICIPANT]
    return [sorted(act["slots"]) for act in said if act["move"] == "Instruct"]


def test_guidance_level_determines_what_follows_the_destination() -> None:
    by_goals, by_steps = orders(BY_GOALS), orders(BY_STEPS)
    assert "Landmark" in by_goals[0] and "Landmark" in by_steps[0]
    assert not any("Action" in slots for slots in by_goals)
    assert any("Action" in slots for slots in by_steps)


@pytest.mark.parametrize("seed", [0, 1])
def test_tasks_are_done_by_dialogue(seed):
    played = play(seed, names={"ad_wizard": "silent"})
    assert played.env.summary()["arrived"]
    assert "Complete" in {
        value for e in played.events if e.type == "DialogueMove" for value in e.data["slots"].get("Status", [])
    }


def test_tasks_are_done_without_observed_acts():
    played = play(1, names={"ad_wizard": "silent"}, config=EnvConfig(observe_acts=False))
    assert played.env.summary()["arrived"]


def test_silent_car_reaches_nothing():
    played = play(0, decisions=200, names={"co_wizard": "silent", "ad_wizard": "silent"})
    assert played.env.summary()["subgoals"]["reached"] == 0
    assert played.moves(Role.PARTICIPANT).count("Instruct") >= 2


def test_number_of_utterances_is_limited():
    played = play(0, decisions=240, names={"co_wizard": "silent", "ad_wizard": "silent"})
    assert len(played.moves(Role.PARTICIPANT)) < 25


def test_equal_seeds_give_equal_sessions():
    first, second = play(5, decisions=160), play(5, decisions=160)
    for a, b in zip(first.actions, second.actions, strict=True):
        for role in a:
            assert all(np.array_equal(a[role][key], b[role][key]) for key in a[role])


@pytest.mark.parametrize("lit", [True, False])
def test_standstill_at_red_light_is_not_asked_about(lit):
    env = DuoWizardEnv(town="brookside")
    observations, _ = env.reset(seed=3)
    policy = ScriptedParticipant(env.limits, style=BY_GOALS)
    state = policy.initial_state(3, env.town)
    lane = next(lane for lane in env.town.lanes if env.town.exits(lane.id) and is_dark(env.town, lane) is not lit)
    observation = dict(observations["participant"])
    begin = next(t for t in range(200) if turned_red(env.town, lane.id, t)) if lit else 0
    asked = 0
    for k in range(60):
        time = begin + 0.5 * k
        if lit and env.town.light(lane.id, time) is not LightColour.RED:
            break
        observation |= {
            "time": np.array([time]),
            "speed": np.zeros(1),
            "lane": np.int64(lane.id),
            "station": np.array([lane.length - 4.0]),
            "pose": np.array([*lane.position(lane.length - 4.0), lane.heading_at(lane.length - 4.0)]),
        }
        action, state = policy.step(observation, state)
        speech = ParticipantAction.decode(action, env.limits).speech
        asked += speech is not None and ActionValue.STOP in speech.act.values(Slot.ACTION)
    assert k > 30
    assert (asked == 0) is lit


def is_dark(town, lane):
    return town.light(lane.id, 0.0) is None


def turned_red(town, lane, time):
    return town.light(lane, time) is LightColour.RED and town.light(lane, time - 1.0) is not LightColour.RED
