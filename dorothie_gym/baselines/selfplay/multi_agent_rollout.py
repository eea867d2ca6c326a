"""The game that learners play with one another: sessions in lockstep, everybody's choices at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.utils import set_random_seed

from dorothie_gym.baselines.rl.environments import shared_out
from dorothie_gym.baselines.selfplay.env import SelfPlayEnv
from dorothie_gym.baselines.selfplay.learner import Learner, draw, make_network
from dorothie_gym.baselines.selfplay.opponent_pool import OpponentPool
from dorothie_gym.baselines.selfplay.role_layout import RoleLayout
from dorothie_gym.baselines.selfplay.settings import SelfPlaySettings
from dorothie_gym.ontology import AGENT_ROLES, Role

AD_WIZARD = AGENT_ROLES.index(Role.AD_WIZARD)
TEAM = (Role.CO_WIZARD, Role.PARTICIPANT)
ALL = "all"
"""Name of the learner that plays all roles."""


class SelfPlayEnvFactory:
    """Makes an environment of a run; can be sent to another process."""

    def __init__(self, settings: Mapping[str, Any], scripted: Collection[Role] = ()) -> None:
        self._settings, self._scripted = dict(settings), tuple(scripted)

    def __call__(self) -> gym.Env[Any, Any]:
        """Returns a new environment."""
        return SelfPlayEnv(**self._settings, scripted=self._scripted)


class MultiAgentRollout:
    """Sessions, the learners in them, and past Ad-Wizards.

    Attributes:
        table: what is at the seats.
        learners: one for each role, or one for all.
        past: earlier Ad-Wizards, which play in the last few environments.
        returns: sums of rewards of the sessions without scripted roles that have ended since `begin`, by role (n, 3).
    """

    def __init__(self, settings: SelfPlaySettings, log: Path | None, ray: str | None = None) -> None:
        """Prepares a game; raises `SettingsError` where nothing can be played with the settings.

        Args:
            settings: what is played, and with which networks.
            log: folder for TensorBoard, or None.
            ray: address of a Ray cluster that steps the sessions; None: this machine does.
        """
        self._settings = settings
        count = settings.environments
        maker = SelfPlayEnvFactory(settings.env_settings)
        template = SelfPlayEnv(**settings.env_settings)  # says in this process what is wrong with the settings
        self.table: RoleLayout = template.table
        coached = _coached(settings)
        self._together = np.array([env not in coached for env in range(count)])
        places = {
            k: [env for env in range(count) if role not in coached.get(env, ())] for k, role in enumerate(AGENT_ROLES)
        }
        del places[AD_WIZARD][len(places[AD_WIZARD]) - settings.past_environments :]
        shares = {ALL: places} if settings.shared else {str(AGENT_ROLES[k]): {k: envs} for k, envs in places.items()}
        self.learners = [
            Learner(name, settings.learner(settings.seed + k), self.table, own, None if log is None else log / name)
            for k, (name, own) in enumerate(shares.items())
        ]
        for learner in self.learners:
            learner.cloned = settings.warm_start is not None
        self.past = OpponentPool()
        against = self.learners[-1]
        self._opponent = make_network(settings.learner(), against.size, against.actions)
        self._old = np.arange(count - settings.past_environments, count)  # where past Ad-Wizards play
        self._vector = shared_out(maker, count, settings.workers, ray)
        for env, scripted in coached.items():
            self._vector.set_attr("scripted", scripted, indices=[env])
        self._rng = np.random.default_rng()
        self.returns: list[NDArray[np.float64]] = []

    def begin(self, steps: int) -> None:
        """Begins new sessions in all environments; all chance from here on follows from the seed and from `steps`."""
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
        """Plays a rollout and lets everybody learn from it.

        Args:
            steps: done before.

        Returns:
            The steps done then.
        """
        if len(self.past):
            self.past.revive(self._opponent, self._rng)
        length = int(self.learners[0].model.n_steps)
        for _ in range(length):
            self._step()
        steps += length * self._settings.environments
        for learner in self.learners:
            learner.update(self._rows, self._starts, steps, max(self._settings.steps, steps))
            self._log(learner, steps)
        return steps

    def close(self) -> None:
        """Ends the environments."""
        self._vector.close()

    def actor(self, role: int) -> Learner:
        """Returns the learner of a role, given by its place in `AGENT_ROLES`."""
        return next(learner for learner in self.learners if role in learner.roles)

    def _step(self) -> None:
        actions = np.zeros((len(self._rows), len(AGENT_ROLES)), dtype=np.int64)
        for learner in self.learners:
            envs, roles = learner.players.T
            actions[envs, roles] = learner.act(self._rows)
        if len(self._old):
            actions[self._old, AD_WIZARD] = self._play_past()
        self._rows, _, dones, infos = self._vector.step(actions)
        rewards = np.stack([info["rewards"] for info in infos])
        self._sums += rewards
        cut = np.array([bool(info.get("TimeLimit.truncated", False)) for info in infos])
        if cut.any():
            ends = self._rows.copy()
            for k in np.flatnonzero(cut):
                ends[k] = infos[k]["terminal_observation"]
            for learner in self.learners:
                learner.look_beyond(rewards, ends, cut)
        for learner in self.learners:
            learner.learn_from(rewards, self._starts)
        self.returns += list(self._sums[dones & self._together])
        self._sums[dones] = 0.0
        self._starts = dones

    def _play_past(self) -> NDArray[np.int64]:
        """Returns the actions of past Ad-Wizards; random ones before the pool has a member."""
        padded = self._settings.shared
        rows = self._rows[self._old]
        vectors = self.table.vectors(rows, AD_WIZARD, padded=padded)
        return draw(self._opponent, vectors, self.table.masks(rows, AD_WIZARD, padded=padded), self._rng)

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
