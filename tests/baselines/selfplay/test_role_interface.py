from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym import DuoWizardEnv
from dorothie_gym.baselines.selfplay.ad_wizard import AdWizardInterface, AdWizardMacro
from dorothie_gym.baselines.selfplay.co_wizard import CoWizardInterface, ExtraAction
from dorothie_gym.baselines.selfplay.env import SelfPlayEnv
from dorothie_gym.baselines.selfplay.participant import ParticipantInterface, ParticipantMemory, ParticipantPhrase
from dorothie_gym.dialogue import Direction
from dorothie_gym.errors import SettingsError
from dorothie_gym.ontology import AGENT_ROLES, ActionValue, DialogueAct, DialogueMove, Role
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.spaces import ParticipantAction, Speech

NOTHING = np.zeros(3, dtype=np.int64)


@pytest.fixture
def env() -> SelfPlayEnv:
    env = SelfPlayEnv(traffic="none", max_seconds=60.0)
    env.reset(seed=0)
    return env


def test_rows_hold_vectors_and_masks_of_all_roles(env: SelfPlayEnv) -> None:
    rng = np.random.default_rng(1)
    row, _ = env.reset(seed=1)
    refused = []
    for _ in range(120):
        assert env.observation_space.contains(row)
        masks = [env.layout.masks(row[None], role, padded=False)[0] for role in range(3)]
        assert all(mask[0] for mask in masks)  # nothing can always be done
        row, team, *_, info = env.step(np.array([rng.choice(np.flatnonzero(mask)) for mask in masks]))
        refused += [reason for reasons in env.sessions.duo.engines[0].session.refused.values() for reason in reasons]
        assert info["rewards"][0] == info["rewards"][1] == pytest.approx(team)
    assert len(refused) <= 2  # fields are masked one by one; how they combine may still not do


def test_padded_vectors_encode_the_role(env: SelfPlayEnv) -> None:
    row, _ = env.reset(seed=0)
    for role in range(3):
        vectors = env.layout.vectors(row[None], role, padded=True)
        assert vectors.shape == (1, env.layout.padded_size)
        np.testing.assert_array_equal(vectors[0, -3:], np.eye(3)[role])
        mask = env.layout.masks(row[None], role, padded=True)[0]
        assert not mask[env.layout.actions[role] :].any()


def test_co_wizard_remembers_the_direction_of_an_utterance(env: SelfPlayEnv) -> None:
    env.step(np.array([ParticipantPhrase.TURN_LEFT, 0, 0]))
    for _ in range(12):
        env.step(NOTHING)
    heard = env.sessions.players[0].memories[1].heard
    assert heard.act.move is DialogueMove.INSTRUCT and ActionValue.J_TURN in heard.act.slots
    assert heard.direction is Direction.LEFT


def test_co_wizard_can_set_the_named_goal(env: SelfPlayEnv) -> None:
    row, *_ = env.step(np.array([ParticipantPhrase.NAME_GOAL, 0, 0]))
    assert not env.layout.masks(row[None], 1, padded=False)[0][ExtraAction.NOTE_GOAL]
    for _ in range(12):
        row, *_ = env.step(NOTHING)
    assert env.layout.masks(row[None], 1, padded=False)[0][ExtraAction.NOTE_GOAL]
    row, *_ = env.step(np.array([0, ExtraAction.NOTE_GOAL, 0]))
    assert env.sessions.duo.engines[0].session.beliefs.goals == (env.sessions.players[0].memories[0].target.name,)
    assert not env.layout.masks(row[None], 1, padded=False)[0][ExtraAction.NOTE_GOAL]


def test_co_wizard_turns_to_the_exit_of_a_sector() -> None:
    duo = DuoWizardEnv()
    observations, infos = duo.reset(seed=0)
    interface, seen = CoWizardInterface(duo.town, duo.limits), observations["co_wizard"]
    memory = interface.update(seen, interface.initial_memory())
    mask = interface.mask(seen, memory) & interface.permitted(seen, memory, infos["co_wizard"]["action_mask"])
    turns = [
        k for k in np.flatnonzero(mask) if k < len(NavigationAction) and NavigationAction(int(k)).sector is not None
    ]
    assert turns
    for choice in turns:
        physical = interface.act(int(choice), seen, memory)[0].physical
        assert physical is not None and physical.angle in seen["exits"][:, 1]


def test_ad_wizard_waits_between_exceptions() -> None:
    duo = DuoWizardEnv()
    observations, _ = duo.reset(seed=0)
    interface = AdWizardInterface(duo.town, duo.limits)
    seen = dict(observations["ad_wizard"])
    assert interface.mask(seen, interface.initial_memory()).sum() == 1  # not at once
    seen["time"] = np.array([40.0])
    assert interface.mask(seen, interface.initial_memory())[AdWizardMacro.FOG]
    _, memory = interface.act(AdWizardMacro.FOG, seen, interface.initial_memory())
    seen["time"] = np.array([60.0])
    assert np.flatnonzero(interface.mask(seen, memory)).tolist() == [AdWizardMacro.NOTHING]


def test_participant_has_the_first_subgoal_and_its_route() -> None:
    duo = DuoWizardEnv()
    observations, _ = duo.reset(seed=0)
    interface, seen = ParticipantInterface(duo.town, duo.limits), observations["participant"]
    target = interface.update(seen, interface.initial_memory()).target
    assert target is not None and target.route.left(float(seen["station"][0])) > 0.0
    assert seen["subgoals"][target.subgoal, 0] == 1.0


def test_scripted_ad_wizard_ignores_chosen_actions() -> None:
    env = SelfPlayEnv(max_seconds=60.0, scripted=[Role.AD_WIZARD])
    env.reset(seed=3)
    for _ in range(119):
        _, _, terminated, truncated, _ = env.step(np.array([0, 0, AdWizardMacro.NOTHING]))
    assert not (terminated or truncated)
    *_, truncated, info = env.step(NOTHING)
    assert truncated and info["is_success"] is False
    assert env.sessions.duo.engines[0].summary()["exceptions"] > 0


def test_actions_are_mapped_back_to_their_numbers(env: SelfPlayEnv) -> None:
    rng = np.random.default_rng(2)
    read = [set[int](), set[int](), set[int]()]
    row, _ = env.reset(seed=2)
    for _ in range(119):
        choices = np.zeros(3, dtype=np.int64)
        for k, (role, interface) in enumerate(zip(AGENT_ROLES, env.sessions.interfaces, strict=True)):
            choices[k] = rng.choice(np.flatnonzero(env.layout.masks(row[None], k, padded=False)[0]))
            seen, memory = env.sessions.observation(role, 0), env.sessions.players[0].memories[k]
            done, _ = interface.act(int(choices[k]), seen, memory)
            found = interface.choice_of(done, seen, memory)
            assert found == choices[k] or done == type(done)()  # a turn that is planned already is asked for by nothing
            read[k].add(found)
        row, *_ = env.step(choices)
    assert [len(numbers) for numbers in read] > [11, 12, 3]


@pytest.mark.parametrize(
    ("act", "text", "phrase"),
    [
        (
            DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.J_TURN),
            "could you take a right at the lights",
            ParticipantPhrase.TURN_RIGHT,
        ),
        (DialogueAct.of(DialogueMove.REPLY_W, ActionValue.J_TURN), "Left, I think.", ParticipantPhrase.TURN_LEFT),
        (
            DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.U_TURN),
            "we have to turn around",
            ParticipantPhrase.TURN_ROUND,
        ),
        (DialogueAct.of(DialogueMove.REPLY_N), "Not at all.", ParticipantPhrase.NO),
        (DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.SPEED_CHANGE), "a bit slower", ParticipantPhrase.NOTHING),
    ],
)
def test_utterances_are_mapped_to_phrases(
    env: SelfPlayEnv, act: DialogueAct, text: str, phrase: ParticipantPhrase
) -> None:
    said = ParticipantAction(speech=Speech(act=act, text=text))
    assert (
        ParticipantInterface(env.sessions.town, env.sessions.duo.limits).choice_of(said, {}, ParticipantMemory())
        is phrase
    )


def test_scripted_roles_reach_all_subgoals_and_ignore_chosen_actions() -> None:
    env = SelfPlayEnv(max_seconds=900.0, scripted=AGENT_ROLES)
    env.reset(seed=0)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = env.step(
            np.array([ParticipantPhrase.STOP, NavigationAction.STOP, AdWizardMacro.FOG])
        )
        ended = terminated or truncated
    assert info["is_success"]
    env.sessions.players[0].scripted = ()
    env.reset(seed=0)
    for _ in range(120):
        env.step(NOTHING)
    assert env.sessions.duo.engines[0].summary()["exceptions"] == 0


def test_invalid_actions_and_arguments_are_refused(env: SelfPlayEnv) -> None:
    with pytest.raises(ValueError, match=f"action of {Role.AD_WIZARD} is 99"):
        env.step(np.array([0, 0, 99]))
    with pytest.raises(SettingsError, match="traffic"):
        SelfPlayEnv(traffic="jam")
    with pytest.raises(SettingsError, match="atlantis"):
        SelfPlayEnv(town="atlantis")
