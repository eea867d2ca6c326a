"""Rollouts of self-play: sessions in lockstep, the learners that play them, and past Ad-Wizards as opponents."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.utils import set_random_seed

from dorothie_gym.baselines.rl.checkpoint import Model
from dorothie_gym.baselines.rl.settings import SelfPlaySettings
from dorothie_gym.baselines.rl.vector_env import make_vector_env
from dorothie_gym.baselines.selfplay.env import RoleLayout, SelfPlayEnv
from dorothie_gym.baselines.selfplay.learner import Learner, make_network, sample_actions
from dorothie_gym.baselines.selfplay.vec_env import SelfPlayEnvFactory
from dorothie_gym.ontology.roles import AGENT_ROLES, Role

AD_WIZARD: Final = AGENT_ROLES.index(Role.AD_WIZARD)
TEAM: Final = (Role.CO_WIZARD, Role.PARTICIPANT)

ALL_ROLES: Final = "all"
"""Name of the learner that plays all roles."""


# --- Opponents --------------------------------------------------------------------------------------------------------

POOL_SIZE: Final = 5
"""Largest number of checkpoints in the pool; the latest are kept."""


class OpponentPool:
    """Past Ad-Wizard checkpoints, against overfitting to the present one."""

    def __init__(self) -> None:
        self._weights: list[dict[str, torch.Tensor]] = []

    def __len__(self) -> int:
        return len(self._weights)

    def add(self, model: Model) -> None:
        """Adds the present weights of a model."""
        weights = {name: value.detach().clone() for name, value in model.policy.state_dict().items()}
        self._weights = [*self._weights, weights][-POOL_SIZE:]

    def load_random(self, model: Model, rng: np.random.Generator) -> None:
        """Loads a random member of the pool, which must not be empty, into a model."""
        model.policy.load_state_dict(self._weights[int(rng.integers(len(self._weights)))])

    def tensors(self) -> dict[str, torch.Tensor]:
        """Returns the weights of all members by name."""
        return {f"{k}/{name}": value for k, weights in enumerate(self._weights) for name, value in weights.items()}

    def restore(self, tensors: Mapping[str, torch.Tensor]) -> None:
        """Restores what `tensors` has returned; raises `ValueError` or `IndexError` if it is something else."""
        self._weights = [{} for _ in {name.split("/", 1)[0] for name in tensors}]
        for name, value in tensors.items():
            number, key = name.split("/", 1)
            self._weights[int(number)][key] = value


# --- Rollouts ---------------------------------------------------------------------------------------------------------


class MultiAgentRollout:
    """Collects rollouts of all roles, and updates the learners with them.

    Attributes:
        layout: layout of the rows.
        learners: one for each role that learns, the Ad-Wizard's last, or one for all.
        opponents: past Ad-Wizards, which play in the last few environments.
        returns: sums of rewards of the sessions without coaching that ended since `reset`, by role (n, 3).
    """

    def __init__(
        self, settings: SelfPlaySettings, make_logger: Callable[[str], Logger], ray: str | None = None
    ) -> None:
        """Prepares environments and learners; raises `SettingsError` if the settings are invalid.

        Args:
            settings: settings of the training.
            make_logger: returns the logger of a learner for its name.
            ray: address of a Ray cluster that steps the sessions; None for this machine.
        """
        self._settings = settings
        count = settings.environments
        template = SelfPlayEnv(**settings.env_settings)  # reports invalid settings in this process
        self.layout: RoleLayout = template.layout
        coached = _coached(settings)
        self._unscripted = np.array([env not in coached for env in range(count)])
        environments = {
            k: [env for env in range(count) if role not in coached.get(env, ())]
            for k, role in enumerate(AGENT_ROLES)
            if role not in settings.partners
        }
        del environments[AD_WIZARD][len(environments[AD_WIZARD]) - settings.past_environments :]
        by_learner = (
            {ALL_ROLES: environments}
            if settings.shared
            else {str(AGENT_ROLES[k]): {k: envs} for k, envs in environments.items()}
        )
        self.learners = [
            Learner(name, settings.learner(settings.seed + min(own)), self.layout, own, make_logger(name))
            for name, own in by_learner.items()
        ]
        for learner in self.learners:
            learner.cloned = settings.warm_start is not None
        self.opponents = OpponentPool()
        ad_wizard = self.learners[-1]
        self._opponent = make_network(settings.learner(), ad_wizard.size, ad_wizard.actions)
        self._opponent_envs = np.arange(count - settings.past_environments, count)
        make = SelfPlayEnvFactory(settings.env_settings, threads=1 if settings.workers or ray is not None else None)
        self._vector = make_vector_env(make, count, settings.workers, ray)
        for env, scripted in coached.items():
            self._vector.set_attr("scripted", scripted, indices=[env])
        self._rng = np.random.default_rng()
        self.returns: list[NDArray[np.float64]] = []

    def reset(self, steps: int) -> None:
        """Starts new sessions in all environments, and seeds all random streams from the seed and `steps`."""
        source = np.random.SeedSequence([self._settings.seed, steps])
        learning, playing, opposing = (int(word) >> 2 for word in source.generate_state(3))
        set_random_seed(learning)
        self._vector.seed(playing)
        self._rows = np.asarray(self._vector.reset())
        self._starts = np.ones(self._settings.environments, dtype=np.bool_)
        self._sums = np.zeros((self._settings.environments, len(AGENT_ROLES)))
        self._rng = np.random.default_rng(opposing)
        self.returns = []

    def play(self, steps: int) -> int:
        """Plays a rollout and updates all learners with it.

        Args:
            steps: number of steps done before.

        Returns:
            The number of steps done after the rollout.
        """
        if len(self.opponents):
            self.opponents.load_random(self._opponent, self._rng)
        length = int(self.learners[0].model.n_steps)
        for _ in range(length):
            self._step()
        steps += length * self._settings.environments
        for learner in self.learners:
            learner.update(self._rows, self._starts, steps, max(self._settings.steps, steps))
            self._log(learner, steps)
        return steps

    def close(self) -> None:
        """Closes the environments."""
        self._vector.close()

    def learner_of(self, role: int) -> Learner:
        """Returns the learner of a role that learns, given by its index in `AGENT_ROLES`."""
        return next(learner for learner in self.learners if role in learner.roles)

    def _step(self) -> None:
        actions = np.zeros((len(self._rows), len(AGENT_ROLES)), dtype=np.int64)
        for learner in self.learners:
            envs, roles = learner.players.T
            actions[envs, roles] = learner.act(self._rows)
        if len(self._opponent_envs):
            actions[self._opponent_envs, AD_WIZARD] = self._opponent_actions()
        rows, _, dones, infos = self._vector.step(actions)
        self._rows = np.asarray(rows)
        rewards = np.stack([info["rewards"] for info in infos])
        self._sums += rewards
        truncated = np.array([bool(info.get("TimeLimit.truncated", False)) for info in infos])
        if truncated.any():
            ends = self._rows.copy()
            for k in np.flatnonzero(truncated):
                ends[k] = infos[k]["terminal_observation"]
            for learner in self.learners:
                learner.bootstrap(rewards, ends, truncated)
        for learner in self.learners:
            learner.store(rewards, self._starts)
        self.returns += list(self._sums[dones & self._unscripted])
        self._sums[dones] = 0.0
        self._starts = dones

    def _opponent_actions(self) -> NDArray[np.int64]:
        """Returns the actions of past Ad-Wizards; those of an untrained network while the pool is empty."""
        padded = self.learner_of(AD_WIZARD).padded
        rows = self._rows[self._opponent_envs]
        vectors = self.layout.vectors(rows, AD_WIZARD, padded=padded)
        return sample_actions(self._opponent, vectors, self.layout.masks(rows, AD_WIZARD, padded=padded), self._rng)

    def _log(self, learner: Learner, steps: int) -> None:
        logger = learner.model.logger
        if self.returns:
            for role in learner.roles:
                latest = [float(sums[role]) for sums in self.returns[-len(self._rows) :]]
                logger.record(f"rollout/return_{AGENT_ROLES[role]}", sum(latest) / len(latest))
        logger.dump(steps)


def _coached(settings: SelfPlaySettings) -> dict[int, tuple[Role, ...]]:
    """Returns the environments in which one team role learns beside scripted ones, and the scripted roles."""
    found = {}
    for env in range(settings.coached_environments):
        learns = TEAM[env % len(TEAM)]
        found[env] = tuple(role for role in AGENT_ROLES if role is not learns)
    return found
