"""Decisions of all roles in a corpus, as input vectors and actions of the role interfaces."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

from dorothie_gym.baselines.rl.behaviour_cloning import NOTHING, Demonstrations, replayable_sessions
from dorothie_gym.baselines.rl.run import OnStage, ignore_stage
from dorothie_gym.baselines.selfplay.env import make_interface
from dorothie_gym.baselines.selfplay.role_interface import Mask
from dorothie_gym.errors import SessionError
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.recording.session import Session
from dorothie_gym.rollout.replay import watch_session
from dorothie_gym.spaces.actions import ActionDecoder, AdWizardAction, RoleAction
from dorothie_gym.spaces.limits import SpaceLimits

RoleDecision: TypeAlias = tuple[Vector, Mask, int]
"""Input vector, mask and number of the action of a decision."""


def read_demonstrations(corpus: Path, fold: str, on_stage: OnStage = ignore_stage) -> dict[int, Demonstrations]:
    """Replays the sessions of a fold and returns the decisions of all roles.

    Args:
        corpus: folder of the corpus.
        fold: name of a `Fold`.
        on_stage: callback for the progress.

    Returns:
        The decisions of each role, by its index in `AGENT_ROLES`.

    Raises:
        SessionError: the corpus cannot be read or replayed, or the fold lacks decisions of a role.
    """
    found: dict[int, list[RoleDecision]] = {k: [] for k in range(len(AGENT_ROLES))}
    for session, town in replayable_sessions(corpus, fold, on_stage):
        for role, decisions in decisions_of(session, town).items():
            found[role] += decisions
    if not all(found.values()):
        raise SessionError(f"{corpus}: fold {fold!r} has no decision to learn from")
    return {role: Demonstrations.of(decisions) for role, decisions in found.items()}


def decisions_of(session: Session, town: Town) -> dict[int, list[RoleDecision]]:
    """Returns the decisions of a session, by the role's index in `AGENT_ROLES`.

    Actions that the interface of a role masks are left out. If such an action adds words to an utterance in progress,
    it replaces the action at the beginning of the utterance, provided that this beginning was read as "nothing".
    """
    limits = SpaceLimits.for_town(town)
    interfaces = [make_interface(role, town, limits) for role in AGENT_ROLES]
    decoders = [ActionDecoder(role, limits) for role in AGENT_ROLES]
    memories = [interface.initial_memory() for interface in interfaces]
    found: dict[int, list[RoleDecision]] = {k: [] for k in range(len(interfaces))}
    utterance_start = [-1] * len(interfaces)  # decision at which the utterance in progress begins
    for observations, actions in watch_session(session, town):
        for k, (role, interface) in enumerate(zip(AGENT_ROLES, interfaces, strict=True)):
            observation, action = observations[role], decoders[k](actions[role])
            memory = memories[k] = interface.update(observation, memories[k])
            choice, mask = interface.choice_of(action, observation, memory), interface.mask(observation, memory)
            if mask[choice]:
                if _speaks(action) and scalar(observation, "speaking") <= 0.0:
                    utterance_start[k] = len(found[k])
                found[k].append((interface.vector(observation, memory), mask, choice))
                memories[k] = interface.act(choice, observation, memory)[1]
            elif _speaks(action) and utterance_start[k] >= 0:
                vector, first_mask, first = found[k][utterance_start[k]]
                if first == NOTHING and first_mask[choice]:
                    found[k][utterance_start[k]] = (vector, first_mask, choice)
    return found


def _speaks(action: RoleAction) -> bool:
    return not isinstance(action, AdWizardAction) and action.speech is not None
