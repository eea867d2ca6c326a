"""Behaviour cloning: a policy learns what the Co-Wizards of a corpus did, before it learns by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from dorothie_gym.errors import SessionError
from dorothie_gym.maps import Town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.policies.navigation.demonstrations import Demonstration, DemonstrationRecorder
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS
from dorothie_gym.recording import Corpus, Session
from dorothie_gym.recording.towns import find_town
from dorothie_gym.rollout import watch_session
from dorothie_gym.spaces import CoWizardAction, SpaceLimits

NOTHING = int(NavigationAction.NOTHING)
"""Doing nothing has this number everywhere."""

LEARNING_RATE, BATCH = 1e-3, 64
MOST_EPOCHS, PATIENCE = 60, 5
"""It ends after so many passes, or when the held-out sessions have got no likelier for so many [passes]."""


ReportProgress = Callable[[str, int, int], None]
"""Is told what is being done, how much of it is done, and how much there is."""

CRITIC_ALONE = 20_000
"""So many steps the critic learns what a cloned actor is worth before that changes: else it would be led astray."""


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Decisions of those who are watched.

    Attributes:
        observations: what the learner would have observed at each (n, m), float32.
        masks: which actions were likely to be carried out (n, k), bool.
        actions: what was done (n,), int64.
    """

    observations: torch.Tensor
    masks: torch.Tensor
    actions: torch.Tensor

    @classmethod
    def of(cls, lessons: Iterable[tuple[NDArray[np.float32], NDArray[np.bool_], int]]) -> Demonstrations:
        """Stacks single decisions, at least one."""
        observations, masks, actions = zip(*lessons, strict=True)
        return cls(
            torch.from_numpy(np.stack(observations)), torch.from_numpy(np.stack(masks)), torch.tensor(actions)
        )  # fmt: skip

    def __len__(self) -> int:
        """How many."""
        return len(self.actions)


@dataclass(frozen=True, kw_only=True)
class CloningResult:
    """What came of cloning.

    Attributes:
        lessons: decisions learned from.
        epochs: passes over them.
        losses: mean negative log-likelihood of the held-out decisions, before and after [nats].
        agreement: share of the held-out decisions at which the policy's best action is what was done.
        majority: the same of a policy that always does what is most often done.
        deeds: as `agreement`, of those in which something was done.
    """

    lessons: int
    epochs: int
    losses: tuple[float, float]
    agreement: float
    majority: float
    deeds: float


def silent(what: str, done: int, total: int) -> None:
    """Tells nobody."""


def read_lessons(
    corpus: Path, fold: str, max_seconds: float = MAX_SECONDS, tell: ReportProgress = silent
) -> Demonstrations:  # fmt: skip
    """Plays the sessions of a fold again, and watches.

    Args:
        corpus: its folder.
        fold: of `Fold`.
        max_seconds: time limit of the environment that the driver is trained in [s].
        tell: is told how far it is.

    Raises:
        SessionError: the corpus cannot be read or played again, or has nothing in the fold.
    """
    played = sessions_of(corpus, fold, tell)
    found = [lesson for session, town in played for lesson in lessons_of(session, town, max_seconds)]
    if not found:
        raise SessionError(f"{corpus}: fold {fold!r} has no decision to learn from")
    return Demonstrations.of(found)


def sessions_of(corpus: Path, fold: str, tell: ReportProgress = silent) -> Iterator[tuple[Session, Town]]:
    """Yields the sessions of a fold, with their towns; raises `SessionError` where one cannot be played again."""
    towns: dict[str, Town] = {}
    entries = Corpus.load(corpus).filter(fold=fold).entries
    for k, entry in enumerate(entries):
        tell(f"Sessions of {fold}", k, len(entries))
        session = entry.load()
        name = session.header.town
        town = towns.get(name) or find_town(name, entry.maps)
        if town is None:
            raise SessionError(f"{session.name}: there is no map of {name}; it cannot be played again")
        towns[name] = town
        yield session, town


def lessons_of(session: Session, town: Town, max_seconds: float = MAX_SECONDS) -> list[Demonstration]:
    """What there is to learn from a session."""
    apprentice, limits = DemonstrationRecorder(town, max_seconds), SpaceLimits.for_town(town)
    role = str(Role.CO_WIZARD)
    watched = (
        apprentice.record(seen[role], CoWizardAction.decode(done[role], limits))
        for seen, done in watch_session(session, town)
    )
    return [lesson for lesson in watched if lesson is not None]


def clone(
    model: Any, shown: Demonstrations, held_out: Demonstrations, seed: int, tell: ReportProgress = silent
) -> CloningResult:
    """Makes what was done likely; of all passes, that is kept after which the held-out decisions are likeliest.

    Args:
        model: of stable-baselines3, PPO, MaskablePPO or A2C; its actor learns, its critic does not.
        shown: what it learns from.
        held_out: decisions of other sessions.
        seed: of the order.
        tell: is told how far it is.
    """
    policy, generator = model.policy, torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(policy.parameters(), lr=LEARNING_RATE)
    before = lowest = _evaluate(policy, held_out)
    best, weights, epoch = 0, _weights(policy), 0
    policy.set_training_mode(True)
    while epoch < MOST_EPOCHS and epoch - best < PATIENCE:
        tell("Passes, at most", epoch, MOST_EPOCHS)
        epoch += 1
        for rows in torch.split(torch.randperm(len(shown), generator=generator), BATCH):
            optimiser.zero_grad()
            _surprise(policy, shown, rows).backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
            optimiser.step()
        loss = _evaluate(policy, held_out)
        if loss < lowest:
            lowest, best, weights = loss, epoch, _weights(policy)
    policy.load_state_dict(weights)
    policy.set_training_mode(False)
    with torch.no_grad():
        chosen = _distribution(policy, held_out, torch.arange(len(held_out))).get_actions(deterministic=True)
    right, deeds = chosen == held_out.actions, held_out.actions != NOTHING
    return CloningResult(
        lessons=len(shown), epochs=epoch, losses=(before, lowest), agreement=float(right.float().mean()),
        majority=float((held_out.actions == shown.actions.mode().values).float().mean()),
        deeds=float(right[deeds].float().mean()),
    )  # fmt: skip


class CriticWarmUp(BaseCallback):
    """Keeps the actor as it was cloned for the first steps of a run (`CRITIC_ALONE`)."""

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        hold_actor(self.model.policy, self.num_timesteps)


def hold_actor(policy: Any, steps: int) -> None:
    """Lets the actor of a cloned policy learn only when `CRITIC_ALONE` steps have been done."""
    for part in (policy.mlp_extractor.policy_net, policy.action_net):
        part.requires_grad_(steps > CRITIC_ALONE)


def _distribution(policy: Any, lessons: Demonstrations, rows: torch.Tensor) -> Any:
    from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

    more = (lessons.masks[rows],) if isinstance(policy, MaskableActorCriticPolicy) else ()
    return policy.get_distribution(lessons.observations[rows], *more)


def _surprise(policy: Any, lessons: Demonstrations, rows: torch.Tensor) -> torch.Tensor:
    """Mean negative log-likelihood of what was done [nats]."""
    likely: torch.Tensor = _distribution(policy, lessons, rows).log_prob(lessons.actions[rows])
    return -likely.mean()


def _evaluate(policy: Any, lessons: Demonstrations) -> float:
    with torch.no_grad():
        return float(_surprise(policy, lessons, torch.arange(len(lessons))))


def _weights(policy: Any) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in policy.state_dict().items()}
