"""Behaviour cloning of the Co-Wizards of a corpus, as a warm start of reinforcement learning."""

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
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.policies.navigation.demonstrations import Demonstration, DemonstrationRecorder
from dorothie_gym.policies.navigation.observation_vector import MAX_SECONDS
from dorothie_gym.recording import Corpus, Session
from dorothie_gym.rollout import watch_session
from dorothie_gym.spaces import CoWizardAction, SpaceLimits

NOTHING = int(NavigationAction.NOTHING)
"""Number of the action "nothing" in every action space."""

LEARNING_RATE, BATCH = 1e-3, 64
MOST_EPOCHS, PATIENCE = 60, 5
"""Largest number of passes, and passes without a better held-out likelihood after which cloning stops."""


ReportProgress = Callable[[str, int, int], None]
"""Callback with the name of the stage, the steps done and their total."""

CRITIC_ALONE = 20_000
"""Steps in which only the critic learns: an untrained critic would spoil the cloned actor."""


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Recorded decisions to clone.

    Attributes:
        observations: the learner's observation at each decision (n, m), float32.
        masks: actions likely to be carried out (n, k), bool.
        actions: the actions taken (n,), int64.
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
        """Returns the number of decisions."""
        return len(self.actions)


@dataclass(frozen=True, kw_only=True)
class CloningResult:
    """Result of behaviour cloning.

    Attributes:
        lessons: number of training decisions.
        epochs: passes over them.
        losses: mean negative log-likelihood of the held-out decisions, before and after [nats].
        agreement: share of held-out decisions at which the policy's best action is the recorded one.
        majority: the same for a policy that always takes the most frequent action.
        deeds: as `agreement`, over decisions other than "nothing".
    """

    lessons: int
    epochs: int
    losses: tuple[float, float]
    agreement: float
    majority: float
    deeds: float


def silent(what: str, done: int, total: int) -> None:
    """Ignores the progress."""


def read_lessons(
    corpus: Path, fold: str, max_seconds: float = MAX_SECONDS, tell: ReportProgress = silent
) -> Demonstrations:  # fmt: skip
    """Replays the sessions of a fold and returns their decisions.

    Args:
        corpus: its folder.
        fold: of `Fold`.
        max_seconds: time limit of the environment that the driver is trained in [s].
        tell: callback for the progress.

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
    """Returns the decisions of a session."""
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
    """Maximises the likelihood of decisions; keeps the pass with the highest held-out likelihood.

    Args:
        model: of stable-baselines3, PPO, MaskablePPO or A2C; its actor learns, its critic does not.
        shown: training decisions.
        held_out: decisions of other sessions, for early stopping.
        seed: seed of the order.
        tell: callback for the progress.
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
    """Freezes the cloned actor during the first steps of a training (`CRITIC_ALONE`)."""

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        hold_actor(self.model.policy, self.num_timesteps)


def hold_actor(policy: Any, steps: int) -> None:
    """Freezes the actor of a cloned policy until `CRITIC_ALONE` steps are done."""
    for part in (policy.mlp_extractor.policy_net, policy.action_net):
        part.requires_grad_(steps > CRITIC_ALONE)


def _distribution(policy: Any, lessons: Demonstrations, rows: torch.Tensor) -> Any:
    from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

    more = (lessons.masks[rows],) if isinstance(policy, MaskableActorCriticPolicy) else ()
    return policy.get_distribution(lessons.observations[rows], *more)


def _surprise(policy: Any, lessons: Demonstrations, rows: torch.Tensor) -> torch.Tensor:
    """Returns the mean negative log-likelihood of the recorded actions [nats]."""
    likely: torch.Tensor = _distribution(policy, lessons, rows).log_prob(lessons.actions[rows])
    return -likely.mean()


def _evaluate(policy: Any, lessons: Demonstrations) -> float:
    with torch.no_grad():
        return float(_surprise(policy, lessons, torch.arange(len(lessons))))


def _weights(policy: Any) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in policy.state_dict().items()}
