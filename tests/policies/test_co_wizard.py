from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Direction, Wording, word_act
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    ObjectClass,
    PhysicalAction,
    Role,
    Slot,
    StreetName,
)
from dorothie_gym.policies import ScriptedCoWizard
from dorothie_gym.policies.co_wizard.intentions import Wish
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import NO_MOVE, CoWizardAction, ParticipantAction, Speech, noop
from dorothie_gym.sim.state.codes import Motion


class Talk:
    """Session of the scripted Co-Wizard with a participant controlled by the test."""

    def __init__(self, seed: int = 2, acts: bool = True) -> None:
        self.env = DuoWizardEnv(town="brookside", config=EnvConfig(observe_acts=acts, word_error_rate=0.0))
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


def test_known_place_becomes_goal_with_plan():
    talk = Talk()
    name = next(mark.name for mark in talk.landmarks(hidden=False) if mark.name.label in ("KFC", "Ikea", "Coco"))
    talk.say(DialogueMove.INSTRUCT, name)
    assert talk.state.beliefs.goal is name and talk.state.beliefs.exact and talk.state.route.progress is not None
    assert talk.state.beliefs.plan


def test_place_off_the_map_is_reported_unknown():
    talk = Talk()
    hidden = talk.landmarks(hidden=True)[0]
    street = talk.env.scenario.street_names[hidden.street]
    talk.say(DialogueMove.INSTRUCT, hidden.name, street)
    said = [action.speech.act for action in talk.actions if action.speech]
    assert any(GoalStatus.UNKNOWN in act.slots and hidden.name in act.slots for act in said)


@pytest.mark.parametrize("acts", [True, False])
def test_stop_is_obeyed_with_and_without_observed_acts(acts):
    talk = Talk(acts=acts)
    for _ in range(4):
        talk.step()
    talk.say(DialogueMove.INSTRUCT, ActionValue.STOP)
    assert PhysicalAction.STOP in talk.physical()


def test_way_is_asked_for_at_junction_without_plan():
    talk = Talk()
    for _ in range(60):
        talk.step()
    assert DialogueMove.QUERY_W in talk.moves()
    assert PhysicalAction.J_TURN not in talk.physical()


def test_direction_becomes_turn():
    talk = Talk()
    for _ in range(40):
        talk.step()
    choice = talk.env.town.exits(int(talk.observations["participant"]["lane"]))
    side = next(way for way in choice if way.type.value in ("left", "right"))
    talk.say(DialogueMove.REPLY_W, ActionValue.J_TURN, wording=Wording(direction=Direction(side.type.value)))
    turns = [a.physical for a in talk.actions if a.physical and a.physical.action is PhysicalAction.J_TURN]
    assert turns and np.sign(turns[0].angle) == np.sign(side.angle)


def test_lights_and_speed_change_on_request():
    talk = Talk()
    talk.say(DialogueMove.INSTRUCT, ActionValue.LIGHT_CHANGE, wording=Wording(lights=True))
    talk.say(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE, wording=Wording(faster=False, speed=25))
    assert int(talk.observations["co_wizard"]["lights"]) == 1
    assert talk.observations["co_wizard"]["cruise_speed"][0] == 25.0


def test_step_does_not_change_given_state():
    talk = Talk()
    before = dict(vars(talk.state))
    observation = dict(talk.observations["co_wizard"])
    first, _ = talk.policy.step(observation, talk.state)
    second, _ = talk.policy.step(observation, talk.state)
    assert vars(talk.state) == before
    assert all(np.array_equal(first[key], second[key]) for key in first)
    assert first["move"] <= NO_MOVE


def test_red_light_is_explained_without_u_turn_or_question():
    talk = Talk()
    talk.say(DialogueMove.INSTRUCT, talk.landmarks(hidden=False)[0].name)
    assert talk.state.route.progress is not None
    way, mentions = talk.state.route.progress.route, 0
    for seed in range(16):
        observation, state = dict(talk.observations["co_wizard"]), talk.state
        state = replace(state, seed=seed, dialogue=replace(state.dialogue, hazard_explained_at=-100.0))
        observation |= {
            "motion": np.int64(Motion.HAZARD),
            "hazard": np.int64(ObjectClass.TRAFFIC_LIGHT.value),
            "hazard_distance": np.array([1.5]),
            "speed": np.zeros(1),
        }
        for _ in range(80):
            observation["time"] = observation["time"] + 0.5
            action, state = talk.policy.step(observation, state)
            done = CoWizardAction.decode(action, talk.env.limits)
            allowed = (PhysicalAction.J_TURN, PhysicalAction.STOP)  # the turn is planned for afterwards
            assert done.physical is None or done.physical.action in allowed
            mentions += done.speech is not None and ObjectClass.TRAFFIC_LIGHT in done.speech.act.values(Slot.OBJECT)
        assert state.route.progress is not None
        assert state.route.progress.route == way
        assert not state.intentions.halted
    assert mentions > 0


def test_wish_is_kept_at_red_light():
    talk = Talk()
    talk.say(DialogueMove.INSTRUCT, ActionValue.U_TURN, decisions=0)
    observation, state = dict(talk.observations["co_wizard"]), talk.state
    until = float(observation["time"][0]) + 5.0
    state = replace(state, intentions=state.intentions.switching(Wish.SWITCH_LEFT, until))
    observation |= {"other_speaking": np.zeros(1, dtype=np.int8)}
    observation |= {"motion": np.int64(Motion.HAZARD), "hazard": np.int64(ObjectClass.TRAFFIC_LIGHT.value)}
    for _ in range(100):
        observation["time"] = observation["time"] + 0.5
        _, state = talk.policy.step(observation, state)
    assert state.intentions.wish is Wish.SWITCH_LEFT
    observation |= {"motion": np.int64(Motion.DRIVING), "hazard": np.int64(0)}
    for _ in range(40):
        observation["time"] = observation["time"] + 0.5
        _, state = talk.policy.step(observation, state)
    assert state.intentions.wish is None


def test_proposed_way_is_taken_after_yes():
    talk = Talk(seed=3)
    talk.state = replace(talk.state, style=replace(talk.state.style, proposes=1.0))
    named = tuple(name for name in StreetName if name not in (StreetName.UNKNOWN, StreetName.QUERIED))
    while talk.state.dialogue.proposed is None:
        assert len(talk.actions) < 60
        talk.state = replace(talk.state, beliefs=replace(talk.state.beliefs, streets=named))  # a reason to propose
        talk.step()
    proposed = talk.state.dialogue.proposed
    talk.say(DialogueMove.REPLY_Y, decisions=4)
    assert talk.state.dialogue.proposed is None
    assert talk.state.intentions.directive == proposed


def test_misheard_instruction_is_queried_and_not_carried_out():
    talk = Talk()
    talk.state = replace(talk.state, style=replace(talk.state.style, mishears=1.0))
    known = talk.landmarks(hidden=False)[0]
    talk.say(DialogueMove.INSTRUCT, known.name, decisions=8)
    assert DialogueMove.CONFUSE in talk.moves()
    assert talk.state.beliefs.goal is None


def test_described_place_is_searched_for_in_its_street():
    talk = Talk()
    hidden = talk.landmarks(hidden=True)[0]
    street = talk.env.scenario.street_names[hidden.street]
    talk.state = replace(talk.state, style=replace(talk.state.style, mishears=0.0))
    talk.say(DialogueMove.INSTRUCT, hidden.name)
    talk.say(DialogueMove.EXPLAIN, street, wording=Wording(topic="where"), decisions=6)
    assert talk.state.route.progress is not None and not talk.state.beliefs.exact
    assert talk.env.scenario.street_names[talk.env.town.lanes[talk.state.route.progress.goal[0]].street] is street


def test_explained_action_counts_as_instruction():
    talk = Talk()
    wording = Wording(direction=Direction.LEFT)
    talk.say(DialogueMove.EXPLAIN, ActionValue.J_TURN, wording=wording, decisions=5)
    assert talk.state.intentions.directive is not None and talk.state.intentions.directive.direction is Direction.LEFT
