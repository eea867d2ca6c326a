"""Checks that a policy, a recorded session or a town keeps its contract."""

from __future__ import annotations

import copy
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from dorothie_gym.archive.comparison import first_difference
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout.replay import resimulate
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.lint import check_town as town_faults
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy import AnyPolicy, Policy, policy_inputs
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.session import Session
from dorothie_gym.testing.playing import first_unequal, play_scripted

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.actions import ActionDict
    from dorothie_gym.session.spaces.observations import ObservationMapping
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

State = TypeVar("State")


def check_policy(
    policy: AnyPolicy,
    *,
    town: str | Path | Town = "brookside",
    seed: int = 0,
    decisions: int = 60,
    config: EnvConfig | None = None,
) -> None:
    """Checks that a policy is stateless, deterministic and acts within its action space.

    The policy plays its role against the scripted policies of the others. At each decision its action must lie in the
    role's action space and be decodable; `step` must change neither the observation (with the action mask, if the
    policy reads it) nor the state that it is given, and must return the same action when it is called again with them.
    The same session played again, interleaved with a second one by the same policy object, must give the same actions.

    Args:
        policy: policy of any role.
        town: name, file or `Town` to play in.
        seed: seed of the session; the second session has the next seed.
        decisions: maximum number of decisions.
        config: config of the environment.

    Raises:
        AssertionError: the contract is broken; the message names the rule and the decision.
        ValueError: the policy's action is malformed; the message names the field.
    """
    env = DuoWizardEnv(town, config=config)
    other = DuoWizardEnv(env.town, config=config)
    alone = list(_Run(policy, env, seed, strict=True).play(decisions))
    assert alone, "the session ended before the first decision"
    run, second = _Run(policy, env, seed), _Run(policy, other, seed + 1)
    interleaved = []
    for _ in range(len(alone)):
        interleaved += list(run.play(1))
        list(second.play(1))
    for k, (one, again) in enumerate(zip(alone, interleaved, strict=True)):
        field = first_unequal(one, again)
        assert field is None, (
            f"decision {k}: {field} of the action differs when the policy plays a second session in between; "
            "whatever a policy remembers belongs into its state"
        )


class _Run:
    """A session in which the policy plays its role and scripts play the others."""

    def __init__(self, policy: AnyPolicy, env: DuoWizardEnv, seed: int, *, strict: bool = False) -> None:
        self._env, self._strict, self._role = env, strict, policy.role
        self._policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
        self._policies[policy.role] = policy
        env.reset(seed=seed)
        self._states: dict[Role, object] = {
            role: played.initial_state(seed, env.town) for role, played in self._policies.items()
        }

    def play(self, decisions: int) -> list[ActionDict]:
        """Plays a number of decisions; returns the actions of the checked policy."""
        actions_of_policy: list[ActionDict] = []
        for _ in range(decisions):
            if not self._env.agents:
                break
            inputs, actions = policy_inputs(self._env.engine, self._policies), {}
            for role, policy in self._policies.items():
                observation, state = inputs[role], self._states[role]
                if role is self._role and self._strict:
                    action, self._states[role] = self._checked(policy, observation, state, len(actions_of_policy))
                else:
                    action, self._states[role] = policy.step(observation, state)
                actions[str(role)] = action
            actions_of_policy.append(actions[str(self._role)])
            self._env.step(actions)
        return actions_of_policy

    def _checked(
        self, policy: Policy[State], observation: ObservationMapping, state: State, k: int
    ) -> tuple[ActionDict, State]:
        before = copy.deepcopy(observation)
        action, after = policy.step(observation, state)
        field = first_unequal(before, observation)
        assert field is None, f"decision {k}: step changed the observation's {field}"
        again, _ = policy.step(observation, state)
        field = first_unequal(action, again)
        assert field is None, f"decision {k}: {field} of the action differs when step is called again on the same state"
        space = self._env.action_space(str(policy.role))
        outside = [name for name, part in space.spaces.items() if name not in action or not part.contains(action[name])]
        outside += [name for name in action if name not in space.spaces]
        assert not outside, f"decision {k}: the action's {outside[0]} is not in the action space of {policy.role}"
        return dict(action), after


# --- recorded sessions ------------------------------------------------------------------------------------------------


def check_session(
    session: Session | Path | str,
    *,
    town: Town | str | Path | None = None,
    storyboard: StoryboardTemplate | None = None,
    replay: bool = True,
) -> None:
    """Checks a recorded session.

    `Session.check` must find no fault; saving and loading must keep the content (`Session.digest`); playing it again
    from its seed and actions must give the same frames and events to the bit.

    Args:
        session: a session, or its folder.
        town: the town of the session if it is not shipped with the package.
        storyboard: its storyboard's template, if that is not shipped.
        replay: whether to play it again; sessions whose actions were not recorded cannot be.

    Raises:
        AssertionError: the session is not sound; the message names the first fault, field or frame.
        SessionError: the session cannot be read or replayed.
    """
    if not isinstance(session, Session):
        session = Session.load(session)
    faults = session.check()
    assert not faults, f"{session.name}: {len(faults)} faults, the first: {faults[0]}"
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        saved = Session.load(session.save(Path(folder) / session.name))
    assert saved.digest == session.digest, f"{session.name}: saving and loading changed its content"
    if replay:
        place = town if isinstance(town, Town) else load_town(session.header.town if town is None else town)
        difference = first_difference(session, resimulate(session, place, storyboard=storyboard))
        assert difference is None, f"{session.name}: replay differs at {difference}"


# --- towns ------------------------------------------------------------------------------------------------------------


def check_town(town: str | Path | Town, *, sessions: int = 3, decisions: int = 40, seed: int = 0) -> None:
    """Checks that a town has no fault that a driver would meet, and that sessions can be played in it.

    Args:
        town: name, file (YAML or OpenDRIVE) or `Town`.
        sessions: scenarios drawn and played with the scripted policies.
        decisions: decisions played in each session.
        seed: seed of the first session.

    Raises:
        AssertionError: the linter found faults (ten are listed), or the lane graph does not match the lanes.
        TownError: the file cannot be read.
        StoryboardError: no storyboard can be bound, for example for lack of sites.
    """
    if not isinstance(town, Town):
        town = load_town(town)
    faults = town_faults(town)
    listed = "\n".join(
        f"  {fault.kind} at ({fault.position[0]:.1f}, {fault.position[1]:.1f}): {fault.message}"
        for fault in faults[:10]
    )
    assert not faults, f"{town.name}: {len(faults)} faults\n{listed}"
    graph = town.to_graph()
    assert len(graph.features) == len(town.lanes), f"{town.name}: the lane graph must have a node for each lane"
    env = DuoWizardEnv(town, config=EnvConfig())
    for k in range(sessions):
        played = list(play_scripted(env, seed=seed + k, decisions=decisions))
        assert len(played) > 1, f"{town.name}, seed {seed + k}: the session ended at its first decision"
