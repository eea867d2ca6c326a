"""Decisions of all roles in a corpus, in the interfaces of the learners."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

from dorothie_gym.baselines.rl.behaviour_cloning import (
    NOTHING,
    Demonstrations,
    ReportProgress,
    sessions_of,
    silent,
)
from dorothie_gym.baselines.selfplay.role_interface import Mask, Vector
from dorothie_gym.baselines.selfplay.role_layout import make_interface
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.recording import Session
from dorothie_gym.rollout import watch_session
from dorothie_gym.spaces import ActionDecoder, AdWizardAction, RoleAction, SpaceLimits

Lesson: TypeAlias = tuple[Vector, Mask, int]
"""Vector, mask and action number of a decision."""


def read_lessons(corpus: Path, fold: str, tell: ReportProgress = silent) -> dict[int, Demonstrations]:
    """Replays the sessions of a fold and returns the decisions of all roles.

    Args:
        corpus: its folder.
        fold: of `Fold`.
        tell: callback for the progress.

    Returns:
        The decisions of each role, by its place in `AGENT_ROLES`.

    Raises:
        SessionError: the corpus cannot be read or played again, or has nothing in the fold.
    """
    found: dict[int, list[Lesson]] = {k: [] for k in range(len(AGENT_ROLES))}
    for session, town in sessions_of(corpus, fold, tell):
        for role, lessons in lessons_of(session, town).items():
            found[role] += lessons
    if not all(found.values()):
        raise SessionError(f"{corpus}: fold {fold!r} has no decision to learn from")
    return {role: Demonstrations.of(lessons) for role, lessons in found.items()}


def lessons_of(session: Session, town: Town) -> dict[int, list[Lesson]]:
    """Returns the decisions of a session, by the role's place in `AGENT_ROLES`.

    What could not have been done at the seat is left out. Words that join an utterance in the air count where that
    begins, if it begins with nothing that the seat can say.
    """
    limits = SpaceLimits.for_town(town)
    seats = [make_interface(role, town, limits) for role in AGENT_ROLES]
    decoders = [ActionDecoder(role, limits) for role in AGENT_ROLES]
    memories = [seat.begin() for seat in seats]
    found: dict[int, list[Lesson]] = {k: [] for k in range(len(seats))}
    begun = [-1] * len(seats)  # where the utterance that is in the air begins
    for seen, done in watch_session(session, town):
        for k, (role, seat) in enumerate(zip(AGENT_ROLES, seats, strict=True)):
            observation, action = seen[role], decoders[k](done[role])
            memory = memories[k] = seat.notice(observation, memories[k])
            choice, mask = seat.choice_of(action, observation, memory), seat.mask(observation, memory)
            if mask[choice]:
                if _speaks(action) and scalar(observation, "speaking") <= 0.0:
                    begun[k] = len(found[k])
                found[k].append((seat.vector(observation, memory), mask, choice))
                memories[k] = seat.act(choice, observation, memory)[1]
            elif _speaks(action) and begun[k] >= 0:
                vector, before, first = found[k][begun[k]]
                if first == NOTHING and before[choice]:
                    found[k][begun[k]] = (vector, before, choice)
    return found


def _speaks(action: RoleAction) -> bool:
    return not isinstance(action, AdWizardAction) and action.speech is not None
