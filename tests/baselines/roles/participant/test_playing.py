"""What the learned participant keeps and reads while it plays, whatever its weights are."""

import numpy as np
import pytest
import torch

from dorothie_gym.baselines.roles.learned_role.decision import Attention
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, UTTERANCE_SIZE, Utterance
from dorothie_gym.baselines.roles.participant.decision import choosing_inputs, perceive
from dorothie_gym.baselines.roles.participant.demonstrations import Pupil
from dorothie_gym.baselines.roles.participant.features import ERRAND_SIZE, STATE_SIZE, answer_to
from dorothie_gym.baselines.roles.participant.memory import AVERAGE, NotedEvent, SessionMemory, TargetChoice
from dorothie_gym.baselines.roles.participant.network import ParticipantLayout, ParticipantNetwork
from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant
from dorothie_gym.baselines.roles.participant.remarks import STOP_FORM, form_of
from dorothie_gym.baselines.roles.participant.teacher import Teacher
from dorothie_gym.dialogue import CommunicativeFunction as Function
from dorothie_gym.dialogue import Direction, Wording, guess_spans, load_lexicon, understand
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, MentalAction, Role
from dorothie_gym.policies import ScriptedAdWizard, ScriptedCoWizard, act_builders
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.heard_utterance import HeardUtterance
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.policy import policy_inputs
from dorothie_gym.policies.speech import intend
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import CoWizardAction, SpaceLimits, observation_space

GUIDE, DRIVER, ADVERSARY = Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD
SEED = 21
UPDATES = ("mental", "plan", "goals", "landmark", "status", "lane", "metres")
"""Fields of the Co-Wizard's action with which it updates its beliefs."""


def vocabulary():
    goal = intend(Function.REQUEST, act_builders.destination(LandmarkName.KFC))
    turn = order(DialogueMove.INSTRUCT, ActionValue.J_TURN, Wording(direction=Direction.LEFT))
    step = {"manoeuvre": ActionValue.J_TURN, "turn": Direction.LEFT}
    return ("", STOP_FORM, form_of(goal, {"goal": LandmarkName.KFC}), form_of(turn, step))


def player(limits):
    torch.manual_seed(1)
    words = vocabulary()
    return LearnedParticipant(ParticipantNetwork(ParticipantLayout.of(len(words))), words, limits)


class Recorded(dict):
    """Observation that notes which fields are read."""

    def __init__(self, content, read):
        super().__init__(content)
        self.read = read

    def __getitem__(self, name):
        self.read.add(name)
        return super().__getitem__(name)

    def get(self, name, default=None):
        self.read |= {name} & self.keys()  # fields of other settings may be asked for
        return super().get(name, default)


def play(guide, *, others=(), read=None, decisions=160):
    """Plays a session; returns the actions of all roles at each decision.

    Args:
        guide: the participant.
        others: actions of the other roles at each decision; empty for the scripted ones.
        read: receives the names of the fields that the participant reads.
        decisions: number of decisions.
    """
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=120.0))
    engine.reset(seed=SEED)
    policies = {GUIDE: guide}
    if not others:
        policies |= {DRIVER: ScriptedCoWizard(engine.limits), ADVERSARY: ScriptedAdWizard(engine.limits)}
    states = {role: one.initial_state(policy_seed(SEED, role), engine.town) for role, one in policies.items()}
    found = []
    for k in range(decisions):
        inputs, actions = policy_inputs(engine, policies), dict(others[k]) if others else {}
        if read is not None:
            inputs[GUIDE] = Recorded(inputs[GUIDE], read)
        for role, one in policies.items():
            actions[str(role)], states[role] = one.step(inputs[role], states[role])
        found.append(actions)
        engine.step(actions)
    return found


def without_updates(actions, limits):
    """Returns the actions of the other roles, those of the Co-Wizard without what it thinks of route and errands.

    Goals and places stay: the car slows down for a goal, which everybody sees.
    """
    blank, driven = CoWizardAction().encode(limits), actions[str(DRIVER)]
    mental = CoWizardAction.decode(driven, limits).mental
    hidden = mental is not None and mental.action in (MentalAction.PLAN_UPDATE, MentalAction.STATUS_UPDATE)
    quiet = {**driven, **{name: blank[name] for name in UPDATES}} if hidden else driven
    return {str(DRIVER): quiet, str(ADVERSARY): actions[str(ADVERSARY)]}


def test_participant_does_the_same_whatever_the_car_thinks():
    limits = SpaceLimits()
    shown = play(player(limits))
    others = [without_updates(actions, limits) for actions in shown]
    assert any(
        one[str(DRIVER)]["mental"] != other[str(DRIVER)]["mental"] for one, other in zip(shown, others, strict=True)
    )
    hidden = play(player(limits), others=others)
    mine, again = ([actions[str(GUIDE)] for actions in played] for played in (shown, hidden))
    assert any(one["move"] for one in mine)
    for one, other in zip(mine, again, strict=True):
        assert one.keys() == other.keys()
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_participant_reads_only_fields_of_its_own_observation():
    read = set()
    play(player(SpaceLimits()), read=read, decisions=40)
    assert {"subgoals", "landmarks", "co_wizard_text"} <= read
    assert read <= set(observation_space(GUIDE, SpaceLimits()).spaces)


def test_state_and_errands_have_the_lengths_that_the_network_takes():
    engine = SessionEngine("midtown", config=EnvConfig(max_seconds=60.0))
    engine.reset(seed=3)
    observation = engine.observations.of([GUIDE])[str(GUIDE)]
    inputs = choosing_inputs(perceive(observation, Attention(memory=SessionMemory.begin(engine.town, 3))))
    assert inputs.state.shape == (STATE_SIZE + KEPT * UTTERANCE_SIZE,)
    assert inputs.options.shape[1] == ERRAND_SIZE and inputs.rows
    assert np.isfinite(inputs.state).all()


def test_memory_beside_the_teacher_has_its_target_and_notes_what_is_done():
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=300.0))
    engine.reset(seed=4)
    town, limits = engine.town, engine.limits
    others = {DRIVER: ScriptedCoWizard(limits), ADVERSARY: ScriptedAdWizard(limits)}
    states = {role: one.initial_state(policy_seed(4, role), town) for role, one in others.items()}
    teacher = Teacher(town, limits, policy_seed(4, GUIDE), AVERAGE)
    pupil, examples, reached = Pupil(town, 4, teacher), [], 0
    while not engine.over and not reached:
        inputs, actions = policy_inputs(engine, others), {}
        for role, one in others.items():
            actions[str(role)], states[role] = one.step(inputs[role], states[role])
        percept, memory, lesson = pupil.decide(engine.observations.of([GUIDE])[str(GUIDE)], examples.append)
        assert memory.records.task.target == lesson.target
        pupil.follow(percept, memory, lesson)
        actions[str(GUIDE)] = lesson.action
        reached = percept.memory.event(NotedEvent.DONE) is not None
        engine.step(actions)
    assert reached
    assert any(one.target > 0 for one in examples)
    assert {one.guides for one in examples} <= {False, True}


@pytest.mark.parametrize(("text", "yes"), [("Are we at {goal}?", False), ("You mean {goal}, right?", True)])
def test_answer_follows_from_what_the_participant_knows(text, yes):
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=60.0))
    engine.reset(seed=5)
    percept = perceive(
        engine.observations.of([GUIDE])[str(GUIDE)], Attention(memory=SessionMemory.begin(engine.town, 5))
    )
    first = next(one.index for one in percept.view.subgoals if one.open and one.allowed)
    memory = percept.memory.chosen(TargetChoice(target=first), percept.view, percept.rng)
    name = load_lexicon().forms(memory.records.task.goal.name, "say")[0]
    words = text.format(goal=name)
    acts = tuple(span.act for span in guess_spans(words))
    asked = Utterance(time=percept.view.time, heard=HeardUtterance(acts=acts, words=understand(words)))
    assert answer_to(memory, percept.view, asked) is yes
