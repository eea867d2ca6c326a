"""Behaviour cloning of the sessions of a corpus, as a warm start of reinforcement learning."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from dorothie_gym.archive.corpus import Corpus
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.rl.run import OnStage, ignore_stage
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.replay import watch_session
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.navigation.actions import NavigationAction
from dorothie_gym.policies.navigation.demonstrations import Demonstration, DemonstrationRecorder
from dorothie_gym.policies.navigation.observation_fields import MAX_SECONDS, Vector
from dorothie_gym.session.spaces.actions import CoWizardAction
from dorothie_gym.session.spaces.fields import SpaceLimits

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.checkpoint import Model, Network
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session

NOTHING: Final = int(NavigationAction.NOTHING)
"""Number of the action "nothing" in every action space."""

LEARNING_RATE: Final = 1e-3
BATCH_SIZE: Final = 64

MAX_EPOCHS: Final = 60
"""Maximum number of passes over the decisions."""

PATIENCE: Final = 5
"""Number of passes without a better held-out likelihood after which cloning stops."""

CRITIC_STEPS: Final = 20_000
"""Steps in which only the critic learns: an untrained critic would spoil the cloned actor."""


# --- Decisions of a corpus --------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Recorded decisions to clone.

    Attributes:
        observations: the learner's observation at each decision (n, m), float32.
        masks: actions that are probably feasible (n, k), bool.
        actions: the actions taken (n,), int64.
    """

    observations: torch.Tensor
    masks: torch.Tensor
    actions: torch.Tensor

    @classmethod
    def of(cls, decisions: Iterable[tuple[Vector, NDArray[np.bool_], int]]) -> Demonstrations:
        """Stacks single decisions, at least one."""
        observations, masks, actions = zip(*decisions, strict=True)
        return cls(torch.from_numpy(np.stack(observations)), torch.from_numpy(np.stack(masks)), torch.tensor(actions))

    def __len__(self) -> int:
        """Returns the number of decisions."""
        return len(self.actions)


def read_demonstrations(
    corpus: Path, fold: str, max_seconds: float = MAX_SECONDS, on_stage: OnStage = ignore_stage
) -> Demonstrations:
    """Replays the sessions of a fold and returns the decisions of their Co-Wizards.

    Args:
        corpus: folder of the corpus.
        fold: name of a `Fold`.
        max_seconds: time limit of the environment that the driver is trained in [s].
        on_stage: callback for the progress.

    Raises:
        SessionError: the corpus cannot be read or replayed, or the fold has no decision.
    """
    sessions = replayable_sessions(corpus, fold, on_stage)
    found = [decision for session, town in sessions for decision in demonstrations_of(session, town, max_seconds)]
    if not found:
        raise SessionError(f"{corpus}: fold {fold!r} has no decision to learn from")
    return Demonstrations.of(found)


def replayable_sessions(corpus: Path, fold: str, on_stage: OnStage = ignore_stage) -> Iterator[tuple[Session, Town]]:
    """Yields the sessions of a fold with their towns; raises `SessionError` if one cannot be replayed."""
    towns: dict[str, Town] = {}
    entries = Corpus.load(corpus).filter(fold=fold).entries
    for k, entry in enumerate(entries):
        on_stage(f"Sessions of {fold}", k, len(entries))
        session = entry.load()
        name = session.header.town
        town = towns.get(name) or find_town(name, entry.maps)
        if town is None:
            raise SessionError(f"{session.name}: there is no map of {name}; the session cannot be replayed")
        towns[name] = town
        yield session, town


def demonstrations_of(session: Session, town: Town, max_seconds: float = MAX_SECONDS) -> list[Demonstration]:
    """Returns the decisions of the Co-Wizard in a session, see `DemonstrationRecorder`."""
    recorder, limits = DemonstrationRecorder(town, max_seconds), SpaceLimits.for_town(town)
    role = str(Role.CO_WIZARD)
    decisions = (
        recorder.record(observations[role], CoWizardAction.decode(actions[role], limits))
        for observations, actions in watch_session(session, town)
    )
    return [decision for decision in decisions if decision is not None]


# --- Cloning ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class CloningResult:
    """Result of behaviour cloning.

    Attributes:
        decisions: number of training decisions.
        epochs: number of passes over them.
        losses: mean negative log-likelihood of the held-out decisions, before and after [nats].
        agreement: share of held-out decisions at which the policy's best action is the recorded one.
        majority: the same for a policy that always takes the most frequent action.
        action_agreement: as `agreement`, over decisions other than "nothing".
    """

    decisions: int
    epochs: int
    losses: tuple[float, float]
    agreement: float
    majority: float
    action_agreement: float


def clone(
    model: Model, training: Demonstrations, held_out: Demonstrations, seed: int, on_stage: OnStage = ignore_stage
) -> CloningResult:
    """Maximises the likelihood of decisions; keeps the pass with the highest held-out likelihood.

    Args:
        model: PPO, MaskablePPO or A2C; only its actor is trained, not its critic.
        training: training decisions.
        held_out: decisions of other sessions, for early stopping.
        seed: seed of the order.
        on_stage: callback for the progress.
    """
    policy, generator = model.policy, torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(policy.parameters(), lr=LEARNING_RATE)
    before = lowest = _held_out_loss(policy, held_out)
    best, weights, epoch = 0, _weights(policy), 0
    policy.set_training_mode(True)
    while epoch < MAX_EPOCHS and epoch - best < PATIENCE:
        on_stage("Passes, at most", epoch, MAX_EPOCHS)
        epoch += 1
        for rows in torch.split(torch.randperm(len(training), generator=generator), BATCH_SIZE):
            optimiser.zero_grad()
            loss = _negative_log_likelihood(policy, training, rows)
            backpropagate(loss)
            torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
            optimiser.step()
        held_out_loss = _held_out_loss(policy, held_out)
        if held_out_loss < lowest:
            lowest, best, weights = held_out_loss, epoch, _weights(policy)
    policy.load_state_dict(weights)
    policy.set_training_mode(False)
    with torch.no_grad():
        chosen = _distribution(policy, held_out, torch.arange(len(held_out))).get_actions(deterministic=True)
    right, is_action = chosen == held_out.actions, held_out.actions != NOTHING
    return CloningResult(
        decisions=len(training),
        epochs=epoch,
        losses=(before, lowest),
        agreement=float(right.float().mean()),
        majority=float((held_out.actions == training.actions.mode().values).float().mean()),
        action_agreement=float(right[is_action].float().mean()),
    )


class CriticWarmUp(BaseCallback):
    """Freezes the cloned actor during the first `CRITIC_STEPS` steps of a training."""

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        policy: Network = self.model.policy
        for part in (policy.mlp_extractor.policy_net, policy.action_net):
            part.requires_grad_(self.num_timesteps > CRITIC_STEPS)


def _distribution(policy: Network, decisions: Demonstrations, rows: torch.Tensor) -> Any:
    from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

    masks = (decisions.masks[rows],) if isinstance(policy, MaskableActorCriticPolicy) else ()
    return policy.get_distribution(decisions.observations[rows], *masks)


def _negative_log_likelihood(policy: Network, decisions: Demonstrations, rows: torch.Tensor) -> torch.Tensor:
    """Returns the mean negative log-likelihood of the recorded actions [nats]."""
    log_likelihood: torch.Tensor = _distribution(policy, decisions, rows).log_prob(decisions.actions[rows])
    return -log_likelihood.mean()


def _held_out_loss(policy: Network, decisions: Demonstrations) -> float:
    with torch.no_grad():
        return float(_negative_log_likelihood(policy, decisions, torch.arange(len(decisions))))


def _weights(policy: Network) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in policy.state_dict().items()}
