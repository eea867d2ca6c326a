import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, Wording, word_act
from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    PhysicalAction,
    Role,
)
from dorothie_gym.policies import ScriptedCoWizard
from dorothie_gym.spaces import NO_MOVE, CoWizardAction, ParticipantAction, Speech, noop


class Talk:
    """A human of the test's own in front of the scripted Co-Wizard."""

    def __init__(self, seed: int = 2, acts: bool = True) -> None:
        self.env = DuoWizardEnv(town="brookside", config=EnvConfig(observe_acts=acts))
        self.observations, _ = self.env.reset(seed=seed)
        self.policy = ScriptedCoWizard(self.env.limits)
        self.state = self.policy.initial_state(seed, self.env.town)
        self.actions: list[CoWizardAction] = []

    def step(self, speech: Speech | None = None) -> CoWizardAction:
        limits = self.env.limits
        action, self.state = self.policy.step(self.observations["co_wizard"], self.state)
        self.observations, *_ = self.env.step(
            {
                "participant": ParticipantAction(speech=speech).encode(limits),
                "co_wizard": action,
                "ad_wizard": noop(Role.AD_WIZARD, limits),
            }
        )
        self.actions.append(CoWizardAction.decode(action, limits))
        return self.actions[-1]

    def say(self, move: DialogueMove, *values, wording: Wording | None = None, decisions: int = 12) -> None:
        act = DialogueAct.of(move, *values)
        text = word_act(act, Role.PARTICIPANT, np.random.default_rng(0), wording or Wording())
        self.step(Speech(act=act, text=text))
        for _ in range(decisions):
            self.step()

    def physical(self) -> list[PhysicalAction]:
        return [action.physical.action for action in self.actions if action.physical]

    def moves(self) -> list[DialogueMove]:
        return [action.speech.act.move for action in self.actions if action.speech]

    def landmarks(self, hidden: bool):
        return [mark for mark in self.env.scenario.storyboard.landmarks if mark.hidden is hidden]


def test_a_known_place_becomes_the_goal_with_a_plan():
    talk = Talk()
    name = next(mark.name for mark in talk.landmarks(hidden=False) if mark.name.label in ("KFC", "Ikea", "Coco"))
    talk.say(DialogueMove.INSTRUCT, name)
    assert talk.state.goal is name and talk.state.exact and talk.state.journey is not None
    assert talk.state.plan


def test_a_place_that_is_not_on_the_map_is_said_to_be_unknown():
    talk = Talk()
    hidden = talk.landmarks(hidden=True)[0]
    street = talk.env.scenario.street_names[hidden.street]
    talk.say(DialogueMove.INSTRUCT, hidden.name, street)
    said = [action.speech.act for action in talk.actions if action.speech]
    assert any(GoalStatus.UNKNOWN in act.slots and hidden.name in act.slots for act in said)


@pytest.mark.parametrize("acts", [True, False])
def test_stop_is_obeyed_whether_acts_are_seen_or_only_words(acts):
    talk = Talk(acts=acts)
    for _ in range(4):
        talk.step()
    talk.say(DialogueMove.INSTRUCT, ActionValue.STOP)
    assert PhysicalAction.STOP in talk.physical()


def test_the_way_is_asked_for_at_a_junction_without_a_plan():
    talk = Talk()
    for _ in range(60):
        talk.step()
    assert DialogueMove.QUERY_W in talk.moves()
    assert PhysicalAction.J_TURN not in talk.physical()


def test_a_direction_becomes_a_turn_that_way():
    talk = Talk()
    for _ in range(40):
        talk.step()
    choice = talk.env.town.exits(int(talk.observations["participant"]["lane"]))
    side = next(way for way in choice if way.type.value in ("left", "right"))
    talk.say(DialogueMove.REPLY_W, ActionValue.J_TURN, wording=Wording(direction=Direction(side.type.value)))
    turns = [a.physical for a in talk.actions if a.physical and a.physical.action is PhysicalAction.J_TURN]
    assert turns and np.sign(turns[0].angle) == np.sign(side.angle)


def test_lights_and_speed_are_changed_on_request():
    talk = Talk()
    talk.say(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE, wording=Wording(lights=True))
    talk.say(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=Wording(faster=False, speed=25))
    assert int(talk.observations["co_wizard"]["lights"]) == 1
    assert talk.observations["co_wizard"]["cruise_speed"][0] == 25.0


def test_a_step_leaves_the_state_it_was_given_as_it_was():
    talk = Talk()
    before = dict(vars(talk.state))
    observation = dict(talk.observations["co_wizard"])
    first, _ = talk.policy.step(observation, talk.state)
    second, _ = talk.policy.step(observation, talk.state)
    assert vars(talk.state) == before
    assert all(np.array_equal(first[key], second[key]) for key in first)
    assert first["move"] <= NO_MOVE
